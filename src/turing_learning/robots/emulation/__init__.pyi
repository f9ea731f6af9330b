from ._arena import move_alone as move_alone
from ._laboratory import SimulatedLaboratory as SimulatedLaboratory
from ._laboratory import obey as obey
from ._laboratory import usage as usage
