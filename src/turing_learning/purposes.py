"""What random numbers are for.

Every generator of the package is made where it is needed, from (purpose, seed, use). Nobody keeps one, so
that a resumed run draws what an uninterrupted one would have drawn. The numbers stay, because results are
repeated to the bit. Where two purposes have one number, the streams differ by what follows the seed, or by
the command that draws them. A new purpose takes a number from 20 on.
"""

# A run: (purpose, seed), and the generation as spawn key.
MODELS = 1
CLASSIFIERS = 2
INTERROGATION = 3
REPLAY = 4
ARCHIVE = 5
# Which samples of a recording are held out; without a seed: all runs hold out the same
GENUINE = 6
DETECTION = 7  # what a detector is calibrated with: (7, seed, use)
CHECK = 8  # what a check simulates and trains: (8, seed, use, ...)

# Controllers of a study: as `ARCHIVE`, but without a generation
RANDOM_BEHAVIORS = 5
# Noise on a rehearsal's tracks: as `DETECTION`, but (7, seed, name of the stage)
REHEARSAL = 7

# Experiments of the paper: (purpose, seed, ...).
EMERGENCE_STARTS = 1
COMPARISON_OBSERVATION = 1
LEAST_SQUARES_MODELS = 1
LEAST_SQUARES_TRIALS = 2
VALIDATION_STARTS = 11
VALIDATION_NOISE = 12
VALIDATION_CAMERA = 13
ACCURACY_MODELS = 15

# A number of its own each.
BUFFER = 20  # which genuine samples a bounded pool keeps
DESIGN = 21  # where the next trials are spent
# Folds and maps of a batch; draws and bootstrap of the read-out
MATCHING = 22
DIALOGUE = 23  # what the best interrogators do, in a report
CLIMBING = 24  # what a lost run tries
# Noise of a tracker: (25, key of the trial), in an emulated laboratory (25, seed)
TRACKING = 25
WHEELS = 26  # scales of the wheels of emulated robots
CLOCKS = 27  # phases and periods of the control cycles of emulated robots
# Models whose samples a comparison asks for before its runs begin
FIRST_SAMPLES = 28
