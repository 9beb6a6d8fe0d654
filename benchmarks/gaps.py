"""Print the share of gaps that the network bridges, by length, and its F1 at other ratios of gauge to railhead.

Run `python benchmarks/gaps.py [WEIGHTS.npz]`. Gaps: plain, curved and parallel tracks at severity 0.1, each with one
rectangular gap in a rail or in both rails. Ratios: rasters as in the main benchmark.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from rail_extract.core.frpdf import DEFAULT_PASSES
from rail_extract.core.frpdf.models import MODELS
from rail_extract.laboratory.rasters.distortion import Pair
from rail_extract.laboratory.rasters.layouts import FAMILIES
from rail_extract.laboratory.rasters.pairs import BASE_RATIO, CELL_M, RATIO_TOLERANCE, RATIOS, SPACING_M, random_pair
from rail_extract.laboratory.training.evaluate import Cleaner, cleaner_of
from rail_extract.laboratory.training.networks import TrainedNetwork
from rail_extract.laboratory.training.scores import Scores, bridged, score

SEED = 3_2026
"""Different from the seeds of training and of the other benchmarks."""
SIDE = 512
SEVERITY = 0.1
TRACKS = ("plain", "curve", "parallel")
LENGTHS_M = (0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0)
RAIL_REACH_M = 0.3
"""Half the width of a gap in one rail: it clears foot and noise, but not the next rail."""
TRACK_REACH_M = 0.5 * SPACING_M + RAIL_REACH_M
DIRECTION_M = 1.0
"""Distance of the cells that determine the direction of a rail at its gap."""
FACTORS = (1.0, 1 - RATIO_TOLERANCE, 1 + RATIO_TOLERANCE)
STANDARDS = (RATIOS[0], 16.5, 20.2, 22.2, 24.5, RATIOS[1])


def main() -> None:
    """Print the two tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("weights", nargs="?", type=Path, default=MODELS[0].path)
    parser.add_argument("--count", type=int, default=60, help="number of rasters of each kind (default 60)")
    arguments = parser.parse_args()
    cleaner = cleaner_of(TrainedNetwork("frpdf", arguments.weights), DEFAULT_PASSES)
    print("gaps bridged, %".ljust(24) + "".join(f"{length:>7g} m" for length in LENGTHS_M))
    for name, reach_m in (("one rail", RAIL_REACH_M), ("both rails", TRACK_REACH_M)):
        shares = [bridged_share(cleaner, length, reach_m, arguments.count) for length in LENGTHS_M]
        print(name.ljust(24) + "".join(f"{100 * share:9.1f}" for share in shares), flush=True)
    print("\n" + "gauge over railhead".ljust(24) + f"{'strict F1':>10}{'within one cell':>17}")
    for ratio in [*(BASE_RATIO * factor for factor in FACTORS), *STANDARDS]:
        strict, tolerant = ratio_scores(cleaner, ratio, arguments.count)
        print(f"{ratio:<24.2f}{strict.f1:10.3f}{tolerant.f1:17.3f}", flush=True)


def bridged_share(cleaner: Cleaner, length_m: float, reach_m: float, count: int) -> float:
    """Return the share of gaps, made by `cut`, that are bridged; those at the border of a raster are left out."""
    results = [
        bridged(np.asarray(cleaner(observed)) >= 0.5, gap).values()
        for observed, gap in gapped_rasters(length_m, reach_m, count)
    ]
    return float(np.mean([all(result) for result in results if result]))


def gapped_rasters(length_m: float, reach_m: float, count: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield rasters with one gap each; see `cut`."""
    for number in range(count):
        rng = np.random.default_rng([SEED, number])
        pair = random_pair(rng, SIDE, SEVERITY, BASE_RATIO, TRACKS[number % len(TRACKS)])
        yield cut(pair, rng, length_m, reach_m)


def cut(pair: Pair, rng: np.random.Generator, length_m: float, reach_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Clear a rectangle along a rail near the middle of the raster, `reach_m` to each side of it.

    For both rails of a track, the reach is measured from its axis. Returns the raster, and the gap as 1 in the cells of
    the label in the rectangle.
    """
    cells = np.argwhere(pair.label)
    middle = np.array(pair.label.shape) / 2
    around = cells[np.argsort(np.linalg.norm(cells - middle, axis=1))[:200]]
    place = around[rng.integers(len(around))]
    near = cells[np.linalg.norm(cells - place, axis=1) <= DIRECTION_M / CELL_M]
    along = np.linalg.svd(near - near.mean(axis=0))[2][0]
    across = np.array([-along[1], along[0]])
    if reach_m > RAIL_REACH_M:
        place = place + across * _to_the_axis(cells, place, across)
    offsets = np.stack(np.indices(pair.label.shape), axis=-1) - place
    inside = (np.abs(offsets @ along) <= 0.5 * length_m / CELL_M) & (np.abs(offsets @ across) <= reach_m / CELL_M)
    return pair.observed & ~inside, (pair.label & inside).astype(int)


def _to_the_axis(cells: np.ndarray, place: np.ndarray, across: np.ndarray) -> float:
    """Return the distance in cells from a rail to the axis of its track, positive if the other rail is in `across`."""
    sides = [place + side * across * SPACING_M / CELL_M for side in (1, -1)]
    nearest = [np.linalg.norm(cells - side, axis=1).min() for side in sides]
    return (1 if nearest[0] < nearest[1] else -1) * 0.5 * SPACING_M / CELL_M


def ratio_scores(cleaner: Cleaner, ratio: float, count: int) -> tuple[Scores, Scores]:
    """Clean rasters of each family and severity at a ratio of gauge to railhead width.

    Counts are strict, and within one cell.
    """
    strict = tolerant = Scores()
    for number in range(count):
        family = list(FAMILIES)[number % len(FAMILIES)]
        severity = (number % 9 + 1) / 10
        pair = random_pair(np.random.default_rng([SEED, 1, number]), SIDE, severity, ratio, family)
        found = np.asarray(cleaner(pair.observed)) >= 0.5
        strict, tolerant = strict + score(found, pair.label), tolerant + score(found, pair.label, 1)
    return strict, tolerant


if __name__ == "__main__":
    main()
