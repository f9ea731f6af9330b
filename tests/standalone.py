"""Inlined kernels have no wrappers for Python: tests call them through a compiled function."""

from numba import njit


def standalone(kernel):
    """Return a function that calls an inlined kernel."""

    @njit(error_model="numpy")
    def call(*arguments):
        return kernel(*arguments)

    return call
