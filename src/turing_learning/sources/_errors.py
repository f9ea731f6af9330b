"""The one error of the room that ends a run."""


class OwnSystemError(RuntimeError):
    """The system or the simulator failed; the run stopped, and one in a folder can be resumed."""
