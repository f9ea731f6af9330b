"""Damage every stored file of small runs and a study in twenty ways each: what do the commands make of it?

By hand, for all cases; an interrupted call is resumed, and the table is printed at the end:

    python tests/reliability/damage.py table.csv
    python tests/reliability/damage.py table.csv 7 7  # seed 7, 7 of the 20 ways for each file and door

The rows are folder, file, damage, door, outcome. Outcomes: "same" (as without damage), "said" (the same or other numbers, and a
warning), "refused" (exit code 1 or 2, and what is wrong), "WRONG" (other numbers in silence), "TRACEBACK" (any other exception).
"""

import contextlib
import csv
import io
import json
import logging
import os
import random
import re
import shutil
import sys
import tempfile
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import turing_learning as tl
from turing_learning.cli import main
from turing_learning.errors import RefusedError
from turing_learning.studies import study

SMALL = {"models.population": 8, "classifiers.population": 8, "run.checkpoint_every": 3}
SWARM = {"scenario.agents": 2, "scenario.trial.duration_s": 1.0}
RECORDED = [
    "--trajectories",
    "track.csv",
    "--fps",
    "10",
    "--scale",
    "1",
    "--y-axis",
    "up",
    "--model",
    "burst-and-coast",
]
RECORDED += ["--window", "1"]
CHECK = ["--samples", "20", "--points", "0", "--recoveries", "0"]
SILENT = ("same", "refused", "said")


# Damage: each gets the bytes of a file, those of another file beside it, those of the same file of another run, and a generator


def flip(content, place):
    """Return bytes with one bit of one of them flipped."""
    return (
        content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :] if content else b"\1"
    )


def digit(content, rng):
    """Return bytes with one digit changed."""
    places = [found.start() for found in re.finditer(rb"\d", content)]
    if not places:
        return content + b"1"
    place = rng.choice(places)
    return (
        content[:place]
        + b"%d" % ((content[place] - 48 + rng.randrange(1, 10)) % 10)
        + content[place + 1 :]
    )


CONTENTS = {
    "first bit": lambda own, beside, other, rng: flip(own, 0),
    "middle bit": lambda own, beside, other, rng: flip(own, len(own) // 2),
    "last bit": lambda own, beside, other, rng: flip(own, max(0, len(own) - 1)),
    "any bit": lambda own, beside, other, rng: flip(own, rng.randrange(max(1, len(own)))),
    "digit": lambda own, beside, other, rng: digit(own, rng),
    "last byte cut": lambda own, beside, other, rng: own[:-1],
    "half": lambda own, beside, other, rng: own[: len(own) // 2],
    "empty": lambda own, beside, other, rng: b"",
    "longer": lambda own, beside, other, rng: own + b" 1",
    "twice": lambda own, beside, other, rng: own + own,
    "zeros": lambda own, beside, other, rng: bytes(len(own)),
    "noise": lambda own, beside, other, rng: rng.randbytes(len(own)),
    "swapped": lambda own, beside, other, rng: beside,
    "of another run": lambda own, beside, other, rng: other,
    "list": lambda own, beside, other, rng: b"[]",
    "object": lambda own, beside, other, rng: b'{"format_version": 1}',
    "text": lambda own, beside, other, rng: b"Dear diary, \xff\xfe\n",
}
PLACES = {
    "deleted": lambda path: None,
    "a folder": lambda path: path.mkdir(),
    "a dangling link": lambda path: path.symlink_to("nowhere"),
}
DAMAGES = (*CONTENTS, *PLACES)


def damage(path, how, files, other, rng):
    """Damage a file; tell whether it has changed.

    Parameters
    ----------
    path
        The file.
    how
        One of `DAMAGES`.
    files
        All files of the folder.
    other
        The same file of another run; may be missing.
    """
    if how in PLACES:
        path.unlink()
        PLACES[how](path)
        return True
    own = path.read_bytes()
    beside = [file for file in files if file != path and file.suffix == path.suffix] or [
        f for f in files if f != path
    ]
    near = sorted(beside, key=lambda file: (file.parent != path.parent, file.name))[0].read_bytes()
    content = CONTENTS[how](own, near, other.read_bytes() if other.is_file() else b"", rng)
    path.write_bytes(content)
    return content != own


# Folders


def make(place, seed, folders):
    """Make a run on a swarm, one of trials, one on a recording, and a study, at a place; or some of them."""
    place.mkdir()
    write_track(place.parent / "track.csv")
    np.save(place.parent / "motion.npy", motion((3, 4, 10, 2)))
    small = [part for key, value in SMALL.items() for part in ("--set", f"{key}={value}")]
    if "swarm" in folders:
        tl.infer(
            "aggregation",
            generations=5,
            seed=seed,
            settings=SMALL | SWARM,
            threads=1,
            out=place / "swarm",
        )
    if "trials" in folders:
        tl.infer(
            "aggregation", trials=30, seed=seed, settings=SWARM, threads=1, out=place / "trials"
        )
    if "recording" in folders:
        more = [
            "--generations",
            "4",
            "--seed",
            str(seed),
            "--threads",
            "1",
            "--out",
            str(place / "recording"),
        ]
        succeed(["infer", *RECORDED, *small, *more])
    if "study" in folders:
        with ThreadPoolExecutor(1) as executor:
            study("aggregation", runs=2, first_seed=seed, generations=4, settings=SMALL | SWARM, executor=executor,
                  out=place / "study")  # fmt: skip
    for each in ("swarm", "recording"):
        if "check" in folders.get(each, ()):
            succeed(
                ["check", str(place / each), *CHECK, *(RECORDED if each == "recording" else [])]
            )


def motion(shape):
    """Return random motion."""
    return np.random.default_rng(0).normal(1, 0.2, shape)


def write_track(path):
    """Write a table of two animals that walk about."""
    steps = np.cumsum(motion((2, 200, 2)) - [1, 0.9], axis=1)
    rows = [
        f"{frame},{who},{x:.3f},{y:.3f}"
        for who in (0, 1)
        for frame, (x, y) in enumerate(steps[who])
    ]
    path.write_text("\n".join(["frame,id,x,y", *rows]) + "\n")


# Doors


class Said:
    """What a door has printed."""

    def __init__(self, code, out, err):
        self.code, self.out, self.err = code, out, err


def run(arguments):
    """Call the command line in this process."""
    out, err = io.StringIO(), io.StringIO()
    handler = logging.StreamHandler(err)
    logging.getLogger("turing_learning").addHandler(handler)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            try:
                main(arguments)
            except SystemExit as end:
                code = end.code
    finally:
        logging.getLogger("turing_learning").removeHandler(handler)
    return Said(code, out.getvalue(), err.getvalue())


def succeed(arguments):
    """Call the command line, which must succeed."""
    said = run(arguments)
    assert said.code == 0, said.err


def loaded(path):
    """Open a run and its history; return what they hold as text."""
    messages = io.StringIO()
    handler = logging.StreamHandler(messages)
    logging.getLogger("turing_learning").addHandler(handler)
    try:
        result = tl.load_run(path)
        history = result.history.load()
        arrays = {
            name: np.asarray(history[name]).tobytes().hex() for name in sorted(history.variables)
        }
        return Said(0, json.dumps(result.to_json()) + json.dumps(arrays), messages.getvalue())
    except RefusedError as error:
        return Said(2, "", f"{error}\n")
    finally:
        logging.getLogger("turing_learning").removeHandler(handler)


DOORS = {
    "show": lambda path, more: run(["show", path]),
    "load_run": lambda path, more: loaded(path),
    "detect": lambda path, more: run(
        ["detect", path, "motion.npy", "--json", "--rule", "unanimous"]
    ),
    "check": lambda path, more: run(["check", path, *CHECK, *more]),
    "resume": lambda path, more: run(["resume", path, *more]),
}
OF = {
    "swarm": tuple(DOORS),
    "trials": ("show", "load_run", "resume"),
    "recording": tuple(DOORS),
    "study": ("show", "resume"),
}


def outcome(door, folder):
    """Call a door; return the outcome's kind if it needs no comparison, and all that it said of numbers."""
    try:
        said = DOORS[door](folder, RECORDED if folder == "recording" else [])
        if said.code == 0 and door == "resume":  # is what it leaves right?
            after = DOORS["show"](folder, [])
            said = Said(after.code, said.out + after.out, said.err + after.err)
    except Exception as error:
        return f"TRACEBACK {type(error).__name__}: {error}"[:160], None
    said.out = "\n".join(
        line for line in said.out.splitlines() if not line.endswith(".csv")
    )  # says whether there is a table
    numbers = re.sub(r"\d+(\.\d+)? (s|ms)\b|\d\d:\d\d:\d\d", "", said.out)
    if said.code == 0:
        return ("said" if said.err else ""), numbers
    return (
        "refused" if said.code in (1, 2) and said.err else f"TRACEBACK {said.code} {said.err}"[:160]
    ), None


def judge(found, reference):
    """Return the outcome beside that of an undamaged folder."""
    kind, numbers = found
    return kind or ("same" if numbers == reference[1] else "WRONG")


def prepare(place, folders, seed=1):
    """Make folders and all references at a place, which is the working directory."""
    make(place / "made", seed, folders)
    make(place / "other", seed + 1, folders)
    references = {}
    for folder, doors in folders.items():
        for door in doors:
            fresh(place, folder)
            references[folder, door] = outcome(door, folder)
            assert references[folder, door][0] == "", (folder, door, references[folder, door])
    return references


def blank_pictures():
    """Save small blank figures: nobody looks at them, and drawing would be nine tenths of the time."""
    save = Figure.savefig
    Figure.draw_without_rendering = lambda _: None
    Figure.savefig = lambda _, *given, **options: save(Figure((1, 1)), *given, **options)


def fresh(place, folder):
    """Put an undamaged copy where the doors look."""
    shutil.rmtree(place / folder, ignore_errors=True)
    shutil.copytree(place / "made" / folder, place / folder, symlinks=True)


def files_of(place, folder):
    """Return the names of all stored files, without what is only drawn and what is only locked."""
    top = place / "made" / folder
    names = sorted(path.relative_to(top).as_posix() for path in top.rglob("*") if path.is_file())
    return [name for name in names if not name.endswith((".png", ".svg", ".html", "lock"))]


def case(place, references, folder, name, how, door, seed=""):
    """Return the outcome of one case."""
    rng = random.Random(f"{folder} {name} {how}{seed}")
    fresh(place, folder)
    files = [place / folder / each for each in files_of(place, folder)]
    if not damage(place / folder / name, how, files, place / "other" / folder / name, rng):
        return "same"
    return judge(outcome(door, folder), references[folder, door])


def all_cases(place, seed=1, ways=20):
    """Yield folder, file, damage and door of each case; of each file and door so many ways, drawn with a seed."""
    for folder, doors in OF.items():
        for name in files_of(place, folder):
            for door in doors:
                for how in random.Random(str((seed, *stable((folder, name, "", door))))).sample(
                    DAMAGES, ways
                ):
                    yield folder, name, how, door


def main_by_hand(table, seed=1, ways=20):
    """Run all cases that are not in the table yet."""
    done = set()
    if table.exists():
        with table.open(newline="") as file:
            done = {tuple(row[:4]) for row in csv.reader(file)}
    table = table.absolute()
    with tempfile.TemporaryDirectory(
        dir="/dev/shm" if Path("/dev/shm").is_dir() else None
    ) as folder:
        place = Path(folder)
        os.chdir(place)
        os.environ["COLUMNS"] = "200"
        blank_pictures()
        references = prepare(place, OF, seed)
        with table.open("a", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            for each in sorted(
                all_cases(place, seed, ways), key=lambda one: one[3] == "check"
            ):  # takes longest
                if stable(each) not in done:
                    writer.writerow([*stable(each), case(place, references, *each, seed)])
                    file.flush()
        os.chdir("/")
    with table.open(newline="") as file:
        rows = list(csv.reader(file))
    for (folder, door, kind), count in sorted(
        Counter((row[0], row[3], row[4].split()[0]) for row in rows).items()
    ):
        sys.stdout.write(f"{folder:10} {door:9} {kind:10} {count}\n")


def stable(each):
    """Return a case without the digest in the name of a checkpoint, which differs from call to call."""
    folder, name, how, door = each
    return folder, re.sub(r"-[0-9a-f]{16}(?=\.npz)", "", name), how, door


if __name__ == "__main__":
    main_by_hand(Path(sys.argv[1]), *map(int, sys.argv[2:]))
