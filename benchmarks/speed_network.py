"""The tables of `speed.py` about the network: speed compared with plain PyTorch, and the effect of each shortcut."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from statistics import median

import numpy as np
import torch
from rail_extract.core.clouds.points import RailPoints
from rail_extract.core.frpdf import START
from rail_extract.core.frpdf.architecture import BASE, architecture_of, fold
from rail_extract.core.frpdf.cleanup import clean
from rail_extract.core.frpdf.corridor import Rectangle, lay_batches
from rail_extract.core.frpdf.engine import Engine
from rail_extract.core.frpdf.network import FRPDF, set_weights
from rail_extract.core.frpdf.onnx import to_onnx
from rail_extract.core.frpdf.opencv_engine import OpenCvEngine
from rail_extract.core.frpdf.torch_engine import TorchEngine
from rail_extract.core.pipeline import Parameters
from rail_extract.core.progress import SILENT
from rail_extract.core.rails import RailLine
from rail_extract.core.raster import RailRaster, cell_size, rasterize
from rail_extract.core.squares.steps import lines_of
from rail_extract.laboratory.ruler.lines import match

TILE = 512
"""Side in cells of the tile that plain PyTorch computes."""
SMALL_FIELD = 100_000
"""Number of cells per field that divides a short scene into several fields."""
DIAGONAL_M, CELL_M = 3000.0, 0.04
END_M = 0.5
"""Length left out at either end of a line, because lines may end a few centimetres apart."""
NEAR_M = 0.1
"""Distance in plan up to which lines are compared."""


@dataclass(frozen=True)
class Cut:
    """A short section of the sample, with the weights for it.

    Lines are not thinned, which may keep different vertices of the same curve.
    """

    points: RailPoints
    parameters: Parameters
    arrays: dict[str, np.ndarray]

    @property
    def raster(self) -> RailRaster:
        """Its rail raster."""
        return rasterize(self.points.xyz, cell_size(self.parameters.gauge_m, self.parameters.head_width_m))


def plain_network(arrays: dict[str, np.ndarray]) -> FRPDF:
    """Return the network as it is trained, in float32."""
    network = FRPDF(architecture_of(arrays))
    set_weights(network, arrays)
    return network.eval()


def open_vino(
    arrays: dict[str, np.ndarray], number_type: str, height: int, width: int
) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """Return a function that runs the first pass on OpenVINO, with as many threads as PyTorch has.

    It gives probabilities from raster and state, in float32 or bfloat16.
    """
    from openvino import Core

    settings = {
        "INFERENCE_PRECISION_HINT": {"float32": "f32", "bfloat16": "bf16"}[number_type],
        "INFERENCE_NUM_THREADS": torch.get_num_threads(),
        "PERFORMANCE_HINT": "LATENCY",
    }
    core = Core()
    model = core.compile_model(core.read_model(to_onnx(fold(arrays)[0], height, width), b""), "CPU", settings)
    return lambda raster, state: 1 / (1 + np.exp(-model(np.stack([raster, state])[None] * 2 - 1)[0][0, 0]))


def speed_table(cut: Cut, rounds: int, clock: Callable[[], float]) -> Iterable[str]:
    """Time the first pass, with the variants in turn, and yield the medians of seconds per megacell."""
    raster = cut.raster
    (field,) = lay_batches(raster, 1 << 40)
    row, column = raster.cells().min(axis=0)
    whole = Rectangle(int(row), int(column), TILE, TILE)
    tile = raster.read(*whole.window).astype(np.float32)
    seen = [raster.read(*piece.window).astype(np.float32) for piece in field.pieces]
    network, exact = plain_network(cut.arrays), TorchEngine(cut.arrays, "CPU", exact=True)
    fast, opencv = TorchEngine(cut.arrays, "CPU"), OpenCvEngine(cut.arrays)
    variants = {
        "eager PyTorch, float32, tile": (TILE**2, lambda: _eager(network, tile)),
        "folded, float32, tile": (TILE**2, lambda: _sweep(exact, [tile], [whole])),
        f"folded, {_number_type(fast)}, tile": (TILE**2, lambda: _sweep(fast, [tile], [whole])),
    }
    if find_spec("openvino"):
        for engine in (exact, fast):
            run = open_vino(cut.arrays, _number_type(engine), *tile.shape)
            title = f"OpenVINO, {_number_type(engine)}, tile"
            variants[title] = (TILE**2, lambda run=run: run(tile, _start(tile)))
    else:
        yield "OpenVINO is not installed and is left out: pip install openvino."
    cells = sum(one.size for one in seen)
    for title, engine in (
        ("PyTorch, float32", exact),
        (f"PyTorch, {_number_type(fast)}", fast),
        ("OpenCV, float32", opencv),
    ):
        variants[f"{title}, along the track"] = (cells, lambda engine=engine: _sweep(engine, seen, field.pieces))
    seconds: dict[str, list[float]] = {title: [] for title in variants}
    for _ in range(rounds + 1):
        for title, (size, run) in variants.items():
            gc.collect()
            start = clock()
            run()
            seconds[title].append((clock() - start) / size * 1e6)
    middle = {title: median(spent[1:]) for title, spent in seconds.items()}  # the first round is a warm-up
    eager = next(iter(middle.values()))
    yield f"{'One pass':40}{'s/Mcell':>9}{'times faster than eager':>25}"
    for title, spent in middle.items():
        yield f"{title:40}{spent:9.2f}{eager / spent:25.2f}"
    slower = middle["OpenCV, float32, along the track"] / middle["PyTorch, float32, along the track"]
    yield f"OpenCV takes {slower:.2f} times as long as PyTorch in float32"


def cells_table() -> Iterable[str]:
    """Yield the share of the bounding box that is computed for a double track on the diagonal."""
    along = np.arange(0.0, DIAGONAL_M, CELL_M / 2)[:, None] * [np.sqrt(0.5), np.sqrt(0.5)]
    across = np.array([-np.sqrt(0.5), np.sqrt(0.5)])
    raster = rasterize(np.concatenate([along + offset * across for offset in (0.0, 1.5, 4.0, 5.5)]), CELL_M)
    cells = raster.cells()
    height, width = (cells.max(axis=0) + 1 - cells.min(axis=0)).tolist()
    fields = lay_batches(raster, TorchEngine.max_cells)
    computed = sum(piece.height * piece.width for field in fields for piece in field.pieces)
    yield (
        f"Cells computed for {DIAGONAL_M / 1000:g} km of double track on the diagonal:"
        f" {100 * computed / (height * width):.2f} % of the bounding box"
    )


def changes_table(cut: Cut) -> Iterable[str]:
    """Yield the change that each shortcut makes, compared with the plain network in float32 on the whole cut."""
    raster = cut.raster
    exact, fast = TorchEngine(cut.arrays, "CPU", exact=True), TorchEngine(cut.arrays, "CPU")
    plain = _clean_whole(plain_network(cut.arrays), raster)
    pieces = clean(raster, exact)
    quick = clean(raster, fast)
    exact.max_cells = SMALL_FIELD
    rows = {
        "pieces along the track": (pieces, plain),
        f"{len(lay_batches(raster, SMALL_FIELD))} fields instead of one": (clean(raster, exact), pieces),
        f"{_number_type(fast)} instead of float32": (quick, pieces),
        "OpenCV instead of PyTorch": (clean(raster, OpenCvEngine(cut.arrays)), pieces),
        "all shortcuts of AUTO": (quick, plain),
    }
    yield f"{'Shortcut':40}{'cells, %':>9}{'lines, mm rms (worst line)':>28}"
    for title, (found, reference) in rows.items():
        yield f"{title:40}{100 * _changed(found, reference):9.2f}{_apart(cut, found, reference):28.2f}"


def _eager(network: FRPDF, tile: np.ndarray) -> None:
    with torch.no_grad():
        seen = torch.from_numpy(tile)[None, None]
        torch.sigmoid(network.logits(seen, torch.full_like(seen, START), 0)).numpy()


def _sweep(engine: Engine, seen: Sequence[np.ndarray], pieces: Sequence[Rectangle]) -> None:
    engine.sweep(seen, [_start(one) for one in seen], 0, pieces, SILENT)


def _start(raster: np.ndarray) -> np.ndarray:
    return np.full_like(raster, START)


def _number_type(engine: Engine) -> str:
    return engine.description.split(", ")[-1]


def _clean_whole(network: FRPDF, raster: RailRaster) -> RailRaster:
    """Run the plain network on the bounding box and on everything around it that it can see."""
    cells = raster.cells()
    corner = cells.min(axis=0) - BASE.receptive_radius
    height, width = (cells.max(axis=0) + 1 + BASE.receptive_radius - corner).tolist()
    with torch.inference_mode():
        seen = torch.from_numpy(raster.read(*corner.tolist(), height, width))[None, None]
        logits = network(seen.float())[-1][0, 0].numpy()
    return raster.with_cells(np.argwhere(logits >= 0) + corner)


def _changed(found: RailRaster, reference: RailRaster) -> float:
    """Return the share of rail cells that differ."""
    ours, theirs = (set(map(tuple, one.cells().tolist())) for one in (found, reference))
    return len(ours ^ theirs) / len(theirs)


def _apart(cut: Cut, found: RailRaster, reference: RailRaster) -> float:
    """Return the rms distance between the lines of two rasters, mm, for the worst line; NaN if their numbers differ."""
    ours, theirs = (lines_of(one, 10, cut.points, cut.parameters) for one in (found, reference))
    if len(ours) != len(theirs):
        return np.nan
    return 1000 * max(min(_distance_m(line, other) for other in theirs) for line in ours)


def _distance_m(line: RailLine, other: RailLine) -> float:
    """Return the rms distance of a line from another one, without its ends; infinite where it is too far away."""
    found = match([line.xyz], [other.xyz])
    inside = (found.t > END_M) & (found.t < found.t[-1] - END_M)
    distance, height = found.back.distance[inside], found.back.height[inside]
    return float(np.sqrt(np.mean(distance**2 + height**2))) if distance.max() <= NEAR_M else np.inf


CLOCKS = {"wall": time.perf_counter, "cpu": time.process_time}
