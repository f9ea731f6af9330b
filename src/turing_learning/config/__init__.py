"""The configuration of a run as validated, frozen data.

`Configuration` and its sections (`ModelsSection`, `ClassifiersSection`, both a `PopulationSection`, `CoevolutionSection`,
`RunSection`) hold every setting of a run, with a seed up to `LARGEST_SEED`;
`load_configuration` resolves one, of a system that has a name (`SCENARIOS`) or another, from a preset (`PRESETS`), a TOML file and
single settings, and rejects what is wrong in one message (`ConfigurationError`; `nearest` says what may have been meant);
`to_toml` writes it back with every field explicit.
`load_variants` resolves the configurations of a study, each a `Variant`: one, a grid, or a list. `flat_settings`
and `with_settings` see a configuration as dotted keys with values, `dotted` any table; `stated_once` refuses settings that are
said twice, and not the same; `single_settings` those of arguments of a call, too. Configurations that differ in `PROSE` alone
are the same. `classifier_of` makes the classifiers' network, and
`part_named`, `part_of`, `built`, `give_again` name, find and make optimizers (of which `OPTIMIZERS` are built in) and classifiers;
`require_whole_cycles` refuses other durations, `require_seen` sensors that tell apart what is not there, `require_at_least` what
is not an integer (`is_integer`) or too small.

Other modules with a file of their own take `Section`, `read_toml` and `line_of`.
"""

from turing_learning.errors import is_integer, nearest

from ._configuration import Configuration, classifier_of, require_seen, require_whole_cycles
from ._load import PRESETS, SCENARIOS, load_configuration
from ._parts import built, give_again, part_named, part_of
from ._sections import (
    LARGEST_SEED,
    OPTIMIZERS,
    PROSE,
    ClassifiersSection,
    CoevolutionSection,
    ConfigurationError,
    ModelsSection,
    PopulationSection,
    RunSection,
    Section,
    require_at_least,
)
from ._study import Variant, dotted, flat_settings, load_variants, single_settings, stated_once, with_settings
from ._toml import line_of, read_toml, to_toml

__all__ = [
    "LARGEST_SEED",
    "OPTIMIZERS",
    "PRESETS",
    "PROSE",
    "SCENARIOS",
    "ClassifiersSection",
    "CoevolutionSection",
    "Configuration",
    "ConfigurationError",
    "ModelsSection",
    "PopulationSection",
    "RunSection",
    "Section",
    "Variant",
    "built",
    "classifier_of",
    "dotted",
    "flat_settings",
    "give_again",
    "is_integer",
    "line_of",
    "load_configuration",
    "load_variants",
    "nearest",
    "part_named",
    "part_of",
    "read_toml",
    "require_at_least",
    "require_seen",
    "require_whole_cycles",
    "single_settings",
    "stated_once",
    "to_toml",
    "with_settings",
]
