"""Learning by imitation: a network that says what comes of the next step, from recordings; needs PyTorch."""

import copy
import math
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from turing_learning.kernels.imitation import (
    LAGS,
    MEMORIES,
    MEMORY_S,
    MOST_OTHERS,
    OWN,
    PAST,
    RAYS,
    TRAITS,
    Layers,
    Units,
    remember_path,
)
from turing_learning.trajectories import nearest_others

from ._pieces import HORIZONS_S, OUTCOMES, Recorded

OUTCOME_BINS = 24
"""Of distances, and of directions, of an outcome: each as likely as the others in what was recorded."""
CONTEXT = 16
"""Dimensions in which contexts are compared."""
SURROUNDINGS = 0.3
"""Weight of what comes of others and walls in this comparison; that of the own motion is 1."""
CLOSEST = 0.005
"""Share of the distances of the nearest other below which nobody comes nearer to another."""
FAST = 0.9
"""Share of the time in which whoever comes and goes is slower than it would like to be."""
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
MOST_ROWS = 60_000
"""Steps that are learned from; where more were recorded, blocks of them are drawn by chance."""


def units_of(paths: Sequence[np.ndarray], interval_s: float) -> Units:
    """Return what perception is measured in, by recordings (F, A, 2) with NaN where one is absent."""
    lengths = np.concatenate([_lengths(path).ravel() for path in paths])
    lengths = lengths[np.isfinite(lengths)]
    step = max(float(np.median(lengths)), 1e-9)
    nearest = np.concatenate([_nearest(path) for path in paths])
    neighbor = float(np.median(nearest)) if len(nearest) else 10 * step
    # a wall is near where a fast individual gets in half a second
    wall = float(np.quantile(lengths, 0.75)) * 0.5 / interval_s
    rates = 1 - np.exp(-interval_s / MEMORY_S)
    fastest = 3 * float(np.mean(lengths)) + step
    closest = float(np.quantile(nearest, CLOSEST)) if len(nearest) else 0.0
    return Units(step, max(wall, step), max(neighbor, step), rates, fastest, closest)


def _nearest(path: np.ndarray) -> np.ndarray:
    """Return distances of the nearest other, in one frame of ten."""
    sampled = path[::10]
    present = ~np.isnan(sampled[..., 0])
    offset, has_neighbor = nearest_others(np.nan_to_num(sampled), present)
    return np.hypot(*np.moveaxis(offset, -1, 0))[has_neighbor & present]


def memories_of(path: np.ndarray, learned: np.ndarray, units: Units) -> np.ndarray:
    """Return the averages (F, A, MEMORIES) along a recording; the lasting ones are of what was `learned` (F, A, 2) of it.

    With leaky averages alone whoever was slow for a while stayed slow, and groups drifted for minutes.
    """
    lengths = np.minimum(_lengths(path), units.fastest)
    memories = np.empty((*path.shape[:2], MEMORIES))
    remember_path(path, units, float(np.nanmean(lengths)), memories)
    lengths = np.minimum(_lengths(learned), units.fastest)
    for individual, own in enumerate(lengths.T):
        own = own[np.isfinite(own)]
        if len(own):
            memories[:, individual, MEMORIES // 2 - 1] = own.mean()
            memories[:, individual, MEMORIES - 1] = (own**2).mean()
    return memories


def _lengths(path: np.ndarray) -> np.ndarray:
    """Return displacements (F - 1, A) from frame to frame (cm)."""
    return np.hypot(*np.moveaxis(np.diff(path, axis=0), -1, 0))


def traits_of(path: np.ndarray) -> np.ndarray:
    """Return lasting averages (F, A, MEMORIES) of whoever comes and goes: how fast each is when it is fast.

    Leaky averages would be a memory of having been slow, and who was slow would stay slow.
    """
    lengths = np.hypot(*np.moveaxis(path[PAST:] - path[:-PAST], -1, 0)) / PAST
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        fast = np.nanquantile(lengths, FAST, axis=0)
    fast = np.where(np.isnan(fast), np.nanmedian(fast), fast)
    traits = np.repeat(np.stack([fast, fast**2], axis=1), MEMORIES // 2, axis=1)
    return np.tile(traits, (len(path), 1, 1))


def learn(
    examples: Recorded, *, steps: int, seed: int, progress: Callable[[int, int], None] | None = None
) -> tuple[Layers, float]:
    """Learn to say what comes of the next step, by likelihood, and so which contexts are alike.

    Distance and direction of each outcome are sorted into bins. Every example is also seen in a mirror. In some of
    them the velocities of others, the others, or others and walls are hidden, so that the network can be asked what it
    would expect without.

    Returns
    -------
    Layers, float
        Those of the moment at which stretches that are not learned from were predicted best, and their
        log-likelihood per step, in nats, in excess of chance.
    """
    import torch
    from torch import nn
    from torch.nn import functional

    with torch.random.fork_rng(devices=[]), _one_thread():
        torch.manual_seed(seed)
        net = trainable_network()
        own_inputs = torch.from_numpy(examples.own)
        traits = torch.from_numpy(examples.traits)
        visible = torch.arange(MOST_OTHERS) < torch.from_numpy(examples.seen)[:, None]
        bins, mirrored_bins = (torch.from_numpy(bins) for bins in _bins_of(examples.outcomes))
        flip_own, order_own, flip_traits = _mirror()
        checked = _checked(examples.stretch)
        learned_from = torch.from_numpy(np.flatnonzero(~checked))
        looked_at = torch.from_numpy(np.flatnonzero(checked))
        optimizer = torch.optim.AdamW(net.parameters(), lr=RATE, weight_decay=DECAY)
        schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, RATE, total_steps=steps)
        averaged = torch.optim.swa_utils.AveragedModel(
            net, multi_avg_fn=torch.optim.swa_utils.get_ema_multi_avg_fn(AVERAGED)
        )

        def missed(says: Any, happened: Any) -> Any:
            """Return the mean of -log p per step, of all outcomes that were recorded."""
            total = functional.cross_entropy(
                says.reshape(-1, OUTCOME_BINS),
                happened.reshape(-1),
                ignore_index=NOT_RECORDED,
                reduction="sum",
            )
            return total / len(says)

        best: Any = None
        chance = (
            math.log(OUTCOME_BINS) * float((bins[looked_at] != NOT_RECORDED).sum()) / len(looked_at)
        )
        for step in range(steps):
            net.train()
            batch = learned_from[torch.randint(len(learned_from), (BATCH,))]
            mirrored = torch.rand(BATCH) < 0.5
            some_own = own_inputs[batch]
            some_traits = traits[batch]
            some_there = visible[batch]
            some_own = torch.where(mirrored[:, None], some_own[:, order_own] * flip_own, some_own)
            some_traits = torch.where(
                mirrored[:, None, None], some_traits * flip_traits, some_traits
            )
            some_own, some_traits, some_there = _blinded(some_own, some_traits, some_there)
            happened = torch.where(mirrored[:, None, None], mirrored_bins[batch], bins[batch])
            loss = missed(net(some_own, some_traits, some_there), happened)
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(net.parameters(), 1.0)
            optimizer.step()
            schedule.step()
            averaged.update_parameters(net)
            if (step + 1) % max(steps // LOOKS, 1) == 0 or step == steps - 1:
                averaged.eval()
                with torch.no_grad():
                    says = averaged(own_inputs[looked_at], traits[looked_at], visible[looked_at])
                    gain = chance - float(missed(says, bins[looked_at]))
                if best is None or gain > best[0]:
                    best = gain, copy.deepcopy(averaged.module.state_dict())
                if progress is not None:
                    progress(step + 1, steps)
        net.load_state_dict(best[1])
        net.eval()
        with torch.no_grad():
            hidden = net.trunk(own_inputs, traits, visible)
            ever = (bins != NOT_RECORDED).any(dim=0).flatten()
            metric = _metric(net.outcomes.weight, net.outcomes(hidden), hidden, ever)
        return net.layers(metric), best[0]


@contextmanager
def _one_thread() -> Iterator[None]:
    """Let PyTorch use one thread: in layers this small threads would wait for each other."""
    import torch

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)


def in_a_mirror(examples: Recorded) -> Recorded:
    """Return the same steps with left and right exchanged in what was perceived."""
    flip_own, order_own, flip_traits = (signs.numpy() for signs in _mirror())
    own_inputs = examples.own[:, order_own] * flip_own
    return replace(examples, own=own_inputs, traits=examples.traits * flip_traits)


NOT_RECORDED = -1
"""Bin of an outcome that was not recorded."""


def _bins_of(outcomes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return bins (N, Q, 2) of outcomes, and of the same in a mirror."""
    bins = np.full(outcomes.shape, NOT_RECORDED)
    mirrored = bins.copy()
    chances = np.linspace(0, 1, OUTCOME_BINS + 1)[1:-1]
    for q in range(outcomes.shape[1]):
        happened = np.isfinite(outcomes[:, q]).all(axis=-1)
        if not happened.any():
            continue
        distances, directions = outcomes[happened, q].T
        edges = np.quantile(distances, chances)
        bins[happened, q, 0] = np.searchsorted(edges, distances, side="right")
        mirrored[happened, q, 0] = bins[happened, q, 0]
        edges = np.quantile(np.concatenate([directions, -directions]), chances)
        bins[happened, q, 1] = np.searchsorted(edges, directions, side="right")
        mirrored[happened, q, 1] = np.searchsorted(edges, -directions, side="right")
    return bins, mirrored


def _metric(weight: Any, says: Any, hidden: Any, ever: Any) -> Any:
    """Return how hidden states (N, H) become contexts, (H, CONTEXT), by what is said of them.

    The squared distance of two contexts is about twice the divergence (nats) of what is expected after them: logits
    are centered, weighted by the probabilities, and projected to their principal axes. `ever` (2 Q,) tells what was
    recorded at all, as walls are where there are some.
    """
    import torch

    chances = torch.softmax(says.reshape(len(says), -1, OUTCOME_BINS), dim=-1).mean(dim=0)
    logits = weight.detach().reshape(*chances.shape, -1)
    logits = logits - (chances[..., None] * logits).sum(dim=1, keepdim=True)
    weights = torch.full((len(chances),), SURROUNDINGS)
    weights[: 2 * len(HORIZONS_S)] = 1.0
    weights = weights * ever
    logits = logits * (torch.sqrt(chances) * weights[:, None])[..., None]
    logits = logits.reshape(-1, logits.shape[-1])
    features = (hidden - hidden.mean(dim=0)) @ logits.T
    _, axes = torch.linalg.eigh(features.T @ features / len(features))
    # the axes come with the least variance first
    return logits.T @ axes[:, -CONTEXT:]


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
    own_inputs = own_inputs.clone()
    traits = traits.clone()
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
            self.outcomes = nn.Linear(WIDTH, OUTCOMES * 2 * OUTCOME_BINS)
            self.dropout = nn.Dropout(DROPOUT)

        def trunk(self, own_inputs: Any, traits: Any, visible: Any) -> Any:
            bend = nn.functional.silu
            encoded = bend(self.other_second(bend(self.other_first(traits))))
            exponent = self.attention(encoded)[..., 0].masked_fill(~visible, -torch.inf)
            # nothing is among the options: a zero, that counts for no one
            nothing = torch.zeros_like(exponent[:, :1])
            weights = torch.softmax(torch.cat([exponent, nothing], dim=1), dim=1)[:, :-1]
            attended = (weights[..., None] * encoded).sum(dim=1)
            hidden = self.dropout(bend(self.trunk_first(torch.cat([own_inputs, attended], dim=1))))
            return self.dropout(bend(self.trunk_second(hidden)))

        def forward(self, own_inputs: Any, traits: Any, visible: Any) -> Any:
            return self.outcomes(self.trunk(own_inputs, traits, visible))

        def layers(self, metric: Any) -> Layers:
            weights: dict[str, np.ndarray] = {}
            for name, layer in self.named_children():
                if not isinstance(layer, nn.Linear) or name == "outcomes":
                    continue
                weights[name] = np.ascontiguousarray(layer.weight.detach().numpy().T)
                weights[f"{name}_bias"] = layer.bias.detach().numpy().copy()
            weights["metric"] = np.ascontiguousarray(metric.numpy())
            return Layers(**weights)

    return Network()
