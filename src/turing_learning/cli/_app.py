"""The commands by their names, in the order of `--help`: what most users need comes first."""

from collections.abc import Callable
from importlib.metadata import version

from cyclopts import App, Parameter

from . import _beside, _compare, _detect, _examine, _game, _look, _robots, _runs, _simulate

app = App(
    name="turing-learning",
    help="Infer the rules that individuals follow from nothing but their motion, without a metric.",
    help_epilogue="Begin with: turing-learning infer aggregation. Documentation: turing-learning docs",
    help_format="plaintext",
    version=lambda: f"turing-learning {version('turing-learning')}",
    default_parameter=Parameter(negative="", show_default=False),
    exit_on_error=False,
    print_error=False,
    suppress_keyboard_interrupt=False,
    result_action="return_value",
)

_ORDER: tuple[Callable[..., object], ...] = (
    _runs.infer,
    _runs.resume,
    _runs.show,
    _simulate.simulate,
    _runs.scenarios,
    _runs.study,
    _runs.pool,
    _runs.check,
    _examine.test,
    _compare.compare,
    _game.game,
    _detect.detect,
    _look.look,
    _beside.reproduce,
    _robots.arena,
    _beside.sample,
    _beside.docs,
    _beside.warm_up,
)
for number, command in enumerate(_ORDER):
    app.command(command, sort_key=number, help_epilogue="")
app.command(_robots.robots)
app.command(_runs.study_run, show=False)
app.command(_runs.study_collect, show=False)
