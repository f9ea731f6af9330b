"""Write the source of the Elman judge for one network size.

Numba vectorizes the judge only if the sizes of the network are constants and nothing is sliced in
the inner loop, so the source is generated. Its two functions work on blocks of `LANES` samples, one
sample per lane.

``pack(start, stop, samples, inverse_scale, blocks, faults)``
    Fills ``blocks[start:stop]``, (block, T, D, lane) float32, from samples (S, T, D) float64; lanes
    without a sample are zero. ``faults`` (block,) receives the flat index of the first value in the
    block that is not finite, or -1.
``judge(start, stop, blocks, weights, outputs)``
    Judges the units ``start`` to ``stop``; unit = block * N + classifier. Fills ``outputs`` (N, S)
    float32.

The arithmetic, and why nothing can overflow or become NaN:

* the largest input of a time step and the largest weight of a neuron are at most `LIMIT`, so with
  at most `LARGEST_SUM` terms a weighted sum stays below 3e18 and its square below 1e37 (float32 ends
  at 3.4e38);
* sigmoid(z) = 1/2 + z P(u) / Q(u), u = min(z^2, `SATURATION`^2), cut to [0, 1]. P / Q is a minimax
  fit of tanh(z / 2) / (2 z); all coefficients are positive, so Q has no zero. Errors stay below
  `SIGMOID_ERROR`. At |z| = `SATURATION` the fit passes 0 and 1, so that saturated neurons are
  exactly 0 or 1, as in double precision.

Floating point flags: everything of fast math except reassociation. The order of a sum is the one in
the source.

Where the state lies decides about a third of the time: a vector that crosses a cache line costs
twice. So it lies on the stack, aligned to a cache line, which also makes the compiler align the
weights that it keeps there.
"""

# Samples that are judged side by side.
LANES = 32

# See above for these and for the numbers of the fit.
LIMIT = 1e8
LARGEST_SUM = 256
SATURATION = 12.25
SIGMOID_ERROR = 6e-6
SMALLEST_OUTPUT = 1e-7
NUMERATOR = (312499.815, 8860.40842, 27.9429323)
DENOMINATOR = (1250059.65, 139567.629, 1335.55456, 1.0)

# Beyond, writing out every weight takes the compiler more than two seconds.
UNROLLED_WEIGHTS = 200

_CUT = "min(max(y, F(0)), F(1))"

_HEADER = '''"""Judge of Elman networks with {inputs} inputs and {hidden} hidden neurons. Generated: do not edit."""

import numpy as np
from llvmlite import ir
from numba import carray, float32, float64, int64, njit, types, void
from numba.core import cgutils
from numba.extending import intrinsic

F = np.float32
FAST = {{"nnan", "ninf", "nsz", "arcp", "contract", "afn"}}
SAMPLES = types.Array(float64, 3, "C", readonly=True)
BLOCKS = float32[:, :, :, ::1]


@intrinsic
def aligned_memory(typing_context):
    def allocate(context, builder, signature, arguments):
        memory = cgutils.alloca_once(builder, ir.ArrayType(ir.FloatType(), {memory}))
        memory.align = 64
        return builder.bitcast(memory, ir.FloatType().as_pointer())

    return types.CPointer(float32)(), allocate

'''

_PACK = """
@njit(types.void(float64[::1], BLOCKS, int64, int64, int64), cache={cache})
def store_limited(step, blocks, block, t, lane):
    largest = 0.0
    for d in range({inputs}):
        largest = max(largest, abs(step[d]))
    for d in range({inputs}):
        blocks[block, t, d, lane] = step[d] * ({limit!r} / largest)


@njit(void(int64, int64, SAMPLES, float64[::1], BLOCKS, int64[::1]), nogil=True, cache={cache})
def pack(start, stop, samples, inverse_scale, blocks, faults):
    step = np.empty({inputs})
    steps = samples.shape[1]
    for block in range(start, stop):
        faults[block] = -1
        first = block * {lanes}
        filled = min({lanes}, samples.shape[0] - first)
        for lane in range(filled):
            for t in range(steps):
                within = True
                for d in range({inputs}):
                    value = samples[first + lane, t, d] * inverse_scale[d]
                    within = within and abs(value) <= {limit!r}
                    blocks[block, t, d, lane] = value
                if within:
                    continue
                finite = True
                for d in range({inputs}):
                    value = samples[first + lane, t, d]
                    if not np.isfinite(value):
                        finite = False
                        if faults[block] < 0:
                            faults[block] = ((first + lane) * steps + t) * {inputs} + d
                    step[d] = value * 1e-160 * inverse_scale[d]
                if finite:
                    store_limited(step, blocks, block, t, lane)
        for t in range(steps):
            for d in range({inputs}):
                for lane in range(filled, {lanes}):
                    blocks[block, t, d, lane] = F(0)
"""

_JUDGE = """
@njit(
    void(int64, int64, BLOCKS, float32[:, ::1], float32[:, ::1]),
    fastmath=FAST,
    error_model="numpy",
    nogil=True,
    cache={cache},
)
def judge(start, stop, blocks, weights, outputs):
    state = carray(aligned_memory(), ({memory},), np.float32)
    classifiers = weights.shape[0]
    for unit in range(start, stop):
        block = unit // classifiers
        n = unit - block * classifiers
{load}
        for k in range({state}):
            state[k] = F(0)
        for t in range(blocks.shape[1]):
{step}
        for lane in range({lanes}):
{output}
        first = block * {lanes}
        for lane in range(min({lanes}, outputs.shape[1] - first)):
            outputs[n, first + lane] = state[lane]
"""


def elman_source(inputs: int, hidden: int, *, cache: bool) -> str:
    """Return the source of the judge for a network of ``inputs`` inputs and ``hidden`` hidden neurons."""
    sizes = {"inputs": inputs, "hidden": hidden, "lanes": LANES, "limit": LIMIT, "cache": cache}
    # The activations; the second half is for networks that are not written out
    sizes["memory"] = 2 * hidden * LANES
    names = [f"w{i}_{d}" for i in range(hidden) for d in range(inputs)]
    names += [f"u{i}_{j}" for i in range(hidden) for j in range(hidden)]
    names += [f"b{i}" for i in range(hidden)] + [f"v{i}" for i in range(hidden)] + ["c"]
    load = [f"{name} = weights[n, {k}]" for k, name in enumerate(names)]
    small = hidden * (inputs + hidden + 1) <= UNROLLED_WEIGHTS
    step = _small_step(inputs, hidden) if small else _large_step(inputs, hidden)
    # The sign of z alone decides: rounding must not lift a negative z to 1/2.
    below_half = 0.5 - 2.0**-25
    output = [
        *_sigmoid("c", [f"v{j} * state[{j * LANES} + lane]" for j in range(hidden)]),
        f"y = min(max(y, F({SMALLEST_OUTPUT!r})), F({1 - SMALLEST_OUTPUT!r}))",
        f"state[lane] = min(y, F({below_half!r})) if z < F(0) else y",
    ]
    sections = {
        "load": (8, load if small else load[-hidden - 1 :]),
        "step": (12, step),
        "output": (12, output),
    }
    written = {}
    for name, (spaces, lines) in sections.items():
        written[name] = "\n".join(_indented(lines, spaces))
    judge = _JUDGE.format(**sizes, state=hidden * LANES, **written)
    return "\n".join([_HEADER.format(**sizes), _PACK.format(**sizes), judge])


def _small_step(inputs: int, hidden: int) -> list[str]:
    """Write out all neurons of a lane: every input and activation is read once."""
    body = [f"x{d} = blocks[block, t, {d}, lane]" for d in range(inputs)]
    body += [f"h{j} = state[{j * LANES} + lane]" for j in range(hidden)]
    for i in range(hidden):
        terms = [f"w{i}_{d} * x{d}" for d in range(inputs)]
        terms += [f"u{i}_{j} * h{j}" for j in range(hidden)]
        body += [*_sigmoid(f"b{i}", terms), f"state[{i * LANES} + lane] = {_CUT}"]
    return [f"for lane in range({LANES}):", *_indented(body)]


def _large_step(inputs: int, hidden: int) -> list[str]:
    """Write out one neuron and loop over them: slower, but the compilation of large networks stays within seconds."""
    recurrent, biases = hidden * inputs, hidden * (inputs + hidden)
    row = [f"w{d} = weights[n, i * {inputs} + {d}]" for d in range(inputs)]
    row += [f"u{j} = weights[n, {recurrent} + i * {hidden} + {j}]" for j in range(hidden)]
    terms = [f"w{d} * blocks[block, t, {d}, lane]" for d in range(inputs)]
    terms += [f"u{j} * state[{j * LANES} + lane]" for j in range(hidden)]
    body = [*_sigmoid("b", terms), f"state[{hidden * LANES} + i * {LANES} + lane] = {_CUT}"]
    neuron = [
        *row,
        f"b = weights[n, {biases} + i]",
        f"for lane in range({LANES}):",
        *_indented(body),
    ]
    copy = [f"for k in range({hidden * LANES}):", f"    state[k] = state[{hidden * LANES} + k]"]
    return [f"for i in range({hidden}):", *_indented(neuron), *copy]


def _indented(lines: list[str], spaces: int = 4) -> list[str]:
    return [" " * spaces + line for line in lines]


def _sigmoid(bias: str, terms: list[str]) -> list[str]:
    """Write out z, the sum of a bias and terms, and y, its sigmoid, not yet cut."""
    # Two chains of half the length: the multiply-adds of one need not wait for those of the other.
    middle = (len(terms) + 1) // 2
    first, second = " + ".join([bias, *terms[:middle]]), " + ".join(terms[middle:])
    return [
        f"z = ({first}) + ({second})" if second else f"z = {first}",
        f"u = min(z * z, F({SATURATION**2!r}))",
        f"p = {_horner(NUMERATOR)}",
        f"q = {_horner(DENOMINATOR)}",
        "y = F(0.5) + (z * p) * (F(1) / q)",
    ]


def _horner(coefficients: tuple[float, ...]) -> str:
    text = f"F({coefficients[-1]!r})"
    for coefficient in coefficients[-2::-1]:
        factor = "u" if text == "F(1.0)" else f"{text} * u"
        text = f"({factor} + F({coefficient!r}))"
    return text
