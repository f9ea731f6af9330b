"""The configuration of a run as validated, frozen data.

`Configuration` and its sections (`ModelsSection`, `ClassifiersSection`, both a `PopulationSection`, `CoevolutionSection`,
`RunSection`) hold every setting of a run;
`load_configuration` resolves one, of a system that has a name (`SCENARIOS`) or another, from a preset (`PRESETS`), a TOML file and
single settings, and rejects what is wrong in one message (`ConfigurationError`);
`to_toml` writes it back with every field explicit.
`flat_settings` and `with_settings` see a configuration as dotted keys with values, `dotted` any table. `classifier_of` makes the
classifiers' network; `part_of` and `built` find and make optimizers (of which `OPTIMIZERS` are built in) and classifiers.
`require_whole_cycles` refuses other durations.

Other modules with a file of their own take `Section` and `read_toml`.
"""

from ._configuration import Configuration, require_whole_cycles
from ._load import PRESETS, SCENARIOS, load_configuration, read_toml, to_toml
from ._parts import built, classifier_of, part_of
from ._sections import (
    OPTIMIZERS,
    ClassifiersSection,
    CoevolutionSection,
    ConfigurationError,
    ModelsSection,
    PopulationSection,
    RunSection,
    Section,
    dotted,
)
from ._study import flat_settings, with_settings

__all__ = [
    "OPTIMIZERS", "PRESETS", "SCENARIOS", "ClassifiersSection", "CoevolutionSection", "Configuration",
    "ConfigurationError", "ModelsSection", "PopulationSection", "RunSection", "Section", "built",
    "classifier_of", "dotted", "flat_settings", "load_configuration", "part_of", "read_toml",
    "require_whole_cycles", "to_toml", "with_settings",
]  # fmt: skip
