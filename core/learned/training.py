"""Train the network on labelled blocks: seeded, resumable, on the CPU or CUDA.

The same settings and blocks give the same weights on the same CPU, whether the training was interrupted or not; a GPU
adds up in varying order.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from ..errors import Cancelled, ModelError, ParameterError
from ..kernels import device_of
from ..progress import SILENT, Progress
from .blocks import Examples
from .model import in_groups, inputs, load
from .network import RandLaNet, parameter_count

BATCH = 8
"""Blocks of a step, half of them with rails: most of a cloud has none."""

RATE, RATE_AGAIN = 6e-3, 2e-3
"""Largest learning rate, from random weights and from weights that have learned before: a higher one would undo what
they know. It rises over `WARM_UP_STEPS` and falls as a cosine."""
WARM_UP_STEPS = 20
WEIGHT_DECAY = 1e-4
MAX_GRADIENT = 1.0
MAX_WEIGHT = 10.0
"""Largest weight of rail points: the inverse of their share beyond it would reward labelling what is beside them."""

CHECKPOINT_STEPS = 25
"""Steps between two checkpoints: less than a minute on a CPU."""
CHECKS = 20
"""How many times during a training the blocks kept back are evaluated, to draw the curve."""
CHECK_BLOCKS = 150
"""Most blocks of these evaluations; the last one takes all."""

TURN = 2 * np.pi
SCALING, SLOPE = 0.05, 0.04
"""Largest change of the scale and of the slope of a block in training."""
NOISE_M, HEIGHT_NOISE_M = 0.012, 0.02
"""Largest standard deviation of noise that is added to a block, and of the change of its height above the bed: that
depends on how the bed is seen."""
LEAST_KEPT = 0.15
"""Least share of a block's points that stay: other scanners and greater distances give thinner clouds. Of the 40 points
per metre that thinning leaves on a rail seen from a train, 6 stay, as many as a cloud of 80 points per m² has there."""

LOGIT_STEP, MAX_LOGIT = 0.05, 8.0
"""Step and range of the search for the bias of the output."""

SAME_F1 = 1e-4
"""Biases whose F1 differs by less are equally good; the smallest change is taken: a few blocks may have no mistakes."""

CHECKPOINT = "checkpoint.pt"


@dataclass(frozen=True)
class TrainingSettings:
    """What determines the weights, besides the blocks: each block with rails is learned from in every epoch.

    `start` has weights to start from; None means random ones.
    """

    epochs: int
    seed: int = 0
    start: Path | None = None


@dataclass(frozen=True)
class LabelFigures:
    """Labels compared with the truth: rail points found and missed, and other points that were taken for rail."""

    right: int = 0
    missed: int = 0
    wrong: int = 0

    def __add__(self, other: LabelFigures) -> LabelFigures:
        return LabelFigures(self.right + other.right, self.missed + other.missed, self.wrong + other.wrong)

    @classmethod
    def of(cls, found: np.ndarray, points: np.ndarray) -> LabelFigures:
        """Count what thinned points, (n,) of `examples.POINT`, stand for; those found, (n,) bool."""
        rails, others = points["rails"], points["others"]
        return cls(int(rails[found].sum()), int(rails[~found].sum()), int(others[found].sum()))

    @property
    def recall(self) -> float:
        """Share of the rail points that were found; NaN without any."""
        return _share(self.right, self.right + self.missed)

    @property
    def precision(self) -> float:
        """Share of the points found that are on rails; NaN without any."""
        return _share(self.right, self.right + self.wrong)

    @property
    def f1(self) -> float:
        """Harmonic mean of both; NaN without rail points."""
        return _share(2 * self.right, 2 * self.right + self.missed + self.wrong)


def _share(part: int, whole: int) -> float:
    return part / whole if whole else math.nan


@dataclass(frozen=True)
class Check:
    """The state of a training after `step` steps: mean loss since the last check, and figures of blocks kept back."""

    step: int
    loss: float
    figures: LabelFigures


@dataclass(frozen=True)
class Trained:
    """The result of a training: blocks learned from, blocks kept back, and their figures by tile of the cloud."""

    network: RandLaNet
    checks: tuple[Check, ...]
    by_tile: dict[int, LabelFigures]
    blocks: int
    kept_back: int
    steps: int

    @property
    def total(self) -> LabelFigures:
        """Figures of all blocks kept back."""
        return sum(self.by_tile.values(), LabelFigures())

    @property
    def parameters(self) -> int:
        """Number of weights."""
        return parameter_count(self.network)


def train(
    examples: Examples, settings: TrainingSettings, folder: Path, device: str = "AUTO", progress: Progress = SILENT
) -> Trained:
    """Train from the beginning, or from the checkpoint in a folder, on the device AUTO, CPU or CUDA.

    Cancelled, the training leaves a checkpoint. Raises ParameterError if the labelled rails lie in one place, or the
    checkpoint belongs to another training; ModelError if there is no CUDA device, it has too little memory, or the
    weights to start from are missing or something else.
    """
    kept_back = examples.validation(settings.seed)
    run = _Run(examples, settings, np.flatnonzero(~kept_back), np.flatnonzero(kept_back), folder, device_of(device))
    run.resume()
    try:
        with _repeatable(run.device):
            run.learn(progress)
        run.calibrate()
        by_tile = run.evaluated_by_tile()
    except torch.cuda.OutOfMemoryError:
        raise ModelError(
            f"The graphics card has too little free memory for {BATCH} blocks at once: close other programs, or set "
            f"DEVICE to CPU. The training continues from {folder}."
        ) from None
    return Trained(run.network, tuple(run.checks), by_tile, len(run.learned), len(run.kept_back), run.total)


@contextmanager
def _repeatable(device: str) -> Iterator[None]:
    """Let several threads of a CPU add up gradients in the same order every time."""
    before = torch.are_deterministic_algorithms_enabled()
    torch.use_deterministic_algorithms(before or device == "cpu")
    try:
        yield
    finally:
        torch.use_deterministic_algorithms(before)


class _Run:
    """A training at one of its steps."""

    def __init__(
        self,
        examples: Examples,
        settings: TrainingSettings,
        learned: np.ndarray,
        kept_back: np.ndarray,
        folder: Path,
        device: str,
    ) -> None:
        self.examples, self.settings = examples, settings
        self.learned, self.kept_back = learned, kept_back
        self.folder, self.device = folder, device
        has_rail = examples.index["rail"][learned] > 0
        self.with_rail, self.without = learned[has_rail], learned[~has_rail]
        self.per_step = BATCH // 2 if len(self.without) else BATCH
        self.total = math.ceil(settings.epochs * len(self.with_rail) / self.per_step)
        torch.manual_seed(settings.seed)
        self.network = (load(settings.start) if settings.start else RandLaNet()).to(device)
        self.rate = RATE_AGAIN if settings.start else RATE
        self.optimizer = torch.optim.AdamW(self.network.parameters(), RATE, weight_decay=WEIGHT_DECAY)
        self.step = 0
        self.losses: list[float] = []
        self.checks: list[Check] = []
        self.weight = self._rail_weight()

    def learn(self, progress: Progress) -> None:
        """Train up to the last step."""
        every = max(self.total // CHECKS, 1)
        if self.step:
            progress.info(f"Continuing the training at step {self.step} of {self.total}.")
        while self.step < self.total:
            if progress.is_cancelled():
                self.save()
                raise Cancelled(
                    f"Cancelled at step {self.step} of {self.total}: the same run continues from {self.folder}."
                )
            self.losses.append(self._learn_step())
            self.step += 1
            if self.step % every == 0 or self.step == self.total:
                self._check(progress)
            if self.step % CHECKPOINT_STEPS == 0 or self.step == self.total:
                self.save()
            progress.set_fraction(self.step / self.total)

    def _check(self, progress: Progress) -> None:
        chosen = self.kept_back[:: math.ceil(len(self.kept_back) / CHECK_BLOCKS)]
        figures = sum(
            (LabelFigures.of(logits > 0, core) for _, logits, core in self._evaluated(chosen)), LabelFigures()
        )
        self.checks.append(Check(self.step, float(np.mean(self.losses)), figures))
        self.losses.clear()
        progress.info(
            f"Step {self.step} of {self.total}: loss {self.checks[-1].loss:.3f}; kept back: recall "
            f"{figures.recall:.3f}, precision {figures.precision:.3f}"
        )

    def _learn_step(self) -> float:
        """Change the weights by the blocks of one step; returns the loss."""
        self.network.train()
        share = share_of_rate(self.step, self.total)
        for group in self.optimizer.param_groups:
            group["lr"] = self.rate * share
        rng = np.random.RandomState([self.settings.seed, 1, self.step])
        blocks = [varied(self.examples.block(number), rng) for number in self._chosen()]
        logits = self.network(*inputs([block["place"] for block in blocks], self.device))
        points = np.concatenate(blocks)
        core = torch.from_numpy(points["core"]).to(self.device)
        rail = torch.from_numpy(points["rail"].astype(np.float32)).to(self.device)
        loss = functional.binary_cross_entropy_with_logits(logits[core], rail[core], pos_weight=self.weight)
        self.optimizer.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), MAX_GRADIENT)
        self.optimizer.step()
        return float(loss.detach())

    def _chosen(self) -> list[int]:
        """Numbers of the blocks of the step: each epoch takes all blocks with rails in another order."""
        chosen = []
        for group, count in ((self.with_rail, self.per_step), (self.without, BATCH - self.per_step)):
            for place in range(self.step * count, (self.step + 1) * count):
                epoch, rank = divmod(place, len(group))
                order = np.random.RandomState([self.settings.seed, 2, epoch, len(group)]).permutation(len(group))
                chosen.append(int(group[order[rank]]))
        return chosen

    def _rail_weight(self) -> Tensor:
        """Weight of rail points, by their share of the blocks with rails."""
        rails = others = 0
        for number in self.with_rail[:: math.ceil(len(self.with_rail) / CHECK_BLOCKS)]:
            points = self.examples.block(int(number))
            rails += int((points["rail"] & points["core"]).sum())
            others += int((~points["rail"] & points["core"]).sum())
        return torch.tensor(min(max(others / rails, 1.0), MAX_WEIGHT), dtype=torch.float32, device=self.device)

    @torch.no_grad()
    def _evaluated(self, numbers: np.ndarray) -> list[tuple[int, np.ndarray, np.ndarray]]:
        """Compute numbers of blocks, and the logits of the points in their cores, with the points."""
        self.network.eval()
        found = []
        counts = self.examples.index["count"][numbers].tolist()
        for group in in_groups(counts):
            blocks = [self.examples.block(int(numbers[place])) for place in group]
            logits = self.network(*inputs([block["place"] for block in blocks], self.device)).cpu().numpy()
            ends = np.cumsum([len(block) for block in blocks])[:-1]
            for place, block, values in zip(group, blocks, np.split(logits, ends)):
                found.append((int(numbers[place]), values[block["core"]], block[block["core"]]))
        return found

    def calibrate(self) -> None:
        """Change the bias of the output, in place, so that F1 of the blocks kept back is largest at probability 0.5."""
        edges = np.arange(-MAX_LOGIT, MAX_LOGIT + LOGIT_STEP, LOGIT_STEP)
        rails, others = np.zeros((2, len(edges) - 1))
        for _, logits, core in self._evaluated(self.kept_back):
            logits = np.clip(logits, -MAX_LOGIT, MAX_LOGIT - LOGIT_STEP / 2)
            rails += np.histogram(logits, edges, weights=core["rails"])[0]
            others += np.histogram(logits, edges, weights=core["others"])[0]
        found, invented = (np.cumsum(counts[::-1])[::-1] for counts in (rails, others))
        f1 = 2 * found / np.maximum(found + invented + rails.sum(), 1)
        best = min(edges[:-1][f1 >= f1.max() - SAME_F1].tolist(), key=abs)
        with torch.no_grad():
            self.network.head[-1].bias -= best

    def evaluated_by_tile(self) -> dict[int, LabelFigures]:
        """Compare the labels of the blocks kept back with the truth, by tile."""
        by_tile: dict[int, LabelFigures] = {}
        for number, logits, core in self._evaluated(self.kept_back):
            tile = int(self.examples.index["tile"][number])
            by_tile[tile] = by_tile.get(tile, LabelFigures()) + LabelFigures.of(logits > 0, core)
        return dict(sorted(by_tile.items()))

    def save(self) -> None:
        """Write the checkpoint; the old one stays until the new one is complete."""
        checks = [[one.step, one.loss, *asdict(one.figures).values()] for one in self.checks]
        state: dict[str, Any] = {
            "network": self.network.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            "step": self.step,
            "losses": self.losses,
            "checks": checks,
            "identity": self._identity(),
        }
        torch.save(state, self.folder / "checkpoint.new")
        (self.folder / "checkpoint.new").replace(self.folder / CHECKPOINT)

    def resume(self) -> None:
        """Load the checkpoint, if there is one; one that is damaged or belongs to another training is refused."""
        path = self.folder / CHECKPOINT
        if not path.exists():
            return
        try:
            state = torch.load(path, map_location=self.device, weights_only=True)
            is_same = state["identity"] == self._identity()
            if is_same:
                self._restore(state)
        except Exception as error:  # a damaged file raises any of a dozen errors
            raise ParameterError(f"{path} is damaged: delete the folder {self.folder} and train again.") from error
        if not is_same:
            raise ParameterError(
                f"{self.folder} holds another training, with other clouds or settings: delete it, or choose another "
                "name for the weights."
            )

    def _restore(self, state: dict[str, Any]) -> None:
        self.network.load_state_dict(state["network"])
        self.optimizer.load_state_dict(state["optimizer"])
        self.step, self.losses = state["step"], list(state["losses"])
        self.checks = [Check(int(step), loss, LabelFigures(*map(int, rest))) for step, loss, *rest in state["checks"]]

    def _identity(self) -> list[int]:
        """Return what must be the same in a training that continues."""
        index, settings = self.examples.index, self.settings
        start = zlib.crc32(settings.start.read_bytes()) if settings.start else 0
        size = [len(index), *(int(index[name].sum()) for name in ("count", "rail"))]
        return [settings.epochs, settings.seed, start, *size]


def share_of_rate(step: int, total: int) -> float:
    """Return the learning rate of a step, as a share of the largest one."""
    rise = min((step + 1) / WARM_UP_STEPS, 1.0)
    fall = 0.5 * (1 + math.cos(math.pi * step / total))
    return rise * max(fall, 1e-3)


def varied(block: np.ndarray, rng: np.random.RandomState) -> np.ndarray:
    """Turn, mirror, scale and tilt a block, (n,) of `examples.POINT`, thin it and add noise."""
    kept = rng.random_sample(len(block)) < rng.uniform(LEAST_KEPT, 1.0)
    if not (kept & block["core"]).any():
        kept[:] = True
    block = block[kept].copy()
    angle, mirror = rng.uniform(0, TURN), rng.choice([-1.0, 1.0])
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    place = block["place"].astype(float)
    place[:, :2] = place[:, :2] @ turn * [mirror, 1.0] * rng.uniform(1 - SCALING, 1 + SCALING)
    place[:, 2] += place[:, :2] @ rng.uniform(-SLOPE, SLOPE, 2)
    noise = rng.standard_normal((len(place), 3)) * rng.uniform(0, NOISE_M)
    place[:, :3] += noise
    place[:, 3] += noise[:, 2] + HEIGHT_NOISE_M * rng.standard_normal()
    block["place"] = place
    return block
