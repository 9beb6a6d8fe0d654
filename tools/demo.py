"""Extract the rails of the sample through qgis_process, compare them with the truth and draw them.

It needs the environment that `make env` prints; `make demo` sets it.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path

from lines import read_features, read_lines
from picture import draw_map
from rail_extract.laboratory.ruler.lines import Comparison, compare_lines

ROOT = Path(__file__).resolve().parent.parent
SAMPLE = ROOT / "resources" / "sample" / "sample.laz"
TRUTH = ROOT / "resources" / "sample" / "sample_truth.geojson"
DEMO = ROOT / "build" / "demo"
OUTPUT = DEMO / "rails.gpkg"
PICTURE = DEMO / "map.png"
REPORT = DEMO / "report.html"
STANDARD = "IN_75R_1000"

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
    """Return a row of the table.

    Parameters
    ----------
    name : str
    length_m : float
    result : Comparison
    """
    return (
        f"{name:12}{result.line_count:6}{result.truth_count:6}{length_m:8.1f} m"
        f"{result.completeness:8.1%} {result.correctness:8.1%} {result.lateral_rmse_m * 1000:10.1f} mm"
        f" {result.lateral_p95_m * 1000:6.1f} mm {result.height_rmse_m * 1000:9.1f} mm"
    )


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
