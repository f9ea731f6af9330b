"""What can go wrong with a run, apart from its configuration."""


class RunFolderError(ValueError):
    """A folder is refused before anything runs; nothing has been changed."""


class RunStorageError(OSError):
    """A run could not be written any further, for example because the disk is full; it can be resumed."""
