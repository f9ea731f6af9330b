"""Draw the pictures of docs/families.md: how a group of each family moves.

Run with ``python docs/family_pictures.py``.
"""

from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from PIL import Image

from turing_learning.families import FAMILIES, Boids, BurstAndCoast, Couzin, Family, Robots, Vicsek

IMAGES = Path(__file__).parent / "images"
PAST, PRESENT = "#56b4e9", "#0072b2"
FADING = LinearSegmentedColormap.from_list("fading", ["#e8f3fa", PAST, PRESENT])
INK, MUTED = "#1f2933", "#66717d"

EXAMPLES: dict[str, list[tuple[str, Family, dict[str, float]]]] = {
    "vicsek": [
        (
            f"noise {noise:g} rad",
            Vicsek(individuals=25, steps=80),
            {"speed": 6, "noise": noise, "radius": 4},
        )
        for noise in (0.5, 2, 6)
    ],
    "couzin": [
        (
            f"orientation width {width:g} cm",
            Couzin(individuals=25, steps=100, settling_steps=400, start_side_cm=10),
            {
                "speed": 6,
                "turning_rate": 2,
                "repulsion_radius": 1,
                "orientation_width": width,
                "attraction_width": 14,
                "noise": 0.05,
            },
        )
        for width in (0, 1.5, 8)
    ],
    "boids": [
        (
            f"alignment {alignment:g} /s",
            Boids(individuals=25, steps=60, start_side_cm=15, radius_cm=30),
            {"speed": 8, "separation": 20, "alignment": alignment, "cohesion": 1},
        )
        for alignment in (0, 0.3, 3)
    ],
    "burst-and-coast": [
        (
            f"turn {turn:g} rad",
            BurstAndCoast(individuals=6, steps=200, start_side_cm=40),
            {"speed": 14, "kick_interval": 0.6, "glide_time": 0.8, "turn": turn},
        )
        for turn in (0.1, 0.4, 1.2)
    ],
    "robots": [
        (
            f"{start} to {start + 30} s",
            Robots(individuals=15, steps=300, settling_steps=10 * start, start_side_cm=150),
            {"vl0": -0.7, "vr0": -1, "vl1": 1, "vr1": -1},
        )
        for start in (0, 60, 240)
    ],
}


def draw_group(axes: Axes, positions: np.ndarray) -> None:
    """Draw paths (F, A, 2), darker toward the present, and where individuals are at the end."""
    steps = np.stack([positions[:-1], positions[1:]], axis=2)
    for path in steps.swapaxes(0, 1):
        axes.add_collection(
            LineCollection(path, array=np.arange(len(path)), cmap=FADING, linewidth=1.1)
        )
    axes.plot(*positions[-1].T, "o", color=INK, markersize=2.6, zorder=3)
    low, high = positions.min(axis=(0, 1)), positions.max(axis=(0, 1))
    middle, half = (low + high) / 2, 0.53 * (high - low).max()
    axes.set(
        xlim=(middle[0] - half, middle[0] + half),
        ylim=(middle[1] - half, middle[1] + half),
        aspect="equal",
    )
    axes.set(xticks=[], yticks=[])
    axes.spines[:].set_color("#d5dae0")
    draw_scale(axes, middle, half)


def draw_scale(axes: Axes, middle: np.ndarray, half: float) -> None:
    """Draw a bar of a round length."""
    decade = 10 ** np.floor(np.log10(half))
    length = max(
        factor * decade for factor in (1, 2, 5) if factor * decade <= 0.7 * half or factor == 1
    )
    x, y = middle[0] - 0.93 * half, middle[1] - 0.93 * half
    axes.plot([x, x + length], [y, y], color=INK, linewidth=1.5, solid_capstyle="butt", zorder=4)
    axes.text(x, y + 0.03 * half, f"{length:g} cm", fontsize=8, color=INK, va="bottom")


def draw_family(name: str) -> Figure:
    """Return a figure of three models of a family."""
    figure = Figure(figsize=(7.2, 2.6), layout="constrained")
    for axes, (label, family, truth) in zip(figure.subplots(1, 3), EXAMPLES[name], strict=True):
        parameters = np.array([[truth[key] for key in family.parameters]])
        draw_group(axes, family.simulate(parameters, np.random.default_rng(2))[0])
        axes.set_title(label, fontsize=9.5, color=INK)
    return figure


def main() -> None:
    """Draw a picture of each family."""
    for name in FAMILIES:
        drawn = BytesIO()
        draw_family(name).savefig(drawn, dpi=100)
        few_colors = Image.open(drawn).convert("RGB").quantize(32)  # a third of the size
        few_colors.save(IMAGES / f"families-{name}.png", optimize=True)


if __name__ == "__main__":
    main()
