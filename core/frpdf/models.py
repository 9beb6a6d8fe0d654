"""The trained models: the choice of one for a rail standard, and its weights on disk.

Weights are arrays in an .npz file, named as in the network's state; kernels are float16.
"""

from __future__ import annotations

import io
import math
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ModelError
from ..parameters import Parameters
from . import AUTO

FOLDER = Path(__file__).resolve().parents[2] / "models"

MIN_RATIO, MAX_RATIO = 13.4, 26.7
"""Ratios of gauge to railhead: those of the training, 14.2 to 25.2, and 6 % beyond, which a model tolerates."""

MAX_BYTES = 2**26
"""Largest size of all arrays together: fifty times that of FRPDF. A file of 1 MB may state gigabytes."""

SUFFIX = ".npy"
"""Suffix of the arrays' names in the archive."""

DTYPES = (np.float16, np.float32)


@dataclass(frozen=True)
class Model:
    """Trained weights and their rail standard; `name` is an option of MODEL, and the value in raster tags."""

    name: str
    gauge_m: float
    head_width_m: float
    file: str

    @property
    def ratio(self) -> float:
        """Gauge divided by railhead width: the only difference between standards once cells are scaled."""
        return self.gauge_m / self.head_width_m

    @property
    def path(self) -> Path:
        """Path of the weights file."""
        return FOLDER / self.file


MODELS = (Model("base", 1.435, 0.0762, "frpdf_base.npz"), Model("fast", 1.435, 0.0762, "frpdf_fast.npz"))

NAMES = (AUTO, *(model.name for model in MODELS))
"""Values of the parameter MODEL."""

AUTOMATIC = ("fast",)
"""Names of the models among which AUTO chooses by ratio; models/MODEL_CARD.md compares both."""


def choose(gauge_m: float, head_width_m: float, name: str = Parameters.model) -> Model:
    """Return the model of a name; with AUTO, that whose ratio of gauge to railhead is nearest (paper, section 7).

    Raises ModelError if no model was trained for such a ratio.
    """
    ratio = gauge_m / head_width_m
    if not MIN_RATIO <= ratio <= MAX_RATIO:
        raise ModelError(
            f"A gauge of {1000 * gauge_m:.0f} mm is {ratio:.1f} times a railhead of {1000 * head_width_m:.1f} mm, and"
            f" the models cover {MIN_RATIO} to {MAX_RATIO} times: check GAUGE and HEAD_WIDTH."
        )
    named = [model for model in MODELS if model.name in (AUTOMATIC if name == AUTO else (name,))]
    return min(named, key=lambda model: abs(math.log(ratio / model.ratio)))


def load_arrays(path: Path) -> dict[str, np.ndarray]:
    """Read weights, float32 arrays by name; no more memory is used than for weights.

    Only plain arrays are accepted. Raises ModelError if the file is missing or damaged.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            if sum(member.file_size for member in archive.infolist()) > MAX_BYTES:
                raise ValueError("too large")
            return {member.filename[: -len(SUFFIX)]: _array(_bytes(archive, member)) for member in archive.infolist()}
    except FileNotFoundError:
        raise ModelError(f"The weights file {path} is missing: reinstall the plugin.") from None
    except Exception as error:
        # A damaged archive raises any of a dozen errors of zipfile, zlib, numpy and struct.
        raise ModelError(f"The weights file {path} cannot be read: reinstall the plugin.") from error


def _bytes(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> bytes:
    """Unpack no more of a member than the archive states; one that holds more is damaged, as its checksum shows."""
    with archive.open(member) as file:
        return file.read(member.file_size)


def _array(data: bytes) -> np.ndarray:
    """Read an array from a member of the archive; its header is checked first, because numpy allocates what it states.

    Raises ValueError if the header states other data than the member holds, or other numbers than weights.
    """
    file = io.BytesIO(data)
    if np.lib.format.read_magic(file) != (1, 0):
        raise ValueError("unknown version")
    shape, by_columns, dtype = np.lib.format.read_array_header_1_0(file)
    if dtype not in DTYPES or math.prod(shape) * dtype.itemsize != len(data) - file.tell():
        raise ValueError("not an array of weights")
    array = np.frombuffer(data, dtype, offset=file.tell())
    return array.reshape(shape, order="F" if by_columns else "C").astype(np.float32)


def save_arrays(path: Path, arrays: dict[str, np.ndarray]) -> None:
    """Write weights, compressed; kernels, which have four dimensions, as float16, which halves the size of the file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    halved: dict[str, Any] = {
        name: array.astype(np.float16) if array.ndim == 4 else array for name, array in arrays.items()
    }
    np.savez_compressed(path, **halved)
