"""The order of calls that every optimizer keeps."""


class Turns:
    """Let `ask` and `tell` alternate, starting with `ask`."""

    def __init__(self) -> None:
        self._asked = False

    def ask(self) -> None:
        """Note that a population was asked for."""
        if self._asked:
            raise RuntimeError(
                "`ask` must be called after `tell`; got a second `ask`. Tell the fitness first, or restore a state."
            )
        self._asked = True

    def tell(self) -> None:
        """Check that a population awaits its fitness."""
        if not self._asked:
            raise RuntimeError("`tell` must be called after `ask`; got `tell` first. Ask for a population first.")

    def reset(self) -> None:
        """Begin anew: the next call is `ask`."""
        self._asked = False

    def pause(self) -> None:
        """Check that no population awaits its fitness."""
        if self._asked:
            raise RuntimeError(
                "`state` must be called after `tell` or before `ask`; got `state` between the two. "
                "Tell the fitness first."
            )
