"""What is said to whoever calls from Python, in the words of the command line: the one place where these are translated."""

import ast
import re
import shlex

_ARGUMENTS = {
    "fps": "--fps",
    "pixels_per_cm": "--scale",
    "y_axis": "--y-axis",
    "length_s": "--window",
    "format": "--format",
    "keypoint": "--keypoint",
    "every": "--every",
    "hold_out_individuals": "--hold-out-individuals",
}
"""Arguments of `load_trajectories`, `thinned` and `windows`, and what they are called on the command line."""

_RESUME = r"`turing_learning\.resume\((?P<run>'[^`]*'|\"[^`]*\"), genuine=\.\.\., simulate=\.\.\.\)`"
_ELSEWHERE = "a system with a simulator of one's own has its doors in Python, see docs/own-system.md."

_SENTENCES = (
    # recordings
    (r' Say "unknown" to stay in pixels, 1 if the file is in cm\.', " Say 1 if it is in cm."),
    (r": say allow_pickle=True if you trust whoever wrote it, or let idtracker\.ai", ": let idtracker.ai"),
    (
        r"`steps` must leave at least one window (for learning|held out); got (\d+) in (\d+) frames with .*? "
        r"Take shorter windows, or bridge gaps\.",
        r"`--window` must leave at least one window \1; got \2 steps in \3 frames. Take a shorter one.",
    ),
    (r" Record for longer, or bridge gaps\.", " Record for longer."),
    (
        r"`genuine` must be windows of motion that varies; got the same at every step of all of them: (.*?)\. See what .*",
        r"`--trajectories` must be motion that varies; got the same at every step: \1. Give a file in which individuals move.",
    ),
    (
        r"`simulate` must have the time step of the samples, (.*?); got (.*?)\. Give the family .*",
        r"`--fps` and `--every` must be those that the run began with, \1 between frames; got \2.",
    ),
    (
        r"`simulate` must have as many steps as the samples, (\d+); got (\d+)\. Give .*",
        r"`--window` must be that of the run, \1 steps; got \2. Leave it out.",
    ),
    (r"keep those with recording\.thinned\((\d+)\)\.", r"keep those with --every \1."),
    (r" Thin the faster recording, and", " Thin the faster recording with --every, and"),
    (
        r"`genuine` must be finite and at most (\S+) in size; got (.*?)\. Cut the gap out, or change the unit\.",
        r"`--trajectories` must give signals of at most \1 in size; got \2. Check --scale and --fps.",
    ),
    # runs on recordings
    (
        r"`(?:genuine|simulate)` must be given to (go on with|check) (?:a run on )?a system of one's own.*?; got nothing"
        r"( \[.*\])?\. Call .*",
        rf"`--trajectories` and `--model` must be given to \1 a run on recorded motion; got none\2. Give the options that the "
        rf"run began with; {_ELSEWHERE}",
    ),
    (
        r"`genuine` must be windows of (\d+) steps, as when the run began; got (\d+)(.*?)\. Cut .*",
        r"`--window` must be that of the run, \1 steps; got \2\3. Leave it out.",
    ),
    (
        r"`genuine` must be the samples that the run began with, .*?; got others, \S+( \[.*\])?\. Give the same, or .*",
        r"`--trajectories` must be the recording that the run began with, and its options the same; got others\1. Give those, or "
        r"start a new run.",
    ),
    (r"`simulate` must have the parameters of the run", "`--model` must have the parameters of the run"),
    (r" Give the simulator that the run has, or its parameters\.", " Give the model that the run has."),
    (
        r"`simulate` must have no headings, as the samples have none; got (\w+), (.*?)\. Give .*",
        r"`--model` must be one without headings, as `--trajectories` has none; got \1, \2. Give another model, or a file with "
        r"headings, see docs/trajectories.md.",
    ),
    (
        r"`simulate` must be given for a system of one's own; got the configuration of (.*?) alone\. Call .*",
        rf"`--trajectories` and `--model` must be given for recorded motion; got the configuration of \1 alone. Remove its "
        rf"scenario, and give them; {_ELSEWHERE}",
    ),
    (
        r"`genuine` and `abnormal` must be given for a run on a system of one's own; got one without\. Give .*",
        "`--genuine` and `--abnormal` must be given for a run that has kept no motion; got one of them or none. Give files "
        "of motion of both kinds, see docs/detection.md.",
    ),
    (
        r"`run` must be on simulated robots for individuals to be simulated; got .*",
        "`--simulate` must be left out for a run on recorded motion or in a laboratory, whose individuals are no simulated "
        "robots; got one. Give MOTION, a file of observed motion.",
    ),
    (r" Resume it first, or give `genuine` and `abnormal`\.", " Resume it first, or give --genuine and --abnormal."),
    (r"laboratory\.json, or give `genuine` and `abnormal`\.", "laboratory.json, or give --genuine and --abnormal."),
    (
        r" Run again with a larger share, or shorter windows\.",
        " Infer again with a shorter --window, or record for longer.",
    ),
    (
        r"`groups` must tell at least 2 groups of kept-out samples apart; got (\d+)\. Name .*",
        r"`--trajectories` must have kept-out windows of 2 individuals or 2 blocks of time at least, to be checked; got \1. Record "
        r"for longer, or more individuals, and infer again, perhaps with a shorter --window.",
    ),
    (r"with the setting run\.history = \"full\"", "with --set run.history=full"),
    (r"with points=0 in `effort` and force=True", "with --points 0 and --force"),
    (r"force=True", "--force"),
)
"""What cannot be done on the command line -> what can."""


def in_options(message: str, file: str) -> str:
    """Return a message on a recording with the names that arguments have on the command line; `file` is that of its file."""
    for argument, option in (_ARGUMENTS | {"path": file}).items():
        message = message.replace(f"`{argument}`", f"`{option}`")
    return message


def on_the_command_line(message: str) -> str:
    """Return a message whose remedy is one that the command line has."""
    message = re.sub(_RESUME, _resumed, message)
    for sentence, said in _SENTENCES:
        message = re.sub(sentence, said, message, flags=re.DOTALL)
    return message


def _resumed(call: re.Match[str]) -> str:
    return (
        f"`turing-learning resume {shlex.quote(ast.literal_eval(call['run']))}` and the options that the run began with"
    )
