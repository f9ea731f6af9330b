"""Five recorded zebrafish, and two families of models that try to pass for them: ``python examples/zebrafish.py``.

The recording states neither its frame rate nor its scale. Both are assumptions here, and every cm and s below stands on them.
"""

import argparse
import csv
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import turing_learning as tl
from turing_learning.analysis import area_under_curve, is_known
from turing_learning.detection import Detector
from turing_learning.families import BurstAndCoast, Couzin, Particles
from turing_learning.identifiability import Check, Effort
from turing_learning.trajectories import Trajectories, Windows

ROOT = Path(__file__).parents[1]
RECORDING = ROOT / "tests" / "reference" / "data" / "tracktor" / "zebrafish_video_idtracked.txt"
ASSUMED_FPS = 30
ASSUMED_PIXELS_PER_CM = 20
"""With it the tank is 36 by 25 cm, and the fish move at 4.5 cm/s in the median."""

LONGEST_GAP = 5
EVERY = 3
WINDOW_S = 5
SIGNALS = ("speed", "turn", "neighbor_distance")
STRAIGHT = 0.1
"""Turn (rad/s) below which a step is straight."""
EFFORT = Effort()
"""How much the fresh classifiers are trained."""
LABELS = ("speed (cm/s)", "turn (rad/s)", "distance of the nearest (cm)")

FISH, MODELS, INK = "#1f2933", ("#0072b2", "#d55e00"), "#1f2933"


def recording() -> Trajectories:
    """Return the fish, short gaps filled, at 10 frames per second."""
    fish = tl.load_trajectories(RECORDING, fps=ASSUMED_FPS, pixels_per_cm=ASSUMED_PIXELS_PER_CM)
    return fish.bridged(max_gap=LONGEST_GAP).thinned(EVERY)


def tank(fish: Trajectories) -> tuple[float, float]:
    """Return width and height (cm) of where the fish were: the glass is not in the file."""
    places = fish.positions[fish.present]
    width, height = np.ptp(places, axis=0).tolist()
    return width, height


def families(fish: Trajectories, windows: Windows) -> dict[str, Particles]:
    """Return the two families, in the tank of the fish."""
    setting = {
        "individuals": len(fish.individuals),
        "steps": windows.learning.shape[1],
        "interval_s": windows.interval_s,
        "signals": windows.names,
        "tank_cm": tank(fish),
        "settling_steps": 50,
        "observed": 3,
    }
    return {"burst-and-coast": BurstAndCoast(**setting), "couzin": Couzin(**setting)}


@dataclass(frozen=True)
class Outcome:
    """What came out for one family.

    Attributes
    ----------
    low, high
        Ends of the interval; None where they are not known.
    area
        Probability that the classifiers of the run score a window of the fish that was never learned from above one that was
        simulated anew from the estimate: 0.5 where they cannot tell, 1 where they always can.
    control
        The same between held-out fish and other fish.
    told
        Share of the simulated windows that are called counterfeit at a threshold that calls 5 % of the fish windows so.
    accuracy, p_value
        Of fresh classifiers on held-out fish and new simulations, see `turing_learning.identifiability.TwoSampleTest`.
    pinned_down
        Whether nothing speaks against the parameter being pinned down.
    straight, straight_fish
        Share of steps with next to no turn, of new simulations and of held-out fish: a statistic that nobody learned from.
    """

    family: str
    parameter: str
    unit: str
    estimate: float
    low: float | None
    high: float | None
    area: float
    control: float
    told: float
    accuracy: float
    p_value: float
    pinned_down: bool
    straight: float
    straight_fish: float


def infer(
    name: str, family: Particles, windows: Windows, out: Path, *, generations: int, population: int
) -> tl.Result:
    """Let a family try to pass for the fish; a run that is complete is opened instead."""
    folder = out / name
    if (folder / "result.json").exists() and tl.load_run(folder).complete:
        return tl.load_run(folder)
    return tl.infer(
        genuine=windows,
        simulate=family,
        parameters=family.parameters,
        name=name,
        generations=generations,
        seed=1,
        threads=1,
        out=folder,
        force=True,
        settings={"models.population": population, "classifiers.population": population},
    )


def simulated(family: Particles, result: tl.Result, groups: int, seed: int) -> np.ndarray:
    """Return samples (K, T, D) of the estimate."""
    return family.observe(result.estimate, groups=groups, rng=np.random.default_rng(seed))


def told_apart(
    family: Particles, result: tl.Result, windows: Windows
) -> tuple[float, float, float]:
    """Return how well the classifiers of a run tell fish from models, fish from fish, and the share told of models.

    Votes are weighed by half of the windows for learning, against simulations of the estimate. Scores are those of held-out
    windows and of new simulations; the control is the other half of the windows for learning.
    """
    learned = np.random.default_rng(1).permutation(windows.learning)
    detector = Detector.from_run(
        result,
        genuine=learned[:, None],
        abnormal=simulated(family, result, 100, seed=11)[:, None],
        false_alarms=0.05,
    )
    fish = detector.judge(windows.held_out)
    new = simulated(family, result, 100, seed=12)
    models = detector.judge(new)
    others = detector.judge(learned[len(learned) // 2 :])
    return (
        area_under_curve(fish, models),
        area_under_curve(fish, others),
        float(np.mean(detector.called_abnormal(new[:, None]))),
    )


def straight(samples: np.ndarray) -> float:
    """Return the share of steps of samples (K, T, D) with a turn below `STRAIGHT`."""
    return float(np.mean(np.abs(samples[..., SIGNALS.index("turn")]) < STRAIGHT))


def rounded(value: float) -> float | None:
    """Return a number with four digits; None where it is not known."""
    return float(f"{value:.4g}") if is_known(value) else None


def outcomes(
    name: str, family: Particles, result: tl.Result, windows: Windows, found: Check
) -> list[Outcome]:
    """Return a row for each parameter."""
    pinned = {each.parameter: each.pinned_down for each in found.parameters}
    area, control, told = told_apart(family, result, windows)
    shares = straight(simulated(family, result, 100, seed=13)), straight(windows.held_out)
    return [
        Outcome(
            name, key, unit, *map(rounded, (result.estimate[key], *result.wandering[key])),
            area=round(area, 3), control=round(control, 3), told=round(told, 3),
            accuracy=round(found.test.accuracy, 3), p_value=round(found.test.p_value, 4), pinned_down=pinned[key],
            straight=round(shares[0], 3), straight_fish=round(shares[1], 3),
        )
        for key, unit in family.units.items()
    ]  # fmt: skip


def plot_signals(samples: dict[str, np.ndarray]) -> Figure:
    """Draw how often each signal has which value, for held-out fish and for simulations of the estimates."""
    figure = Figure(figsize=(8, 2.6), layout="constrained")
    ends = [np.percentile(samples["fish"][..., d], (0.5, 99.5)) for d in range(len(SIGNALS))]
    for d, axes in enumerate(figure.subplots(1, len(SIGNALS))):
        for (name, values), color in zip(samples.items(), (FISH, *MODELS), strict=True):
            counts, edges = np.histogram(values[..., d], bins=40, range=ends[d])
            axes.stairs(
                counts / values[..., d].size / np.diff(edges),
                edges,
                color=color,
                linewidth=1.4,
                label=name,
            )
        axes.set_xlabel(LABELS[d], color=INK)
        highest = np.histogram(samples["fish"][..., d], bins=40, range=ends[d], density=True)[
            0
        ].max()
        axes.set(yticks=[], ylim=(0, 1.6 * highest))
        axes.spines[["top", "right", "left"]].set_visible(False)
    figure.legend(
        *axes.get_legend_handles_labels(), loc="outside upper center", ncols=3, frameon=False
    )
    return figure


def plot_paths(fish: Trajectories, models: dict[str, np.ndarray], frames: int) -> Figure:
    """Draw the fish, and a group of each model, for as many frames, in the same tank."""
    start = complete_stretch(fish.present, frames)
    groups = {
        "fish": fish.positions[start : start + frames] - fish.positions[fish.present].min(axis=0)
    }
    width, height = tank(fish)
    figure = Figure(figsize=(8, 2.3), layout="constrained")
    for axes, (name, paths), color in zip(
        figure.subplots(1, 3), (groups | models).items(), (FISH, *MODELS), strict=True
    ):
        axes.plot(paths[:frames, :, 0], paths[:frames, :, 1], color=color, linewidth=0.8)
        axes.plot(*paths[frames - 1].T, "o", color=color, markersize=3)
        axes.set(xlim=(0, width), ylim=(0, height), aspect="equal", xticks=[], yticks=[])
        axes.set_title(name, fontsize=10, color=INK)
    return figure


def complete_stretch(present: np.ndarray, frames: int) -> int:
    """Return the first frame from which on everybody (F, A) is there for so many frames.

    Raises
    ------
    ValueError
        If there is no such stretch.
    """
    absent = np.concatenate([[0], np.cumsum(~present.all(axis=1))])
    whole = np.flatnonzero(absent[frames:] == absent[:-frames])
    if not len(whole):
        raise ValueError(f"`frames` must leave a stretch with everybody; got {frames}.")
    return int(whole[0])


def draw(fish: Trajectories, windows: Windows, results: dict[str, tl.Result], images: Path) -> None:
    """Draw both pictures."""
    members, frames = families(fish, windows), 100
    samples = {"fish": windows.held_out} | {
        name: simulated(family, results[name], 100, seed=13) for name, family in members.items()
    }
    plot_signals(samples).savefig(images / "zebrafish-signals.png", dpi=110)
    paths = {}
    for name, family in members.items():
        parameters = np.array([list(results[name].estimate.values())])
        longer = replace(family, steps=frames)
        paths[name] = longer.simulate(parameters, np.random.default_rng(14))[0]
    plot_paths(fish, paths, frames).savefig(images / "zebrafish-paths.png", dpi=110)


def write(path: Path, rows: Sequence[Outcome]) -> None:
    """Write rows as CSV."""
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.DictWriter(file, [field.name for field in fields(Outcome)], lineterminator="\n")
        table.writeheader()
        table.writerows(asdict(row) for row in rows)


def main(arguments: Sequence[str] | None = None) -> None:
    """Infer both families, ask fresh classifiers, write the table, draw the pictures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--out", type=Path, default=ROOT / "runs" / "zebrafish", help="folder of the two runs"
    )
    parser.add_argument(
        "--docs", type=Path, default=ROOT / "docs", help="folder with results/ and images/"
    )
    parser.add_argument("--generations", type=int, default=800)
    parser.add_argument("--population", type=int, default=50)
    chosen = parser.parse_args(arguments)
    fish = recording()
    windows = fish.windows(length_s=WINDOW_S, signals=SIGNALS)
    rows, results = [], {}
    for name, family in families(fish, windows).items():
        size = {"generations": chosen.generations, "population": chosen.population}
        results[name] = infer(name, family, windows, chosen.out, **size)
        found = results[name].check(genuine=windows, simulate=family, recording=fish, effort=EFFORT)
        rows += outcomes(name, family, results[name], windows, found)
        print(results[name], rows[-1], found, sep="\n", flush=True)
    write(chosen.docs / "results" / "zebrafish.csv", rows)
    draw(fish, windows, results, chosen.docs / "images")


if __name__ == "__main__":
    main()
