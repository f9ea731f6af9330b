"""A folder that can be resumed: locked, versioned, atomic, sealed.

What is sound is taken from there, the rest is made again. Runs, studies, searches, checks and
experiments keep their files in one of these.
"""

import hashlib
import io
import json
import logging
import os
import shutil
import time
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ._files import (
    PARTIAL,
    SEALS,
    Seals,
    digest_of,
    file_digest,
    in_home,
    json_bytes,
    unused,
    write_atomically,
)
from .errors import RefusedError, brief, refuse, require

LOCK = "lock"
_LOGGER = logging.getLogger("turing_learning")


# Of a file that does not fit its seal: the process that writes may have replaced both in between.
_ATTEMPTS = 4
# How many pieces of a file, each of how many bytes, say whether it is worth compressing.
_CHUNKS, _CHUNK = 16, 4096


@contextmanager
def os_errors_as(error: type[Exception], trouble: str, remedy: str) -> Iterator[None]:
    """Turn an error of the operating system inside the block into one message.

    The message says what must be, why it is not, and what to do.
    A `RunStorageError` has its message already, and passes; so does the message of a
    FileExistsError that is ours.
    """
    try:
        yield
    except RunStorageError:
        raise
    except OSError as problem:
        if isinstance(problem, FileExistsError) and problem.errno is None:
            raise error(str(problem)) from problem
        raise error(f"{trouble} ({problem.strerror or problem}). {remedy}") from problem


class RunFolderError(RefusedError):
    """A folder is rejected before anything runs; nothing has been changed."""


check_folder = partial(require, error=RunFolderError)
reject_folder = partial(refuse, error=RunFolderError)
"""Reject a folder, as `require` and `refuse` do."""


class DamagedError(RunFolderError):
    """A stored file is missing, or not as it was written.

    `reason` says in few words what is wrong with it.
    """

    reason = ""


class RunStorageError(OSError):
    """A folder could not be written any further, for example because the disk is full.

    Its work can be resumed.
    """


def writable(name: str, path: Path) -> AbstractContextManager[None]:
    """Reject a folder, before anything runs, to which the block cannot write."""
    remedy = "Use a copy elsewhere, or make room."
    if name == "out":
        remedy = "Choose another folder, or make room."
    return os_errors_as(
        RunFolderError, f"`{name}` must be a folder that can be written; got {path}", remedy
    )


def storage(path: Path, ahead: str, name: str = "out") -> AbstractContextManager[None]:
    """Say of a folder that cannot be written any further what to do when there is room."""
    trouble = f"`{name}` must be a folder with space left; could not write to {path}"
    return os_errors_as(RunStorageError, trouble, f"Make room, then {ahead}")


@dataclass(frozen=True)
class FolderKind:
    """What a store holds.

    While the folder is locked, its head and the files beside it are written again if they are
    removed.
    """

    # What it is called, and the name of the argument in messages: "study"
    noun: str
    # The JSON file that says what the folder is; it has a ``format_version``
    head: str
    # Keys of the head whose values stay the same for its life
    identity: tuple[str, ...] = ()
    newest: int = 1  # newest format version that can be read
    beside: tuple[str, ...] = ()  # files that belong to the head


def refuse_format(version: Any, newest: int, path: Path, noun: str) -> None:
    """Raise RunFolderError unless a version of the package that we know has written the file at `path`."""
    later = f"Use the version of turing-learning that wrote this {noun}, or a later one."
    check = partial(
        require, name="format_version", got=version, place=str(path), error=RunFolderError
    )
    check(
        type(version) is int and version >= 1,
        rule="be an integer of at least 1",
        remedy="Restore the file.",
    )
    check(version <= newest, rule=f"be at most {newest}", remedy=later)


class Store:
    """A folder of files that are written atomically, and verified when they are read.

    Each file has a seal, its SHA-256, in one index (``seals.txt``). What has no seal, or another
    one, is rejected. Nothing is made before something is written.
    """

    def __init__(self, path: str | Path, kind: FolderKind) -> None:
        # a name that the operating system takes; the folder may be missing
        try:
            nameable = b"\0" not in os.fsencode(path)
        except UnicodeEncodeError:  # half a character
            nameable = False
        check_folder(nameable, kind.noun, "be the path of a folder", brief(path))
        self.path = in_home(path)
        self.kind = kind
        self._seals: Seals | None = None
        # While the folder is locked: its device and inode, and the content of its head and of the
        # files beside it.
        self._locked_inode: tuple[int, int] | None = None
        self._head_files: dict[Path, bytes] = {}
        # Files that have been written since the index was read, and have their names.
        self._written: set[str] = set()

    # What the folder is

    @property
    def head_path(self) -> Path:
        """The file that says what the folder is."""
        return self.path / self.kind.head

    def exists(self) -> bool:
        """Return whether this is a store of its kind, of any version."""
        return self._unverified_head() is not None

    def head(self) -> dict[str, Any]:
        """Return what the folder says that it is.

        Reject what is something else, of a later version, or changed.
        """
        content = self._unverified_head()
        noun = self.kind.noun
        if content is None:
            got = f"{self.path} without a readable {self.kind.head}"
            rule = f"be a {noun} folder"
            reject_folder(noun, rule, got, f"Give the folder that `{noun}` has made.")
        refuse_format(content["format_version"], self.kind.newest, self.head_path, noun)
        self.read(self.kind.head)
        return content

    def create(self, head: Mapping[str, Any], files: Mapping[str, Any] | None = None) -> None:
        """Make the folder a store.

        Pieces that are there stay, unverified. Other `files` are written before the head, so that a
        folder with a head is complete.
        """
        head = {"format_version": self.kind.newest} | dict(head)
        self.path.mkdir(parents=True, exist_ok=True)
        self._head_files = {}
        self._seals = Seals(self.path, _identity(head, self.kind))
        self._seals.rewrite()
        for name, content in (files or {}).items():
            self.write(name, content)
        self.write(self.kind.head, head)

    def foreign_names(self) -> list[str]:
        """Return the names in the folder that are not of a store that has only been begun."""
        if not self.path.exists():
            return []
        names = {path.name for path in self.path.iterdir()} - {LOCK, SEALS}
        return sorted(name for name in names if not name.endswith(PARTIAL))

    def clear(self, names: Iterable[str]) -> None:
        """Remove files and folders; of a link the link itself."""
        for name in names:
            path = self.path / name
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path)
            else:
                path.unlink(missing_ok=True)

    def _unverified_head(self) -> dict[str, Any] | None:
        try:
            content = json.loads(self.head_path.read_text(encoding="utf-8"))
        except (OSError, ValueError, RecursionError):
            return None
        if isinstance(content, dict) and type(content.get("format_version")) is int:
            return content
        return None

    # Who writes

    @contextmanager
    def locked(self, *, wait_s: float = 0.0) -> Iterator[None]:
        """Hold the folder, which must exist, for this process; the lock dies with it.

        Reject one that another process still holds after so long a wait (s).
        """
        from filelock import FileLock, Timeout

        lock = FileLock(self.path / LOCK, timeout=wait_s)
        try:
            lock.acquire()
        except Timeout as error:
            got = f"{self.path}, to which {self._writer()} is writing"
            rule = f"`{self.kind.noun}` must not be in use"
            raise RunFolderError(f"{rule}; got {got}. Wait until it ends, or stop it.") from error
        try:
            # The process may change its working folder while it writes.
            self.path = self.path.absolute()
            self._locked_inode = _inode(self.path)
            self._seals = None
            self._written.clear()
            if self.exists():
                self._remember_head_files()
            yield
        finally:
            self._locked_inode = None
            self._head_files = {}
            lock.release()

    def _writer(self) -> str:
        """Return who holds the lock, as far as the head says."""
        process = (self._unverified_head() or {}).get("process")
        if isinstance(process, dict) and {"pid", "host"} <= process.keys():
            return f"process {process['pid']} on {process['host']}"
        return "another process"

    def require_here(self) -> None:
        """Raise RunStorageError if the locked folder has been moved, removed or replaced.

        Restore lost files.
        """
        if self._locked_inode is None:
            return
        if _inode(self.path) != self._locked_inode:
            rule = f"`{self.kind.noun}` must stay where it is while it is written"
            got = f"{self.path}, which has been moved, removed or replaced"
            remedy = "What was saved until then is in the folder that was here: resume that."
            raise RunStorageError(f"{rule}; got {got}. {remedy}")
        for path, content in self._head_files.items():
            if not path.exists():
                write_atomically(path, content)
                _LOGGER.warning("%s was missing; it is written again.", path)

    def _remember_head_files(self) -> None:
        self._head_files = {}
        for name in (self.kind.head, *self.kind.beside):
            path = self.path / name
            if path.is_file():
                self._head_files[path] = path.read_bytes()

    # Files

    def write(self, name: str, content: Any) -> Path:
        """Write a file, atomically, with its seal.

        If that fails, an earlier file of that name is left as it was.
        The name may have slashes: folders on the way are made. Its suffix says how the content is
        stored, see `encoded`.
        """
        self.require_here()
        content = encoded(name, content)
        path = self.path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        seals = []
        if name not in self._written and self.seals.ambiguous(name) and path.is_file():
            # Writing it may have been cut short more than once. The index keeps two seals of a
            # name, so the one of the file that is there is repeated before the new one pushes it
            # out.
            digest = file_digest(path)
            if self.seals.fits(name, digest):
                seals.append((name, digest))
        seals.append((name, digest_of(content)))
        self._written.discard(name)
        self.seals.append(seals)
        write_atomically(path, content)
        self._written.add(name)
        if self._locked_inode is not None and name == self.kind.head:
            self._remember_head_files()
        return path

    def read(self, name: str) -> Any:
        """Return the content of a file as it was given to `write`, text and other formats as bytes; see `read_bytes`."""
        content = self.read_bytes(name)
        suffix = Path(name).suffix
        try:
            if suffix == ".json":
                return json.loads(content)
            if suffix == ".npy":
                return np.lib.format.read_array(io.BytesIO(content), allow_pickle=False)
            if suffix == ".npz":
                with np.load(io.BytesIO(content), allow_pickle=False) as archive:
                    return {name: archive[name] for name in archive.files}
        except Exception as error:
            # Whatever a parser says about bytes that it did not expect
            reason = " ".join(f"{type(error).__name__}: {error}".split())
            raise self.damaged(name, reason[:200]) from error
        return content

    def read_bytes(self, name: str) -> bytes:
        """Return the bytes of a file.

        Raise DamagedError if it is missing, or not as it was written.
        """
        for attempt in range(_ATTEMPTS):
            try:
                content = (self.path / name).read_bytes()
            except OSError as error:
                raise self.damaged(name, error.strerror or str(error)) from error
            flaw = self._flaw(name, digest_of(content))
            if not flaw:
                return content
            time.sleep(0.01 * attempt)
            self.seals.load()
        raise self.damaged(name, flaw)

    def once(self, name: str, compute: Callable[[], Any]) -> Any | None:
        """Return a piece of work: from its file, see `find`, or computed now and stored.

        None if that was stopped.
        """
        content = self.find(name)
        if content is None:
            content = compute()
            if content is not None:
                self.write(name, content)
        return content

    def find(self, name: str) -> Any | None:
        """Return the content of a file, None if there is none.

        A damaged one is set aside, and the log says so.
        """
        if not os.path.lexists(self.path / name):
            return None
        try:
            return self.read(name)
        except DamagedError as error:
            reason = error.reason
        damaged = self.set_aside(name)
        text = "%s is damaged (%s); it is made again. The damaged file is %s."
        _LOGGER.warning(text, self.path / name, reason, damaged.name)
        return None

    def set_aside(self, name: str) -> Path:
        """Rename a damaged file to NAME.damaged, or NAME.damaged-2, ...; return the new path."""
        self.require_here()
        path = self.path / name
        damaged = unused(path.with_name(f"{path.name}.damaged"))
        path.rename(damaged)
        return damaged

    def remove(self, name: str) -> None:
        """Remove a file and its seal; nothing happens where there is none."""
        self.require_here()
        if name in self.seals:
            self.seals.append([(name, None)])
        (self.path / name).unlink(missing_ok=True)

    # Seals

    @property
    def seals(self) -> Seals:
        """The index."""
        if self._seals is None:
            self._seals = Seals(self.path, _identity(self._unverified_head() or {}, self.kind))
        return self._seals

    def damaged(self, name: str, reason: str) -> DamagedError:
        """Return the error that says what is wrong with a file."""
        got = f"{self.path / name} ({reason})"
        error = DamagedError(
            f"`{self.kind.noun}` must hold {name} as it was written; got {got}. Restore the file."
        )
        error.reason = reason
        return error

    def _flaw(self, name: str, digest: str) -> str:
        """Return why a file of that digest is not the one that was sealed; nothing if it is."""
        seals = self.seals
        if not seals.exists:
            return f"{SEALS} is missing"
        if not seals.usable:
            return f"{SEALS} is damaged, or that of another {self.kind.noun}"
        if name not in seals:
            return f"{SEALS} does not know it"
        if seals.fits(name, digest):
            return ""
        return "it has been changed"


def encoded(name: str, content: Any) -> bytes:
    """Return the bytes of a file of that name.

    Bytes and text stay as they are; else the suffix decides: .json, .npy, .npz of name -> array,
    .csv of pandas.
    """
    if isinstance(content, bytes):
        return content
    if isinstance(content, str):
        return content.encode()
    suffix = Path(name).suffix
    memory = io.BytesIO()
    if suffix == ".json":
        return json_bytes(content)
    if suffix == ".npy":
        np.save(memory, content, allow_pickle=False)
        return memory.getvalue()
    if suffix == ".npz":
        np.savez(memory, **content)
        if _repeats_itself(memory.getbuffer()):
            memory = io.BytesIO()
            np.savez_compressed(memory, **content)
        return memory.getvalue()
    if suffix == ".csv":
        return content.to_csv(index=False, lineterminator="\n").encode()
    rule = "be .json, .npy, .npz or .csv, or its content bytes or text"
    raise TypeError(f"{name} must {rule}; got {type(content).__name__}")


def _repeats_itself(content: memoryview) -> bool:
    """Return whether bytes shrink below a half, by what their compression makes of a part of them.

    Counts and stepwise signals do; measurements and random numbers hardly, and take long.
    """
    # From all over, as arrays follow one another
    starts = range(0, len(content), max(_CHUNK, len(content) // _CHUNKS))
    sample = b"".join(content[start : start + _CHUNK] for start in starts)
    return len(zlib.compress(sample, level=1)) < len(sample) / 2


def _identity(head: Mapping[str, Any], kind: FolderKind) -> str:
    """Return the digest of what must stay the same."""
    # Through JSON and back, so that a head in memory has the digest of the same head in its file.
    values = json.loads(json.dumps(list(map(head.get, kind.identity))))
    return hashlib.sha256(json.dumps([kind.noun, values], sort_keys=True).encode()).hexdigest()


def _inode(path: Path) -> tuple[int, int] | None:
    """Return the device and the inode of a folder, which stay its own when it is renamed.

    None without one.
    """
    try:
        stat = path.stat()
    except OSError:
        return None
    return stat.st_dev, stat.st_ino


class StoredPath:
    """The path of a file or folder in a store, as a property with a description."""

    def __init__(self, name: str, description: str) -> None:
        self._name = name
        self.__doc__ = description

    def __get__(self, store: Store | None, owner: type | None = None) -> Path:
        # looked up in the class, for its docs
        if store is None:
            return self  # type: ignore[return-value]
        return store.path / self._name
