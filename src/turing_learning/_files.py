"""Atomic files: a reader sees the old or the new content, never half of it. What a path means.

And seals of files.
"""

import contextlib
import hashlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

PARTIAL = ".partial"
"""How temporary names end."""

SEALS = "seals.txt"
"""The index of a folder; see `Seals`."""
_TITLE = "# SHA-256 of the files in this folder; do not edit.\n"


_REMOVED = "-"


# The index is written anew when it has more lines than four for each name, and these.
_SPARE_LINES = 256


def in_home(path: str | Path) -> Path:
    """Return a path whose leading ~ stands for a home folder, also where no shell has expanded it.

    An unknown one stays.
    """
    return Path(os.path.expanduser(path))  # noqa: PTH111 - the other one raises for unknown users


def unused(path: Path) -> Path:
    """Return a path, or the first of PATH-2, PATH-3, ... that does not exist."""
    candidate = path
    number = 2
    while os.path.lexists(candidate):
        candidate = path.with_name(f"{path.name}-{number}")
        number += 1
    return candidate


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """Give a temporary name to write to.

    At the end of the block the file is flushed to the disk and gets its name. The folder must
    exist. An earlier file of that name is replaced, or left as it was if anything fails.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}{PARTIAL}")
    try:
        yield temporary
        with temporary.open("rb+") as file:
            os.fsync(file.fileno())
        temporary.replace(path)
    finally:
        # A disk that cannot be written has nothing to remove either
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
    # The folder's list of names, too
    if os.name == "posix":
        descriptor = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file, atomically; see `whole`."""
    with whole(path) as temporary:
        temporary.write_bytes(content)


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write an object as JSON, atomically; numbers must be finite."""
    write_atomically(path, json_bytes(content))


def json_bytes(content: Any) -> bytes:
    """Return JSON as it is stored; numbers must be finite."""
    return (json.dumps(content, indent=2, allow_nan=False) + "\n").encode()


def remove_partial(folder: Path) -> None:
    """Remove what a killed process left under temporary names, anywhere below a folder that nobody else writes to."""
    for path in list(folder.rglob(f"*{PARTIAL}")):
        path.unlink(missing_ok=True)


class Seals:
    """The sealed index of one folder: a line with the SHA-256 of every file that is read again.

    A line is ``CHECK DIGEST NAME``. CHECK is a digest of the rest of the line and of the identity
    of the folder's content: a line that was changed, or comes from another folder, does not count.
    A line is appended before its file gets its name. A kill between the two leaves the earlier
    file, whose line stands just above. So the last two lines of a name count. The index `exists` if
    it has a line, sound or not.
    """

    def __init__(self, folder: Path, identity: str) -> None:
        self._path = folder / SEALS
        self._identity = identity
        self.load()

    def load(self) -> None:
        """Read the index from the disk."""
        self._digests: dict[str, tuple[str, ...]] = {}
        self._lines = 0
        try:
            text = self._path.read_text(encoding="utf-8", errors="replace")
        except OSError:
            text = ""
        for line in text.splitlines():
            if not line or line.startswith("#"):
                continue
            self._lines += 1
            check, _, content = line.partition(" ")
            digest, _, name = content.partition(" ")
            if name and check == self._check(content):
                self._take(name, digest)
        self._torn = bool(text) and not text.endswith("\n")
        self.exists = self._lines > 0

    @property
    def usable(self) -> bool:
        """Whether any line counts."""
        return bool(self._digests)

    def __contains__(self, name: str) -> bool:
        return bool(self._digests.get(name))

    def names(self) -> list[str]:
        return [name for name, digests in self._digests.items() if digests]

    def fits(self, name: str, digest: str) -> bool:
        """Return whether a file of that name was written with that digest."""
        return digest in self._digests.get(name, ())

    def ambiguous(self, name: str) -> bool:
        """Return whether two lines of a name count: its file must be looked up before a third one is added."""
        return len(self._digests.get(name, ())) > 1

    def append(self, lines: Sequence[tuple[str, str | None]]) -> None:
        """Add names and digests, flushed to the disk; None stands for a file that is removed."""
        text = ""
        for name, digest in lines:
            digest = digest or _REMOVED
            self._take(name, digest)
            text += self._line(name, digest)
        self._lines += len(lines)
        self.exists = self.exists or bool(lines)
        if not self._path.exists() or self._lines > 4 * len(self._digests) + _SPARE_LINES:
            self.rewrite()
            return
        # The last line was cut off: it must not swallow the next one
        if self._torn:
            text = "\n" + text
        self._torn = False
        with self._path.open("ab") as file:
            file.write(text.encode())
            file.flush()
            os.fsync(file.fileno())

    def rewrite(self) -> None:
        """Write the index anew, atomically, with nothing but the lines that count."""
        lines = []
        for name, digests in self._digests.items():
            lines += [self._line(name, digest) for digest in digests]
        with whole(self._path) as temporary:
            temporary.write_text(_TITLE + "".join(lines), encoding="utf-8")
        self._lines = len(lines)
        self._torn = False
        self.exists = bool(lines)

    def _take(self, name: str, digest: str) -> None:
        if digest == _REMOVED:
            self._digests[name] = ()
        else:
            self._digests[name] = (*self._digests.get(name, ()), digest)[-2:]

    def _line(self, name: str, digest: str) -> str:
        return f"{self._check(f'{digest} {name}')} {digest} {name}\n"

    def _check(self, content: str) -> str:
        return hashlib.sha256(f"{self._identity} {content}".encode()).hexdigest()[:16]


def digest_of(content: bytes | memoryview) -> str:
    return hashlib.sha256(content).hexdigest()


def file_digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
