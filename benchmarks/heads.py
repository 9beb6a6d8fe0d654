"""Judge how lines are moved onto their heads and get heights: errors and standard errors over kinds of scenes.

Run `python benchmarks/heads.py [KIND ...] [--quick] [--rows] [--save FILE] [--against FILE]`. Each kind has six seeds.
Lines that the raster shows are drawn once, kept in a folder, and measured in every run, so that two versions of the
measurement are compared on the same lines: save the figures of one with `--save`, and give them to the other with
`--against`, which prints the ratios of errors. `--quick` takes two seeds of each kind, `--rows` prints every seed.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.parameters import Parameters
from rail_extract.core.rails import RailLine
from rail_extract.core.raster import cell_size
from rail_extract.core.squares.steps import clean_square, draw_lines, engine_for, measure_lines, square_side
from rail_extract.core.tiles.grid import MemorySource, lay_out
from rail_extract.laboratory.ruler.lines import match
from rail_extract.laboratory.scenes import adversarial, plain, strips, switches, uneven
from rail_extract.laboratory.scenes.scene import RAIL, Scene

SEEDS, QUICK_SEEDS = range(101, 107), range(101, 103)
"""Seeds of each kind; constants were set on scenes with other seeds."""

TOLERANCE_M = 0.05
"""Errors count where a line is this close to its rail."""

FOLDER = Path(tempfile.gettempdir()) / "rail_extract_heads"

KINDS: dict[str, Callable[[int], Scene]] = {
    "straight": plain.straight,
    "curved": plain.curved,
    "tram": plain.tram,
    "noisy": plain.noisy,
    "sparse": plain.sparse,
    "rough": uneven.rough,
    "rough_side": uneven.rough_side,
    "rough_thin": uneven.rough_thin,
    "worn": uneven.worn,
    "flat": uneven.flat,
    "other_rail": uneven.other_rail,
    "ridge": uneven.ridge,
    "side_17": lambda seed: adversarial.from_the_side("side_17", seed, 17.0),
    "side_30": lambda seed: adversarial.from_the_side("side_30", seed, 30.0, face_share=0.5),
    "side_45": lambda seed: adversarial.from_the_side("side_45", seed, 45.0),
    "one_face": lambda seed: adversarial.from_the_side("one_face", seed, 20.0, noise_m=0.004, top_share=0.0),
    "all_faces": adversarial.all_faces,
    "narrow_heads": adversarial.narrow_heads,
    "thin_points": adversarial.thin_points,
    "gaps": adversarial.gaps,
    "hidden_heads": lambda seed: adversarial.standing_train("hidden_heads", seed, head_share=0.0),
    "standing_train": lambda seed: adversarial.standing_train(seed=seed),
    "unmarked_passes": strips.unmarked,
    "unmarked_heights": strips.unmarked_heights,
    "crossing": adversarial.crossing,
    "grooved": adversarial.grooved,
    "turnout_9": lambda seed: switches.turnout("turnout_9", "300-1:9", (-1) ** seed, 0.4 * seed, seed),
}
"""Kinds of scenes by name, made from a seed."""

COLUMNS = ("across", "p95", "height", "p95 z", "in 1 s", "in 2 s", "in 1 sz", "in 2 sz", "found", "seconds")
"""Figures of a scene: errors in mm, shares of errors within one and two standard errors and of rails found in %."""

ERRORS = len(("across", "p95", "height", "p95 z"))

HEADING = f"{'kind':<18}" + "".join(f"{name:>9}" for name in COLUMNS)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kinds", nargs="*", choices=[*KINDS, []], metavar="KIND", help=f"of {', '.join(KINDS)}")
    parser.add_argument("--quick", action="store_true", help=f"{len(QUICK_SEEDS)} seeds of each kind")
    parser.add_argument("--rows", action="store_true", help="print each seed, too")
    parser.add_argument("--folder", type=Path, default=FOLDER, help=f"of the drawn lines (default {FOLDER})")
    parser.add_argument("--save", type=Path, metavar="FILE", help="write the figures to a JSON file")
    parser.add_argument("--against", type=Path, metavar="FILE", help="print ratios to the figures in a file")
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    seeds = QUICK_SEEDS if arguments.quick else SEEDS
    figures: dict[str, dict[str, list[float]]] = {}
    print(HEADING)
    for kind in arguments.kinds or KINDS:
        own = {str(seed): figures_of(KINDS[kind](seed), arguments.folder) for seed in seeds}
        for seed, row in own.items() if arguments.rows else ():
            print(written(f"  {seed}", row))
        figures[kind] = own
        print(written(kind, summary(list(own.values()))), flush=True)
    if arguments.save:
        arguments.save.write_text(json.dumps(figures, indent=1), encoding="utf-8")
    if arguments.against:
        print("\n" + compared(figures, json.loads(arguments.against.read_text(encoding="utf-8"))))


def figures_of(scene: Scene, folder: Path) -> list[float]:
    """Measure the lines of a scene; returns its figures in the order of `COLUMNS`."""
    standard, points = scene.standard, scene.rail_points()
    parameters = Parameters(standard.gauge_m, standard.head_width_m)
    network = drawn_once(scene, parameters, folder)
    start = time.process_time()
    cell_m = cell_size(standard.gauge_m, standard.head_width_m)
    rails, *_ = measure_lines(network, points, RAIL, parameters, cell_m)
    seconds = time.process_time() - start
    return [*errors_of(rails, scene.rails), seconds]


def errors_of(rails: Sequence[RailLine], true: Sequence[np.ndarray]) -> list[float]:
    """Compare rails with the true ones; returns all figures but the time."""
    found = match([rail.xyz for rail in rails], true)
    sigmas = np.empty((2, len(found.line)))
    for number, rail in enumerate(rails):
        mine = found.line == number
        if rail.support is not None:
            for row, stated in zip(sigmas, (rail.support.sigma_m, rail.support.sigmaz_m)):
                row[mine] = np.interp(found.t[mine], rail.support.t, stated)
    compared, near = found.within(TOLERANCE_M), found.back.distance <= TOLERANCE_M
    offs = np.abs([found.back.lateral[near], found.back.height[near]])
    within = [100 * float(np.mean(off <= factor * own)) for off, own in zip(offs, sigmas[:, near]) for factor in (1, 2)]
    errors = compared.lateral_rmse_m, compared.lateral_p95_m, compared.height_rmse_m, compared.height_p95_m
    return [*(1000 * error for error in errors), *within, 100 * compared.completeness]


def drawn_once(scene: Scene, parameters: Parameters, folder: Path) -> LineNetwork:
    """Return the lines drawn from the raster of a scene, or those in the folder if its points are the same."""
    points = scene.rail_points()
    path = folder / f"{scene.name}_{hashlib.sha256(points.xyz.tobytes()).hexdigest()[:16]}.npz"
    if not path.exists():
        print(f"drawing {path.name}", file=sys.stderr, flush=True)
        side_m = square_side(parameters)
        source = MemorySource(points, side_m)
        (square,) = lay_out([source], source)
        raster = clean_square(source, square, parameters, engine_for(parameters))
        network = draw_lines(raster, parameters)
        lines = {f"line{number}": line for number, line in enumerate(network.lines)}
        np.savez(path, nodes=network.nodes, ends=network.ends, passes=network.passes, **lines)
    with np.load(path) as kept:
        lines = tuple(kept[f"line{number}"] for number in range(len(kept.files) - 3))
        return LineNetwork(lines, kept["nodes"], kept["ends"], kept["passes"])


def summary(rows: Sequence[Sequence[float]]) -> list[float]:
    """Summarize the seeds of a kind: errors by their root mean square, all else by the mean."""
    table = np.array(rows)
    return [*np.sqrt(np.mean(table[:, :ERRORS] ** 2, axis=0)), *np.mean(table[:, ERRORS:], axis=0)]


def written(name: str, row: Sequence[float]) -> str:
    """Format a row of the table."""
    cells = [f"{value:>9.2f}" for value in row[:ERRORS]] + [f"{value:>9.0f}" for value in row[ERRORS:-1]]
    return f"{name:<18}" + "".join(cells) + f"{row[-1]:>9.2f}"


def compared(figures: dict[str, dict[str, list[float]]], before: dict[str, dict[str, list[float]]]) -> str:
    """Format errors and times relative to another run, by kind and as a geometric mean.

    The last columns are the changes in mm, across and in height.
    """
    names = ("across", "p95", "height", "p95 z", "seconds", "+ across", "+ height")
    rows, lines = [], [f"{'ratios':<18}" + "".join(f"{name:>9}" for name in names)]
    for kind in figures:
        shared = [seed for seed in figures[kind] if seed in before.get(kind, {})]
        if shared:
            now, then = (np.array(summary([one[kind][seed] for seed in shared])) for one in (figures, before))
            ratios = now / then
            rows.append([*ratios[:ERRORS], ratios[-1]])
            lines.append(_ratios(kind, [*rows[-1], now[0] - then[0], now[2] - then[2]]))
    return "\n".join([*lines, _ratios("geometric mean", np.exp(np.mean(np.log(rows), axis=0)))])


def _ratios(name: str, row: Sequence[float]) -> str:
    return f"{name:<18}" + "".join(f"{value:>9.2f}" for value in row)


if __name__ == "__main__":
    main()
