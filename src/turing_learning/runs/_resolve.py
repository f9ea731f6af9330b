"""The configuration that the arguments of `infer` stand for."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from turing_learning.config import Configuration, ConfigurationError, dotted, load_configuration
from turing_learning.swarm import Scenario
from turing_learning.systems import CustomSystem


def resolved(
    scenario: str | Scenario | CustomSystem | None,
    preset: str,
    config: str | Path | Configuration | None,
    overrides: Mapping[str, Any],
) -> Configuration:
    """Return a configuration from a file, or from another one, with what comes before it."""
    labels = {key: f"argument {key.rpartition('.')[2]}" for key in overrides if key.startswith("run.")}
    if not isinstance(config, str | Path | Configuration | None):
        raise ConfigurationError(
            f"`config` must be a TOML file or a Configuration; got {type(config).__name__}. Give single settings to "
            "`turing_learning.config.load_configuration`, and its result here."
        )
    if isinstance(config, Configuration):
        flat = dotted(config.model_dump())
        known = {key: value for key, value in flat.items() if not key.startswith("scenario.")} | dict(overrides)
        if isinstance(scenario, CustomSystem):  # whose data has scales of its own
            known = {key: value for key, value in known.items() if key != "classifiers.input_scale" or key in overrides}
        return load_configuration(None, preset, known, scenario=scenario or config.scenario, labels=labels)
    return load_configuration(config, preset, overrides, scenario=scenario, labels=labels)
