"""Extract the rails of the sample through qgis_process, compare them with the truth and draw them.

It needs the environment that `make env` prints; `make demo` sets it.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from lines import read_features, read_lines
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from rail_extract.core.clouds.points import read_rail_points
from rail_extract.laboratory.ruler.lines import Comparison, compare_lines

ROOT = Path(__file__).resolve().parent.parent
SAMPLE = ROOT / "resources" / "sample" / "sample.laz"
TRUTH = ROOT / "resources" / "sample" / "sample_truth.geojson"
DEMO = ROOT / "build" / "demo"
OUTPUT = DEMO / "rails.gpkg"
PICTURE = DEMO / "map.png"
REPORT = DEMO / "report.html"
STANDARD = "IN_75R_1000"

RAIL_CLASS = 10
DETAIL_M = 12.0
"""Length of track that is shown in detail, so that single points can be seen."""

POINTS, RAIL, TRACK = "#9e9e9e", "#1565c0", "#e64a19"

HEADER = (
    f"{'':12}{'lines':>6}{'truth':>6}{'length':>10}{'found':>9}{'correct':>9}"
    f"{'lateral RMSE':>14}{'P95':>9}{'height RMSE':>13}"
)


def extract() -> dict:
    """Run the algorithm in QGIS and return its results by name."""
    inputs = {
        "INPUT": SAMPLE,
        "STANDARD": STANDARD,
        "RAILS": f"ogr:dbname='{OUTPUT}' table=\"rails\" (geom)",
        "CENTERLINES": f"ogr:dbname='{OUTPUT}' table=\"centerlines\" (geom)",
        "REPORT": REPORT,
    }
    words = [f"{name}={value}" for name, value in inputs.items()]
    command = [os.environ["QGIS_PROCESS"], "--json", "run", "railextract:extractrails", "--", *words]
    run = subprocess.run(command, capture_output=True, text=True)
    if run.returncode:
        sys.exit(f"qgis_process ended with {run.returncode}:\n{run.stdout}\n{run.stderr}")
    return json.loads(run.stdout[run.stdout.index("{") :])["results"]


def row(name: str, length_m: float, result: Comparison) -> str:
    """Return a row of the table."""
    return (
        f"{name:12}{result.line_count:6}{result.truth_count:6}{length_m:8.1f} m"
        f"{result.completeness:8.1%} {result.correctness:8.1%} {result.lateral_rmse_m * 1000:10.1f} mm"
        f" {result.lateral_p95_m * 1000:6.1f} mm {result.height_rmse_m * 1000:9.1f} mm"
    )


def draw_map(cloud: Path, rails: Sequence[np.ndarray], centerlines: Sequence[np.ndarray], picture: Path) -> None:
    """Draw the whole scene, a detail and the heights along the tracks as PNG; lines have the cloud's coordinates."""
    (points,) = read_rail_points(cloud, (RAIL_CLASS,))
    frame = points.frame
    rails, centerlines = [[frame.to_local(line) for line in lines] for lines in (rails, centerlines)]
    figure = Figure(figsize=(13, 15))
    whole, detail, heights = figure.subplots(3, 1)
    for axes, size in ((whole, 0.2), (detail, 4)):
        axes.plot(*points.xyz[:, :2].T, ".", color=POINTS, markersize=size, label="rail points")
        _draw(axes, rails, RAIL, "rails")
        _draw(axes, centerlines, TRACK, "track centerlines", linestyle="--")
        axes.set_aspect("equal")
        axes.set(xlabel="x [m]", ylabel="y [m]")
    whole.set_title(f"{cloud.name}: {len(points.xyz)} rail points, {len(rails)} rails, {len(centerlines)} tracks")
    whole.legend(loc="lower right", markerscale=20)
    _zoom(detail, centerlines or rails)
    detail.set_title("Detail")
    direction = _direction(points.xyz)
    for color, lines in ((RAIL, rails), (TRACK, centerlines)):
        for line in lines:
            heights.plot(line[:, :2] @ direction, line[:, 2] + frame.origin[2], color=color, linewidth=1)
    heights.set(xlabel="distance along the scene [m]", ylabel="z [m]", title="Heights of rails and track centerlines")
    heights.grid(alpha=0.3)
    figure.tight_layout()
    figure.savefig(picture, dpi=110)


def _draw(axes: Axes, lines: Sequence[np.ndarray], color: str, label: str, linestyle: str = "-") -> None:
    for number, line in enumerate(lines):
        axes.plot(*line[:, :2].T, linestyle, color=color, linewidth=1, label=label if number == 0 else None)


def _direction(xyz: np.ndarray) -> np.ndarray:
    """Return the direction in plan, (2,), in which points, (n, 3), have the greatest extent."""
    _, axes = np.linalg.eigh(np.cov(xyz[:, :2].T))
    return axes[:, 1] * np.sign(axes[0, 1])


def _zoom(axes: Axes, lines: Sequence[np.ndarray]) -> None:
    """Show a detail at the middle of the middle line."""
    if not lines:
        return
    line = lines[len(lines) // 2]
    x, y = line[len(line) // 2, :2]
    axes.set_xlim(x - DETAIL_M / 2, x + DETAIL_M / 2)
    axes.set_ylim(y - DETAIL_M / 4, y + DETAIL_M / 4)


def main() -> None:
    """Extract, compare, draw."""
    DEMO.mkdir(parents=True, exist_ok=True)
    OUTPUT.unlink(missing_ok=True)
    print(f"Extracting {SAMPLE.relative_to(ROOT)} ({STANDARD}) with {os.environ['QGIS_PROCESS']}", flush=True)
    start = time.monotonic()
    results = extract()
    print(f"{time.monotonic() - start:.0f} s with {results['ENGINE_USED']}\n\n{HEADER}")
    for layer, kind, figure in (("rails", "rail", "RAIL"), ("centerlines", "centerline", "CENTERLINE")):
        truth = read_lines(TRUTH, where=f"kind = '{kind}'")
        comparison = compare_lines(read_lines(OUTPUT, layer), truth)
        print(row(layer, results[f"{figure}_LENGTH"], comparison))
    gauges = [items["gauge_mm"] for _, items in read_features(OUTPUT, "centerlines")]
    print(f"\nGauge of the tracks: {', '.join(f'{gauge:.1f}' for gauge in gauges)} mm (truth: 1000 mm)")
    draw_map(SAMPLE, read_lines(OUTPUT, "rails"), read_lines(OUTPUT, "centerlines"), PICTURE)
    for name, path in (("Lines", OUTPUT), ("Map", PICTURE), ("Report", REPORT)):
        print(f"{name + ':':8}{path.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
