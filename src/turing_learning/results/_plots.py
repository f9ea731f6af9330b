"""What a result draws into axes of matplotlib: `Result.plot`."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from turing_learning.config import ConfigurationError
from turing_learning.errors import require
from turing_learning.systems import Given, Source

from ._present import distributions_of, fitness_of, recorded_replay, replay, simulated_model, stopped_in
from ._result import Result

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COMPARED = 500  # simulated samples whose signals are compared


@dataclass(frozen=True, repr=False)
class Plots:
    """Pictures of a result on matplotlib axes.

    Each method draws into the axes `ax`, or into a new figure of pyplot, and returns the axes: one for `fitness`, an array with
    one for each panel otherwise. It raises a ConfigurationError if `ax` are not as many axes as there are panels.
    """

    result: Result
    moved: Callable[[], Mapping[str, np.ndarray]]
    opened: Callable[[Given], Source]

    def parameters(self, ax: Any = None) -> np.ndarray:
        """Draw each of P parameters over generations or trials, of the best and of the typical model; the truth is dashed."""
        from turing_learning.figures._one_run import draw_parameters

        configuration, history = self.result.configuration, self.result.history
        best, typical = (configuration.described(history[name].to_numpy()) for name in ("best_model", "typical_model"))
        over: dict[str, Any] = {"truth": configuration.system.truth, "trials": configuration.spent(len(best))}
        names = configuration.system.parameter_labels
        return _drawn(ax, names, 2.15, lambda panels, columns: draw_parameters(panels, columns, best, typical, **over))

    def fitness(self, ax: Any = None) -> "Axes":
        """Draw the fitness of models and classifiers over generations or trials: median and quartiles, as in the report."""
        from turing_learning.figures._one_run import draw_fitness

        history = self.result.history
        models, classifiers = (fitness_of(history, name) for name in ("model", "classifier"))
        over: dict[str, Any] = {"stopped": stopped_in(history), "trials": self.result.configuration.spent(len(models))}
        drawn: Axes = _drawn(ax, [""], 3.1, lambda panels, _: draw_fitness(panels[0], models, classifiers, **over))[0]
        return drawn

    def motion(self, ax: Any = None) -> np.ndarray:
        """Draw paths (cm) of genuine individuals, where they are known, and beside them of replicas that execute the estimate.

        Of a swarm both are simulated from the same start for 180 s. Of a recording it is what the report shows;
        other simulators need a method `simulate` that says where everybody is, as families of models have.
        """
        from turing_learning.figures._swarms import draw_paths

        configuration = self.result.configuration
        simulated = configuration.system.simulated is not None
        shown = replay(configuration, simulated_model(self.result)) if simulated else recorded_replay(self.moved())
        rule, got = "be of a system whose simulator says where everybody is", "samples alone"
        remedy = "Give a simulator with a method `simulate` and samples with a time step; see docs/own-system.md."
        require(shown is not None, "run", rule, got, remedy, error=ConfigurationError)
        assert shown is not None
        radii = {"robot_radius_cm": shown.robot_radius_cm, "object_radius_cm": shown.object_radius_cm}
        swarms = [(each.poses, each.robots, each.replica_mask) for each in shown.swarms]
        return _drawn(
            ax, [each.label for each in shown.swarms], 4.0, lambda panels, _: draw_paths(panels, swarms, **radii)
        )

    def distributions(self, ax: Any = None, *, genuine: Any = None, simulate: Any = None) -> np.ndarray:
        """Draw distributions of what can be seen of the genuine motion and of motion simulated at the estimate.

        Of a swarm: speed, turning, distance of neighbors and polarization. Of a custom system: its signals, for which `genuine`
        and `simulate` are given again if the run was loaded and they are no functions of a module.
        """
        from turing_learning.figures._classifiers import draw_quantities
        from turing_learning.identifiability._evidence import COMPARING, compare_quantities, stream, swarm_quantities

        result, system = self.result, self.result.configuration.system
        rule, got = "be of a system that can be simulated", "one in a laboratory"
        require(not result.in_laboratory, "run", rule, got, place=str(result.path), error=ConfigurationError)
        if system.simulated is not None:
            found = swarm_quantities(result.configuration, simulated_model(self.result), seed=0)
        else:
            with self.opened(Given(genuine, simulate)) as source:
                source.generation, rng, data = None, stream(0, COMPARING), source.genuine
                simulated = source.simulate(np.tile(simulated_model(self.result), (COMPARED, 1)), rng)
                known = source.genuine_samples(COMPARED, rng) if data is None or data.live else data.samples
            sides = [{name: side[..., d] for d, name in enumerate(system.signals)} for side in (known, simulated)]
            found = compare_quantities(sides[0], sides[1], system.signal_units)
        shown = distributions_of(found)
        return _drawn(
            ax, [each.name for each in shown], 2.1, lambda panels, columns: draw_quantities(panels, columns, shown)
        )


def _drawn(ax: Any, titles: Sequence[str], height: float, draw: "Callable[[Sequence[Axes], int], None]") -> np.ndarray:
    """Draw into given axes, or a new figure; return the axes. A legend is above a new figure, or in the first of given axes."""
    from turing_learning.figures._style import add_legend, grid_of_panels, legend_above, name_panels

    if ax is None:
        from matplotlib.pyplot import figure as new

        figure, panels, columns = grid_of_panels(
            titles, height, new=lambda width, height: new(figsize=(width, height), layout="constrained")
        )
    else:
        given = np.array(ax, dtype=object)
        figure, panels, columns = None, list(given.flat), given.shape[-1] if given.ndim else 1
        rule = "be matplotlib axes" if len(titles) == 1 else f"be {len(titles)} matplotlib axes"
        fits = len(panels) == len(titles) and all(hasattr(each, "get_legend_handles_labels") for each in panels)
        got = f"{given.size} of {type(panels[0]).__name__}" if panels else "none"
        require(fits, "ax", rule, got, error=ConfigurationError)
        name_panels(panels, titles)
    draw(panels, columns)
    if panels[0].get_legend_handles_labels()[0]:
        add_legend(panels[0]) if figure is None else legend_above(figure, panels)
    return np.array(panels)
