"""What is kept of a run of trials: all samples, and what classifiers say of these."""

from collections.abc import Mapping

import numpy as np

from turing_learning.arrays import array
from turing_learning.coevolution import Classifier
from turing_learning.errors import integer, require


class SampleBuffer:
    """The samples of all trials of models, and the latest genuine ones; arrays that only grow.

    Rows are appended and never changed, so that a store can write what has come since it last wrote
    (`since`), and nothing twice.

    Parameters
    ----------
    pool_size
        Number of genuine samples that are judged, the latest: those of trials with models that are
        nearly right.
    share
        Share of these that one batch may fill; of more, a random part is kept.

    Attributes
    ----------
    pool_size
        As given; all genuine samples are kept, so that it may be raised.
    """

    def __init__(self, pool_size: int = 2000, share: float = 0.1) -> None:
        self.pool_size = integer("pool_size", pool_size, 2)
        self._share = share
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
        return self._filled("genuine")[-self.pool_size :]

    def append(
        self,
        parameters: np.ndarray,
        samples: np.ndarray,
        genuine: np.ndarray,
        rng: np.random.Generator,
        usable: np.ndarray | None = None,
    ) -> np.ndarray:
        """Take over trials; return the genuine samples (k, T, D) that are kept.

        Parameters
        ----------
        parameters : (M, P)
            Of the models.
        samples : (M, C, T, D)
            Of the models.
        genuine : (K, T, D)
            That were met beside them.
        rng
            Chooses genuine samples where there are more than one batch may bring.
        usable : (M,)
            Which trials have not failed; None: all.
        """
        parameters = array("parameters", parameters, "M P")
        samples = array("samples", samples, "M C T D", M=len(parameters))
        genuine = array(
            "genuine", genuine, "K T D", empty=True, T=samples.shape[2], D=samples.shape[3]
        )
        most_added = self.pool_size
        if len(self):
            most_added = max(1, round(self._share * self.pool_size))
        if len(genuine) > most_added:
            genuine = genuine[np.sort(rng.permutation(len(genuine))[:most_added])]
        self._add("parameters", parameters)
        self._add("samples", samples.astype(np.float32))
        if usable is None:
            usable = np.ones(len(parameters), bool)
        self._add("usable", np.asarray(usable, bool))
        self._add("genuine", genuine.astype(np.float32))
        return genuine

    def since(self, trials: int, genuine: int) -> dict[str, np.ndarray]:
        """Return the rows that came after so many trials and kept genuine samples.

        `counts` says how many there are now.
        """
        rows = {name: self._filled(name)[trials:] for name in self._arrays if name != "genuine"}
        if "genuine" in self._arrays:
            rows["genuine"] = self._filled("genuine")[genuine:]
        return rows

    @property
    def counts(self) -> tuple[int, int]:
        """Numbers of trials and of genuine samples kept so far."""
        return len(self), self._counts.get("genuine", 0)

    def state(self) -> dict[str, np.ndarray]:
        """Return all rows."""
        return {name: array.copy() for name, array in self.since(0, 0).items()}

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Take over rows in the place of all that there are."""
        self._arrays = {}
        self._counts = {}
        if not state:
            return
        names = {"parameters", "samples", "usable", "genuine"}
        require(names <= set(state), "state", f"hold {sorted(names)}", str(sorted(state)))
        lengths = {name: len(rows) for name, rows in state.items()}
        same = lengths["parameters"] == lengths["samples"] == lengths["usable"]
        require(same, "state", "hold as many samples as parameters", str(lengths))
        for name in names:
            self._add(name, np.asarray(state[name]))

    def _filled(self, name: str) -> np.ndarray:
        return self._arrays[name][: self._counts[name]]

    def _add(self, name: str, rows: np.ndarray) -> None:
        count = self._counts.get(name, 0)
        needed = count + len(rows)
        if name not in self._arrays:
            self._arrays[name] = np.empty((max(needed, 64), *rows.shape[1:]), rows.dtype)
        elif len(self._arrays[name]) < needed:
            larger = np.empty((max(needed, count + count // 2), *rows.shape[1:]), rows.dtype)
            larger[:count] = self._arrays[name][:count]
            self._arrays[name] = larger
        shape = self._arrays[name].shape[1:]
        require(rows.shape[1:] == shape, name, f"have rows of shape {shape}", str(rows.shape[1:]))
        self._arrays[name][count:needed] = rows
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
        self._judged_rows = range(0)
        self.counterfeit = np.empty((0, 0), np.float32)
        self.genuine = np.empty((0, 0), np.float32)

    def update(self, genomes: np.ndarray, buffer: SampleBuffer) -> None:
        """Let classifiers (N, Q) judge what is new to them.

        New samples, and all if a classifier is new.
        """
        columns = {genome.tobytes(): column for column, genome in enumerate(self._genomes)}
        # Of one that has judged already they are taken from where it stood; -1 is a new one
        columns_before = np.array([columns.get(genome.tobytes(), -1) for genome in genomes], int)
        total = buffer.counts[1]
        judged_rows = range(total - len(buffer.genuine), total)
        trials = range(len(buffer))
        before = range(len(self.counterfeit))
        self.counterfeit = self._updated(
            self.counterfeit, before, trials, genomes, columns_before, buffer.samples
        )
        self.genuine = self._updated(
            self.genuine,
            self._judged_rows,
            judged_rows,
            genomes,
            columns_before,
            buffer.genuine[:, None],
        )
        self._genomes = genomes.copy()
        self._judged_rows = judged_rows

    def _updated(
        self,
        outputs: np.ndarray,
        before: range,
        now: range,
        genomes: np.ndarray,
        columns_before: np.ndarray,
        samples: np.ndarray,
    ) -> np.ndarray:
        """Return the outputs for the rows `now`.

        Those for the rows in `before` are there, in the columns (N,) where classifiers were before.
        Column -1 is that of a new one.
        """
        updated = np.empty((len(now), len(genomes)), np.float32)
        # rows only come at the end, unless the pool has become larger
        start = max(now.start, before.start)
        stop = max(min(now.stop, before.stop), start)
        shared = slice(start - now.start, stop - now.start)
        judged = outputs[start - before.start : stop - before.start]
        known = columns_before >= 0
        if np.array_equal(columns_before, np.arange(judged.shape[1])):
            updated[shared] = judged
        else:
            updated[shared, known] = judged[:, columns_before[known]]
            updated[shared, ~known] = self._judged(genomes[~known], samples[shared])
        for missing in (slice(0, shared.start), slice(shared.stop, len(now))):
            updated[missing] = self._judged(genomes, samples[missing])
        return updated

    def _judged(self, genomes: np.ndarray, samples: np.ndarray) -> np.ndarray:
        """Return the outputs (S, N) for trials (S, C, T, D)."""
        trials, count, *series = samples.shape
        if trials == 0 or len(genomes) == 0:
            return np.empty((trials, len(genomes)), np.float32)
        outputs = self.classifier.judge(genomes, samples.reshape(trials * count, *series))
        return outputs.reshape(len(genomes), trials, count).mean(axis=2, dtype=np.float32).T
