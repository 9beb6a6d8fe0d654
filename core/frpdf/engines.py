"""The choice of an engine."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np

from ..errors import ModelError
from . import AUTO
from .engine import Engine

_PACKAGES = {"TORCH": ("torch", "torch"), "OPENCV": ("cv2", "opencv-python-headless")}
"""Module and package of each engine."""


def make_engine(arrays: dict[str, np.ndarray], engine: str = AUTO, device: str = AUTO) -> Engine:
    """Set up the engine that the user chose; with AUTO, PyTorch where it is installed and OpenCV elsewhere.

    `engine` is AUTO, TORCH or OPENCV, `device` AUTO, CPU or CUDA. Raises ModelError if the engine's package or device
    is not available, or the weights are not those of FRPDF.
    """
    if choose_engine(engine, device) == "TORCH":
        try:
            from .torch_engine import TorchEngine
        except (ImportError, OSError) as error:  # Windows: a missing library, or one of another plugin with its name
            if engine != AUTO or device == "CUDA" or not find_spec("cv2"):
                raise ModelError(
                    f"PyTorch is installed but does not start ({error}): set ENGINE to OPENCV, or reinstall PyTorch."
                ) from error
        else:
            return TorchEngine(arrays, device)
    from .opencv_engine import OpenCvEngine

    return OpenCvEngine(arrays)


def choose_engine(engine: str, device: str) -> str:
    """Return the name of the engine to use, without importing it.

    Raises ModelError if its package is not installed, or it cannot use the device.
    """
    if engine == AUTO:
        engine = "TORCH" if find_spec("torch") else "OPENCV"
    module, package = _PACKAGES[engine]
    if not find_spec(module):
        raise ModelError(f"ENGINE {engine} needs the package {package}: install it, or set ENGINE to AUTO.")
    if engine == "OPENCV" and device == "CUDA":
        raise ModelError("ENGINE OPENCV runs on the CPU only: set DEVICE to AUTO, or ENGINE to TORCH.")
    return engine
