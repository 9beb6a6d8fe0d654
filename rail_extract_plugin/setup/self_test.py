"""Checks of an installation: package versions, checksums of the weights, and a run on 20 m of the sample."""

from __future__ import annotations

import hashlib
import json
from importlib import import_module, metadata
from typing import TYPE_CHECKING, NamedTuple

from ...core.frpdf.models import FOLDER, MODELS
from ...core.progress import Progress
from ..paths import SAMPLE
from .dependencies import is_installed

if TYPE_CHECKING:
    import numpy as np

MODULES = ("numpy", "scipy", "pyproj", "laspy", "lazrs", "cv2", "torch", "skimage", "matplotlib")
"""Packages whose version belongs in an error report."""

CHECKSUMS = FOLDER / "SHA256SUMS"
"""Made in the folder `models` with ``sha256sum *.npz > SHA256SUMS``."""

CLOUD, TRUTH = SAMPLE / "sample.laz", SAMPLE / "sample_truth.geojson"
"""Rail points of three synthetic metre-gauge tracks, and the lines from which they were made."""

RAIL_CLASS, STANDARD = 10, "IN_75R_1000"
"""Class of the sample's rail points, and its rail standard."""

EXTENT = (578215.0, 2494290.0, 578235.0, 2494390.0)
"""Part of the sample that is extracted (west, south, east, north, in metres): all three tracks over 20 m of easting."""

END_M = 1.0
"""The lines are not compared this close to the extent's borders, where the points end."""

STEP_M = 0.05
"""Distance between the places at which the lines are compared."""

TOLERANCE_M = 0.05
"""A line this close to the true rail, in plan, shows that rail."""

MIN_COMPLETENESS, MAX_ERROR_M = 0.95, 0.005
"""Share of the true rails that must be found, and greatest RMSE in plan and in height; measured: 1.00, and 0.0019 m in
plan, 0.0005 m in height."""

RAILS, TRACKS = 6, 3
"""Lines that the sample contains."""


class Verdict(NamedTuple):
    """Result of the run on the sample: whether it passed, the figures in words, and the engine that was used."""

    passed: bool
    words: str
    engine: str


def version(module: str) -> str:
    """Import a package and return its version, or the reason why there is none."""
    if not is_installed(module):
        return "not installed"
    try:
        imported = import_module(module)
    except Exception as error:  # a broken package may raise anything
        return f"broken ({error})"
    return str(getattr(imported, "__version__", None) or _distribution_version(module))


def model_states() -> dict[str, str]:
    """Return the state of each model's weights: ok (as shipped), changed or missing."""
    lines = CHECKSUMS.read_text(encoding="utf-8").splitlines() if CHECKSUMS.is_file() else []
    shipped = {name: checksum for checksum, name in (line.split() for line in lines)}
    states = {}
    for model in MODELS:
        if not model.path.is_file():
            states[model.name] = "missing"
        else:
            same = hashlib.sha256(model.path.read_bytes()).hexdigest() == shipped.get(model.file)
            states[model.name] = "ok" if same else "changed"
    return states


def extract_sample(progress: Progress) -> Verdict:
    """Extract the rails of a part of the sample and compare them with the true rails."""
    import numpy as np

    from ...core.clouds.points import read_rail_points
    from ...core.pipeline import Parameters, extract_rails
    from ...core.standards import STANDARDS

    standard = STANDARDS[STANDARD]
    points = read_rail_points(CLOUD, [RAIL_CLASS], extent=EXTENT)
    network = extract_rails(points, Parameters(standard.gauge_m, standard.head_width_m), progress)
    features = json.loads(TRUTH.read_text(encoding="utf-8"))["features"]
    true_rails = [
        network.frame.to_local(np.array(feature["geometry"]["coordinates"]))
        for feature in features
        if feature["properties"]["kind"] == "rail"
    ]
    west, east = (network.frame.to_local(np.array([EXTENT[i], 0.0, 0.0]))[0] for i in (0, 2))
    completeness, lateral_m, height_m = _compare(
        [rail.xyz for rail in network.rails], true_rails, west + END_M, east - END_M
    )
    passed = (
        completeness >= MIN_COMPLETENESS
        and max(lateral_m, height_m) <= MAX_ERROR_M
        and (len(network.rails), len(network.centerlines)) == (RAILS, TRACKS)
    )
    words = (
        f"{completeness:.1%} of the true rails found, RMSE {1000 * lateral_m:.1f} mm in plan and {1000 * height_m:.1f} "
        f"mm in height; {len(network.rails)} of {RAILS} rails, {len(network.centerlines)} of {TRACKS} centerlines"
    )
    return Verdict(passed, words, network.engine)


def _compare(
    lines: list[np.ndarray], true_lines: list[np.ndarray], west: float, east: float
) -> tuple[float, float, float]:
    """Compare lines with the true ones, (n, 3) each, at places along the true lines between two eastings.

    Returns the share of the places with a line within the tolerance, and the root mean squares of the offsets there, in
    plan and in height; infinite if no line is near.
    """
    import numpy as np

    from ...core.polyline import Polyline, project

    places = np.concatenate([Polyline(line).resampled(STEP_M).xyz for line in true_lines])
    places = places[(places[:, 0] > west) & (places[:, 0] < east)]
    feet = project([line[:, :2] for line in lines], places[:, :2], TOLERANCE_M)
    if not len(feet.point):
        return 0.0, np.inf, np.inf
    heights = np.concatenate([Polyline(line).at(feet.of(i).t)[:, 2] for i, line in enumerate(lines)])
    above = heights - places[feet.point, 2]
    return len(feet.point) / len(places), float(np.sqrt(np.mean(feet.across**2))), float(np.sqrt(np.mean(above**2)))


def _distribution_version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "of unknown version"
