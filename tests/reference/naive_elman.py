"""The Elman network, written plainly in double precision: the slow twin of `ElmanClassifier`."""

import numpy as np

LIMIT = 1e8


SMALL = 2.0**-200  # a power of two, so that scaling by it rounds nothing


def shorten(vector, limit=LIMIT):
    """Shorten a vector whose largest component exceeds the limit, keeping its direction."""
    vector = np.asarray(vector, dtype=np.float64)
    largest = np.max(np.abs(vector))
    return vector if largest <= limit else vector / largest * limit


def sigmoid(z):
    return 0.5 * (1.0 + np.tanh(0.5 * z))


def unpack(genome, inputs, hidden):
    """Return W (H, D), U (H, H), b (H), v (H), c of a genome, every neuron's weights shortened."""
    ends = np.cumsum([hidden * inputs, hidden * hidden, hidden, hidden])
    w, u, b, v, c = np.split(np.asarray(genome, dtype=np.float64), ends)
    rows = [
        shorten([*w[i * inputs : (i + 1) * inputs], *u[i * hidden : (i + 1) * hidden], b[i]])
        for i in range(hidden)
    ]
    rows, output = np.array(rows), shorten([*v, *c])
    return rows[:, :inputs], rows[:, inputs:-1], rows[:, -1], output[:-1], output[-1]


def judge_one(genome, sample, inputs, hidden, scale=None):
    """Return the output for one sample (T, D)."""
    w, u, b, v, c = unpack(genome, inputs, hidden)
    h = np.zeros(hidden)
    for signals in sample:
        x = (
            shorten(signals * SMALL / (1.0 if scale is None else np.asarray(scale)), LIMIT * SMALL)
            / SMALL
        )
        h = sigmoid(w @ x + u @ h + b)
    return sigmoid(v @ h + c)


def judge(genomes, samples, inputs, hidden, scale=None):
    """Return the outputs (N, S)."""
    return np.array([[judge_one(g, s, inputs, hidden, scale) for s in samples] for g in genomes])
