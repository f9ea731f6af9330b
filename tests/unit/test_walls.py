"""No room imports a private module or a private name of another one."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import turing_learning

ROOT = Path(turing_learning.__file__).parent


def imported_modules(root: Path, path: Path) -> Iterator[tuple[str, ...]]:
    """Yield what a module imports of its package, as parts of a dotted name without the package's own."""
    package = [root.name, *path.relative_to(root).parts[:-1]]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names = [alias.name.split(".") for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) - node.level + 1] if node.level else []
            module = [*above, *(node.module or "").split(".")]
            names = [[part for part in module if part] + [alias.name] for alias in node.names]
        else:
            continue
        yield from (tuple(name[1:]) for name in names if name[0] == root.name)


def climbed_walls(root: Path) -> set[tuple[str, str]]:
    """Return the imports of private names of other rooms, as pairs (module, what it imports)."""
    climbed = set()
    for path in root.rglob("*.py"):
        module = path.relative_to(root)
        for name in imported_modules(root, path):
            elsewhere = len(name) > 1 and name[0] != module.parts[0]
            private = [
                part for part in name[1:] if part.startswith("_") and not part.startswith("__")
            ]
            if elsewhere and private and not name[0].startswith("_"):
                climbed.add((module.as_posix(), ".".join(name)))
    return climbed


def test_no_room_imports_private_names_of_another():
    assert not climbed_walls(ROOT)


@pytest.mark.parametrize(
    "statement",
    [
        "from p.a import _hidden",
        "from p.a._module import name",
        "from ..a import _module",
        "import p.a._module",
        "def f():\n    from ..a._module import name",
    ],
)
def test_a_private_import_is_seen_in_every_form(tmp_path, statement):
    room = tmp_path / "p" / "b"
    room.mkdir(parents=True)
    (room / "c.py").write_text(statement)
    assert len(climbed_walls(tmp_path / "p")) == 1


@pytest.mark.parametrize(
    "statement", ["from ._module import _hidden", "from p.a import name", "from .. import _files"]
)
def test_what_a_room_may_import_is_no_fault(tmp_path, statement):
    room = tmp_path / "p" / "b"
    room.mkdir(parents=True)
    (room / "c.py").write_text(statement)
    assert not climbed_walls(tmp_path / "p")
