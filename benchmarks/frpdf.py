"""Compare networks that clean rail rasters on a fixed set of synthetic rasters.

The tables have the figures of Gribov and Chang, F1 by severity and by family, bridged gaps, removed lines, and the
scores on rare rasters: thin rails, ends of third rails, slips and open blades. Run
`python benchmarks/frpdf.py [NETWORK ...]`. A network is one of

- `weights.npz`: weights of FRPDF, with one pass and with two (`weights.npz@3`: with three only; `@0`: until fewer than
  0.1 % of the rail cells change from pass to pass, at most five passes);
- `unet=weights.npz`: weights of another network, from `python -m rail_extract train FOLDER --network unet`;
- `network.onnx`: from `(1, 1, height, width)`, 0 or 1, to the same shape, probability of rail;
- `pass1.onnx+pass2.onnx`: passes of FRPDF as `python -m rail_extract onnx` writes them (with `--side 1024`);
- `module:function`: a Python function from a `(height, width)` bool array to an array of bools or probabilities; the
  table shows its attribute `parameters` if it has one.

Each row runs in a separate process, so that its memory can be measured. The set: 1024 x 1024 cells of 4 cm, 132RE, each
family of layouts at each severity from 0.1 to 0.9, and rare rasters of 512 x 512. Nothing is trained or tuned with its
seeds.
"""

from __future__ import annotations

import argparse
import importlib
import multiprocessing
import resource
import sys
import time
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from rail_extract.core.frpdf import DEFAULT_PASSES
from rail_extract.core.frpdf.models import MODELS
from rail_extract.laboratory.rasters.distortion import Pair
from rail_extract.laboratory.rasters.layouts import FAMILIES, RARE_FAMILIES
from rail_extract.laboratory.rasters.pairs import BASE_RATIO, random_pair
from rail_extract.laboratory.training.evaluate import Cleaner, classical, cleaner_of
from rail_extract.laboratory.training.networks import TrainedNetwork
from rail_extract.laboratory.training.scores import Scores, bridged, score

SEED = 1024_2026
"""Different from the seeds of training and of `rail_extract evaluate`."""
SIDE = 1024
SEVERITIES = tuple(number / 10 for number in range(1, 10))
GAP_LENGTHS_M = (0.2, 0.5, 1.0, 2.0, 4.0, 8.0)
"""Limits of the classes of gaps; the last class also has overlapping gaps that are longer."""
TOLERANCES = (0, 1)
RARE = ("thin rails", *RARE_FAMILIES)
RARE_COUNT, RARE_SIDE, RARE_SEVERITY = 8, 512, 0.25


@dataclass
class Tally:
    """Figures of one cleaner.

    Attributes
    ----------
    scores : dict of (tolerance, key) to Scores
        The key is a severity, the name of a family, or "all".
    gaps : dict of class to [bridged, all]
    lines : list of int
        Cells of guard rails and lone lines: removed ones, all.
    rare : dict of str to Scores
        Within one cell, for each kind of rare rasters.
    seconds : float
        Per raster.
    memory_mib : float
        Peak of the process, or of the GPU if one is used.
    """

    name: str
    scores: dict = field(default_factory=lambda: defaultdict(Scores))
    gaps: dict = field(default_factory=lambda: defaultdict(lambda: [0, 0]))
    lines: list = field(default_factory=lambda: [0, 0])
    rare: dict = field(default_factory=lambda: defaultdict(Scores))
    parameters: int | None = None
    seconds: float = 0.0
    memory_mib: float = 0.0


def main() -> None:
    """Measure each row and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("networks", nargs="*", metavar="NETWORK", help="further rows")
    parser.add_argument("--count", type=int, default=set_size(), help="number of rasters to use (default: all)")
    parser.add_argument("--only", action="store_true", help="leave the standard rows out")
    arguments = parser.parse_args()
    standard = ["input", "closing", *(str(model.path) for model in MODELS)]
    rows = list(expand([*([] if arguments.only else standard), *arguments.networks]))
    with multiprocessing.get_context("spawn").Pool(1, maxtasksperchild=1) as processes:
        tallies = []
        for row in rows:
            tallies.append(processes.apply(measure, (row, arguments.count)))
            print(f"measured {row}", file=sys.stderr, flush=True)
    print("\n".join(report(tallies, arguments.count)))


def set_size() -> int:
    """Return the number of rasters in the set: each family at each severity once."""
    return len(FAMILIES) * len(SEVERITIES)


def benchmark_pair(number: int) -> tuple[str, float, Pair]:
    """Return family, severity and pair of a raster; the first rasters of the set vary in both."""
    family, severity = list(FAMILIES)[number % len(FAMILIES)], SEVERITIES[number % len(SEVERITIES)]
    return family, severity, random_pair(np.random.default_rng([SEED, number]), SIDE, severity, BASE_RATIO, family)


def rare_pair(kind: str, number: int) -> Pair:
    """Return the pair of a rare raster."""
    rng, family = np.random.default_rng([SEED, RARE.index(kind), number]), kind if kind in RARE_FAMILIES else None
    return random_pair(rng, RARE_SIDE, RARE_SEVERITY, BASE_RATIO, family, thin=family is None)


def expand(networks: Iterable[str]) -> Iterable[str]:
    """Yield a row for each number of passes of weights: `weights.npz@2`."""
    for network in networks:
        if network.endswith(".npz"):
            yield from (f"{network}@{passes}" for passes in range(1, DEFAULT_PASSES + 1))
        else:
            yield network


def measure(row: str, count: int) -> Tally:
    """Clean the first `count` rasters of the set and add up the figures."""
    cleaner, parameters = make_cleaner(row)
    cleaner(np.zeros((SIDE, SIDE), dtype=bool))
    tally = Tally(_title(row), parameters=parameters)
    for number in range(count):
        family, severity, pair = benchmark_pair(number)
        start = time.perf_counter()
        found = np.asarray(cleaner(pair.observed)) >= 0.5
        tally.seconds += (time.perf_counter() - start) / count
        for tolerance in TOLERANCES:
            for key in ("all", family, severity):
                tally.scores[tolerance, key] += score(found, pair.label, tolerance)
        for gap, whole in bridged(found, pair.gap).items():
            place = min(np.searchsorted(GAP_LENGTHS_M, pair.gap_lengths_m[gap - 1], "right"), len(GAP_LENGTHS_M) - 1)
            tally.gaps[int(place)][0] += whole
            tally.gaps[int(place)][1] += 1
        tally.lines[0] += int(np.count_nonzero(pair.distractor & ~found))
        tally.lines[1] += int(np.count_nonzero(pair.distractor))
    for kind in RARE:
        for number in range(min(count, RARE_COUNT)):
            pair = rare_pair(kind, number)
            tally.rare[kind] += score(np.asarray(cleaner(pair.observed)) >= 0.5, pair.label, tolerance=1)
    tally.memory_mib = _peak_mib()
    tally.gaps = dict(tally.gaps)
    tally.scores, tally.rare = dict(tally.scores), dict(tally.rare)
    return tally


def make_cleaner(row: str) -> tuple[Cleaner, int | None]:
    """Return the function of a row that cleans a raster, and its number of parameters if it is known."""
    if row == "input":
        return (lambda observed: observed), 0
    if row == "closing":
        return classical, 0
    if ".npz@" in row:
        name, rest = row.split("=", 1) if "=" in row else ("frpdf", row)
        path, passes = rest.rsplit("@", 1)
        network = TrainedNetwork(name, Path(path))
        return cleaner_of(network, int(passes)), network.parameter_count
    if row.endswith(".onnx"):
        return _onnx_cleaner(row.split("+"))
    module, name = row.split(":")
    sys.path.insert(0, ".")
    function = getattr(importlib.import_module(module), name)
    return function, getattr(function, "parameters", None)


def _onnx_cleaner(paths: Sequence[str]) -> tuple[Cleaner, int]:
    """Return a cleaner from ONNX files on OpenCV: a network from raster to probability, or the passes of FRPDF."""
    import cv2

    nets = [cv2.dnn.readNetFromONNX(path) for path in paths]
    layers = [nets[0].getLayer(nets[0].getLayerId(name)) for name in nets[0].getLayerNames()]
    parameters = sum(blob.size for layer in layers for blob in layer.blobs)
    if len(nets) > 1:
        return cleaner_of(_OnnxPasses(nets), len(nets)), parameters

    def clean(observed: np.ndarray) -> np.ndarray:
        nets[0].setInput(observed[None, None].astype(np.float32))
        return nets[0].forward()[0, 0]

    return clean, parameters


class _OnnxPasses:
    """Passes from one ONNX file each."""

    def __init__(self, nets: Sequence) -> None:
        self._nets = nets

    def probabilities(self, raster: np.ndarray, state: np.ndarray, number: int) -> np.ndarray:
        self._nets[number].setInput(np.stack([raster, state])[None] * 2 - 1)
        return 1 / (1 + np.exp(-self._nets[number].forward()[0, 0]))


def _peak_mib() -> float:
    torch = sys.modules.get("torch")
    if torch is not None and torch.cuda.is_initialized():
        return torch.cuda.max_memory_allocated() / 2**20
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def _title(row: str) -> str:
    if ".npz@" not in row:
        return " + ".join(Path(part).name for part in row.split("+"))
    path, passes = row.rsplit("@", 1)
    name = path.split("=")[0] if "=" in path else Path(path).stem
    return f"{name}, " + {"0": "until stable", "1": "1 pass"}.get(passes, f"{passes} passes")


def report(tallies: Sequence[Tally], count: int) -> Iterable[str]:
    """Yield the lines of the tables."""
    yield f"{count} of {set_size()} rasters of {SIDE} x {SIDE}; counts by cell"
    for tolerance in TOLERANCES:
        yield ""
        yield from _confusion(tallies, tolerance)
        yield from _parted(tallies, tolerance, SEVERITIES[:count], "by severity")
        yield from _parted(tallies, tolerance, list(FAMILIES)[:count], "by family")
    yield ""
    yield from _repairs(tallies)
    yield ""
    yield f"{'rare, within one cell':24}" + "".join(f"{kind:>22}" for kind in RARE)
    for tally in tallies:
        figures = [f"{s.precision:.3f} {s.recall:.3f} {s.f1:.3f}" for s in (tally.rare[kind] for kind in RARE)]
        yield f"{tally.name:24}" + "".join(f"{words:>22}" for words in figures)


def _confusion(tallies: Sequence[Tally], tolerance: int) -> Iterable[str]:
    yield (
        f"{_kind(tolerance):24}{'FN':>9}{'FP':>9}{'TP':>9}{'precision':>11}{'recall':>8}{'F1':>7}"
        f"{'parameters':>12}{'MiB':>7}{'s':>8}"
    )
    for tally in tallies:
        s = tally.scores[tolerance, "all"]
        parameters = "?" if tally.parameters is None else f"{tally.parameters:,}"
        yield (
            f"{tally.name:24}{s.fn:9d}{s.fp:9d}{s.tp:9d}{s.precision:11.3f}{s.recall:8.3f}{s.f1:7.3f}"
            f"{parameters:>12}{tally.memory_mib:7.0f}{tally.seconds:8.3f}"
        )


def _parted(tallies: Sequence[Tally], tolerance: int, keys: Sequence, title: str) -> Iterable[str]:
    yield ""
    yield f"{'F1 ' + title:24}" + "".join(f"{str(key):>12}" for key in keys)
    for tally in tallies:
        yield f"{tally.name:24}" + "".join(f"{tally.scores[tolerance, key].f1:12.3f}" for key in keys)


def _repairs(tallies: Sequence[Tally]) -> Iterable[str]:
    classes = range(1, len(GAP_LENGTHS_M))
    names = [f"{GAP_LENGTHS_M[place - 1]:g} to {GAP_LENGTHS_M[place]:g} m" for place in classes]
    yield f"{'gaps bridged, %':24}" + "".join(f"{name:>12}" for name in names) + f"{'lines removed, %':>20}"
    for tally in tallies:
        shares = [100 * done / max(every, 1) for done, every in (tally.gaps.get(place, (0, 0)) for place in classes)]
        lines = 100 * tally.lines[0] / max(tally.lines[1], 1)
        yield f"{tally.name:24}" + "".join(f"{share:12.1f}" for share in shares) + f"{lines:20.1f}"
    numbers = [tallies[0].gaps.get(place, (0, 0))[1] for place in classes] if tallies else []
    yield f"{'number of gaps':24}" + "".join(f"{number:12d}" for number in numbers)


def _kind(tolerance: int) -> str:
    return "within one cell" if tolerance else "strict"


if __name__ == "__main__":
    main()
