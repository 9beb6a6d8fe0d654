"""What computes a pass of FRPDF: an engine maps windows of raster and state to probabilities."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from typing import Protocol

import numpy as np

from ..errors import ModelError
from ..progress import Progress
from . import AUTO
from .corridor import Piece


class Engine(Protocol):
    """Runs the folded network somewhere.

    Attributes
    ----------
    description : str
        Engine, device and number type, for ENGINE_USED.
    most_cells : int
        How many cells to give it at once.
    """

    description: str
    most_cells: int

    def sweep(
        self,
        seen: Sequence[np.ndarray],
        known: Sequence[np.ndarray],
        number: int,
        pieces: Sequence[Piece],
        progress: Progress,
    ) -> list[np.ndarray]:
        """Run one pass over pieces of a raster that is empty elsewhere.

        Parameters
        ----------
        seen, known : sequences of (height, width) float32 arrays
            Raster, 0 or 1, and state, as in `network.FRPDF.logits`, of each piece.
        number : int
            Number of the pass, from 0.
        pieces : sequence of Piece
            Where they lie.
        progress : Progress

        Returns
        -------
        list of (height, width) float32 arrays
            Probability of rail, for each piece.

        Raises
        ------
        DeviceExhaustedError
            After a `retreat`, the same can be tried again.
        """

    def retreat(self) -> str:
        """Be content with less memory, or with another device; give a message for the user.

        Only engines that raise `DeviceExhaustedError` need it.
        """

    def probabilities(self, raster: np.ndarray, state: np.ndarray, number: int) -> np.ndarray:
        """Run one pass over a raster around which nothing is known, as in training.

        Parameters
        ----------
        raster, state : (height, width) float32 arrays
            Raster 0 or 1; state as in `network.FRPDF.logits`.
        number : int
            Number of the pass, from 0.

        Returns
        -------
        (height, width) float32 array
            Probability of rail.
        """


def make_engine(arrays: dict[str, np.ndarray], engine: str = AUTO, device: str = AUTO) -> Engine:
    """Set up the engine that the user chose, or PyTorch where it is installed and OpenCV elsewhere.

    Parameters
    ----------
    arrays : dict
        Weights, from `weights.load_arrays`.
    engine : {"AUTO", "TORCH", "OPENCV"}
    device : {"AUTO", "CPU", "CUDA"}

    Raises
    ------
    ModelError
        The engine's package or device is not there, or the weights are not FRPDF's.
    """
    if choose_engine(engine, device) == "TORCH":
        try:
            from .torch_engine import TorchEngine
        except (ImportError, OSError) as error:  # Windows: a library that it needs, or another plugin's of its name
            if engine != AUTO or device == "CUDA" or not find_spec("cv2"):
                raise ModelError(
                    f"PyTorch is there but does not start ({error}): set ENGINE to OPENCV, or install PyTorch anew."
                ) from error
        else:
            return TorchEngine(arrays, device)
    from .opencv_engine import OpenCvEngine

    return OpenCvEngine(arrays)


def choose_engine(engine: str, device: str) -> str:
    """Tell which engine AUTO means here, without importing it.

    Raises
    ------
    ModelError
        The engine's package is not there, or it can't use the device.
    """
    if engine == AUTO:
        engine = "TORCH" if find_spec("torch") else "OPENCV"
    module, package = _PACKAGES[engine]
    if not find_spec(module):
        raise ModelError(f"The engine {engine} needs the package {package}: install it, or set ENGINE to AUTO.")
    if engine == "OPENCV" and device == "CUDA":
        raise ModelError("The engine OPENCV computes on the processor alone: set DEVICE to AUTO, or ENGINE to TORCH.")
    return engine


_PACKAGES = {"TORCH": ("torch", "torch"), "OPENCV": ("cv2", "opencv-python-headless")}
