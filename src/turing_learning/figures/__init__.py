"""Figures: arrays in, pictures out. Nothing is computed here beyond the medians and quartiles that a picture shows.

`parameters_figure`
    Inferred parameters over generations, one panel each, the truth dashed.
`error_figure`
    Mean absolute error over generations.
`fitness_figure`
    Fitness of models and classifiers over generations, with the spans in which selection stopped.
`step_sizes_figure`
    Mutation strengths over generations.
`box_figure`, `error_box_figure`, `convergence_figure`, `error_histogram_figure`
    Many runs in one picture: their parameters and errors as boxes, medians over generations, a histogram.
`accuracy_figure`, `roc_figure`
    Classifiers: their accuracy over generations, and what they detect at which rate of false alarms.
`quantities_figure`, `profiles_figure`
    Whether an estimate can be believed: a `Distribution` of genuine beside simulated motion, a `ParameterProfile` each.
`timeline_figure`
    Which individuals behave abnormally, and when.
`snapshots_figure`, `dispersion_figure`, `prediction_figure`
    The paper's figures of swarms, of what inferred behaviors do, and of what least squares infers.
`budget_figure`
    How accurate several methods are with how many trials.
`box_panels_figure`, `dynamic_outputs_figure`
    Several ways to infer side by side; what networks put out while the sensor reading changes.
`convergence_panels_figure`, `error_panels_figure`, `gathering_figure`
    Runs in a laboratory beside simulated ones; what large swarms come to.
`swarm_frame`
    One moment of a swarm, drawn on given axes.
`save_figure`, `svg_markup`
    A figure as PNG and SVG files, and as SVG markup for a page.

Figures are `matplotlib.figure.Figure` objects without pyplot and without global state; matplotlib is imported when the
first one is made.
"""

from ._black_box import box_panels_figure, dynamic_outputs_figure
from ._check import Distribution, ParameterProfile, profiles_figure, quantities_figure
from ._comparison import budget_figure
from ._detection import accuracy_figure, roc_figure
from ._error import error_figure
from ._fitness import fitness_figure
from ._laboratory import convergence_panels_figure, error_panels_figure, gathering_figure
from ._parameters import parameters_figure
from ._reproduction import dispersion_figure, prediction_figure, snapshots_figure
from ._save import save_figure
from ._step_sizes import step_sizes_figure
from ._studies import box_figure, convergence_figure, error_box_figure, error_histogram_figure
from ._svg import svg_markup
from ._swarm import swarm_frame
from ._timeline import timeline_figure

__all__ = [
    "Distribution",
    "ParameterProfile",
    "accuracy_figure",
    "box_figure",
    "box_panels_figure",
    "budget_figure",
    "convergence_figure",
    "convergence_panels_figure",
    "dispersion_figure",
    "dynamic_outputs_figure",
    "error_box_figure",
    "error_figure",
    "error_histogram_figure",
    "error_panels_figure",
    "fitness_figure",
    "gathering_figure",
    "parameters_figure",
    "prediction_figure",
    "profiles_figure",
    "quantities_figure",
    "roc_figure",
    "save_figure",
    "snapshots_figure",
    "step_sizes_figure",
    "svg_markup",
    "swarm_frame",
    "timeline_figure",
]
