"""How aligned a group moves."""

import numpy as np


def polarization(directions: np.ndarray, present: np.ndarray | None = None) -> np.ndarray:
    """Compute the length of the mean direction of a group: 1 if all go one way, about 0 in disorder.

    Parameters
    ----------
    directions : (..., A, 2)
        Displacements or headings as vectors of any length; those of length 0 have no direction and do not count.
    present : (..., A)
        Which of them are known; None for all.

    Returns
    -------
    (moments,)
        0 to 1, of the moments in which at least two individuals have a direction.

    Source
    ------
    Vicsek and others, Phys. Rev. Lett. 75 (1995), the absolute value of the average normalized velocity.
    """
    length = np.hypot(directions[..., 0], directions[..., 1])
    counted = (length > 0) if present is None else present & (length > 0)
    unit = np.where(counted[..., None], directions / np.where(length > 0, length, 1.0)[..., None], 0.0)
    count = counted.sum(axis=-1)
    total = unit.sum(axis=-2)
    aligned = np.asarray(np.hypot(total[..., 0], total[..., 1]) / np.maximum(count, 1))
    return aligned[count >= 2]
