"""Any program as a simulator, and who calls simulators: processes here, or a cluster."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Group, Parameter

import turing_learning as tl
from turing_learning.errors import RefusedError, integer, refuse, refusing_as, require

from ._options import Columns, Files, Integer, OptionGroup

if TYPE_CHECKING:
    import numpy as np

MANIFEST = "command"
"""Name in the manifest of a run under which it remembers its program."""
PROGRAM = Group("Any program as the simulator", sort_key=20)
CALLERS = Group("Who calls a simulator", sort_key=30)
RUN = "run"
"""Column of a table of several series that tells them apart."""


@Parameter(name="*", group=PROGRAM)
@dataclass(frozen=True)
class Program(OptionGroup):
    """A program that simulates one model, and series that the system gave."""

    simulate_command: str | None = None
    """Command line with {NAME} for each parameter and {seed}; it prints a table (CSV), a row for each time step."""
    series: Files = None
    """Table (CSV) of what the system gave, with the same columns; several times for several series, or with a column run."""
    simulate_columns: Columns = None
    """Column of the tables that the classifiers see; several times for several, all by default."""

    def system(self, ranges: Sequence[str] | None) -> dict[str, Any]:
        """Return what `turing_learning.infer` takes."""
        example = 'For example: --simulate-command "prog {speed} {seed}" --range speed=0:10 --series data.csv'
        for name, value in (
            ("simulate_command", self.simulate_command),
            ("series", self.series),
            ("range", ranges),
        ):
            require(value, f"--{name.replace('_', '-')}", "be given for a program", "none", example)
        parameters = tl.families.said_ranges(ranges or ())
        columns = tuple(self.simulate_columns or ())
        command = tl.systems.Command(str(self.simulate_command), tuple(parameters), columns)
        paths = self.series or []
        genuine = _series(paths, columns)
        entry = {
            "simulate_command": self.simulate_command,
            "series": [str(path.absolute()) for path in paths],
            "simulate_columns": list(columns),
            "range": list(ranges or ()),
        }
        return {
            "genuine": genuine,
            "simulate": command,
            "parameters": parameters,
            "name": "program",
            "title": str(self.simulate_command),
            "provenance": {MANIFEST: entry},
        }


def remembered_program(run: Path) -> dict[str, Any]:
    """Return genuine series and simulator of a run on a program; nothing for other runs."""
    stored = tl.runs.RunFolder(run).manifest().get(MANIFEST)
    if not isinstance(stored, Mapping):
        return {}
    program = Program(
        stored["simulate_command"],
        list(map(Path, stored["series"])),
        list(stored["simulate_columns"]) or None,
    )
    system = program.system(stored["range"])
    return {"genuine": system["genuine"], "simulate": system["simulate"]}


def _series(paths: Sequence[Path], columns: tuple[str, ...]) -> "list[dict[str, np.ndarray]]":
    """Return the series in files, K tables of D columns (T,) by name."""
    import numpy as np

    series: list[dict[str, np.ndarray]] = []
    names: tuple[str, ...] = columns
    for path in paths:
        try:
            text = path.read_text(encoding="utf-8-sig")
        except (OSError, UnicodeDecodeError) as error:
            refuse("--series", "be a readable file in UTF-8", f"{path} ({error})")
        with refusing_as(RefusedError, name="--series", place=str(path)):
            table = tl.systems.read_table(text)
            runs = np.array(table.pop(RUN, [0.0] * len(next(iter(table.values())))))
            names = names or tuple(table)
            values = tl.systems.table_values(table, names)
        for run in dict.fromkeys(runs.tolist()):
            series.append(dict(zip(names, values[runs == run].T, strict=True)))
    return series


@Parameter(name="*", group=CALLERS)
@dataclass(frozen=True)
class Callers(OptionGroup):
    """Who calls the simulator of a recording or a program."""

    workers: Annotated[Integer | None, Parameter(name="--workers")] = None
    """Number of processes that call the simulator, or that execute the runs of a study."""
    cluster: Annotated[str | None, Parameter(name=("--cluster", "--dask"))] = None
    """A Dask scheduler whose workers do that, as tcp://10.0.0.1:8786."""

    @contextmanager
    def options(self) -> Iterator[dict[str, Any]]:
        """Yield what `infer`, `resume` and `check` take."""
        if self.cluster is not None:
            require(self.workers is None, "--workers", "be left out beside --cluster", self.workers)
            with tl.studies.dask_cluster(self.cluster) as client:
                # there is an address
                assert client is not None
                yield {"executor": client.get_executor(pure=False)}
        elif self.workers is not None:
            yield {"workers": integer("workers", self.workers, 1, place="--workers")}
        else:
            yield {}
