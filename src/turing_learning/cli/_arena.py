"""The command that runs an emulated laboratory."""

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ._numbers import integer, real

if TYPE_CHECKING:
    from turing_learning.robots import ArenaService, EmulatedLaboratory


def register(app: typer.Typer) -> None:
    """Add the command to the command line."""
    app.command(
        epilog="Example:\n\n"
        "  turing-learning arena --out lab\n\n"
        "and in another terminal\n\n"
        "  turing-learning robots run --config lab/lab.toml\n\n"
        "Type `help` while it runs for what may be done to the robots; `remote` lets them begin. Ctrl-C ends it. "
        "See docs/robots/arena.md."
    )(arena)


def arena(
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder for lab.toml and camera.json; lab by default.")
    ] = Path("lab"),
    lines: Annotated[
        str, typer.Option("--lines", metavar="KIND", help="Robots' lines: terminal (pseudo-terminals) or tcp.")
    ] = "terminal",
    speed: Annotated[
        float, typer.Option("--speed", metavar="K", help="Seconds of the laboratory in one second.", parser=real)
    ] = 1.0,
    agents: Annotated[int, typer.Option("--agents", metavar="A", help="Number of agents.", parser=integer)] = 8,
    replicas: Annotated[
        int, typer.Option("--replicas", metavar="R", help="Number of replicas, at most 4.", parser=integer)
    ] = 2,
    seed: Annotated[int, typer.Option("--seed", metavar="S", help="Seed of everything.", parser=integer)] = 0,
    force: Annotated[bool, typer.Option("--force", metavar="", help="Replace files in the folder.")] = False,
) -> None:
    """Run an emulated laboratory: robots on serial lines and a camera, for `robots run` or a program of your own."""
    from dataclasses import replace

    from turing_learning.config import ConfigurationError
    from turing_learning.robots import LABORATORY, ArenaService
    from turing_learning.runs import told

    if seed < 0:
        raise ConfigurationError(f"`seed` must be 0 or more; got {seed} [--seed].")
    try:
        scenario = replace(LABORATORY, agents=agents, replicas=replicas)
        service = ArenaService(scenario, seed=seed, lines=lines, speed=speed)
    except ValueError as error:
        raise ConfigurationError(str(error)) from error
    with service, _ended_by_signals():
        with told(
            ConfigurationError,
            f"`out` must be a folder that can be written; got {out}",
            "Choose another, or make room.",
        ):
            path = service.write(out, force=force)
        _show(service, path)
        _listen(service.laboratory)
    typer.echo("the laboratory is closed")


@contextmanager
def _ended_by_signals() -> Iterator[None]:
    """Let Ctrl-C and SIGTERM end the block, also where a shell has begun the command in the background, deaf to Ctrl-C."""
    before = {number: signal.signal(number, signal.default_int_handler) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    except KeyboardInterrupt:
        typer.echo("")
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _show(service: "ArenaService", path: Path) -> None:
    for name, address in service.addresses.items():
        typer.echo(f"{name:12} {address}")
    typer.echo(f"{'camera':12} {service.camera_url}")
    typer.echo(f"{'laboratory':12} {path}")
    typer.echo("type `remote` to let the robots begin, `help` for everything else; Ctrl-C ends")


def _listen(laboratory: "EmulatedLaboratory") -> None:
    """Obey what is typed; wait for a signal when nothing more can be."""
    from turing_learning.robots import obey, usage

    for line in sys.stdin:
        if line.strip() == "help":
            for command, meaning in usage(laboratory):
                typer.echo(f"{command:32} {meaning}")
        elif line.strip():
            try:
                obey(laboratory, line)
            except ValueError as error:
                typer.echo(str(error))
    threading.Event().wait()
