"""What can go wrong in a laboratory and end a session."""


class LaboratoryError(RuntimeError):
    """A laboratory cannot go on; the run can be resumed."""
