from . import (
    analysis as analysis,
)
from . import (
    classifiers as classifiers,
)
from . import (
    coevolution as coevolution,
)
from . import (
    config as config,
)
from . import (
    detection as detection,
)
from . import (
    errors as errors,
)
from . import (
    evolution as evolution,
)
from . import (
    examination as examination,
)
from . import (
    families as families,
)
from . import (
    few_trials as few_trials,
)
from . import (
    figures as figures,
)
from . import (
    identifiability as identifiability,
)
from . import (
    interaction as interaction,
)
from . import (
    models as models,
)
from . import (
    report as report,
)
from . import (
    reproduction as reproduction,
)
from . import (
    robots as robots,
)
from . import (
    runs as runs,
)
from . import (
    studies as studies,
)
from . import (
    swarm as swarm,
)
from . import (
    systems as systems,
)
from . import (
    trajectories as trajectories,
)
from .examination import test as test
from .models import Parameter as Parameter
from .runs import Evolution as Evolution
from .runs import Pooled as Pooled
from .runs import Posterior as Posterior
from .runs import Result as Result
from .runs import infer as infer
from .runs import load_run as load_run
from .runs import pool as pool
from .runs import resume as resume
from .studies import StudyResult as StudyResult
from .studies import load_study as load_study
from .studies import study as study
from .trajectories import Trajectories as Trajectories
from .trajectories import load_trajectories as load_trajectories

__version__: str
