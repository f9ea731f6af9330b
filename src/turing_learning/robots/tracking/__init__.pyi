from ._camera import refuse_taken as refuse_taken
from ._tracker import signed_speeds as signed_speeds
from ._tracker import write_table as write_table
