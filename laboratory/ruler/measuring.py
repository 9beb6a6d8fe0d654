"""Measurement of one scene: our lines, and the lines of a plain script, compared with the truth."""

from __future__ import annotations

import resource
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...core.clouds.points import RailPoints, read_rail_points
from ...core.pipeline import Parameters, extract_rails
from ...core.polyline import length_along
from ...core.rails import RailLine, RailNetwork
from ..scenes.scene import RAIL, Scene
from ..scenes.write import write_cloud
from .lines import Match, match
from .plain_script import script_lines
from .tracks import GeometryErrors, TrackErrors, compare_geometry, compare_tracks

SMOOTHING_M = 0.8
"""Smoothing in plan; the n of w / sqrt(12 n) is the number of points in this length."""

QUALITY_STEP_M = 1.0
"""Distance between the stations of track geometry."""


@dataclass(frozen=True)
class Result:
    """The measurements of one scene: our lines, and the rails of the plain script, matched with the truth.

    `within_sigma` and `within_two_sigma` are the shares of the lateral errors of our rails up to the standard error
    there, and up to twice it. `mean_error_m` is the standard error of the mean of the points in the smoothing length,
    if they are spread evenly across the head, and `peak_mib` the peak memory up to the end of our extraction.
    """

    scene: str
    rails: Match
    centerlines: Match
    script: Match
    tracks: TrackErrors
    geometry: GeometryErrors
    within_sigma: float
    within_two_sigma: float
    mean_error_m: float
    seconds: float
    script_seconds: float
    peak_mib: float


def measure(scene: Scene, model: str = Parameters.model) -> Result:
    """Extract the lines of a scene by this project and by the plain script, and compare both with the truth."""
    clouds = _through_a_file(scene)
    standard = scene.standard
    start = time.perf_counter()
    parameters = Parameters(
        standard.gauge_m,
        standard.head_width_m,
        other_gauges_m=scene.other_gauges_m,
        quality_step_m=QUALITY_STEP_M,
        model=model,
    )
    network = extract_rails(clouds, parameters)
    seconds = time.perf_counter() - start
    peak_mib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    rails = match([_local(scene, network, rail.xyz) for rail in network.rails], scene.rails)
    true_rails, true_centerlines = (
        [network.frame.to_local(scene.frame.to_crs(line)) for line in lines]
        for lines in (scene.rails, scene.centerlines)
    )
    sigma_m = local_sigma(network.rails, rails)
    start = time.perf_counter()
    script = match(script_lines(scene.rail_points(), standard.gauge_m, standard.head_width_m), scene.rails)
    return Result(
        scene=scene.name,
        rails=rails,
        centerlines=match([_local(scene, network, line.xyz) for line in network.centerlines], scene.centerlines),
        script=script,
        tracks=compare_tracks(network.centerlines, network.rails, true_rails, standard.head_width_m),
        geometry=compare_geometry(network.geometry, true_rails, true_centerlines, standard.head_width_m),
        within_sigma=rails.share_within(sigma_m),
        within_two_sigma=rails.share_within(2 * sigma_m),
        mean_error_m=_mean_error(scene),
        seconds=seconds,
        script_seconds=time.perf_counter() - start,
        peak_mib=peak_mib,
    )


def _through_a_file(scene: Scene) -> tuple[RailPoints, ...]:
    """Write the cloud of a scene to a file and read it, as a run by a user does."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cloud.laz"
        write_cloud(scene, path)
        return read_rail_points([path], [RAIL])


def local_sigma(rails: Sequence[RailLine], found: Match) -> np.ndarray:
    """Interpolate the standard error of our rails at each place that was compared, (n,) metres."""
    sigma_m = np.empty(len(found.line))
    for number, rail in enumerate(rails):
        if rail.support is None:
            raise ValueError(f"The rail {rail.rail_id} has no standard error.")
        mine = found.line == number
        sigma_m[mine] = np.interp(found.t[mine], rail.support.t, rail.support.sigma_m)
    return sigma_m


def _local(scene: Scene, network: RailNetwork, xyz: np.ndarray) -> np.ndarray:
    """Transform a line of the result into the local metres of the scene."""
    return scene.frame.to_local(network.frame.to_crs(xyz))


def _mean_error(scene: Scene) -> float:
    """Compute w / sqrt(12 n) for the n points in the smoothing length of an average rail."""
    length_m = sum(length_along(rail)[-1] for rail in scene.rails)
    count = SMOOTHING_M * len(scene.rail_points().xyz) / length_m
    return scene.standard.head_width_m / np.sqrt(12 * count)
