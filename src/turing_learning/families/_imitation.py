"""Learning by imitation: a network that says what an individual does next, from recordings; needs PyTorch."""

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from turing_learning.kernels.imitation import (
    HISTORY,
    LAGS,
    MEMORIES,
    MEMORY_S,
    MOST_OTHERS,
    OWN,
    RAYS,
    TRAITS,
    Choices,
    Layers,
    Tanks,
    Units,
    perceive,
    remember_path,
)  # fmt: skip
from turing_learning.trajectories import nearest_others

BINS = 48
"""Of lengths, and of turns: each as likely as the others in what was recorded."""
QUANTILES = 17
"""Of the values within a bin."""
OTHER_WIDTH = 32
"""Neurons of each layer that looks at another individual."""
WIDTH = 96
"""Neurons of each other layer."""
DROPOUT = 0.1
"""Share of the neurons of the trunk that are left out in a step of the training."""
BATCH = 256
RATE = 2e-3
"""Largest learning rate."""
DECAY = 1e-3
"""Of the weights."""
BLINDED = 0.1
"""Share of the examples without the velocities of others, as many without others, as many without others and walls."""
AVERAGED = 0.998
"""Share of the averaged weights that stays in a step: about the last 500 steps count."""
CHECKED = 10
"""Stretches of which the last is for choosing when to stop."""
LOOKS = 20
"""Times that the training looks at these stretches."""
MOST_ROWS = 100_000
"""Steps that are learned from, drawn by chance where more were recorded."""


@dataclass(frozen=True)
class Recorded:
    """What individuals perceived and did: N steps of recordings.

    `stretch` (N,) tells where in a recording: steps of one stretch follow each other.
    """

    own: np.ndarray
    traits: np.ndarray
    seen: np.ndarray
    answers: np.ndarray
    stretch: np.ndarray


def units_of(paths: Sequence[np.ndarray], interval_s: float) -> Units:
    """Return what perception is measured in, by recordings (F, A, 2) with NaN where one is absent."""
    lengths = np.concatenate(
        [np.hypot(*np.moveaxis(np.diff(path, axis=0), -1, 0)).ravel() for path in paths]
    )
    lengths = lengths[np.isfinite(lengths)]
    step = max(float(np.median(lengths)), 1e-9)
    nearest = np.concatenate([_nearest(path) for path in paths])
    neighbor = float(np.median(nearest)) if len(nearest) else 10 * step
    # a wall is near where a fast individual gets in half a second
    wall = float(np.quantile(lengths, 0.75)) * 0.5 / interval_s
    rates = 1 - np.exp(-interval_s / MEMORY_S)
    return Units(
        step, max(wall, step), max(neighbor, step), rates, 3 * float(np.mean(lengths)) + step
    )


def _nearest(path: np.ndarray) -> np.ndarray:
    """Return distances of the nearest other, in one frame of ten."""
    sampled = path[::10]
    present = ~np.isnan(sampled[..., 0])
    offset, has_neighbor = nearest_others(np.nan_to_num(sampled), present)
    return np.hypot(*np.moveaxis(offset, -1, 0))[has_neighbor & present]


def memories_of(path: np.ndarray, units: Units) -> np.ndarray:
    """Return the leaky averages (F, A, MEMORIES) along a recording."""
    lengths = np.hypot(*np.moveaxis(np.diff(path, axis=0), -1, 0))
    memories = np.empty((*path.shape[:2], MEMORIES))
    remember_path(path, units, float(np.nanmean(np.minimum(lengths, units.fastest))), memories)
    return memories


def rows_of(path: np.ndarray, learned: np.ndarray) -> np.ndarray:
    """Return frames and individuals (N, 2) whose past is there and whose next step may be learned, `learned` (F, A)."""
    usable = np.isfinite(path).all(axis=-1) & learned
    unusable = np.cumsum(~usable, axis=0)
    frames = np.arange(HISTORY, len(path) - 1)
    before = frames - HISTORY
    at, individual = np.nonzero(usable[before] & (unusable[frames + 1] == unusable[before]))
    return np.stack([frames[at], individual], axis=1)


def recorded(
    path: np.ndarray, memories: np.ndarray, rows: np.ndarray, tanks: Tanks, tank: int, units: Units
) -> Recorded:
    """Return what was perceived and done at these frames and individuals of a recording."""
    count = len(rows)
    own_inputs = np.zeros((count, OWN))
    traits = np.zeros((count, MOST_OTHERS, TRAITS), dtype=np.float32)
    others_seen = np.zeros(count, dtype=np.int64)
    answers = np.zeros((count, 2))
    perceive(path, memories, rows, tanks, tank, units, own_inputs, traits, others_seen, answers)
    return Recorded(own_inputs.astype(np.float32), traits, others_seen, answers, rows[:, 0])


def bins_of(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return inner edges (BINS - 1,) of bins that are equally likely, and quantiles within each (BINS, QUANTILES)."""
    chances = np.linspace(0, 1, BINS * (QUANTILES - 1) + 1)
    quantiles = np.quantile(values, chances)
    edges = np.arange(BINS) * (QUANTILES - 1)
    inner = quantiles[edges[1:]]
    return inner, quantiles[edges[:, None] + np.arange(QUANTILES)]


def learn(
    examples: Recorded, *, steps: int, seed: int, progress: Callable[[int, int], None] | None = None
) -> tuple[Layers, Choices, float]:
    """Learn to say how long the next step is, and which turn it makes, by likelihood.

    Both are drawn from bins, the turn after the length. Every example is also seen in a mirror. In some of them the
    velocities of others, the others, or others and walls are hidden, so that the network can be asked what it would do
    without.

    Returns
    -------
    Layers, Choices, float
        Those of the moment at which stretches that are not learned from were predicted best, and their
        log-likelihood per step, in nats, in excess of chance.
    """
    import torch
    from torch import nn
    from torch.nn import functional

    lengths, turns = examples.answers.T
    length_edges, length_values = bins_of(lengths)
    turn_edges, turn_values = bins_of(np.concatenate([turns, -turns]))
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        net = trainable_network()
        own_inputs, traits = torch.from_numpy(examples.own), torch.from_numpy(examples.traits)
        visible = torch.arange(MOST_OTHERS) < torch.from_numpy(examples.seen)[:, None]
        length_bins = torch.from_numpy(np.searchsorted(length_edges, lengths, side="right"))
        turn_bins = torch.from_numpy(np.searchsorted(turn_edges, turns, side="right"))
        mirrored_bins = torch.from_numpy(np.searchsorted(turn_edges, -turns, side="right"))
        flip_own, order_own, flip_traits = _mirror()
        checked = _checked(examples.stretch)
        learned_from = torch.from_numpy(np.flatnonzero(~checked))
        looked_at = torch.from_numpy(np.flatnonzero(checked))
        optimizer = torch.optim.AdamW(net.parameters(), lr=RATE, weight_decay=DECAY)
        schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, RATE, total_steps=steps)
        averaged = torch.optim.swa_utils.AveragedModel(
            net, multi_avg_fn=torch.optim.swa_utils.get_ema_multi_avg_fn(AVERAGED)
        )
        best: Any = None
        chance = 2 * np.log(BINS)
        for step in range(steps):
            net.train()
            batch = learned_from[torch.randint(len(learned_from), (BATCH,))]
            mirrored = torch.rand(BATCH) < 0.5
            some_own, some_traits, some_there = own_inputs[batch], traits[batch], visible[batch]
            some_own = torch.where(mirrored[:, None], some_own[:, order_own] * flip_own, some_own)
            some_traits = torch.where(
                mirrored[:, None, None], some_traits * flip_traits, some_traits
            )
            some_own, some_traits, some_there = _blinded(some_own, some_traits, some_there)
            turned = torch.where(mirrored, mirrored_bins[batch], turn_bins[batch])
            says_length, says_turn = net(some_own, some_traits, some_there, length_bins[batch])
            loss = functional.cross_entropy(
                says_length, length_bins[batch]
            ) + functional.cross_entropy(says_turn, turned)
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(net.parameters(), 1.0)
            optimizer.step()
            schedule.step()
            averaged.update_parameters(net)
            if (step + 1) % max(steps // LOOKS, 1) == 0 or step == steps - 1:
                averaged.eval()
                with torch.no_grad():
                    says_length, says_turn = averaged(
                        own_inputs[looked_at],
                        traits[looked_at],
                        visible[looked_at],
                        length_bins[looked_at],
                    )
                    missed = functional.cross_entropy(says_length, length_bins[looked_at])
                    missed = missed + functional.cross_entropy(says_turn, turn_bins[looked_at])
                gain = float(chance - missed)
                if best is None or gain > best[0]:
                    best = gain, copy.deepcopy(averaged.module.state_dict())
                if progress is not None:
                    progress(step + 1, steps)
        net.load_state_dict(best[1])
        return net.layers(), Choices(length_values, turn_values), best[0]


def _checked(stretch: np.ndarray) -> np.ndarray:
    """Return which steps are for choosing when to stop: every tenth part of the time."""
    edges = np.quantile(stretch, np.linspace(0, 1, 2 * CHECKED + 1)[1:-1])
    return np.searchsorted(edges, stretch, side="right") % CHECKED == CHECKED // 2


def _mirror() -> tuple[Any, Any, Any]:
    """Return signs and order of own perception in a mirror, and signs of the traits of others."""
    import torch

    signs = torch.ones(OWN)
    signs[1 : 2 * LAGS : 2] = -1
    order = torch.arange(OWN)
    offset = 2 * LAGS + MEMORIES
    for scale in range(2):
        for ray in range(RAYS):
            order[offset + scale * RAYS + ray] = offset + scale * RAYS + (-ray) % RAYS
    traits = torch.ones(TRAITS)
    traits[[1, 6]] = -1
    return signs, order, traits


def _blinded(own_inputs: Any, traits: Any, visible: Any) -> tuple[Any, Any, Any]:
    """Hide the velocities of others, the others, or others and walls in a share of the examples."""
    import torch

    chance = torch.rand(len(own_inputs))
    own_inputs, traits = own_inputs.clone(), traits.clone()
    traits[chance < BLINDED, :, 5:] = 0.0
    visible = visible & (chance > 3 * BLINDED)[:, None] | visible & (chance < BLINDED)[:, None]
    without_walls = (chance >= BLINDED) & (chance < 2 * BLINDED)
    own_inputs[without_walls, OWN - 2 * RAYS - 1 :] = 0.0
    return own_inputs, traits, visible


def trainable_network() -> Any:
    """Return the network, as PyTorch trains it; `kernels.imitation` computes the same."""
    import torch
    from torch import nn

    class Network(nn.Module):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__()
            self.other_first = nn.Linear(TRAITS, OTHER_WIDTH)
            self.other_second = nn.Linear(OTHER_WIDTH, OTHER_WIDTH)
            self.attention = nn.Linear(OTHER_WIDTH, 1)
            self.trunk_first = nn.Linear(OWN + OTHER_WIDTH, WIDTH)
            self.trunk_second = nn.Linear(WIDTH, WIDTH)
            self.length = nn.Linear(WIDTH, BINS)
            self.turn_hidden = nn.Linear(WIDTH, WIDTH)
            self.turn_of_length = nn.Embedding(BINS, WIDTH)
            self.turn = nn.Linear(WIDTH, BINS)
            self.dropout = nn.Dropout(DROPOUT)
            nn.init.normal_(self.turn_of_length.weight, std=0.1)

        def forward(
            self, own_inputs: Any, traits: Any, visible: Any, length_bins: Any
        ) -> tuple[Any, Any]:
            bend = nn.functional.silu
            encoded = bend(self.other_second(bend(self.other_first(traits))))
            exponent = self.attention(encoded)[..., 0].masked_fill(~visible, -torch.inf)
            # nothing is among the options: a zero, that counts for no one
            nothing = torch.zeros_like(exponent[:, :1])
            weights = torch.softmax(torch.cat([exponent, nothing], dim=1), dim=1)[:, :-1]
            attended = (weights[..., None] * encoded).sum(dim=1)
            hidden = self.dropout(bend(self.trunk_first(torch.cat([own_inputs, attended], dim=1))))
            hidden = self.dropout(bend(self.trunk_second(hidden)))
            turning = bend(self.turn_hidden(hidden) + self.turn_of_length(length_bins))
            return self.length(hidden), self.turn(turning)

        def layers(self) -> Layers:
            weights: dict[str, np.ndarray] = {}
            for name, layer in self.named_children():
                if not isinstance(layer, nn.Linear):
                    continue
                weights[name] = np.ascontiguousarray(layer.weight.detach().numpy().T)
                weights[f"{name}_bias"] = layer.bias.detach().numpy().copy()
            bias = weights.pop("turn_hidden_bias")
            weights["turn_of_length"] = self.turn_of_length.weight.detach().numpy() + bias
            return Layers(**weights)

    return Network()
