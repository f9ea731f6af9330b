"""What is observed, and what imitates it: simulated swarms, custom systems, robots in a laboratory.

`System`
    What a run has to know of it, whatever its kind: parameters, signals, truth, and how its samples
    are opened.
    `Swarm`, `CustomSystem` and `Laboratory` are the kinds.
`Source`
    Samples of a system while they are needed, from `System.open`; `CustomSource` is that of a
    custom system,
    `Arguments` what its caller hands over. `SystemFailedError` ends a run that can be resumed,
    `CustomSystemError` where a simulator failed.
`describe`, `describe_simulated`, `read_parameters`, `NO_PRIOR`
    A custom system from what a caller hands over: samples, simulator, `Range` of each parameter,
    `CustomOptions`. The same with simulated samples; the parameters alone; why a prior is refused.
`system_of`
    The system of a scenario.
`Genuine`, `observed`, `held_out_groups`
    Samples of a system, checked and split into those for learning and those held out for testing;
    which of these belong together.
`GuardedInterrogation`
    Reject models whose simulation failed.
`FallibleSource`, `FailureLog`
    A source whose simulations may fail; what has failed.
`per_model`, `PerModel`, `Command`, `table_values`, `read_table`
    A simulator from a function that runs one model and returns a table, or from any program; such a table as
    numbers; one in CSV.
`Simulator`, `imported`, `importable_name`, `name_of`
    A simulator as a type; a function by the name that another process imports it by; that name, if
    there is one; that name, or a refusal.
`scales_of`, `SMALLEST_SCALE`, `same_time_step`
    What samples are divided by, and the least of it; whether two time steps count as the same.
`physics_steps`
    Physics steps of single robots in a generation, which the configuration limits.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
