"""Does it work here? Versions of packages, checksums of the weights, and a short track held to its truth."""

from __future__ import annotations

import hashlib
from importlib import import_module, metadata

from ...core.frpdf.models import FOLDER, MODELS
from ...core.progress import Progress
from .dependencies import is_installed

MODULES = ("numpy", "scipy", "pyproj", "laspy", "lazrs", "cv2", "torch", "skimage", "matplotlib")
"""Packages whose version a report of an error should tell."""

CHECKSUMS = FOLDER / "SHA256SUMS"
"""Written in the folder `models` by ``sha256sum *.npz > SHA256SUMS``."""

LENGTH_M = 20.0
"""Long enough for a line and short enough for any computer."""

LEAST_COMPLETENESS, LARGEST_ERROR_M = 0.95, 0.010
"""Share of the rails to be found within 5 cm, and error in plan and in height, root of the mean square; on clean
points the errors are about 1 mm."""


def version(module: str) -> str:
    """Version of a package, which is imported, or why there is none."""
    if not is_installed(module):
        return "not installed"
    try:
        imported = import_module(module)
    except Exception as error:  # what a broken package raises is anybody's guess
        return f"broken ({error})"
    return str(getattr(imported, "__version__", None) or _distribution_version(module))


def model_states() -> dict[str, str]:
    """Say of each model's weights whether they are as they were shipped: ok, changed or missing."""
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


def extract_straight(progress: Progress) -> tuple[bool, str, str]:
    """Extract a synthetic straight track and compare it with its truth.

    Returns
    -------
    bool
        Whether it is as good as it should be.
    str
        The figures, in words.
    str
        Engine that ran the network.
    """
    import numpy as np

    from ...core.pipeline import Parameters, extract_rails
    from ...core.standards import STANDARDS
    from ...laboratory.curves import Element, trace
    from ...laboratory.ruler.lines import compare_lines
    from ...laboratory.scenes.plain import rolling, spacing
    from ...laboratory.scenes.scene import Plan, build
    from ...laboratory.scenes.tracks import Track

    standard = STANDARDS["EN_60E1_1435"]
    curve = trace([Element(LENGTH_M)], heading=0.35)
    plan = Plan([Track(curve, spacing(standard), rolling(curve))], standard)
    scene = build("self test", plan, np.random.RandomState(1))
    parameters = Parameters(standard.gauge_m, standard.head_width_m)
    network = extract_rails([scene.rail_points()], parameters, progress)
    found = compare_lines([rail.xyz for rail in network.rails], scene.rails)
    passed = (
        found.completeness >= LEAST_COMPLETENESS
        and max(found.lateral_rmse_m, found.height_rmse_m) <= LARGEST_ERROR_M
        and len(network.centerlines) == 1
    )
    words = (
        f"{found.completeness:.1%} of two rails of {LENGTH_M:.0f} m found, {1000 * found.lateral_rmse_m:.1f} mm off in "
        f"plan and {1000 * found.height_rmse_m:.1f} mm in height; {len(network.centerlines)} of 1 centerline"
    )
    return passed, words, network.engine


def _distribution_version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "of unknown version"
