"""Trained weights on disk, the probabilities that they give, and squares labelled by them.

`label_square` is the counterpart of `classify.square.classify_square`: lines, partners and pieces are found as in
`classify`. The network sees 4 m and does not know what continues beyond: what is too short is left out, and what
continues a rail is added.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..errors import ModelError, ParameterError
from ..frpdf.models import FOLDER
from ..frpdf.weights import load_arrays, save_arrays
from ..kernels import device_of, one_thread, pytorch
from ..parameters import LEARNED
from ..progress import SILENT, Progress
from .blocks import MAX_POINTS, Block, Thinned, build, centred

if TYPE_CHECKING:
    from torch import Tensor

    from .network import RandLaNet, Tensors
from dataclasses import replace

from scipy.spatial import cKDTree

from ..classify.bed import COARSE_M, Coarse
from ..classify.labels import Near
from ..classify.lines import REACH_M, Lines, Marks, find_lines, reach_at
from ..classify.partner import have_partners
from ..classify.pieces import links, long_enough, shares_of_length
from ..classify.settings import DENSE, THIN, Settings
from ..classify.square import Classified, beside_guide, classify_square
from ..classify.tops import Grid
from ..clouds.on_heads import GRADIENT
from ..rails import SearchFigures
from .blocks import RAIL_VOXEL_M, cut, thin

SHIPPED = FOLDER / "rail_classifier.npz"
"""Weights trained on simulated clouds of a scanner on a train; models/MODEL_CARD.md describes them."""

WEIGHTS_SUFFIX = ".npz"

AT_ONCE = 8 * MAX_POINTS
"""Points that go through the network at once: some 300 MB."""

NO_TORCH = "{} needs PyTorch: install it with the algorithm Install packages, or with pip install torch."

PROBABILITY, POSSIBLE = 0.5, 0.1
"""Probability from which a point is labelled, for which the training sets the bias of the output; and that from which
it is labelled if it continues a rail: where a rail leaves the block, plants or shadows leave less to see of it."""

NEAREST = 3
"""Thinned points whose probabilities, weighted by the inverse of their squared distances, give that of a point."""

NEAREST_M = 0.001
"""Smaller distances count as this one: a point that the network has seen keeps its probability."""

LEVEL_M = 1.0
"""Labelled points this far apart in height may be on one line: on the decks of bridges and below them they are not."""


def check_torch(what: str) -> None:
    """Check that PyTorch starts; `ModelError` says what needs it."""
    try:
        import torch  # noqa: F401
    except (ImportError, OSError) as error:  # Windows: a missing library
        raise ModelError(NO_TORCH.format(what)) from error


def save(path: Path, network: RandLaNet) -> None:
    """Write the weights of a network."""
    from ..frpdf.network import weights_of

    save_arrays(path, weights_of(network))


def load(path: Path) -> RandLaNet:
    """Make a network with the weights of a file, on the CPU.

    Raises ModelError if PyTorch is missing, or the file is missing, is damaged or holds something else.
    """
    check_torch("METHOD LEARNED")
    from ..frpdf.network import set_weights, weights_of
    from .network import RandLaNet

    if not path.is_file():
        raise ModelError(f"The weights file {path} is missing: choose one that Train rail classifier has written.")
    try:
        arrays = load_arrays(path)
    except ModelError as error:
        raise ModelError(
            f"The weights file {path.name} cannot be read: choose one that Train rail classifier has written."
        ) from error
    network = RandLaNet()
    shapes = {name: array.shape for name, array in weights_of(network).items()}
    if {name: array.shape for name, array in arrays.items()} != shapes:
        raise ModelError(
            f"{path.name} holds the weights of something else: choose a file that Train rail classifier has written."
        )
    if not all(np.isfinite(array).all() for array in arrays.values()):
        raise ModelError(f"{path.name} holds weights that are not numbers: train them again.")
    set_weights(network, arrays)
    return network.eval()


class Classifier:
    """A trained network on its device, AUTO, CPU or CUDA; ModelError if there is no CUDA device."""

    def __init__(self, network: RandLaNet, device: str = "AUTO") -> None:
        self.device = device_of(device)
        self._network = network.eval().to(self.device)
        self._may_retreat = device == "AUTO"

    @classmethod
    def of(cls, path: Path, device: str = "AUTO") -> Classifier:
        """Load the weights of a file; see `load`."""
        return cls(load(path), device)

    def probabilities(self, thinned: Thinned, blocks: Sequence[Block], progress: Progress = SILENT) -> np.ndarray:
        """Return the probability of each thinned point of being on a rail, (n,) float32; NaN outside of all cores."""
        found = np.full(len(thinned.number), np.nan, dtype=np.float32)
        for group in in_groups([len(block.number) for block in blocks]):
            progress.check()
            chosen = [blocks[number] for number in group]
            places = [centred(thinned.place[block.number]) for block in chosen]
            computed = self._computed(places, progress)
            for block, values in zip(chosen, np.split(computed, np.cumsum([len(place) for place in places])[:-1])):
                found[block.number[block.core]] = values[block.core]
        return found

    def _computed(self, places: Sequence[np.ndarray], progress: Progress) -> np.ndarray:
        """Run the network on blocks; the graphics card's memory may be taken by other programs."""
        import torch

        try:
            with torch.inference_mode(), one_thread(pytorch()):
                return torch.sigmoid(self._network(*inputs(places, self.device))).cpu().numpy()
        except torch.cuda.OutOfMemoryError:
            if not self._may_retreat:
                raise ModelError("The graphics card has too little free memory: set DEVICE to CPU.") from None
            torch.cuda.empty_cache()
            self.device = "cpu"
            self._network.to(self.device)
            progress.warning("The graphics card has too little free memory: continuing on the CPU.")
            return self._computed(places, progress)


def weights_for(method: str, weights: Path | None) -> Path | None:
    """Return the weights that one of `parameters.METHODS` uses, after a check that they can be; None for geometry.

    Raises ParameterError if the method and the weights contradict each other.
    """
    if method != LEARNED:
        if weights is not None:
            raise ParameterError("WEIGHTS are for METHOD LEARNED: choose this method, or leave WEIGHTS empty.")
        return None
    weights = weights or SHIPPED
    load(weights)
    return weights


def inputs(places: Sequence[np.ndarray], device: str) -> tuple[Tensor, list[Tensors]]:
    """Make the network's inputs from the places of blocks, (n, FEATURES) float32 each; see `blocks.centred`."""
    import torch

    from .network import Tensors

    layers = build([place[:, :3] for place in places])
    return torch.from_numpy(np.concatenate(places)).to(device), [Tensors.of(layer, device) for layer in layers]


def in_groups(counts: Sequence[int]) -> list[list[int]]:
    """Divide blocks, by their numbers of points, into groups of at most `AT_ONCE` points, in order."""
    groups: list[list[int]] = []
    total = 0
    for number, count in enumerate(counts):
        if not groups or total + count > AT_ONCE:
            groups.append([])
            total = 0
        groups[-1].append(number)
        total += count
    return groups


def label_square(
    xyz: np.ndarray, settings: Settings, classifier: Classifier, progress: Progress = SILENT
) -> Classified:
    """Find the points on railheads in a square; see `classify.square.classify_square`.

    Rails in pavements are found by their shape, because the network does not see their grooves, and so are, beside what
    the network finds, blunted heads, of which it sees too little where they are low and wide.
    """
    by_shape = classify_square(xyz, settings)
    rail, figures = by_shape.flush.rail.copy(), by_shape.flush.figures
    if not len(xyz):
        return Classified(rail, figures)
    thinned = thin(xyz)
    blocks = cut(thinned, settings.side_m)
    if blocks:
        probability = _spread(thinned, classifier.probabilities(thinned, blocks, progress))
        if settings.blunt:
            probability[by_shape.rail[thinned.band]] = 1.0
        found = np.flatnonzero((probability >= POSSIBLE) & settings.own(xyz[thinned.band]))
        point, sure = thinned.band[found], probability[found] >= PROBABILITY
        kept, standing = rails_of(xyz[point], sure, settings, _reach_m(thinned.coarse, point[sure]))
        rail[point[kept]] = True
        figures += replace(standing, blunt_m=by_shape.figures.blunt_m, blur_m2=by_shape.figures.blur_m2)
    shown = {name: getattr(by_shape.figures, name) for name in ("sharp_m", "round_m", "unsure_m", "clear_m")}
    return Classified(rail, replace(figures, points=int(rail.sum()), squares=int(rail.any()), **shown))


def _reach_m(coarse: Coarse, point: np.ndarray) -> float:
    """Return the distance within which lines are looked for, from the density around labelled points, (n,) numbers."""
    if not len(point):
        return REACH_M[0]
    per_m2 = np.median(coarse.count[coarse.cell[point]]) / COARSE_M**2
    return reach_at(per_m2)


def _spread(thinned: Thinned, probability: np.ndarray) -> np.ndarray:
    """Probabilities of all points in the zone of railheads, (m,), from those of the thinned points, (n,)."""
    seen = np.flatnonzero(np.isfinite(probability))
    count = min(NEAREST, len(seen))
    tree = cKDTree(thinned.place[seen, :3])
    away, near = tree.query(thinned.band_place, k=np.arange(1, count + 1), distance_upper_bound=2 * RAIL_VOXEL_M)
    known = np.isfinite(away)
    weight = np.where(known, 1 / np.square(np.maximum(away, NEAREST_M)), 0.0)
    values = np.where(known, probability[seen][np.where(known, near, 0)], 0.0)
    total = weight.sum(axis=1)
    return np.divide((weight * values).sum(axis=1), total, out=np.zeros(len(total)), where=total > 0)


def rails_of(xyz: np.ndarray, sure: np.ndarray, settings: Settings, reach_m: float) -> tuple[np.ndarray, SearchFigures]:
    """Choose among points of a square, (n, 3) metres from its corner, that may be on rails, and sum up their rails.

    Those that the network labels are `sure`, (n,) bool; the others are kept if they lie on the axis of a rail of these.
    Cells are compared within `reach_m`. Returns which points are kept, (n,) bool.
    """
    if not sure.any():
        return sure, SearchFigures()
    grid, cell = Grid.around(xyz[:, 0], xyz[:, 1], settings.cell_m)
    cells = np.unique(cell[sure])
    _, first = np.unique(grid.blocks(cells), return_index=True)
    marks = cells[np.sort(first)]
    highest = np.full(grid.shape[0] * grid.shape[1], -np.inf)
    np.maximum.at(highest, cell[sure], xyz[sure, 2])
    lines = find_lines(Marks(grid.middles(marks), highest[marks]), reach_m, LEVEL_M, THIN.beside_line_m)
    paired = have_partners(lines, settings.spacings_m, LEVEL_M)
    pairs = links(lines)
    wanted = _wanted(lines, paired, pairs, settings)
    kept = sure & wanted[cKDTree(grid.middles(marks)).query(xyz[:, :2])[1]]
    kept[~sure] = _continue(lines.of(wanted), xyz[~sure], settings.head_width_m)
    share_m = shares_of_length(lines, settings.head_width_m)
    along_m, across_m = beside_guide(lines, settings)
    figures = SearchFigures(
        points=int(kept.sum()),
        paired_m=float(share_m[wanted & paired].sum()),
        single_m=float(share_m[wanted & ~paired].sum()),
        cells=len(np.unique(cell[kept])),
        squares=int(kept.any()),
        along_m=float(along_m),
        across_m=float(across_m),
    )
    return kept, figures


def _continue(lines: Lines, xyz: np.ndarray, head_width_m: float) -> np.ndarray:
    """Return which points, (n, 3), lie on the heads of rails, (n,) bool."""
    near = Near.find(xyz[:, :2], lines)
    place = xyz[near.place]
    above = place[:, 2] - lines.height[near.cell]
    rise_m = GRADIENT * np.hypot(*(place[:, :2] - lines.axis[near.cell]).T)
    level = (above >= -DENSE.below_m - rise_m) & (above <= DENSE.above_m + rise_m)
    return near.on(head_width_m / 2 + DENSE.beside_m, level)


def _wanted(lines: Lines, paired: np.ndarray, pairs: np.ndarray, settings: Settings) -> np.ndarray:
    """Return which cells belong to rails that are long enough and that the user wants, (n,) bool."""
    low, high = lines.reach_m / 2, settings.side_m - lines.reach_m / 2
    open_ended = np.any((lines.axis < low) | (lines.axis > high), axis=1)
    wanted = long_enough(lines, pairs, paired, open_ended, settings.keep_single)
    if settings.guide is not None:
        wanted &= settings.guide.keeps(lines, pairs, settings.spacings_m, LEVEL_M)
    return wanted
