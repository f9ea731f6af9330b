"""The command line's words for arguments, settings and calls that messages name."""

import shlex

from turing_learning.errors import Call, Setting

_OPTIONS = {
    "pixels_per_cm": "--scale",
    "length_s": "--window",
    "fps": "--fps",
    "y_axis": "--y-axis",
    "format": "--format",
    "keypoint": "--keypoint",
    "every": "--every",
    "hold_out_individuals": "--hold-out-individuals",
    "hold_out_recordings": "--hold-out-recordings",
    "max_gap": "--bridge",
    "smooth_frames": "--smooth",
    "names": "--signals",
    "signals": "--signals",
    "tank_cm": "--tank",
    "tanks": "--tank",
    "steps": "--window",
}
"""Arguments of Python whose options have other names, or stand in messages with their dashes."""


_RECORDED = {"genuine": "--trajectories", "simulate": "--model"}
"""What a recording and a family of models stand for; `detect` has a --genuine of its own."""


class OptionWords:
    """The names of options and commands.

    Parameters
    ----------
    command
        The command that was given.
    """

    def __init__(self, command: str = "") -> None:
        self._options = _OPTIONS if command == "detect" else _OPTIONS | _RECORDED

    def name(self, name: str) -> str:
        """Return the option of an argument; a name that is no argument of a function stays as it is."""
        return name if name.startswith("--") else self._options.get(name, name)

    def setting(self, setting: Setting) -> str:
        """Return ``--name value``; ``--set key=value`` for a key of the configuration; only ``--name`` for a switch."""
        if "." in setting.name:
            return f"--set {setting.name}={'...' if setting.value is None else setting.value}"
        option = self._options.get(setting.name, f"--{setting.name.replace('_', '-')}")
        return option if setting.value in (None, True) else f"{option} {shlex.quote(str(setting.value))}"

    def call(self, call: Call) -> str:
        """Return the command in backticks; a custom system is given from Python, and a recording by its options."""
        command = (
            f"`turing-learning {call.verb} {shlex.quote(call.path)}`" if call.path else f"`turing-learning {call.verb}`"
        )
        return f"{command} and the options that the run began with" if call.more else command
