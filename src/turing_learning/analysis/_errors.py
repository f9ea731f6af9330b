"""Errors of inferred parameters."""

import numpy as np


def absolute_error(estimate: np.typing.ArrayLike, truth: np.typing.ArrayLike) -> np.ndarray:
    """Compute the absolute error (AE) in each parameter.

    Parameters
    ----------
    estimate : (..., P)
        Inferred parameters, of one model or of many.
    truth : (P,)
        Parameters of the agent.

    Returns
    -------
    (..., P)
        In the units of the parameters.

    Raises
    ------
    ValueError
        If the shapes do not fit, or a parameter is not finite.

    Source
    ------
    Paper, section 4.3, equation 9.
    """
    inferred, true = np.asarray(estimate, dtype=np.float64), np.asarray(truth, dtype=np.float64)
    if true.ndim != 1 or true.size == 0 or inferred.shape[-1:] != true.shape:
        raise ValueError(
            f"`estimate` must be of shape (..., P) and `truth` of shape (P,); got {inferred.shape} and {true.shape}."
        )
    for name, values in (("estimate", inferred), ("truth", true)):
        if not np.isfinite(values).all():
            raise ValueError(f"`{name}` must be finite; got {values[~np.isfinite(values)].flat[0]}.")
    return np.abs(inferred - true)


def mean_absolute_error(estimate: np.typing.ArrayLike, truth: np.typing.ArrayLike) -> np.ndarray:
    """Compute the mean absolute error (MAE) over all parameters.

    Parameters
    ----------
    estimate : (..., P)
        Inferred parameters, of one model or of many.
    truth : (P,)
        Parameters of the agent.

    Returns
    -------
    (...)
        In the units of the parameters.

    Raises
    ------
    ValueError
        If the shapes do not fit, or a parameter is not finite.

    Source
    ------
    Paper, section 4.3, equation 10.
    """
    return absolute_error(estimate, truth).mean(axis=-1)
