"""Print how many synthetic training pairs a second are drawn, by family of layouts.

Run `python benchmarks/synthetic.py`.
"""

from __future__ import annotations

import multiprocessing
import time

import numpy as np
from rail_extract.core.synthetic.layouts import FAMILIES, WEIGHTS
from rail_extract.core.synthetic.pairs import random_pair

SIDE = 512
PROCESSES = 2
PAIRS = 40


def main() -> None:
    """Print the table."""
    print(f"Pairs of {SIDE} x {SIDE} a second, {PROCESSES} processes")
    with multiprocessing.get_context("spawn").Pool(PROCESSES) as processes:
        processes.map(draw, [(None, number) for number in range(PROCESSES)])
        for family in (None, *FAMILIES):
            start = time.perf_counter()
            processes.map(draw, [(family, number) for number in range(PAIRS)])
            rate = PAIRS / (time.perf_counter() - start)
            weight = "" if family is None else f"  weight {WEIGHTS[family]:g}"
            print(f"{family or 'all, by their weights':24}{rate:6.1f}{weight}", flush=True)


def draw(task: tuple[str | None, int]) -> None:
    """Draw a pair of a family and drop it."""
    family, number = task
    random_pair(np.random.default_rng([PAIRS, number]), SIDE, family=family)


if __name__ == "__main__":
    main()
