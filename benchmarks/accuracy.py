"""Print how far extracted lines lie from the truth on synthetic scenes, beside what a plain script reaches.

Run `python benchmarks/accuracy.py [SCENE ...]`.
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from peer import peer_lines
from rail_extract.core.pipeline import Parameters, extract_rails
from rail_extract.core.points import RailPoints, read_rail_points
from rail_extract.core.rails import RailNetwork, length_along
from rail_extract.core.synthetic.compare import Match, match
from rail_extract.core.synthetic.compare_tracks import TrackErrors, compare_tracks
from rail_extract.core.synthetic.scene import RAIL, Scene
from rail_extract.core.synthetic.scenes import SCENES
from rail_extract.core.synthetic.write import write_cloud
from tables import error_table, found_table

SMOOTHING_M = 0.8
"""Smoothing in plan, whose length holds the n points of w / sqrt(12 n)."""


@dataclass(frozen=True)
class Result:
    """What became of one scene.

    Attributes
    ----------
    scene : str
    rails, centerlines, peer : Match
        Our lines and the plain script's rails against the truth.
    tracks : TrackErrors
    within_sigma : float
        Share of our rails' lateral errors that are at most their own sigma_mm.
    mean_error_m : float
        Standard error of a mean of the points in the smoothing length, spread evenly across the head.
    seconds, peer_seconds : float
    peak_mib : float
        Most memory up to the end of our own extraction.
    """

    scene: str
    rails: Match
    centerlines: Match
    peer: Match
    tracks: TrackErrors
    within_sigma: float
    mean_error_m: float
    seconds: float
    peer_seconds: float
    peak_mib: float


def main() -> None:
    """Print the tables for the scenes named on the command line, or all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", choices=[*SCENES, []], metavar="SCENE", help=f"of {', '.join(SCENES)}")
    arguments = parser.parse_args()
    results = [_measured(name) for name in arguments.scenes or SCENES]
    print(found_table(results), error_table(results), sep="\n\n")


def _measured(name: str) -> Result:
    """Measure one scene in a process of its own, whose peak memory is the scene's."""
    print(name, file=sys.stderr, flush=True)
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        return pool.submit(measure, SCENES[name]()).result()


def measure(scene: Scene) -> Result:
    """Extract a scene's lines from its file, by us and by the plain script, and compare both with the truth."""
    clouds = _through_a_file(scene)
    standard = scene.standard
    start = time.perf_counter()
    parameters = Parameters(standard.gauge_m, standard.head_width_m, other_gauges_m=scene.other_gauges_m)
    network = extract_rails(clouds, parameters)
    seconds = time.perf_counter() - start
    peak_mib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    rails = match([_local(scene, network, rail.xyz) for rail in network.rails], scene.rails)
    true_rails = [network.frame.to_local(scene.frame.to_crs(rail)) for rail in scene.rails]
    start = time.perf_counter()
    peer = match(peer_lines(scene.rail_points(), standard.gauge_m, standard.head_width_m), scene.rails)
    return Result(
        scene=scene.name,
        rails=rails,
        centerlines=match([_local(scene, network, line.xyz) for line in network.centerlines], scene.centerlines),
        peer=peer,
        tracks=compare_tracks(network.centerlines, network.rails, true_rails, standard.head_width_m),
        within_sigma=rails.share_within(np.array([rail.sigma_mm / 1000 for rail in network.rails])),
        mean_error_m=_mean_error(scene),
        seconds=seconds,
        peer_seconds=time.perf_counter() - start,
        peak_mib=peak_mib,
    )


def _through_a_file(scene: Scene) -> tuple[RailPoints, ...]:
    """Write a scene's cloud and read it back, as a user's run would."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cloud.laz"
        write_cloud(scene, path)
        return read_rail_points([path], [RAIL])


def _local(scene: Scene, network: RailNetwork, xyz: np.ndarray) -> np.ndarray:
    """Bring a line of the network into the scene's local metres."""
    return scene.frame.to_local(network.frame.to_crs(xyz))


def _mean_error(scene: Scene) -> float:
    """Compute w / sqrt(12 n) for the n points in the smoothing length of an average rail."""
    length_m = sum(length_along(rail)[-1] for rail in scene.rails)
    count = SMOOTHING_M * len(scene.rail_points().xyz) / length_m
    return scene.standard.head_width_m / np.sqrt(12 * count)


if __name__ == "__main__":
    main()
