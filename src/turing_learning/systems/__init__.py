"""What is observed, and what imitates it: simulated swarms, custom systems, robots in a laboratory.

`System`
    What a run has to know of it, whatever its kind: parameters, signals, truth, and how its samples are opened. `Swarm`,
    `CustomSystem` and `Laboratory` are the kinds; `system_of` makes one from a scenario.
`Source`
    Samples of a system while they are needed, from `System.open`; `CustomSource` is that of a custom system, `Given` what its
    caller hands over. `SystemFailedError` ends a run that can be resumed, `CustomSystemError` where a simulator failed.
`describe`
    A custom system from what a caller hands over: samples, simulator, `Range` of each parameter (`read_parameters`),
    `CustomOptions`.
`Genuine`, `read_genuine`, `cut_samples`, `observed`, `SplitSamples`
    Samples of a system, checked and split into those for learning and those held out for testing; samples that are split already.
`CenteredClassifier`, `GuardedInterrogation`
    Judge samples as they were observed; reject models whose simulation failed.
`Simulator`, `FailureLog`, `same_time_step`
    A simulator as a type; which simulations failed, and why; which time steps count as the same.
`name_of`, `importable_name`, `imported`
    Functions by the names that another process imports them by.
`physics_steps`
    Physics steps of single robots in a generation, which the configuration limits.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
