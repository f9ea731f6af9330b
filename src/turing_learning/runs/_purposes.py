"""What the random numbers of a run are for."""

MODELS, CLASSIFIERS, INTERROGATION, REPLAY, ARCHIVE, GENUINE = range(1, 7)
"""Purposes of random numbers: the entropy of each is (purpose, seed of the run), so that no two streams meet.

That of `GENUINE`, which chooses the samples of a recording that are held out, has no seed: all runs hold out the same."""
