"""The command that puts a simulator to the test."""

import json
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

import turing_learning as tl
from turing_learning.errors import refuse, require

from ._options import Against, Integer, Real, Tracks, named, words_of
from ._tables import plain_console

if TYPE_CHECKING:
    import numpy as np

ARRAYS = (".npy", ".npz")
"""Endings of files that hold samples (K, T, D)."""


def test(
    *real: Path,
    against: Against = Against(),  # noqa: B008 - frozen
    signals: str | None = None,
    window: Real | None = None,
    control: bool = False,
    quick: bool = False,
    seed: Integer = 0,
    tracks: Tracks = Tracks(),  # noqa: B008 - frozen
    out: Path | None = None,
    force: bool = False,
    as_json: Annotated[bool, Parameter("--json")] = False,
) -> None:
    """Say whether simulated motion can be told from real motion, and by what.

    Two sets of recordings, from anywhere. Nothing is inferred, and no simulator is needed. Files are those of trackers,
    or arrays (K, T, D) of samples (.npy, or .npz with `samples`). See `turing-learning docs examination`.

    Examples:

      turing-learning test fish.csv --against simulated.csv --fps 25 --pixels-per-cm 20 --out test.html
      turing-learning test monday.csv tuesday.csv --against model/*.csv --signals speed,turn --json

    :param real: Recordings of the real thing.
    :param signals: What the examiners see, with commas: speed, turn, neighbor_distance, neighbor_bearing, polarization,
        area. By default all that there are, the last two where recordings are groups.
    :param window: Length of the samples (s); by default 5, or less where individuals are not there for so long.
    :param control: Test one half of the real groups against the other, too.
    :param quick: Leave the boosted trees out, which take most of the time.
    :param seed: Seed of all that is drawn; 0 by default.
    :param out: Write a page (.html).
    :param force: Replace a page that is there.
    :param as_json: Print JSON.
    """
    from turing_learning.examination import PANEL, QUICK
    from turing_learning.examination.present import test_page
    from turing_learning.targets import refuse_target

    example = "For example: turing-learning test fish.csv --against simulated.csv"
    if not real:
        refuse("REAL", "be one recording or several", "none", example)
    against_files = against.against
    if not against_files:
        refuse("--against", "be one recording or several", "none", example)
    if out is not None:
        refuse_target(out, name="out", suffixes=(".html",), force=force)
    options: dict[str, Any] = {"control": control, "seed": seed}
    options["examiners"] = QUICK if quick else PANEL
    names = None
    if signals is not None:
        names = [name.strip() for name in signals.split(",")]
    # Trackers write .npy and .npz, too: what is in them decides.
    arrays = []
    for path in (*real, *against_files):
        arrays.append(path.suffix.lower() in ARRAYS and tl.detection.holds_motion(path))
    if any(arrays):
        got = "samples and recordings"
        require(all(arrays), "REAL", "be recordings where the others are, or samples", got)
        remedy = "Arrays hold samples that are measured already."
        tracks.refuse_beside("be left out for samples", remedy, window=window)
        sides = [_samples(real), _samples(against_files)]
        # One file of a side says nothing of how files differ: then samples are exchanged.
        groups = None
        if len(real) > 1 and len(against_files) > 1:
            groups = [owners for _, owners in sides]
        outcome = tl.test(sides[0][0], sides[1][0], groups, names, **options)
    else:
        recordings = [tracks.read(path, "REAL") for path in real]
        simulated = against.read(tracks)
        for recording in (*recordings, *simulated):
            recording.announce()
        options |= {"window_s": window, "smooth_frames": tracks.smooth or 1}
        outcome = tl.test(recordings, simulated, names=names, **options)
    if as_json:
        print(json.dumps(outcome.to_json(), indent=2, allow_nan=False))
    else:
        plain_console().print(outcome)
    if out is not None:
        title = f"{named(real)} against {named(against_files)}"
        words = ["turing-learning", "test", *map(str, real), "--against", *map(str, against_files)]
        for given in (against.given, tracks.given):
            words += words_of({name: value for name, value in given.items() if name != "against"})
        options = {"signals": signals, "window": window, "control": control, "quick": quick}
        words += words_of({**options, "seed": seed or None})
        tl.report.write_page(test_page(outcome, title, shlex.join(words)), out)
        print(out, file=sys.stderr if as_json else sys.stdout)


def _samples(paths: "tuple[Path, ...] | list[Path]") -> "tuple[np.ndarray, np.ndarray]":
    """Return the samples (K, T, D) of some files, and of which file each is."""
    import numpy as np

    pieces: list[np.ndarray] = []
    for path in paths:
        content = np.load(path, allow_pickle=False)
        samples = content
        if isinstance(content, np.lib.npyio.NpzFile):
            samples = content["samples"]
        shape = str(samples.shape)
        require(samples.ndim == 3, "REAL", "hold samples (K, T, D)", shape, place=str(path))
        pieces.append(samples)
        same = samples.shape[1:] == pieces[0].shape[1:]
        rule = f"hold samples of the same T and D as {paths[0]}"
        require(same, "REAL", rule, shape, place=str(path))
    owners = np.repeat(np.arange(len(pieces)), list(map(len, pieces)))
    return np.concatenate(pieces), owners
