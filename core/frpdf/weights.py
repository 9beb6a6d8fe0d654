"""Weights of FRPDF on disk: arrays in an .npz file, named as in the network's state; kernels are float16."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..errors import ModelError


def load_arrays(path: Path) -> dict[str, np.ndarray]:
    """Read weights; only plain arrays are accepted.

    Parameters
    ----------
    path : Path

    Returns
    -------
    dict of str to float32 array

    Raises
    ------
    ModelError
        The file is missing or damaged.
    """
    try:
        with np.load(path, allow_pickle=False) as archive:
            return {name: archive[name].astype(np.float32) for name in archive.files}
    except FileNotFoundError:
        raise ModelError(f"The weights file {path} is missing: reinstall the plugin.") from None
    except Exception as error:
        # A damaged archive raises any of a dozen errors of zipfile, zlib, numpy and struct. Some of their messages
        # advise allowing pickled data.
        raise ModelError(f"The weights file {path} cannot be read: reinstall the plugin.") from error


def save_arrays(path: Path, arrays: dict[str, np.ndarray]) -> None:
    """Write weights, compressed; kernels, which have four dimensions, as float16, which halves the size of the file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    halved = {name: array.astype(np.float16) if array.ndim == 4 else array for name, array in arrays.items()}
    np.savez_compressed(path, **halved)
