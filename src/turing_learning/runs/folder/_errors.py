"""What can go wrong with a run, apart from its configuration: the errors of every store."""

from turing_learning.store import RunFolderError, RunStorageError, refuse_format, storage, told, writable

refuse_future_format = refuse_format

__all__ = ["RunFolderError", "RunStorageError", "refuse_future_format", "storage", "told", "writable"]
