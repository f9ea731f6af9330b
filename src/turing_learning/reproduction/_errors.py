"""What can happen to an experiment, apart from what can happen to runs and studies."""


class Stopped(Exception):
    """An experiment was stopped between two pieces of work, and can go on."""
