"""Tables that are made row by row: what is there is not done again."""

import csv
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path


def keys_done(path: Path, columns: Sequence[str]) -> set[tuple[str, ...]]:
    """Return what some columns of a table hold, row by row; nothing where there is no table yet."""
    if not path.exists():
        return set()
    with path.open(newline="") as file:
        return {tuple(row[name] for name in columns) for row in csv.DictReader(file)}


def append_rows(path: Path, fields: Sequence[str], rows: Iterable[Mapping[str, object]]) -> None:
    """Add rows at the end of a table, which begins with the names of its fields."""
    with path.open("a", newline="") as file:
        writer = csv.DictWriter(file, fields, lineterminator="\n")
        if file.tell() == 0:
            writer.writeheader()
        writer.writerows(rows)
