"""Print how well fitted alignments meet the random designs that tracks were made from.

Run `python benchmarks/alignment.py [--designs N]`. Every row has N chains of 100 elements, with a point every metre.
The first rows have white noise only, the next ones misalignment that neighbours share as well, the last one is 20 km in
one piece.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace

import numpy as np
from rail_extract.core.alignment.elements import Alignment
from rail_extract.core.alignment.fit import fit_track
from rail_extract.core.alignment.measured import Track
from rail_extract.core.parameters import FitParameters
from rail_extract.laboratory.designs import FAMILIES, Family, random_design, surveyed
from rail_extract.laboratory.ruler.alignments import Met, compared, together

SEED = 33_2026
"""Different from the seeds of the other benchmarks."""

CANT_NOISE_M = 0.0004
"""Standard deviation of a measured cant, metres."""

MISALIGNMENTS = ((0.002, 25.0), (0.003, 15.0), (0.005, 8.0))
"""Standard deviation and correlation length of the misalignment, metres."""

WHITE_M = 0.002
"""White noise of the rows without misalignment, metres; those with misalignment have half of it."""

LONG_KM = 20.0


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--designs", type=int, default=2, help="number of chains in each row")
    count = parser.parse_args().designs
    print(HEAD)
    for name, family in FAMILIES.items():
        print(row(name, [family] * count, WHITE_M, (0.0, 15.0)))
    for shared, length in MISALIGNMENTS:
        for name in ("main line", "branch line"):
            title = f"{name}, {1000 * shared:.0f} mm over {length:.0f} m"
            print(row(title, [FAMILIES[name]] * count, 0.5 * WHITE_M, (shared, length)))
    print(row(f"main line, {LONG_KM:.0f} km", [FAMILIES["main line"]], WHITE_M, (0.0, 15.0), 1000.0 * LONG_KM))


HEAD = (
    f"{'':<30}{'found':>7}{'fitted':>8}{'radius error %':>16}{'tangent point m':>17}{'curve':>8}{'sigma':>7}"
    f"{'curves in':>11}{'cant':>9}{'its ends m':>12}{'s per':>7}\n"
    f"{'100 elements each':<30}{'%':>7}{'per true':>8}{'median':>9}{'90 %':>7}{'median':>10}{'90 %':>7}{'mm':>8}"
    f"{'of R':>7}{'height':>11}{'ramps':>9}{'95 %':>12}{'km':>7}"
)


def row(
    title: str, families: list[Family], white_m: float, shared: tuple[float, float], length_m: float | None = None
) -> str:
    """Fit designs, and return a row of the table.

    Parameters
    ----------
    title : str
    families : list of Family
        One for each design.
    white_m : float
    shared : (float, float)
        Standard deviation and correlation length of the misalignment, metres.
    length_m : float, optional
        Length to which the design is cut; else it has 100 elements.
    """
    met, seconds, kilometres = [], 0.0, 0.0
    for number, family in enumerate(families):
        random = np.random.default_rng([SEED, number])
        design = random_design(random, family, 100 if length_m is None else 300)
        if length_m is not None:
            design = shortened(design, length_m)
        line = surveyed(design, random, white_m, *shared)
        s = np.arange(len(line), dtype=float)
        cant = np.column_stack([s, design.cants(s) + CANT_NOISE_M * random.standard_normal(len(s))])
        start = time.process_time()
        fit = fit_track(Track(1, line, cant, np.zeros(len(line), dtype=bool)), design.frame, FitParameters())
        seconds += time.process_time() - start
        kilometres += design.s_to / 1000.0
        met.append(compared(design, fit.alignment))
    return _written(title, together(met), seconds / kilometres)


def shortened(design: Alignment, length_m: float) -> Alignment:
    """Return the part of a design up to the last plan element that ends within a length; others end there, too."""
    plan = tuple(one for one in design.plan if one.s_to <= length_m)
    vertical, cant = (
        tuple(one for one in layout if one.s_to <= plan[-1].s_to) for layout in (design.vertical, design.cant)
    )
    return replace(design, plan=plan, vertical=vertical, cant=cant)


def _written(title: str, met: Met, speed: float) -> str:
    """Return the text of a row."""
    radius, ends = 100.0 * np.quantile(met.radius, [0.5, 0.9]), np.quantile(met.ends_m, [0.5, 0.9])
    ramp_ends = np.quantile(met.ramp_ends_m, 0.95) if len(met.ramp_ends_m) else np.nan
    return (
        f"{title:<30}{100 * met.found / met.true:>7.1f}{met.fitted / met.true:>8.3f}{radius[0]:>9.3f}{radius[1]:>7.2f}"
        f"{ends[0]:>10.3f}{ends[1]:>7.2f}{1000 * np.sqrt(np.mean(met.curve_m**2)):>8.2f}"
        f"{np.sqrt(np.mean(met.radius_scores**2)):>7.2f}{f'{met.curves_found}/{met.curves_true}':>11}"
        f"{f'{met.ramps_found}/{met.ramps_true}':>9}{ramp_ends:>12.2f}{speed:>7.2f}"
    )


if __name__ == "__main__":
    main()
