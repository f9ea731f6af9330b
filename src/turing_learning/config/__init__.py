"""The configuration of a run as validated, frozen data.

`Configuration` and its sections (`ModelsSection`, `ClassifiersSection`, both a `PopulationSection`,
`CoevolutionSection`,
`RunSection`) hold every setting of a run;
`load_configuration` resolves one, of a system that has a name (`SCENARIOS`) or another, from a
preset (`PRESETS`), a TOML file and single settings, and rejects what is wrong in one message
(`ConfigurationError`);
`to_toml` writes it back with every field explicit.
`flat_settings` and `with_settings` see a configuration as dotted keys with values, `dotted` any
table, and `PROSE` names those that change nothing. `LARGEST_SEED` is that of a run.
`classifier_of` makes the classifiers' network; `part_of` and `built` find and make optimizers
(`OPTIMIZERS` are built in) and classifiers. `require_whole_cycles` refuses other durations,
`require_visible_objects` sensors of objects that are not there.

Other modules with a file of their own take `Section`, `read_toml`, `merged`, `toml_table`, and
`Origins`, which says where a setting comes from. Two modules serve what conducts runs: `settings`
has single settings and the configurations of a study,
`parts` the optimizers and classifiers that a configuration names.
"""

from turing_learning.errors import ConfigurationError

from ._configuration import Configuration, require_visible_objects, require_whole_cycles
from ._load import (
    PRESETS,
    SCENARIOS,
    Origins,
    load_configuration,
    merged,
    read_toml,
    to_toml,
    toml_table,
)
from ._sections import (
    LARGEST_SEED,
    OPTIMIZERS,
    PROSE,
    ClassifiersSection,
    CoevolutionSection,
    ModelsSection,
    PopulationSection,
    RunSection,
    Section,
    dotted,
)
from .parts import built, classifier_of, part_of
from .settings import flat_settings, with_settings

__all__ = [
    "LARGEST_SEED", "OPTIMIZERS", "PRESETS", "PROSE", "SCENARIOS", "ClassifiersSection", "CoevolutionSection",
    "Configuration", "ConfigurationError", "ModelsSection", "Origins", "PopulationSection", "RunSection", "Section",
    "built", "classifier_of", "dotted", "flat_settings", "load_configuration", "merged", "part_of", "read_toml",
    "require_visible_objects", "require_whole_cycles", "to_toml", "toml_table", "with_settings",
]  # fmt: skip
