"""Print the number of synthetic training pairs drawn per second, by family of layouts.

Run `python benchmarks/synthetic.py`.
"""

from __future__ import annotations

import multiprocessing
import time

import numpy as np
from rail_extract.laboratory.rasters.layouts import FAMILIES, WEIGHTS
from rail_extract.laboratory.rasters.pairs import random_pair

SIDE = 512
PROCESSES = 2
PAIRS = 40


def main() -> None:
    """Print the table."""
    print(f"Pairs of {SIDE} x {SIDE}, {PROCESSES} processes")
    print(f"{'family':16}{'per second':>10}{'CPU, ms':>10}{'weight':>10}")
    with multiprocessing.get_context("spawn").Pool(PROCESSES) as processes:
        processes.map(draw, [(None, number) for number in range(PROCESSES)])
        for family in (None, *FAMILIES):
            start = time.perf_counter()
            busy = sum(processes.map(draw, [(family, number) for number in range(PAIRS)], chunksize=1))
            rate = PAIRS / (time.perf_counter() - start)
            weight = "" if family is None else f"{WEIGHTS[family]:g}"
            print(f"{family or 'all, by weight':16}{rate:10.1f}{1000 * busy / PAIRS:10.0f}{weight:>10}", flush=True)


def draw(task: tuple[str | None, int]) -> float:
    """Draw a pair of a family and return its processor time, seconds."""
    family, number = task
    start = time.process_time()
    random_pair(np.random.default_rng([PAIRS, number]), SIDE, family=family)
    return time.process_time() - start


if __name__ == "__main__":
    main()
