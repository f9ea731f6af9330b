"""What can go wrong with a study, apart from its configuration and its folder."""


class ExecutorError(RuntimeError):
    """The workers cannot go on; what the runs have saved is kept, and the study can be resumed."""
