"""Classifiers: from a genome to a judgment on samples of motion.

`ElmanClassifier`
    A small recurrent network, the classifier of the paper: reads a sample step by step and judges it at the
    end.

A classifier has ``parameters`` (the length of a genome, Q) and ``judge(genomes (N, Q), samples (S, T, D))``,
which returns outputs (N, S) strictly between 0 and 1; 0.5 and above means judged genuine.
"""

from ._elman import ElmanClassifier

__all__ = ["ElmanClassifier"]
