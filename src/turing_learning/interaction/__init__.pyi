from ._describe import describe_stimulated as describe_stimulated
from ._describe import read_stimuli as read_stimuli
from ._stimulus import Interrogator as Interrogator
from ._stimulus import Stimulus as Stimulus
from ._system import STIMULATED as STIMULATED
from ._system import Step as Step
from ._system import StimulatedSource as StimulatedSource
from ._system import StimulatedSystem as StimulatedSystem
