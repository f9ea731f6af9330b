from ._stimulus import PASSIVE as PASSIVE
from ._stimulus import Stimulus as Stimulus
from ._system import STIMULATED as STIMULATED
from ._system import Step as Step
from ._system import StimulatedSystem as StimulatedSystem
from ._system import describe_stimulated as describe_stimulated
from ._system import read_stimuli as read_stimuli
