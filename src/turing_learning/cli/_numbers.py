"""Numbers on the command line, refused with the value that was given."""

import typer


def integer(text: str | int) -> int:
    """Return the integer that a text is."""
    try:
        return int(text)
    except ValueError as error:
        raise typer.BadParameter(f"must be an integer; got {text!r}.") from error


def real(text: str | float) -> float:
    """Return the number that a text is."""
    try:
        return float(text)
    except ValueError as error:
        raise typer.BadParameter(f"must be a number; got {text!r}.") from error
