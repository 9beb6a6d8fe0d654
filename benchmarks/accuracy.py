"""Print how far extracted lines lie from the truth on synthetic scenes, beside what a plain script reaches.

Run `python benchmarks/accuracy.py [SCENE ...]`.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Iterator

from peer import peer_lines
from rail_extract.core.pipeline import Parameters, extract_rails
from rail_extract.core.synthetic.compare import Comparison, compare_lines
from rail_extract.core.synthetic.scenes import SCENES, Scene

COLUMNS = (
    f"{'scene':<12}{'lines of':<13}{'found %':>8}{'right %':>8}{'length':>7}{'lines':>8}"
    f"{'lat rms':>9}{'p95':>6}{'bias':>6}{'z rms':>7}{'bias':>6}{'gauge':>7}{'s':>7}"
)


def main() -> None:
    """Print the table for the scenes named on the command line, or all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", choices=[*SCENES, []], help="scenes (default: all)")
    names = parser.parse_args().scenes or list(SCENES)
    print("Within 5 cm; errors in millimetres; gauge: largest deviation of a track's mean from the truth.")
    print(COLUMNS)
    for name in names:
        for row in rows(SCENES[name]()):
            print(row, flush=True)
    peak_mib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"Peak memory of all scenes: {peak_mib:.0f} MiB")


def rows(scene: Scene) -> Iterator[str]:
    """Give the table's rows of one scene: our rails and centerlines, and the plain script's rails."""
    standard = scene.standard
    start = time.perf_counter()
    network = extract_rails([scene.rail_points()], Parameters(standard.gauge_m, standard.head_width_m))
    seconds = time.perf_counter() - start
    rails = compare_lines([rail.xyz for rail in network.rails], scene.rails)
    yield _row(scene.name, "rails", rails, seconds=seconds)
    centerlines = compare_lines([line.xyz for line in network.centerlines], scene.centerlines)
    gauges = [line.gauge_mm - 1000 * standard.gauge_m for line in network.centerlines]
    yield _row("", "centerlines", centerlines, gauge_mm=max(gauges, key=abs, default=None))
    start = time.perf_counter()
    lines = peer_lines(scene.rail_points(), standard.gauge_m, standard.head_width_m)
    yield _row("", "plain script", compare_lines(lines, scene.rails), seconds=time.perf_counter() - start)


def _row(
    scene: str, lines: str, result: Comparison, gauge_mm: float | None = None, seconds: float | None = None
) -> str:
    def mm(value_m: float) -> str:
        return f"{1000 * value_m:.1f}"

    return (
        f"{scene:<12}{lines:<13}{100 * result.completeness:>8.2f}{100 * result.correctness:>8.2f}"
        f"{result.length_ratio:>7.3f}{f'{result.line_count}:{result.truth_count}':>8}"
        f"{mm(result.lateral_rmse_m):>9}{mm(result.lateral_p95_m):>6}{mm(result.lateral_bias_m):>6}"
        f"{mm(result.height_rmse_m):>7}{mm(result.height_bias_m):>6}"
        f"{'' if gauge_mm is None else f'{gauge_mm:.1f}':>7}{'' if seconds is None else f'{seconds:.1f}':>7}"
    )


if __name__ == "__main__":
    main()
