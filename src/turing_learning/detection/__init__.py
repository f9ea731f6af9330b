"""Classifiers as a product: which individuals of a swarm behave abnormally?

`detect`, `Detection`, `Ranking`, `Standing`
    Judged alike: how unlike normal ones individuals are, beside baselines of window statistics.
`Detector`, `SampleVerdict`, `TimedVerdict`, `RULES`
    Rules by votes, the paper's among them.
`MotionOutlierDetector`
    Motion statistics as an estimator of scikit-learn, without a run.
`Motion`, `load_motion`, `RecordedMotion`, `recorded_motion`
    Samples of named individuals, from files (`MOTION_SUFFIXES`, `holds_motion`), or windows of what
    a tracker wrote.
`simulate_behaviors`, `random_controllers`, `plant_abnormal`
    Genuine and abnormal motion of a scenario, to calibrate, to compare, and to show.
`simulated_calibration`, `observed_calibration`, `RANDOM_MODELS`
    What a run keeps for detectors: samples of its system, or what was observed in a laboratory; of
    how many random models.
`run_classifiers`, `RunClassifiers`
    The classifiers of a run: its last generation, the best of all generations, and a jury of the
    whole run.

The module `present` has what pages and terminals show of a detection.

Motion has the shape (individuals, samples, T, D) throughout; a sample is what a classifier judges
at once, T steps.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
