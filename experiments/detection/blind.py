"""Twelve kinds of individuals that move otherwise, by somebody who had not read how `detect` looks at motion.

Each takes paths (F, A, 2) in cm, the place of an individual, frames per second, and random numbers, and returns the path
(F, 2) of what is put in its place. They were written from a description in words, after most statistics and all weights
of `detect` were settled, and were not used for choosing.
"""

import numpy as np

DIRS = np.stack([np.cos(np.arange(48) * np.pi / 24), np.sin(np.arange(48) * np.pi / 24)], 1)


def _smooth(x, w):
    """Centred moving mean of odd width w along the frames, ends held."""
    h = max(1, int(w) // 2)
    p = np.concatenate([np.repeat(x[:1], h, 0), x, np.repeat(x[-1:], h, 0)])
    c = np.cumsum(np.concatenate([np.zeros_like(p[:1]), p]), 0)
    return (c[2 * h + 1 :] - c[: -2 * h - 1]) / (2 * h + 1)


def _setup(paths, k):
    """Smooth paths, the tracking noise of k, its step lengths (not below the group's mean), group mean step."""
    paths = np.asarray(paths, float)
    s = _smooth(paths, 3)
    steps = np.linalg.norm(np.diff(s, axis=0), axis=-1)
    mean = max(float(steps.mean()), 1e-6)
    own = steps[:, k]
    if own.mean() < 0.3 * mean:  # hardly moves: lend it the gait of the most usual individual
        own = steps[:, np.argmin(np.abs(steps.mean(0) - mean))]
    own = own * max(1.0, mean / max(float(own.mean()), 0.1 * mean))
    return s, paths[:, k] - s[:, k], np.minimum(own, 3 * max(mean, own.mean())), mean


def _space(s):
    """Support of the used space in 48 directions, its middle and its mean radius."""
    mid = (s.min((0, 1)) + s.max((0, 1))) / 2
    h = ((s.reshape(-1, 2) - mid) @ DIRS.T).max(0)
    return mid, h, float(h.mean())


def _go(p, th, step, mid, h, side=0):
    """One step at heading th, turned as little as needed (to one side only, if given) to stay inside."""
    for i in range(22):
        for sg in [side] if side else [1, -1]:
            a = th + sg * 0.3 * i
            q = p + step * np.array([np.cos(a), np.sin(a)])
            if np.all((q - mid) @ DIRS.T <= h + 1e-9):
                return q, a
    return p + min(step, np.linalg.norm(mid - p)) * (mid - p) / (np.linalg.norm(mid - p) + 1e-9), th


def _wrap(a):
    return (a + np.pi) % (2 * np.pi) - np.pi


def _replay(x, rate, start):
    """The path x played at another pace, forward and back, from frame start."""
    t = (start + rate * np.arange(len(x))) % (2 * (len(x) - 1))
    t = np.minimum(t, 2 * (len(x) - 1) - t)
    return np.stack([np.interp(t, np.arange(len(x)), x[:, d]) for d in (0, 1)], 1)


def _pursue(s, k, steps, target, turn, rng, wander=0.0):
    """Goes at the given steps towards target[t], turning at most `turn` rad a frame."""
    mid, h, _ = _space(s)
    out, th = [s[0, k]], rng.uniform(-np.pi, np.pi)
    for t, st in enumerate(steps):
        d = target[t] - out[-1]
        th += np.clip(_wrap(np.arctan2(d[1], d[0]) - th), -turn, turn) + wander * rng.normal()
        q, th = _go(out[-1], th, st, mid, h)
        out.append(q)
    return np.array(out)


def anaesthetised(paths, k, fps, rng):
    """Half anaesthetised: does everything at about a third of the pace."""
    s, noise, _, mean = _setup(paths, k)
    own = max(np.linalg.norm(np.diff(s[:, k], axis=0), axis=1).mean(), 1e-6)
    rate = 0.33 * min(1.0, mean / own)
    return _replay(s[:, k], rate, rng.uniform(0, 0.5) * len(s)) + noise


def overstimulated(paths, k, fps, rng):
    """Overstimulated: rushes about its usual ways at more than twice the pace, with no rest."""
    s, noise, _, mean = _setup(paths, k)
    own = max(np.linalg.norm(np.diff(s[:, k], axis=0), axis=1).mean(), 1e-6)
    rate = float(np.clip(2.3 * max(1.0, mean / own), 2.3, 5))
    return _replay(s[:, k], rate, rng.uniform(0, 0.5) * len(s)) + noise


def one_sided(paths, k, fps, rng):
    """Blind in one eye or lame on one side: keeps turning to that side, in loops."""
    s, noise, steps, mean = _setup(paths, k)
    mid, h, size = _space(s)
    v = np.diff(s[:, k], axis=0)
    turns = np.r_[0, _wrap(np.diff(np.arctan2(v[:, 1], v[:, 0])))] * (steps > 0.4 * mean)
    side, r = rng.choice([-1, 1]), 0.22 * size
    out, th = [s[0, k]], np.arctan2(v[0, 1], v[0, 0])
    for st, tu in zip(steps, turns, strict=True):
        q, th = _go(out[-1], th + side * st / r + 0.4 * tu, st, mid, h, side)
        out.append(q)
    return np.array(out) + noise


def four_headings(paths, k, fps, rng):
    """A robot that can only head along four directions, turning on the spot by a right angle."""
    s, noise, steps, _ = _setup(paths, k)
    mid, h, _ = _space(s)
    ahead = _smooth(s[:, k], fps)
    out, q4 = [s[0, k]], int(rng.integers(4))
    left = int(fps)
    for t, st in enumerate(steps):
        left -= 1
        want = ahead[min(t + int(2 * fps), len(s) - 1)] - out[-1]
        if left <= 0:
            q4 = int(np.round(np.arctan2(want[1], want[0]) / (np.pi / 2))) % 4
            left = int(rng.uniform(1.5, 4) * fps)
        for turn in (0, 1, 3, 2):
            a = (q4 + turn) * np.pi / 2
            q = out[-1] + st * np.round([np.cos(a), np.sin(a)])
            if np.all((q - mid) @ DIRS.T <= h + 1e-9):
                q4 = (q4 + turn) % 4
                break
        else:
            q = out[-1]
        out.append(q)
    return np.array(out) + noise


def coarse_clock(paths, k, fps, rng):
    """A robot on a two-second clock: stands still, then makes one quick straight step to where it should be."""
    s, noise, _, _ = _setup(paths, k)
    n, go = max(4, round(2 * fps)), max(2, round(0.8 * fps))
    t = np.arange(len(s)) + int(rng.integers(n))
    ticks = np.clip((t // n)[:, None] * n - t[0] + np.array([-n, 0]), 0, len(s) - 1)
    w = np.clip((t % n) / go, 0, 1)[:, None]
    return s[ticks[:, 0], k] * (1 - w) + s[ticks[:, 1], k] * w + noise


def cruiser(paths, k, fps, rng):
    """A robot whose motor runs at one constant speed and that can only turn slowly, in wide curves."""
    s, noise, steps, _ = _setup(paths, k)
    to = np.minimum(np.arange(len(s)) + int(2 * fps), len(s) - 1)
    return _pursue(s, k, np.full(len(steps), steps.mean()), s[to, k], 0.6 / fps, rng) + noise


def group_was_there(paths, k, fps, rng):
    """Clings to the middle of the group, but goes to where that was four seconds ago."""
    s, noise, steps, _ = _setup(paths, k)
    mid = np.delete(s, k, 1).mean(1)[np.maximum(np.arange(len(s)) - int(4 * fps), 0)]
    return _pursue(s, k, steps, mid, 3.0 / fps, rng, 0.1) + noise


def subordinate(paths, k, fps, rng):
    """A subordinate animal: always makes for the place farthest from its fellows and gives way to each."""
    s, noise, steps, mean = _setup(paths, k)
    mid, h, size = _space(s)
    rest, look = np.delete(s, k, 1), 0.35 * size
    out, th = [s[0, k]], 0.0
    offs = np.linspace(-np.pi, np.pi, 25)
    for t, st in enumerate(steps):
        c = th + offs
        q = out[-1] + look * np.stack([np.cos(c), np.sin(c)], 1)
        near = np.linalg.norm(q[:, None] - rest[t], axis=-1).min(1)
        out_by = np.maximum(((q - mid) @ DIRS.T - h).max(1), 0)
        best = offs[np.argmax(near - 2 * out_by - 0.05 * size * np.abs(offs))]
        th += np.clip(best, -6 / fps, 6 / fps) + 0.1 * rng.normal()
        q, th = _go(out[-1], th, 0.6 * st + 0.5 * mean, mid, h)
        out.append(q)
    return np.array(out) + noise


def against_the_group(paths, k, fps, rng):
    """Heads the opposite way to its fellows' common heading at every moment."""
    s, noise, steps, _ = _setup(paths, k)
    mid, h, _ = _space(s)
    v = -_smooth(np.diff(np.delete(s, k, 1).mean(1), axis=0), 0.7 * fps)
    out = [s[0, k]]
    for st, a in zip(steps, np.arctan2(v[:, 1], v[:, 0]), strict=True):
        out.append(_go(out[-1], a + 0.1 * rng.normal(), st, mid, h)[0])
    return np.array(out) + noise


def home_patch(paths, k, fps, rng):
    """Hides: moves about as much as ever, but never leaves a small patch near one side of the tank."""
    s, noise, steps, _ = _setup(paths, k)
    mid, h, size = _space(s)
    i = int(rng.integers(48))
    home, r = mid + 0.68 * h[i] * DIRS[i], 0.25 * size
    out, th = [s[0, k]], 0.0
    for st in steps:
        d = home - out[-1]
        th += 0.25 * rng.normal()
        if np.linalg.norm(d) > r:
            th += np.clip(_wrap(np.arctan2(d[1], d[0]) - th), -5 / fps, 5 / fps)
        q, th = _go(out[-1], th, st, mid, h)
        out.append(q)
    return np.array(out) + noise


def patrol(paths, k, fps, rng):
    """Patrols between three fixed posts in straight lines, always in the same order."""
    s, noise, steps, _ = _setup(paths, k)
    mid, h, _ = _space(s)
    i = (int(rng.integers(48)) + np.array([0, 16, 32])) % 48
    posts = (mid + 0.6 * h[i, None] * DIRS[i])[rng.permutation(3)]
    out, at = [s[0, k]], 0
    for st in steps:
        d = posts[at] - out[-1]
        n = np.linalg.norm(d)
        if n <= st:
            out.append(posts[at])
            at = (at + 1) % 3
        else:
            out.append(out[-1] + d / n * st)
    return np.array(out) + noise


def merged_track(paths, k, fps, rng):
    """A tracking fault: most of the time the mark slides onto the nearest fellow and stays with it."""
    s, noise, _, mean = _setup(paths, k)
    out, who, left = [s[0, k]], k, int(rng.uniform(2, 5) * fps)
    for t in range(1, len(s)):
        left -= 1
        if left <= 0:
            d = np.linalg.norm(s[t] - out[-1], axis=1)
            d[k] = np.inf
            who = int(np.argmin(d)) if who == k else k
            left = int((rng.uniform(4, 8) if who == k else rng.uniform(16, 28)) * fps)
        d = s[t, who] - out[-1]
        n = np.linalg.norm(d)
        out.append(out[-1] + d * min(1.0, 3 * mean / max(n, 1e-9)))
    return np.array(out) + noise


BLIND = {
    "half anaesthetised": anaesthetised,
    "overstimulated": overstimulated,
    "turns to one side": one_sided,
    "four headings": four_headings,
    "coarse clock": coarse_clock,
    "constant-speed cruiser": cruiser,
    "where the group was": group_was_there,
    "subordinate": subordinate,
    "against the group": against_the_group,
    "home patch": home_patch,
    "patrol": patrol,
    "track merged with a fellow": merged_track,
}
