"""What is kept of a run: past classifiers, all samples, and what classifiers say of these."""

from collections.abc import Mapping

import numpy as np

from turing_learning.evolution import state_arrays

from ..arrays import array
from ..errors import integer, require
from ..evolution import Seed, check_seed, generation_rng
from ._protocols import Classifier


class ClassifierArchive:
    """A sample of the best classifiers of all past generations, drawn uniformly (reservoir sampling).

    Coevolution forgets: classifiers lose an ability once no model needs it, and models fall back into what
    they had left. Archived classifiers judge the models beside the present ones. They cost no simulation,
    earn nothing, and do not change the fitness of the present classifiers.

    Source: Rosin and Belew, New methods for competitive coevolution (1997), the hall of fame; Vitter, Random
    sampling with a reservoir (1985).

    Parameters
    ----------
    capacity
        Largest number of classifiers kept, >= 1.
    seed
        Entropy: a non-negative integer or a sequence of them.

    Attributes
    ----------
    genomes : (B, Q)
        The classifiers kept; empty at first.
    specificity : (B,)
        Share of genuine samples that each judged genuine in its own generation. It stays true, because the
        system does not change.
    """

    def __init__(self, capacity: int, *, seed: Seed) -> None:
        self.capacity = integer("capacity", capacity, 1)
        self.genomes = np.empty((0, 0))
        self.specificity = np.empty(0)
        self._seed = check_seed(seed)
        self._seen = 0

    def admit(self, genome: np.ndarray, specificity: float) -> None:
        """Offer a classifier (Q,): kept with probability capacity / number offered so far, in the place of another."""
        place = int(generation_rng(self._seed, self._seen).integers(self._seen + 1))
        self._seen += 1
        if len(self.genomes) < self.capacity:
            self.genomes = np.vstack([*self.genomes, genome])
            self.specificity = np.append(self.specificity, specificity)
        elif place < self.capacity:
            self.genomes, self.specificity = self.genomes.copy(), self.specificity.copy()
            self.genomes[place], self.specificity[place] = genome, specificity

    def state(self) -> dict[str, np.ndarray]:
        """Return the classifiers, their specificity, and the number offered so far."""
        return {
            "genomes": self.genomes.copy(),
            "specificity": self.specificity.copy(),
            "seen": np.array(self._seen, dtype=np.int64),
        }

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Take over a state."""
        genomes, shares, seen = state_arrays(state, {"genomes": "B Q", "specificity": "B", "seen": ""}).values()
        rule = f"be at most {self.capacity} classifiers (B, Q)"
        require(len(genomes) <= self.capacity, "state['genomes']", rule, f"shape {genomes.shape}")
        require(((shares >= 0) & (shares <= 1)).all(), "state['specificity']", "be shares from 0 to 1", shares.tolist())
        self.genomes, self.specificity, self._seen = genomes, shares, int(seen)


class SampleBuffer:
    """The samples of all trials of models, and the latest genuine ones; arrays that only grow.

    Rows are appended and never changed, so that a store can write what has come since it last wrote (`since`),
    and nothing twice.

    Parameters
    ----------
    pool
        Number of genuine samples that are judged, the latest: those of trials with models that are nearly
        right.
    share
        Share of the pool that one batch may fill; of more, a random part is kept.

    Attributes
    ----------
    pool
        As given; all genuine samples are kept, so that it may be raised.
    """

    def __init__(self, pool: int = 2000, share: float = 0.1) -> None:
        self.pool, self._share = integer("pool", pool, 2), share
        self._arrays: dict[str, np.ndarray] = {}
        self._counts: dict[str, int] = {}

    def __len__(self) -> int:
        return self._counts.get("parameters", 0)

    @property
    def parameters(self) -> np.ndarray:
        """Parameters of the model of each trial (S, P)."""
        return self._filled("parameters")

    @property
    def samples(self) -> np.ndarray:
        """C samples of each trial (S, C, T, D) float32."""
        return self._filled("samples")

    @property
    def usable(self) -> np.ndarray:
        """Which trials have samples (S,) bool; those that failed count as trials."""
        return self._filled("usable")

    @property
    def genuine(self) -> np.ndarray:
        """Genuine samples (K, T, D) float32 that are judged."""
        return self._filled("genuine")[-self.pool :]

    def append(
        self, parameters: np.ndarray, samples: np.ndarray, genuine: np.ndarray, rng: np.random.Generator,
        usable: np.ndarray | None = None,
    ) -> np.ndarray:  # fmt: skip
        """Take over trials of models (M, P): samples (M, C, T, D), genuine ones (K, T, D) met beside them, and which are usable.

        Returns the genuine samples (k, T, D) that were kept.
        """
        parameters = array("parameters", parameters, "M P")
        samples = array("samples", samples, "M C T D", M=len(parameters))
        genuine = array("genuine", genuine, "K T D", empty=True, T=samples.shape[2], D=samples.shape[3])
        most = max(1, round(self._share * self.pool)) if len(self) else self.pool
        if len(genuine) > most:
            genuine = genuine[np.sort(rng.permutation(len(genuine))[:most])]
        self._add("parameters", parameters)
        self._add("samples", samples.astype(np.float32))
        self._add("usable", np.ones(len(parameters), bool) if usable is None else np.asarray(usable, bool))
        self._add("genuine", genuine.astype(np.float32))
        return genuine

    def since(self, trials: int, genuine: int) -> dict[str, np.ndarray]:
        """Return the rows that came after so many trials and kept genuine samples; `counts` says how many there are now."""
        return {name: self._filled(name)[genuine if name == "genuine" else trials :] for name in self._arrays}

    @property
    def counts(self) -> tuple[int, int]:
        """Numbers of trials and of genuine samples kept so far."""
        return len(self), self._counts.get("genuine", 0)

    def state(self) -> dict[str, np.ndarray]:
        """Return all rows."""
        return {name: array.copy() for name, array in self.since(0, 0).items()}

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Take over rows in the place of all that there are."""
        names = {"parameters", "samples", "usable", "genuine"}
        require(not state or names <= set(state), "state", f"hold {sorted(names)}", str(sorted(state)))
        rows = len(state["parameters"]) if state else 0
        fits = not state or (len(state["samples"]) == rows and len(state["usable"]) == rows)
        require(fits, "state", "hold as many samples as parameters", str({k: len(v) for k, v in state.items()}))
        self._arrays, self._counts = {}, {}
        for name in names if state else ():
            self._add(name, np.asarray(state[name]))

    def _filled(self, name: str) -> np.ndarray:
        return self._arrays[name][: self._counts[name]]

    def _add(self, name: str, rows: np.ndarray) -> None:
        held = self._counts.get(name, 0)
        needed = held + len(rows)
        if name not in self._arrays:
            self._arrays[name] = np.empty((max(needed, 64), *rows.shape[1:]), rows.dtype)
        elif len(self._arrays[name]) < needed:
            larger = np.empty((max(needed, held + held // 2), *rows.shape[1:]), rows.dtype)
            larger[:held] = self._arrays[name][:held]
            self._arrays[name] = larger
        shape = self._arrays[name].shape[1:]
        require(rows.shape[1:] == shape, name, f"have rows of shape {shape}", str(rows.shape[1:]))
        self._arrays[name][held:needed] = rows
        self._counts[name] = needed


class JudgmentRecord:
    """Outputs of classifiers for all samples of a buffer: what has been judged is not judged again.

    Parameters
    ----------
    classifier
        Judges the samples, as genomes say.

    Attributes
    ----------
    counterfeit : (S, N) float32
        Outputs of N classifiers for S trials, each the mean over the samples of the trial.
    genuine : (K, N) float32
        Outputs for the genuine samples that are judged.
    """

    def __init__(self, classifier: Classifier) -> None:
        self.classifier = classifier
        self._genomes = np.empty((0, classifier.parameters))
        # the genuine samples that are judged, among all that are kept
        self._pool = range(0)
        self.counterfeit = np.empty((0, 0), np.float32)
        self.genuine = np.empty((0, 0), np.float32)

    def update(self, genomes: np.ndarray, buffer: SampleBuffer) -> None:
        """Let classifiers (N, Q) judge what is new to them: new samples, and all if a classifier is new in its row."""
        compared = min(len(genomes), len(self._genomes))
        changed = np.ones(len(genomes), bool)
        changed[:compared] = (genomes[:compared] != self._genomes[:compared]).any(axis=1)
        last = buffer.counts[1]
        pool = range(last - len(buffer.genuine), last)
        trials = range(len(buffer))
        before = range(len(self.counterfeit))
        self.counterfeit = self._updated(self.counterfeit, before, trials, genomes, changed, buffer.samples)
        self.genuine = self._updated(self.genuine, self._pool, pool, genomes, changed, buffer.genuine[:, None])
        self._genomes = genomes.copy()
        self._pool = pool

    def _updated(
        self, outputs: np.ndarray, before: range, now: range, genomes: np.ndarray, changed: np.ndarray,
        samples: np.ndarray,
    ) -> np.ndarray:  # fmt: skip
        """Return the outputs for the rows `now`, of which those in `before` are there but for changed classifiers."""
        updated = np.empty((len(now), len(genomes)), np.float32)
        # rows only come at the end, unless the pool has become larger
        first = max(now.start, before.start)
        last = max(min(now.stop, before.stop), first)
        kept = slice(first - now.start, last - now.start)
        same = np.flatnonzero(~changed)
        updated[kept, same] = outputs[first - before.start : last - before.start, same]
        updated[kept, changed] = self._judged(genomes[changed], samples[kept])
        for new in (slice(0, kept.start), slice(kept.stop, len(now))):
            updated[new] = self._judged(genomes, samples[new])
        return updated

    def _judged(self, genomes: np.ndarray, samples: np.ndarray) -> np.ndarray:
        """Return the outputs (S, N) for trials (S, C, T, D)."""
        trials, count, *series = samples.shape
        if trials == 0 or len(genomes) == 0:
            return np.empty((trials, len(genomes)), np.float32)
        outputs = self.classifier.judge(genomes, samples.reshape(trials * count, *series))
        return outputs.reshape(len(genomes), trials, count).mean(axis=2, dtype=np.float32).T
