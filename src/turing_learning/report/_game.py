"""A Turing test for people: pairs of replays, one of which is real; plain data, and the page that asks."""

import base64
import hashlib
import json
from dataclasses import dataclass
from string import Template

import numpy as np

from turing_learning.arrays import array
from turing_learning.errors import integer, number

from ._page import POSE_STEPS, asset, page_of

VIEW_MARGIN = 1.08
"""Of the view, in sides of the square that holds all motion of a pair."""
SALT_BITS = 30
"""Of the number by which the page knows on which side the real motion is."""


@dataclass(frozen=True, eq=False)
class Game:
    """Pairs of motion, real and simulated.

    Parameters
    ----------
    title
        What moves; it is seen before the answers.
    real, simulated : (N, F, A, 2)
        x, y of A individuals in F frames, N scenes of each side, all in one unit.
    interval_s
        Time between two frames (s), > 0.
    panel
        Share of pairs, 0 to 1, that a panel of examiners tells; None where none was asked.
    speed
        Seconds of motion in one second, > 0.
    seed
        Of the sides on which the real motion is, >= 0.
    """

    title: str
    real: np.ndarray
    simulated: np.ndarray
    interval_s: float
    panel: float | None = None
    speed: float = 1.0
    seed: int = 0

    def __post_init__(self) -> None:
        real = array("real", self.real, "N F A 2")
        sizes = {"N": real.shape[0], "F": real.shape[1], "A": real.shape[2]}
        array("simulated", self.simulated, "N F A 2", **sizes)
        number("interval_s", self.interval_s, above=0)
        number("speed", self.speed, above=0)
        integer("seed", self.seed)

    @property
    def real_is_left(self) -> np.ndarray:
        """Whether the real motion is on the left (N,), drawn from the seed."""
        return np.random.default_rng((self.seed, 1)).random(len(self.real)) < 0.5


def game_page(game: Game) -> str:
    """Return the page that asks of each pair which motion is real; it works offline."""
    content = _content(game)
    pairs = "pair" if len(game.real) == 1 else "pairs"
    summary = f"{len(game.real)} {pairs} of replays. One of each is real, the other simulated: say which one is real."
    body = Template(asset("_game.html")).substitute(count=len(game.real))
    data = json.dumps(content, allow_nan=False).replace("<", "\\u003c")
    return page_of(game.title, summary, [body], asset("_game.js"), data)


def _content(game: Game) -> dict[str, object]:
    """Return what the script of the page reads; nothing in it names a side."""
    rng = np.random.default_rng((game.seed, 2))
    pairs = []
    for real, simulated, real_left in zip(
        game.real, game.simulated, game.real_is_left.tolist(), strict=True
    ):
        scenes = [_centered(real), _centered(simulated)]
        side = 2 * VIEW_MARGIN * max(float(np.abs(scene).max()) for scene in scenes)
        coded = [_coded(scene / max(side, 1e-9) + 0.5) for scene in scenes]
        if not real_left:
            coded.reverse()
        pairs.append({"scenes": coded, "mark": _mark(real_left, rng)})
    digest = hashlib.sha256(json.dumps(pairs).encode()).hexdigest()
    return {
        "game": digest[:8],
        "interval": game.interval_s,
        "frames": game.real.shape[1],
        "bodies": game.real.shape[2],
        "speed": game.speed,
        "panel": game.panel,
        "pairs": pairs,
    }


def _mark(real_left: bool, rng: np.random.Generator) -> int:
    """Return a number with an even count of ones if the real motion is on the left: nobody sees that at a glance."""
    mark = int(rng.integers(1 << SALT_BITS)) << 1
    odd = mark.bit_count() % 2 == 1
    return mark | int(odd == real_left)


def _centered(scene: np.ndarray) -> np.ndarray:
    """Return positions (F, A, 2) around the middle of all of them: where the camera stood gives nothing away."""
    middle = (scene.min(axis=(0, 1)) + scene.max(axis=(0, 1))) / 2
    return np.asarray(scene - middle)


def _coded(shares: np.ndarray) -> str:
    """Return shares of the view as integers of 16 bits, in base64."""
    return base64.b64encode(np.rint(shares * POSE_STEPS).astype("<u2").tobytes()).decode()
