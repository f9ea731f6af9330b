"""Systems that answer to stimuli, and classifiers that choose them while they watch: interrogators.

`StimulatedSystem`, `Stimulus`
    What is known of such a system, as frozen data; what can be done to it, and who chooses: the
    classifiers, or nobody; `PASSIVE` has the words for that.
`STIMULATED`
    Those that are built in, by name: an agent that responds to light, a robot that does not know
    its sensors.
`describe_stimulated`, `Step`, `read_stimuli`
    A system from what a caller hands over; how a model of it answers, as a function; ranges of
    stimuli.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
