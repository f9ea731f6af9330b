"""A process that runs in a scripted laboratory again and again, in children that kill themselves in one state each.

Arguments: the folder with lab.toml and camera.json, and the run's folder. It makes no threads itself, so that forking is
safe. Its exit status is the number of children that were not killed; it prints how many trials are stored after each kill.
"""

import os
import signal
import sys
from pathlib import Path

from program_laboratory import ScriptedLaboratory

from turing_learning.robots import Event, load_laboratory
from turing_learning.runs import resume_laboratory, start_laboratory

KILLS = (("P1", 2), ("P2", 2), ("P3", 2), ("P4", 2), ("P5", 2))
"""State, and which time that it is entered in a session: four of the six trials are stored then, and two had no STOP yet."""


def run(folder: Path, path: Path, state: str, count: int) -> None:
    """Start or resume, and die."""
    seen = []

    def die(event: Event) -> None:
        seen.append(event.state if event.kind == "state" else "")
        if event.kind == "state" and seen.count(state) == count:
            os.kill(os.getpid(), signal.SIGKILL)

    try:
        doors = ScriptedLaboratory().equipment()
        if path.exists():
            resume_laboratory(path, equipment=doors, on_event=die)
        else:
            start_laboratory(
                load_laboratory(folder / "lab.toml"), path, equipment=doors, on_event=die
            )
    finally:
        os._exit(1)


def main(folder: Path, path: Path) -> int:
    """Run all children."""
    survivors = 0
    for state, count in KILLS:
        child = os.fork()
        if child == 0:
            run(folder, path, state, count)
        _, status = os.waitpid(child, 0)
        survivors += not (os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGKILL)
        sys.stdout.write(f"{state} {len(list(path.rglob('trial-*.npz')))}\n")
    return survivors


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2])))
