"""Weights of the network on disk: arrays in an .npz file, named as in the network's state; kernels are float16."""

from __future__ import annotations

import io
import math
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ModelError

MAX_BYTES = 2**26
"""Largest size of all arrays together: fifty times that of FRPDF. A file of 1 MB may state gigabytes."""


SUFFIX = ".npy"
"""Suffix of the arrays' names in the archive."""


DTYPES = (np.float16, np.float32)


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
