"""Write docs/settings.md, every setting of the method with its default and what the preset "paper" makes of it.

Run with ``python docs/settings.py``; a test compares the page with the code.
"""

import json
from pathlib import Path

from turing_learning.config import (
    PRESETS,
    ClassifiersSection,
    CoevolutionSection,
    ModelsSection,
    PopulationSection,
    RunSection,
    Section,
)

PAGE = Path(__file__).with_suffix(".md")
HEAD = """# Settings of the method

All that a file may say in `[models]`, `[classifiers]`, `[coevolution]` and `[run]`, `--set` on the command line, or
`settings=` in Python:

    turing-learning infer aggregation --set models.population=60 --set classifiers.hidden=8

```python
tl.infer("aggregation", settings={"models.population": 60, "classifiers.hidden": 8})
```

`--preset paper` keeps to the text of the paper; where nothing stands below, it is as the default. `--preset
authors` adds `start = "middle"` and `minimum_step_size = 0.01`, as in the group's code TL_source. What the settings are for:
[How it works](method.md). What moves, and where: [A scenario of your own](scenarios.md). This page is written by
`python docs/settings.py`.
"""
SECTIONS = {
    "models": ModelsSection,
    "classifiers": ClassifiersSection,
    "coevolution": CoevolutionSection,
    "run": RunSection,
}


def page() -> str:
    """Return the page."""
    both = "Both populations: `models.` and `classifiers.`"
    shared = [
        name
        for name in PopulationSection.model_fields
        if _row("models", name) == _row("classifiers", name)
    ]
    population = [
        "population",
        *_values("models", "parents", "offspring"),
        "`parents` and `offspring` together, half of it each; even",
    ]
    parts = [_table(both, [population, *(_row("models", name) for name in shared)])]
    for name, section in SECTIONS.items():
        rows = [_row(name, key) for key in section.model_fields if key not in shared]
        parts.append(_table(f"`[{name}]`", [[f"{name}.{row[0]}", *row[1:]] for row in rows]))
    return "\n".join([HEAD, *parts])


def _row(section: str, key: str) -> list[str]:
    description = " ".join((SECTIONS[section].model_fields[key].description or "").split())
    if not description:
        raise ValueError(f"`{section}.{key}` must have a description; got none.")
    return [key, *_values(section, key), description]


def _values(section: str, *keys: str) -> list[str]:
    """Return the default, and the value in the preset "paper", of a setting, or of the sum of several."""
    return [
        _text([getattr(_section(section, preset), key) for key in keys])
        for preset in ("default", "paper")
    ]


def _section(name: str, preset: str) -> Section:
    return SECTIONS[name](**PRESETS[preset].get(name, {}))


def _text(values: list) -> str:
    return json.dumps(values[0] if len(values) == 1 else sum(values))


def _table(title: str, rows: list[list[str]]) -> str:
    lines = [
        f"## {title}",
        "",
        "| setting | default | `paper` | meaning |",
        "| --- | --- | --- | --- |",
    ]
    lines += [
        f"| `{key}` | {default} | {'' if paper == default else paper} | {meaning} |"
        for key, default, paper, meaning in rows
    ]
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
