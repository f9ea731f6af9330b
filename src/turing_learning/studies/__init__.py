"""Studies: many runs, executed by workers, read as one table.

`study`
    Run a scenario with many seeds, with a grid or list of configurations, or with random behaviors
    (`BEHAVIORS`).
`resume_study`, `load_study`
    Resume a study; open one.
`plan_study`
    What will run, resolved and validated before anything does.
`StudyResult`, `StudyRun`, `ParameterSummary`
    The table: one entry per run, and statistics of the errors per parameter.
`StudyProgress`
    What an observer gets while the runs are executed.
`ExecutorChoice`, `dask_cluster`, `create_study`, `execute_study`
    The steps of a study: who executes the runs; the folder; the runs.
`run_one`, `collect_study`, `write_slurm`
    The steps of a study on a Slurm cluster: one run by its number, the table at the end, the job
    script.
`StudyFolder`, `is_study`, `new_study_path`
    The files of a study; whether a folder is one; where a new one may be.
`convergences`, `refuse_script`
    Medians over the runs of a configuration, generation by generation; paths where no job script
    may be written.
`ExecutorError`
    Workers that cannot go on; the study can be resumed.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
