"""How the recording of walkers is read, and what makes runs on it short."""

READ = ("--fps", "10", "--scale", "1", "--y-axis", "up")
SMALL = (
    *("--set", "models.population=8", "--set", "classifiers.population=8"),
    *("--generations", "2", "--threads", "1"),
)
