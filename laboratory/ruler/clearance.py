"""What *Measure clearance* finds in a scene, in figures."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from ...core.clearance.measure import Clearance, measure
from ...core.clearance.profiles import named
from ...core.clearance.settings import Settings
from ...core.clouds.points import ask
from ...core.run.tasks import Runner
from ..scenes.clearance import courses_of, write_points
from ..scenes.gauges import GaugeScene


def measured(made: GaugeScene) -> Clearance:
    """Measure the clearance in a scene."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "cloud.las"
        write_points(path, made.scene.points, made.scene.codes)
        settings = Settings(named()[made.profile], **made.settings)
        courses = courses_of(made.scene, made.with_rails)
        return measure(ask(path, range(256)), courses, settings, Path(folder) / "work", Runner())


def clearance_figures(made: GaugeScene) -> dict[str, float]:
    """Count what stands inside, and measure platforms, wires and the distance of tracks.

    `sure`, `doubtful` and `named` are objects; `deep mm` is the sum of their depths, `margin mm` the mean least margin
    of the stations of the first track, `offset mm` and `high mm` the means of platforms, `wire m` and `wire mm` length
    and mean height of wires, `apart mm` the mean distance of the first track's neighbour, and `near m` the length on
    which it is too near.
    """
    found = measured(made)
    first, counts = found.stations[0], [one for one in found.intrusions if not one.what]
    least = first.least_m.min(axis=1)
    return {
        "sure": len(found.sure),
        "doubtful": len(counts) - len(found.sure),
        "named": len(found.intrusions) - len(counts),
        "deep mm": sum(one.pen_mm for one in found.intrusions),
        "margin mm": 1000 * _mean(least[np.isfinite(least)]),
        "offset mm": 1000 * _mean(np.concatenate([np.empty(0), *(np.abs(one.v) for one in found.platforms)])),
        "high mm": 1000 * _mean(np.concatenate([np.empty(0), *(one.w for one in found.platforms)])),
        "wire m": sum(one.length_m for one in found.wires),
        "wire mm": 1000 * _mean(np.concatenate([np.empty(0), *(one.w for one in found.wires)])),
        "apart mm": 1000 * _mean(first.left.distance_m[np.isfinite(first.left.distance_m)]),
        "near m": float(first.left.short.sum()) * found.settings.step_m,
    }


def _mean(values: np.ndarray) -> float:
    return float(values.mean()) if len(values) else np.nan
