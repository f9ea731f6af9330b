"""The image library, imported when a camera is first used."""

from types import ModuleType

import numpy as np


def vision() -> ModuleType:
    """Return OpenCV.

    Raises
    ------
    ImportError
        If it is not installed.
    """
    try:
        import cv2
    except ImportError as error:
        raise ImportError("OpenCV must be installed. Run: pip install 'turing-learning[vision]'") from error
    return cv2


def require_image(name: str, image: np.ndarray, size: tuple[int, int] | None = None) -> None:
    """Refuse what is not a color image (H, W, 3) of 8 bits, or not of `size`, width and height in pixels.

    Raises
    ------
    ValueError
        With the shape and type received.
    """
    shape = ("H", "W", 3) if size is None else (size[1], size[0], 3)
    fits = image.ndim == 3 and image.shape[2] == 3 if size is None else image.shape == shape
    if not fits or image.dtype != np.uint8:
        expected = f"({shape[0]}, {shape[1]}, 3)"
        raise ValueError(f"`{name}` must be an image {expected} of uint8; got {image.shape} of {image.dtype}.")


def gray(image: np.ndarray) -> np.ndarray:
    """Return the brightness (H, W) of an image (H, W, 3) in blue, green, red."""
    cv2 = vision()
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY))
