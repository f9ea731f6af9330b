"""The paper's figures, to stand beside what a run infers."""

from dataclasses import replace

from turing_learning.swarm import SCENARIOS, Scenario

SOURCE = "Li, Gauci and Gross (2016), Turing learning, Swarm Intelligence 10, sections 4.3, 4.6.1, 5.4: means of 30 (5.4: 10) runs"

ABSOLUTE_ERRORS: dict[str, tuple[float, ...]] = {
    "aggregation": (0.01, 0.01, 0.07, 0.06),
    "object-clustering": (0.03, 0.04, 0.02, 0.03, 0.08, 0.08),
    "aggregation-field-of-view-0": (0.02, 0.02, 0.05, 0.06, 0.01),
    "aggregation-field-of-view-60": (0.04, 0.03, 0.05, 0.05, 0.20),
}
"""Scenario -> mean absolute error of the subjectively best model of the last generation, parameter
by parameter."""
LABORATORY_ERRORS = (0.08, 0.01, 0.05, 0.02)
"""The same of the post-evaluated best model of aggregating robots in an arena with walls."""


def paper_absolute_errors(scenario: Scenario) -> dict[str, float] | None:
    """Return the paper's absolute error of each parameter of a scenario of its own.

    None of others.
    """
    if scenario.name not in ABSOLUTE_ERRORS:
        return None
    papers = SCENARIOS[scenario.name]
    errors = ABSOLUTE_ERRORS[scenario.name]
    if scenario.name == "aggregation" and scenario.arena.bounded:
        from turing_learning.robots import LABORATORY

        papers = replace(LABORATORY, name=scenario.name)
        errors = LABORATORY_ERRORS
    if replace(scenario, title=papers.title, description=papers.description) != papers:
        return None
    return dict(zip(scenario.parameter_names, errors, strict=True))
