from ._equipment import laboratory_calibration as laboratory_calibration
from ._equipment import laboratory_tracker as laboratory_tracker
from ._setup import read_setup as read_setup
from ._setup import refuse_without_history as refuse_without_history
from ._source import ObservedTrial as ObservedTrial
from ._source import trial_samples as trial_samples
