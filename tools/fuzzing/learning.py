"""The folder of an interrupted training, to be damaged."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from rail_extract.core.errors import RailExtractError
from rail_extract.core.labelling.training import EXAMPLES
from rail_extract.core.learned.blocks import Examples, save_index, write_square
from rail_extract.core.learned.training import TrainingSettings, _Run
from rail_extract.laboratory.scenes.raw_shapes import flat, rough, with_track

SIDE_M = 40.0


def write_training(folder: Path) -> list[Path]:
    """Write the blocks of 12 m of track and a checkpoint, and return all files."""
    torch.set_num_threads(1)
    examples = folder / EXAMPLES
    examples.mkdir()
    rng = np.random.RandomState(3)
    xyz, on_rail = with_track(flat(12.0, rng=rng, per_m2=50), 1.435, 0.072, 0.3)
    tile = np.zeros(len(xyz), dtype=int)
    save_index(examples, write_square(examples, 0, (0, 0), SIDE_M, rough(xyz, rng), on_rail, tile))
    _run(folder).save()
    return sorted(path for path in folder.rglob("*") if path.is_file())


def continue_training(path: Path) -> None:
    """Load what a training continues from; the product cuts damaged blocks again."""
    folder = path.parent.parent if path.parent.name == EXAMPLES else path.parent
    try:
        run = _run(folder)
    except ValueError as error:
        raise RailExtractError(str(error)) from error
    run.resume()


def _run(folder: Path) -> _Run:
    examples = Examples.load(folder / EXAMPLES)
    every = np.arange(len(examples.index))
    return _Run(examples, TrainingSettings(1), every, every[:1], folder, "cpu")
