"""Train FRPDF, or a network to compare it with, on synthetic pairs: seeded, logged and resumable, on the CPU or CUDA.

Loss on every pass, no gradient through the feedback, shared weights, batch statistics per pass; see
docs/network.md.
"""

from __future__ import annotations

import argparse
import csv
import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
import torch
from scipy import ndimage
from torch import Tensor
from torch.nn import functional

from ...core.errors import ParameterError
from ...core.frpdf import DEFAULT_PASSES, OUTPUT_THRESHOLD, START, STATISTICS
from ...core.frpdf.network import PassBatchNorm2d, Recurrent, feedback, set_weights, weights_of
from ...core.frpdf.weights import load_arrays, save_arrays
from ..rasters.distortion import Pair
from ..rasters.pairs import ratio_near, training_pair
from .gradients import move, train_on_cpu
from .learning_curves import draw_curves
from .networks import NETWORKS, output_bias
from .optimizers import Optimizers
from .scores import Scores, score

CROPS = ((256, 4), (384, 2), (512, 1))
"""Side and number of the crops of a step, of similar cost; the large ones train the outer taps of wide dilations."""
CROP_SHARES = (0.2, 0.3, 0.5)
LAST_CROP = 1024
"""Side of the single crop of each of the last steps. The widest dilation reaches 381 cells in each direction; only in
such a crop do most cells have all of its inputs."""
LAST_SHARE = 0.01
"""Share of the steps with this crop; each takes as long as four of the others."""
HARD_WEIGHT, HARD_REACH = 5.0, 2
"""Weight in the entropy, and distance in cells, of cells near a gap, a guard rail or a lone line, whether rail or not:
they are few, and lines depend on them. The weight makes the output find too few cells, which `calibrate` corrects."""
EARLY_PASS_WEIGHT = 0.5
"""Weight of the loss of each pass before the last one."""
OUTPUT_BIAS = -4.0
"""Initial bias of the output layer, near the share of rail cells in a raster. From 0, the first hundred steps would
only learn that there are few."""
MAX_GRADIENT = 1.0
WARM_UP_STEPS = 40
STATISTICS_STEPS = 60
"""Number of steps over which the batch statistics of the final weights are averaged."""
CHECKPOINT_STEPS = 50
CALIBRATION_STEPS, CALIBRATION_ROUNDS = 30, 2
"""Number of steps from which the bias of the output is determined, and rounds: the feedback between passes changes with
the bias."""
LOGIT_BIN, MAX_LOGIT = 0.05, 8.0
"""Step and range of the search for the bias: a step changes F1 by less than 0.0005."""
DATA, STATISTICS_DATA, CALIBRATION_DATA = 0, 1, 2
"""Streams of random numbers; evaluation uses others."""


@dataclass(frozen=True)
class Settings:
    """Settings of a training.

    The same settings give the same weights on the same CPU; a GPU adds up in varying order.

    Attributes
    ----------
    steps : int
        Steps of the whole training.
    rate : float
        Largest learning rate.
    device : str
        "cpu" or "cuda".
    start : Path, optional
        Weights to start from.
    network : str
        One of `networks.NETWORKS`.
    ratio : float, optional
        Gauge divided by railhead width, to train a specialized model.
    """

    steps: int
    rate: float
    seed: int
    device: str
    start: Path | None = None
    network: str = "frpdf"
    passes: int = DEFAULT_PASSES
    ratio: float | None = None


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument("folder", type=Path, help="for checkpoint.pt, log.csv, curves.png and weights.npz")
    parser.add_argument("--steps", type=int, default=1000, help="steps of the whole training (default 1000)")
    parser.add_argument("--minutes", type=float, default=math.inf, help="stop after this time; the next call continues")
    parser.add_argument("--rate", type=float, default=3e-3, help="largest learning rate (default 0.003)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--start", type=Path, help="weights (.npz) to start from")
    parser.add_argument("--ratio", type=float, help="gauge divided by railhead width to specialize in (default: all)")
    parser.add_argument("--network", choices=NETWORKS, default="frpdf", help="network to train (default frpdf)")
    parser.add_argument("--passes", type=int, default=DEFAULT_PASSES, help=f"passes (default {DEFAULT_PASSES})")
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Start or continue a training, and export the weights once it is complete."""
    settings = Settings(**{field.name: getattr(arguments, field.name) for field in fields(Settings)})
    arguments.folder.mkdir(parents=True, exist_ok=True)
    network = train(settings, arguments.folder, arguments.minutes)
    if network is None:
        print(f"Stopped before the last step; the same command continues from {arguments.folder / 'checkpoint.pt'}.")
        return
    recompute_statistics(network, settings)
    calibrate(network, settings)
    save_arrays(arguments.folder / "weights.npz", weights_of(network))
    print(f"Wrote {arguments.folder / 'weights.npz'}.")


def train(settings: Settings, folder: Path, minutes: float) -> Recurrent | None:
    """Train up to the last step, or for a number of minutes; None if the time was over before the last step.

    The folder is for the checkpoint, from which a training continues, and for the log.
    """
    torch.manual_seed(settings.seed)
    network = new_network(settings)
    optimizer = Optimizers(network)
    first = _resume(folder / "checkpoint.pt", settings, network, optimizer)
    until = time.monotonic() + 60 * minutes
    for step in range(first, settings.steps):
        started = time.monotonic()
        rate = learning_rate(step, settings)
        losses, scores = _learn(network, optimizer, rate, settings.passes, batch(settings, DATA, step))
        _log(folder / "log.csv", step, rate, losses, scores, time.monotonic() - started)
        done = step + 1
        out_of_time = time.monotonic() > until
        if done % CHECKPOINT_STEPS == 0 or out_of_time or done == settings.steps:
            state = {"network": network.state_dict(), "optimizer": optimizer.state_dict(), "step": done}
            state["settings"] = _plain(settings)
            torch.save(state, folder / "checkpoint.new")
            (folder / "checkpoint.new").replace(folder / "checkpoint.pt")
            draw_curves(folder / "log.csv", folder / "curves.png")
        if out_of_time and done < settings.steps:
            return None
    return network


def new_network(settings: Settings) -> Recurrent:
    """Build the network, untrained or with the weights of a file, on its device."""
    network = NETWORKS[settings.network]()
    torch.nn.init.constant_(output_bias(network), OUTPUT_BIAS)
    if settings.start is not None:
        set_weights(network, load_arrays(settings.start))
    if settings.device == "cpu":
        train_on_cpu(network)
    move(network, settings.device)
    return network


def learning_rate(step: int, settings: Settings) -> float:
    """Return the rate of a step: it rises during the warm-up, then falls as a cosine to a thousandth."""
    rise = min((step + 1) / WARM_UP_STEPS, 1.0)
    fall = 0.5 * (1 + math.cos(math.pi * step / settings.steps))
    return settings.rate * rise * max(fall, 1e-3)


def batch(settings: Settings, stream: int, step: int) -> tuple[Tensor, Tensor, Tensor]:
    """Draw observed rasters, labels and weights of cells, (n, 1, side, side), from a stream of random numbers."""
    rng = np.random.default_rng([settings.seed, stream, step])
    side, count = CROPS[rng.choice(len(CROPS), p=CROP_SHARES)]
    if stream == DATA and step >= (1 - LAST_SHARE) * settings.steps:
        side, count = LAST_CROP, 1
    ratios = [None if settings.ratio is None else ratio_near(rng, settings.ratio) for _ in range(count)]
    pairs = [training_pair(rng, side, ratio) for ratio in ratios]
    rasters = zip(*((pair.observed, pair.label, cell_weights(pair)) for pair in pairs))
    observed, label, weight = (
        torch.from_numpy(np.stack(one)[:, None].astype(np.float32))
        .to(settings.device)
        .contiguous(memory_format=torch.channels_last)
        for one in rasters
    )
    return observed, label, weight


def cell_weights(pair: Pair) -> np.ndarray:
    """Return the weights of the cells of a pair, (size, size): `HARD_WEIGHT` near gaps and false rails, otherwise 1."""
    hard = ndimage.binary_dilation((pair.gap > 0) | pair.distractor, np.ones((3, 3)), iterations=HARD_REACH)
    return np.where(hard, HARD_WEIGHT, 1.0)


def run_passes(network: Recurrent, observed: Tensor, passes: int) -> Iterator[Tensor]:
    """Run passes in bfloat16 and yield the float logits of each; the caller may compute gradients in between."""
    state = torch.full_like(observed, START)
    for number in range(passes):
        with torch.autocast(observed.device.type, torch.bfloat16):
            logits = network.logits(observed, state, number)
        yield logits.float()
        state = feedback(logits.float()).to(observed.dtype)


def loss_of(logits: Tensor, label: Tensor, weight: Tensor) -> Tensor:
    """Compute weighted binary cross entropy plus soft Dice: with entropy alone, training starts slowly."""
    probability = torch.sigmoid(logits)
    dice = 1 - (2 * (probability * label).sum() + 1) / (probability.sum() + label.sum() + 1)
    return functional.binary_cross_entropy_with_logits(logits, label, weight) * ENTROPY_WEIGHT + dice


ENTROPY_WEIGHT = 5.0
"""Makes the entropy, a few hundredths per cell, about as large as Dice."""


def _learn(
    network: Recurrent, optimizer: Optimizers, rate: float, passes: int, pairs: tuple[Tensor, Tensor, Tensor]
) -> tuple[list[float], list[Scores]]:
    observed, label, weight = pairs
    network.train()
    optimizer.zero_grad()
    losses, scores = [], []
    for number, logits in enumerate(run_passes(network, observed, passes), start=1):
        loss = loss_of(logits, label, weight)
        (loss if number == passes else EARLY_PASS_WEIGHT * loss).backward()
        losses.append(float(loss.detach()))
        found = torch.sigmoid(logits.detach()) >= OUTPUT_THRESHOLD
        scores.append(score(found.cpu().numpy(), label.cpu().numpy() > 0.5))
    torch.nn.utils.clip_grad_norm_(network.parameters(), MAX_GRADIENT)
    optimizer.step(rate)
    return losses, scores


@torch.no_grad()
def recompute_statistics(network: Recurrent, settings: Settings) -> None:
    """Average the batch statistics of each kind of pass over many batches, because running averages lag the weights."""
    network.train()
    layers = [module for module in network.modules() if isinstance(module, PassBatchNorm2d)]
    for step in range(STATISTICS_STEPS):
        for layer in layers:
            layer.momentum = 1.0 / (step + 1)
        observed, *_ = batch(settings, STATISTICS_DATA, step)
        for _ in run_passes(network, observed, max(settings.passes, STATISTICS)):
            pass


@torch.no_grad()
def calibrate(network: Recurrent, settings: Settings) -> None:
    """Change the bias of the output, in place, so that F1 is largest at `OUTPUT_THRESHOLD`; see `HARD_WEIGHT`."""
    network.eval()
    edges = torch.arange(-MAX_LOGIT, MAX_LOGIT, LOGIT_BIN)
    for _ in range(CALIBRATION_ROUNDS):
        rails, others = np.zeros((2, len(edges) - 1))
        for step in range(CALIBRATION_STEPS):
            observed, label, _ = batch(settings, CALIBRATION_DATA, step)
            *_, logits = run_passes(network, observed, settings.passes)
            logits = logits.clamp(-MAX_LOGIT + LOGIT_BIN, MAX_LOGIT - 2 * LOGIT_BIN).cpu()
            rails += torch.histogram(logits[label.cpu() > 0.5], edges)[0].numpy()
            others += torch.histogram(logits[label.cpu() <= 0.5], edges)[0].numpy()
        found, invented = (np.cumsum(counts[::-1])[::-1] for counts in (rails, others))
        best = float(edges[int(np.argmax(2 * found / (found + invented + rails.sum())))])
        output_bias(network).sub_(best - math.log(OUTPUT_THRESHOLD / (1 - OUTPUT_THRESHOLD)))


def _plain(settings: Settings) -> dict[str, str]:
    """Return the settings that determine the weights, as text."""
    return {field.name: str(getattr(settings, field.name)) for field in fields(settings) if field.name != "device"}


def _resume(path: Path, settings: Settings, network: Recurrent, optimizer: Optimizers) -> int:
    """Load a checkpoint if there is one, and return the number of the next step.

    Raises ParameterError if it belongs to another training.
    """
    if not path.exists():
        return 0
    state = torch.load(path, weights_only=True)
    others = {name: value for name, value in _plain(settings).items() if state["settings"].get(name) != value}
    if others:
        stated = ", ".join(f"--{name} {state['settings'].get(name)}" for name in others)
        raise ParameterError(f"{path.parent} has a training with {stated}: use the same values, or another folder.")
    network.load_state_dict(state["network"])
    optimizer.load_state_dict(state["optimizer"])
    return state["step"]


def _log(path: Path, step: int, rate: float, losses: list[float], scores: list[Scores], seconds: float) -> None:
    new = not path.exists()
    with path.open("a", newline="") as file:
        writer = csv.writer(file)
        if new:
            names = [f"{name}_{number + 1}" for name in ("loss", "f1") for number in range(len(losses))]
            writer.writerow(["step", "rate", *names, "seconds"])
        figures = [f"{loss:.4f}" for loss in losses] + [f"{s.f1:.4f}" for s in scores]
        writer.writerow([step, f"{rate:.2e}", *figures, f"{seconds:.2f}"])
