"""Trained weights on disk, and the probabilities that they give."""

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

SHIPPED = FOLDER / "rail_classifier.npz"
"""Weights trained on simulated clouds of a scanner on a train; models/MODEL_CARD.md describes them."""

WEIGHTS_SUFFIX = ".npz"

AT_ONCE = 8 * MAX_POINTS
"""Points that go through the network at once: some 300 MB."""

NO_TORCH = "{} needs PyTorch: install it with the algorithm Install packages, or with pip install torch."


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
