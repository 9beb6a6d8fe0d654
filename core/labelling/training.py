"""From a labelled cloud of any size to the weights of a classifier.

The cloud is cut into blocks in a folder that lets an interrupted training continue.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..classify.settings import Settings
from ..clouds.points import Request
from ..disk import Destination, scratch_folder, writing
from ..errors import NoRailPointsError, ParameterError
from ..kernels import device_of
from ..learned.blocks import CHECKS, Examples, Plan, save_index, write_square
from ..learned.model import WEIGHTS_SUFFIX, check_torch, load, save
from ..progress import SILENT, Progress
from ..run.tasks import Runner
from ..tiles.grid import Square
from ..tiles.store import files_of, read_stored
from .finding import POINT, sort_files

if TYPE_CHECKING:
    from ..learned.training import Trained

FOLDER_SUFFIX = "_training"
"""Added to the name of the weights, it is that of the folder that holds a training until it is complete."""

SOURCE, EXAMPLES = "source.json", "examples"


def check_training(weights: Path, plan: Plan) -> None:
    """Check what can be checked before a cloud is read.

    Raises ParameterError if the weights have another suffix, and ModelError if PyTorch or the CUDA device is missing,
    or the weights to start from are missing or something else.
    """
    if weights.suffix.lower() != WEIGHTS_SUFFIX:
        raise ParameterError(f"{weights.name} is not a name for weights: let it end in {WEIGHTS_SUFFIX}.")
    check_torch("Training")
    device_of(plan.device)
    if plan.start is not None:
        load(plan.start)


def folder_of(weights: Path) -> Path:
    """Return the folder that holds the training of weights until it is complete."""
    return weights.with_name(weights.stem + FOLDER_SUFFIX)


def train_classifier(
    request: Request, settings: Settings, plan: Plan, weights: Destination, progress: Progress = SILENT
) -> Trained:
    """Train a classifier on a labelled cloud and write its weights; continue if such a training was interrupted.

    The request has the files, `standards.SEARCHED_CLASSES` and the extent. The folder `folder_of` the weights, an .npz
    file, is removed once they are written.
    """
    from ..learned.training import TrainingSettings, train

    folder = folder_of(weights.file)
    reading, learning = progress.after_reading()
    with writing(folder.parent):
        examples = _examples(request, settings, plan, folder, reading)
        reading.set_fraction(1.0)
        progress.status("Training")
        trained = train(examples, TrainingSettings(plan.epochs, plan.seed, plan.start), folder, plan.device, learning)
    with weights.replacing() as new:
        save(new, trained.network)
    shutil.rmtree(folder, ignore_errors=True)
    return trained


def _examples(request: Request, settings: Settings, plan: Plan, folder: Path, progress: Progress) -> Examples:
    """Write the blocks of the cloud, or return those of the training that continues."""
    source, examples = folder / SOURCE, folder / EXAMPLES
    identity = _identity(request, settings, plan.rail_classes)
    if source.exists():
        if source.read_bytes() != identity.encode():
            raise other_training(folder)
    elif folder.exists() and any(folder.iterdir()):
        raise other_training(folder)
    if (examples / CHECKS).exists():
        try:
            return Examples.load(examples)
        except ValueError:
            progress.warning(f"{examples} is damaged: the cloud is cut into blocks again.")
            shutil.rmtree(examples)
    is_new = not folder.exists()
    try:
        examples.mkdir(parents=True, exist_ok=True)
        source.write_bytes(identity.encode())
        progress.status("Cutting the cloud into blocks")
        progress.reading()
        found = _write_examples(request, plan.rail_classes, settings, examples, progress)
        found.validation(plan.seed)
        return found
    except BaseException:
        if is_new:
            shutil.rmtree(folder, ignore_errors=True)
        raise


def other_training(folder: Path) -> ParameterError:
    """Return the error for a folder that holds something else."""
    return ParameterError(
        f"{folder} holds another training, with other clouds or settings: delete it, or choose another name for the "
        "weights."
    )


def _identity(request: Request, settings: Settings, rail_classes: Sequence[int]) -> str:
    """Return a text that is the same for the same blocks."""
    files = [[header.path.name, header.point_count, *map(str, header.extent)] for header in request.headers]
    mask = None if request.mask is None else list(map(str, request.mask.extent))
    extent = None if request.extent is None else list(map(str, request.extent))
    return json.dumps([files, list(rail_classes), settings.side_m, extent, mask, list(request.leave_out)])


def _write_examples(
    request: Request, rail_classes: Sequence[int], settings: Settings, folder: Path, progress: Progress = SILENT
) -> Examples:
    """Cut a labelled cloud into blocks in an existing folder; memory holds one square."""
    starts = np.cumsum([header.point_count for header in request.headers])
    reading, cutting = progress.divide((1.0, 1.0))
    census = np.zeros(2, dtype=np.int64)
    with writing(folder), scratch_folder(folder) as squares:
        sorted_files = sort_files(request, settings, squares, Runner(), reading, with_class=True)
        keys = sorted({key for one in sorted_files for key in one.counts})
        entries = []
        for file, key in enumerate(cutting.follow(keys)):
            points = read_stored(files_of(key, sorted_files), POINT)
            rail = np.isin(points["mark"], rail_classes)
            tile = np.searchsorted(starts, points["number"], side="right")
            census += np.bincount(rail, minlength=2)
            xyz = Square.on_grid(key, settings.side_m, request.zero).frame.to_local(points["xyz"])
            entries.append(write_square(folder, file, key, settings.side_m, xyz, rail, tile))
        index = np.concatenate(entries) if entries else np.empty(0)
        _check(census, index, rail_classes)
        save_index(folder, index)
    return Examples.load(folder)


def _check(census: np.ndarray, index: np.ndarray, rail_classes: Sequence[int]) -> None:
    """Refuse labels from which nothing can be learned."""
    named = ", ".join(map(str, rail_classes))
    others, rails = census
    if not rails:
        raise NoRailPointsError(
            f"The cloud has no points of class {named} to learn from: classify its rails, or set the rail classes."
        )
    if not others:
        raise ParameterError(
            f"All points of the cloud are of class {named}: give the whole cloud, with the points around the rails."
        )
    if not index["rail"].any():
        raise NoRailPointsError(
            f"No point of class {named} is 0.055 to 0.4 m above the bed, where railheads are: check the labels and the "
            "unit of the coordinates."
        )
