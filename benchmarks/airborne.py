"""Prints how well tracks are fitted in simulated airborne clouds: seen, right, standard errors, switches, and speed.

Usage: python benchmarks/airborne.py [--seeds 3] [--first 1] [--rows ROW ...]
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from rail_extract.core.airborne.fitting import SEEN, fit_tracks
from rail_extract.core.airborne.guide_line import axis_of_guide
from rail_extract.laboratory.airborne.designs import SPACING_M, Design, canted_curve, curved_line, drawn_together, yard
from rail_extract.laboratory.airborne.flight import Flight, fly
from rail_extract.laboratory.ruler.airborne import Stationwise, compare_stations

REACH_M, RAIL_HEIGHT_M = 3.0, 0.17

FLIGHTS = {
    **{f"line, 25 cm, {density} per m2": (curved_line, density, 0.25) for density in (5, 10, 20, 40)},
    **{f"line, 50 cm, {density} per m2": (curved_line, density, 0.5) for density in (5, 10, 20, 40)},
    "150 mm cant, 50 cm, 10 per m2": (canted_curve, 10, 0.5),
    "150 mm cant, 50 cm, 20 per m2": (canted_curve, 20, 0.5),
    "yard, 25 cm, 10 per m2": (yard, 10, 0.25),
    "yard, 50 cm, 10 per m2": (yard, 10, 0.5),
}
"""Design, points per square metre and footprint of each row."""

APART_M = ((3.5, np.inf), (1.6, 3.5), (0.5, 1.6), (0.0, 0.5))
"""Distances from the next track by which the stations of yards are listed."""


def measured(design: Design, density: float, footprint_m: float, seed: int) -> tuple[Stationwise, float, float]:
    """Return the figures of a design flown once, the length of its tracks in km, and the processor time in seconds."""
    cloud = fly(design.world, design.where, design.width_m, Flight(density, footprint_m), seed)
    guides = drawn_together(design.tracks, seed, off_m=0.5)
    axes = [axis_of_guide(guide) for guide in guides]
    start = time.process_time()
    found = fit_tracks(cloud.xyz, cloud.strip, axes, [SPACING_M] * len(axes), REACH_M, footprint_m)
    seconds = time.process_time() - start
    rows = []
    for number, one in enumerate(found):
        stations = one.stations
        xyz = np.column_stack([stations.xy, stations.bed + RAIL_HEIGHT_M])
        truth = design.truth(number)
        others = [design.truth(other) for other in range(len(found)) if other != number]
        seen = stations.reason == SEEN
        rows.append(compare_stations(xyz, seen, stations.sigma, stations.switch, truth, others))
        rows[-1] = rows[-1][~design.is_hidden(number, rows[-1].along_m)]
    return Stationwise.joined(rows), sum(axis.t[-1] for axis in axes) / 1000, seconds


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=3, help="designs of each row (default: 3)")
    parser.add_argument("--first", type=int, default=1, help="seed of the first (default: 1)")
    parser.add_argument("--rows", nargs="*", choices=FLIGHTS, help="rows (default: all)")
    args = parser.parse_args()
    print("| scene | stations | seen | within 10 cm | across, rms | height, sd | 95 % interval | s per km |")
    print("|---|---|---|---|---|---|---|---|")
    for name in args.rows or list(FLIGHTS):
        make, density, footprint_m = FLIGHTS[name]
        runs = [measured(make(seed), density, footprint_m, seed) for seed in range(args.first, args.first + args.seeds)]
        found = Stationwise.joined([one for one, _, _ in runs])
        speed = sum(seconds for _, _, seconds in runs) / sum(km for _, km, _ in runs)
        print(_row(name, found) + f" {speed:.1f} |", flush=True)
        if make is yard:
            for low, high in APART_M:
                part = found[(found.beside_m >= low) & (found.beside_m < high)]
                flagged = f"{100 * part.flagged.mean():.0f} % flagged" if len(part.seen) else ""
                print(_row(f"- next track at {low:g} to {high:g} m, {flagged}", part) + " |", flush=True)


def _row(name: str, found: Stationwise) -> str:
    seen, right, rms, sd, within = found.shares()
    return (
        f"| {name} | {len(found.seen)} | {100 * seen:.1f} % | {100 * right:.1f} % | {rms:.0f} mm | {sd:.0f} mm "
        f"| {100 * within:.1f} % |"
    )


if __name__ == "__main__":
    main()
