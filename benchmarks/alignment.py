"""Print how well fitted alignments meet the random designs that tracks were made from.

Run `python benchmarks/alignment.py [--designs N]`. Every row has N chains of 100 elements, with a point every metre.
The first rows have white noise only, the next ones misalignment that neighbours share as well, then there are 8 short
tracks of 24 elements, and the last row is 20 km in one piece. With `--given`, the rows with white noise are fitted with
the types of the true elements: what the points allow, if no element is missed. With `--bound`, the least errors are
computed that any such fit can have.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from functools import partial

import numpy as np
from rail_extract.core.alignment.elements import Alignment
from rail_extract.core.alignment.fit import fit_track
from rail_extract.core.alignment.layouts import noted
from rail_extract.core.parameters import FitParameters
from rail_extract.laboratory.designs import FAMILIES, Family, random_design, surveyed, with_cant
from rail_extract.laboratory.ruler.alignments import Met, bound_of, compared, quantiles, together

SEED = 33_2026
"""Different from the seeds of the other benchmarks."""

MISALIGNMENTS = ((0.002, 25.0), (0.003, 15.0), (0.005, 8.0))
"""Standard deviation and correlation length of the misalignment, metres."""

WHITE_M = 0.002
"""White noise of the rows without misalignment, metres; those with misalignment have half of it."""

LONG_KM = 20.0

SHORT, TRACKS = 24, 8
"""Elements of a short track, and number of these tracks."""


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--designs", type=int, default=2, help="number of chains in each row")
    parser.add_argument(
        "--seed", type=int, default=SEED, help="of the random designs and errors (default: %(default)s)"
    )
    parser.add_argument("--given", action="store_true", help="give the fit the types of the true elements")
    parser.add_argument("--bound", action="store_true", help="print the least errors of white noise instead")
    args = parser.parse_args()
    if args.bound:
        print_bounds(args.seed, args.designs)
    else:
        print_rows(args)


def print_rows(args: argparse.Namespace) -> None:
    """Fit the designs, and print the rows."""
    count = args.designs
    row = partial(row_of, args.seed)
    print(HEAD)
    for name, family in FAMILIES.items():
        print(row(name, [family] * count, WHITE_M, (0.0, 15.0), given=args.given), flush=True)
    if args.given:
        return
    for shared, length in MISALIGNMENTS:
        for name in ("main line", "branch line"):
            title = f"{name}, {1000 * shared:.0f} mm over {length:.0f} m"
            print(row(title, [FAMILIES[name]] * count, 0.5 * WHITE_M, (shared, length)), flush=True)
    shared, length = MISALIGNMENTS[1]
    title = f"short, {1000 * shared:.0f} mm over {length:.0f} m"
    tracks = [FAMILIES["branch line"]] * TRACKS
    print(row(title, tracks, 0.5 * WHITE_M, (shared, length), elements=SHORT), flush=True)
    print(row(f"main line, {LONG_KM:.0f} km", [FAMILIES["main line"]], WHITE_M, (0.0, 15.0), 1000.0 * LONG_KM))


HEAD = (
    f"{'':<30}{'found':>7}{'fitted':>8}{'radius error %':>16}{'tangent point m':>17}{'curve':>8}{'sigma':>7}"
    f"{'curves in':>11}{'cant':>9}{'its ends m':>12}{'s per':>7}\n"
    f"{'100 elements each':<30}{'%':>7}{'per true':>8}{'median':>9}{'90 %':>7}{'median':>10}{'90 %':>7}{'mm':>8}"
    f"{'of R':>7}{'height':>11}{'ramps':>9}{'95 %':>12}{'km':>7}"
)


def print_bounds(seed: int, count: int) -> None:
    """Print median and 90 % of the least errors of radii and tangent points with white noise."""
    print(f"{'':<20}{'radius %':>9}{'90 %':>7}{'tangent point m':>18}{'90 %':>7}")
    for name, family in FAMILIES.items():
        bounds = []
        for number in range(count):
            random = np.random.default_rng([seed, number])
            design = random_design(random, family, 100)
            bounds.append(bound_of(design, surveyed(design, random, 0.0), WHITE_M))
        radius = quantiles(np.concatenate([one.radius for one in bounds]), (0.5, 0.9))
        ends = quantiles(np.concatenate([one.ends_m for one in bounds]), (0.5, 0.9))
        print(f"{name:<20}{100 * radius[0]:>9.3f}{100 * radius[1]:>7.2f}{ends[0]:>18.3f}{ends[1]:>7.2f}", flush=True)


def row_of(
    seed: int,
    title: str,
    families: list[Family],
    white_m: float,
    shared: tuple[float, float],
    length_m: float | None = None,
    elements: int = 100,
    given: bool = False,
) -> str:
    """Fit a design of each family, and return a row of the table.

    `shared` is the standard deviation and the correlation length of the misalignment, metres. Designs are cut to
    `length_m` or else have as many elements; with `given`, the fit knows their types.
    """
    met, seconds, kilometres = [], 0.0, 0.0
    for number, family in enumerate(families):
        random = np.random.default_rng([seed, number])
        design = random_design(random, family, elements if length_m is None else 300)
        if length_m is not None:
            design = shortened(design, length_m)
        track = with_cant(design, surveyed(design, random, white_m, *shared), random)
        start = time.process_time()
        fixed = replace(design, plan=tuple(map(noted, design.plan))) if given else None
        fit = fit_track(track, design.frame, FitParameters(), fixed)
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
