"""What the paper prints, claim by claim, and what is written about the experiments and the rules of their verdicts."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from types import MappingProxyType
from typing import Any


@dataclass(frozen=True)
class Claim:
    """One number or picture of the paper.

    Attributes
    ----------
    id
        Section and name, for example "4.3-aggregation-ae".
    where
        Section, figure and conditions.
    kind
        "value" for printed numbers, "figure" for a picture without.
    seen
        What is to be seen, of a figure.
    values
        The printed numbers by name.
    note
        What else is to be known.
    """

    id: str
    where: str
    kind: str
    seen: str
    values: Mapping[str, Any]
    note: str

    @property
    def section(self) -> str:
        """Section of the paper."""
        return self.id.partition("-")[0]


@cache
def load_claims() -> Mapping[str, Claim]:
    """Return id -> claim, in the order of the paper.

    Source
    ------
    Paper, sections 3.2, 4 and 5.
    """
    claims = {}
    for entry in tomllib.loads((files(__package__) / "claims.toml").read_text(encoding="utf-8"))["claim"]:
        words = {key: entry.pop(key, "") for key in ("id", "where", "seen", "note")}
        claims[words["id"]] = Claim(**words, kind=entry.pop("kind", "value"), values=MappingProxyType(entry))
    return MappingProxyType(claims)


@cache
def prose() -> dict[str, Any]:
    """Return what experiments.toml holds: what the experiments are about, and when claims agree."""
    return tomllib.loads((files(__package__) / "experiments.toml").read_text(encoding="utf-8"))
