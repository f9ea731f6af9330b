"""Twelve more kinds of individuals that move otherwise, moderately hard, again by somebody who had not read how `detect` looks.

Each takes paths (F, A, 2) in cm, the place of an individual, frames per second, and random numbers, and returns the path
(F, 2) of what is put in its place. They were written from a description in words when all of `detect` was settled. Most
turn, scale or re-time the steps of the individual that is replaced, so that their natural texture stays.
"""

import numpy as np


def _wrap(a):
    return (a + np.pi) % (2 * np.pi) - np.pi


def _smooth(x, sd):
    """Gaussian smoothing along axis 0, sd in frames, edges held."""
    x = np.asarray(x, float)
    if sd < 0.3:
        return x.copy()
    h = int(np.ceil(3 * sd))
    w = np.exp(-0.5 * (np.arange(-h, h + 1) / sd) ** 2)
    w /= w.sum()
    y = x.reshape(len(x), -1)
    y = np.concatenate([np.repeat(y[:1], h, 0), y, np.repeat(y[-1:], h, 0)])
    out = np.stack([np.convolve(y[:, c], w, "valid") for c in range(y.shape[1])], 1)
    return out.reshape(x.shape)


def _unit(v):
    return v / max(float(np.hypot(v[0], v[1])), 1e-12)


class _World:
    """Scales of one recording: space, walls (convex, from the paths), speeds, spacing."""

    _ang = np.linspace(0, 2 * np.pi, 72, endpoint=False)
    U = np.stack([np.cos(_ang), np.sin(_ang)], 1)

    def __init__(self, paths, k, fps):
        p = np.asarray(paths, float)
        self.p, self.k, self.fps, self.dt = p, k, float(fps), 1.0 / float(fps)
        self.F, self.A = p.shape[:2]
        flat = p.reshape(-1, 2)
        self.h = (flat @ self.U.T).max(0)
        self.lo, self.hi = flat.min(0), flat.max(0)
        self.size = max(float(np.min(self.hi - self.lo)), 1e-6)
        self.mid = 0.5 * (self.lo + self.hi)
        self.others = [a for a in range(self.A) if a != k]
        self.o = p[:, self.others]
        st = np.hypot(*np.moveaxis(np.diff(p, axis=0), -1, 0))  # (F-1, A)
        self.cap = 1.5 * max(float(np.quantile(st, 0.998)), 1e-9)
        sp = st[:, self.others] * self.fps
        self.vmed = max(float(np.median(sp)), 0.3 * float(sp.mean()), 1e-9)
        self.v80 = max(float(np.quantile(sp, 0.8)), self.vmed)
        self.still = min(float(np.quantile(st, 0.05)), 0.05 * self.vmed * self.dt)
        mean = st.mean(0)
        typ = float(np.median(mean[self.others]))
        # an almost motionless individual lends no texture: borrow a typical fellow's steps
        self.src = k
        if mean[k] < 0.4 * typ:
            self.src = min(self.others, key=lambda a: abs(mean[a] - typ))
        self.mean = mean
        idx = np.unique(np.linspace(0, self.F - 1, min(self.F, 200)).astype(int))
        d = np.linalg.norm(p[idx][:, :, None] - p[idx][:, None], axis=-1)
        d[:, np.arange(self.A), np.arange(self.A)] = np.inf
        self.nn = max(float(np.median(d.min(-1))), 0.01 * self.size)
        c = self.o.mean(1)
        self.spread = max(float(np.median(np.linalg.norm(self.o - c[:, None], axis=-1))), self.nn)
        self.vel = _smooth(np.gradient(p, axis=0) * self.fps, 0.4 * self.fps)

    def steps(self):
        return np.diff(self.p[:, self.src], axis=0)

    def wall(self, x):
        """distance to the nearest wall and the outward normal there"""
        g = self.h - self.U @ x
        i = int(np.argmin(g))
        return float(g[i]), self.U[i]

    def inside(self, x):
        for _ in range(4):
            d, u = self.wall(x)
            if d >= 0:
                break
            x = x + 1.6 * d * u
        return x

    def finish(self, y):
        y = np.nan_to_num(np.asarray(y, float), nan=0.0, posinf=0.0, neginf=0.0)
        out = np.empty_like(y)
        x = self.inside(y[0])
        out[0] = x
        for t in range(1, len(y)):
            s = self.inside(y[t]) - x
            n = float(np.hypot(s[0], s[1]))
            x = x + (s if n <= self.cap else s * (self.cap / n))
            out[t] = x
        return out


def _walk(w, steps, want=None, gain=2.0, rate=2.0, spin=None, side=0, margin=0.07):
    """Integrates `steps`, each turned by a slowly changing angle phi.

    want(t, x, head) -> (direction or None, weight 0..1, scale of step)
    spin: extra turning of phi in rad per frame (array) ; side: preferred turn at walls
    """
    F = len(steps) + 1
    sm = _smooth(steps, 0.25 * w.fps)
    head0 = np.arctan2(sm[:, 1], sm[:, 0])
    phi, x = 0.0, w.p[0, w.k].copy()
    out = np.empty((F, 2))
    out[0] = x
    m = margin * w.size
    for t in range(F - 1):
        head = head0[t] + phi
        scale = 1.0
        if spin is not None:
            phi += spin[t]
        if want is not None:
            v, wt, scale = want(t, x, head)
            if v is not None and wt > 0 and np.hypot(v[0], v[1]) > 1e-9:
                e = _wrap(np.arctan2(v[1], v[0]) - head)
                phi += float(np.clip(gain * wt * e, -rate, rate)) * w.dt
        d, u = w.wall(x)
        if d < m:
            head = head0[t] + phi
            hv = np.array([np.cos(head), np.sin(head)])
            out_part = float(hv @ u)
            if out_part > 0:  # going outward: veer along the wall
                tan = hv - out_part * u
                if side and out_part > 0.5:  # only when it meets the wall head on
                    tan = side * np.array([-u[1], u[0]])
                v = _unit(tan + 1e-9) - (0.2 + 0.4 * (1 - max(d, 0) / m)) * u
                e = _wrap(np.arctan2(v[1], v[0]) - head)
                phi += float(np.clip(5 * e, -4.5, 4.5)) * w.dt
        c, s = np.cos(phi), np.sin(phi)
        q = steps[t] * scale
        x = w.inside(x + np.array([c * q[0] - s * q[1], s * q[0] + c * q[1]]))
        out[t + 1] = x
    return out


def _base(w):
    """own true path, or, if it hardly moves, a wander made of a fellow's steps"""
    return w.p[:, w.k].copy() if w.src == w.k else w.finish(_walk(w, w.steps()))


def _replay(path, tau):
    """path read at fractional frames tau (Catmull-Rom)"""
    F = len(path)
    tau = np.clip(tau, 0, F - 1)
    i = np.minimum(tau.astype(int), F - 2)
    f = (tau - i)[:, None]
    p0, p1 = path[np.maximum(i - 1, 0)], path[i]
    p2, p3 = path[i + 1], path[np.minimum(i + 2, F - 1)]
    return p1 + 0.5 * f * (
        p2 - p0 + f * (2 * p0 - 5 * p1 + 4 * p2 - p3 + f * (3 * (p1 - p2) + p3 - p0))
    )


# ------------------------------------------------------------------ own motion


def sluggish_pace(paths, k, fps, rng):
    """goes roughly where the true one goes, every step only 0.5 to 0.65 as long"""
    w = _World(paths, k, fps)
    s = rng.uniform(0.5, 0.65)
    goal = _smooth(w.p[:, k], 1.0 * fps)

    def want(t, x, head):
        v = goal[t] - x
        far = np.hypot(*v) / (0.25 * w.size)
        return v, float(np.clip(far - 0.4, 0, 0.8)), s

    return w.finish(_walk(w, w.steps(), want, gain=1.2, rate=1.2))


def stop_and_dash(paths, k, fps, rng):
    """own course, but in a rhythm of rests (0.8 to 2.2 s) and dashes that catch up"""
    w = _World(paths, k, fps)
    base = _base(w)
    F, tau, t = w.F, np.zeros(w.F), 0.0
    rest, left = False, rng.uniform(0.5, 1.5)
    r = 1.0
    for i in range(1, F):
        left -= w.dt
        if rest and left <= 0:
            rest, left = False, rng.uniform(1.5, 3.0)
        elif not rest and left <= 0 and (i - t) < 0.5 * fps:
            rest, left = True, rng.uniform(0.8, 2.2)
        aim = 0.06 if rest else (1.75 if i - t > 0.2 * fps else 1.0)
        r += (aim - r) * min(1.0, w.dt / 0.15)
        t = min(t + r, i)
        tau[i] = t
    y = _replay(base, tau)
    return w.finish(y + rng.normal(0, 0.5 * w.still, y.shape))


def freezing_spells(paths, k, fps, rng):
    """normal, but freezes on the spot for 5 to 9 s about every 20 s; hurries a little after"""
    w = _World(paths, k, fps)
    base = _base(w)
    F, dur = w.F, w.F / fps
    n = max(2, round(dur / rng.uniform(18, 24)))
    slots = (np.arange(n) + rng.uniform(0.15, 0.5, n)) * dur / n
    lens = np.minimum(rng.uniform(5, 9, n), 0.5 * dur / n)
    sec = np.arange(F) / fps
    frozen = np.zeros(F, bool)
    for a, b in zip(slots, lens, strict=False):
        frozen |= (sec >= a) & (sec < a + b)
    tau, t, r = np.zeros(F), 0.0, 1.0
    for i in range(1, F):
        aim = 0.02 if frozen[i] else (1.5 if i - t > 0.3 * fps else 1.0)
        r += (aim - r) * min(1.0, w.dt / 0.3)
        t = min(t + r, i)
        tau[i] = t
    y = _replay(base, tau)
    return w.finish(y + frozen[:, None] * rng.normal(0, 0.5 * w.still, y.shape))


def one_sided_turning(paths, k, fps, rng):
    """own steps with a steady veer to one side: keeps curling the same way in wide loops"""
    w = _World(paths, k, fps)
    side = 1 if rng.random() < 0.5 else -1
    om = np.clip(w.vmed / (0.2 * w.size), np.deg2rad(12), np.deg2rad(23))
    st = w.steps()
    v = _smooth(np.hypot(st[:, 0], st[:, 1]) * fps, 0.4 * fps)
    wob = 1 + 0.35 * np.sin(
        2 * np.pi * np.arange(len(st)) / fps / rng.uniform(7, 11) + rng.uniform(0, 6)
    )
    spin = side * om * w.dt * np.clip(v / w.vmed, 0.2, 1.6) * wob
    return w.finish(_walk(w, st, spin=spin, side=side))


def straightened_course(paths, k, fps, rng):
    """own steps with four fifths of the turning taken out: long straight runs wall to wall"""
    w = _World(paths, k, fps)
    st = w.steps()
    sm = _smooth(st, 0.35 * fps)
    H = np.unwrap(np.arctan2(sm[:, 1], sm[:, 0]))
    keep = rng.uniform(0.15, 0.25)
    spin = np.zeros(len(st))
    spin[1:] = -(1 - keep) * np.diff(H)
    return w.finish(_walk(w, st, spin=spin))


def odd_wall_habit(paths, k, fps, rng):
    """clings to the wall in a group that roams; keeps to the middle in a group that clings"""
    w = _World(paths, k, fps)
    idx = np.unique(np.linspace(0, w.F - 1, min(w.F, 150)).astype(int))
    d = np.median((w.h - w.o[idx].reshape(-1, 2) @ w.U.T).min(1))
    turn = [1 if rng.random() < 0.5 else -1, 0.0]
    if d > 0.11 * w.size:  # others roam: cling
        near = 0.035 * w.size

        def want(t, x, head):
            g, u = w.wall(x)
            if t * w.dt > turn[1]:  # now and then it turns back
                if turn[1] > 0:
                    turn[0] = -turn[0]
                turn[1] = t * w.dt + rng.uniform(8, 22)
            tan = turn[0] * np.array([-u[1], u[0]])
            pull = float(np.clip((g - near) / (0.12 * w.size), -0.6, 1.2))
            return tan + pull * u, 0.8, 1.0

        y = _walk(w, w.steps(), want, gain=2.2, rate=2.2, margin=0.02)
    else:  # others cling: stay off the wall

        def want(t, x, head):
            g, _u = w.wall(x)
            far = float(np.clip((0.30 * w.size - g) / (0.12 * w.size), 0, 1))
            hv = np.array([np.cos(head), np.sin(head)])
            v = (w.mid - x) / w.size + 0.3 * hv
            return v, far, 1.0

        y = _walk(w, w.steps(), want, gain=2.2, rate=2.5)
    return w.finish(y)


# ------------------------------------------------------------------ relations to others


def late_echo(paths, k, fps, rng):
    """own course, but falls behind in the first seconds and then does all 1.5 to 5 s late"""
    w = _World(paths, k, fps)
    lag = float(np.clip(rng.uniform(1.3, 1.9) * w.nn / w.vmed, 1.5, 5.0)) * fps
    t = np.arange(w.F)
    ramp = max(12 * fps, 3 * lag)
    slow = 0.15 * lag * np.sin(2 * np.pi * t / fps / rng.uniform(15, 25)) * np.clip(t / ramp, 0, 1)
    tau = t - lag * np.clip(t / ramp, 0, 1) + slow
    return w.finish(_replay(_base(w), np.maximum.accumulate(tau)))


def favorite_fellow(paths, k, fps, rng):
    """trails one fellow closely all the time, its own way of stepping, blind to the rest"""
    w = _World(paths, k, fps)
    med = np.median(w.mean[w.others])
    cand = [a for a in w.others if w.mean[a] >= 0.7 * med] or w.others
    d0 = [np.linalg.norm(w.p[0, a] - w.p[0, k]) for a in cand]
    cand = [cand[i] for i in np.argsort(d0)[:2]]
    j = cand[int(rng.integers(len(cand)))]
    lag = round(0.35 * fps)
    pos = _smooth(w.p[:, j], 0.2 * fps)
    gap = 0.4 * w.nn
    st = w.steps()
    own = _smooth(np.hypot(st[:, 0], st[:, 1]) * fps, 0.5 * fps)
    stj = np.diff(w.p[:, j], axis=0, append=w.p[-1:, j])
    his = _smooth(np.hypot(stj[:, 0], stj[:, 1]) * fps, 0.5 * fps)

    def want(t, x, head):
        q = max(t - lag, 0)
        u = _unit(w.vel[q, j] + 1e-9)
        e = (pos[q] - gap * u - x) / w.nn
        far = float(np.hypot(*e))
        ahead = float(e @ u)
        ratio = float(np.clip(his[q] / max(own[t], 0.3 * w.vmed), 0.6, 1.5))
        if far > 2:  # lost: straight after it
            return e, 1.0, float(np.clip(1.35 * ratio, 1.0, 1.6))
        return u + 0.9 * e, 1.0, float(np.clip(ratio * (1 + 0.6 * ahead), 0.4, 1.6))

    return w.finish(_walk(w, st, want, gain=4.0, rate=4.0, margin=0.03))


def keeps_apart(paths, k, fps, rng):
    """drifts off whenever fellows come within an arm's length and wanders by itself"""
    w = _World(paths, k, fps)
    D = max(0.26 * w.size, 1.3 * w.nn)

    def want(t, x, head):
        r = x - w.o[t]
        d = np.hypot(r[:, 0], r[:, 1])
        near = d < D
        if not near.any():
            return None, 0.0, 1.0
        wt = 1 - d[near] / D
        v = (r[near] / np.maximum(d[near], 1e-6)[:, None] * wt[:, None]).sum(0)
        g, u = w.wall(x)
        v = v - max(0.0, 1 - g / (0.12 * w.size)) * 0.6 * max(0.0, float(v @ u)) * u
        press = float(np.clip(1.6 * wt.max(), 0, 1))
        return v, press, 1.0 + 0.25 * press

    return w.finish(_walk(w, w.steps(), want, gain=2.2, rate=2.4))


def middle_lure(paths, k, fps, rng):
    """robot lure: steers to the group's middle late, by coarse commands and a soft motor"""
    w = _World(paths, k, fps)
    c = _smooth(w.o.mean(1), 0.4 * fps)
    cv = _smooth(np.gradient(c, axis=0) * fps, 0.3 * fps)
    lag = round(0.5 * fps)
    x, v, cmd, nxt = w.p[0, k].copy(), w.vel[0, k].copy(), np.zeros(2), 0.0
    side = rng.uniform(0, 2 * np.pi)
    out = np.empty((w.F, 2))
    for t in range(w.F):
        out[t] = x
        if t * w.dt >= nxt:  # a new command about every 0.8 s
            nxt = t * w.dt + rng.uniform(0.5, 1.1)
            side += rng.normal(0, 0.5)
            q = max(t - lag, 0)
            aim = c[q] + 0.8 * cv[q] + 0.3 * w.nn * np.array([np.cos(side), np.sin(side)])
            e = aim - x
            n = float(np.hypot(*e))
            s = (
                0.25 * w.vmed if n < 0.25 * w.nn else min(n / 1.1, 1.15 * w.v80)
            )  # it idles in a dead zone
            a = np.arctan2(e[1], e[0]) + rng.normal(0, 0.25)
            cmd = s * rng.uniform(0.85, 1.15) * np.array([np.cos(a), np.sin(a)])
        v = v + (cmd - v) * min(1.0, w.dt / 0.35)
        x = w.inside(x + (v + rng.normal(0, 0.05 * w.vmed, 2)) * w.dt)
    return w.finish(out)


def against_current(paths, k, fps, rng):
    """stays among the fellows but heads against the nearest ones, back and forth through them"""
    w = _World(paths, k, fps)
    c = w.o.mean(1)
    R = max(2.0 * w.spread, 0.28 * w.size)
    ov = w.vel[:, w.others]
    back = [False]

    def want(t, x, head):
        e = c[t] - x
        n = float(np.hypot(*e))
        if n > R:
            back[0] = True
        elif n < 0.55 * R:
            back[0] = False
        if back[0]:
            return e, 0.9, 1.2
        r = np.linalg.norm(w.o[t] - x, axis=1)
        near = np.argsort(r)[:3]
        return -ov[t, near].mean(0), 0.7, 1.0

    return w.finish(_walk(w, w.steps(), want, gain=2.4, rate=2.6))


def oblivious_wanderer(paths, k, fps, rng):
    """own steps in pieces of 3 to 6 s, in shuffled order: natural in itself, reacts to no one"""
    w = _World(paths, k, fps)
    st = w.steps()
    cuts, i = [], 0
    while i < len(st):
        n = max(4, int(rng.uniform(3, 6) * fps))
        cuts.append((i, min(i + n, len(st))))
        i += n
    order = rng.permutation(len(cuts))
    parts, prev = [], None
    b = max(2, int(0.3 * fps))
    for o in order:
        s = st[cuts[o][0] : cuts[o][1]]
        if rng.random() < 0.5:
            s = s * np.array([1.0, -1.0])  # mirrored: left and right turns change places
        if prev is not None:  # go on in the direction just held
            a = prev - np.arctan2(*(s[:b].sum(0)[::-1]))
            ca, sa = np.cos(a), np.sin(a)
            s = s @ np.array([[ca, sa], [-sa, ca]])
        z = s[-b:].sum(0)
        prev = np.arctan2(z[1], z[0])
        parts.append(s)
    return w.finish(_walk(w, np.concatenate(parts)))


SECOND = {
    "sluggish pace": sluggish_pace,
    "stop and dash": stop_and_dash,
    "freezing spells": freezing_spells,
    "one sided turning": one_sided_turning,
    "straightened course": straightened_course,
    "odd wall habit": odd_wall_habit,
    "late echo": late_echo,
    "favorite fellow": favorite_fellow,
    "keeps apart": keeps_apart,
    "middle lure": middle_lure,
    "against current": against_current,
    "oblivious wanderer": oblivious_wanderer,
}
