"""Measure clearance on simulated double tracks with exact truth: objects, platforms, wires, distance of tracks, time.

Run `python benchmarks/clearance.py`, or give seeds: `python benchmarks/clearance.py 1 2`. It prints for each seed what
was found, missed and found where nothing stands, errors of depth against the standard errors, and seconds and memory.
`--cancel` measures instead how long a run over the densest cloud takes to end when it is cancelled at some moments.
"""

from __future__ import annotations

import argparse
import resource
import time
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import shapely
from rail_extract.core.clearance.frame import Course, course_of
from rail_extract.core.clearance.measure import Clearance, measure
from rail_extract.core.clearance.profiles import named
from rail_extract.core.clearance.settings import Settings
from rail_extract.core.clouds.points import ask
from rail_extract.core.errors import Cancelled
from rail_extract.core.progress import Progress
from rail_extract.core.run.tasks import Runner
from rail_extract.laboratory.curves import Element
from rail_extract.laboratory.scenes import clearance as scenes
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree

DENSITIES = {1: 400.0, 2: 600.0, 3: 800.0, 4: 1000.0, 5: 1500.0}
"""Points per square metre by seed."""

PROFILE = "EBO_G1"
HALF_M, FOOT_HALF_M, TOP_M = 1.645, 1.620, 4.310
"""Half widths of the profile above and below 1.17 m, and the height of its top."""

STEP_M, NEAR_M = 3.0, 1.2
"""Distance of the objects, and up to which a result belongs to one."""

ACROSS_M, UP_M = 0.0010, 0.0006
"""Standard errors of the rails across and in height."""

CORRELATED_M = 4.0
"""Length over which these errors wander: about that over which extracted rails are smoothed."""

DEPTHS_M = (0.005, 0.008, 0.015, 0.030, 0.080, 0.150)
SURE_M = 0.015
"""Depths of the objects, inside and outside; all of those of this depth or more are to be found, and none outside."""

PLATFORMS = ((20.0, 120.0, -1, 1.70, 0.55), (140.0, 230.0, -1, 1.72, 0.76))
"""From, to, side, offset and height of the platforms."""


MANY_PER_M2, MOMENTS = 1500.0, 8
"""Points per square metre, and parts of a run between which it is cancelled."""


@dataclass
class Score:
    """Errors that add up over the seeds; millimetres."""

    errors: list[float] = field(default_factory=list)
    sigmas: list[float] = field(default_factory=list)
    platforms: list[tuple[float, float]] = field(default_factory=list)
    wires: list[tuple[float, float]] = field(default_factory=list)
    distances: list[float] = field(default_factory=list)
    inside: int = 0
    missed: int = 0
    false: int = 0


def main() -> None:
    """Print a line for each seed, and one for all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("seeds", nargs="*", type=int, default=list(DENSITIES))
    parser.add_argument("--cancel", action="store_true", help="measure how long a cancelled run takes to end")
    arguments = parser.parse_args()
    if arguments.cancel:
        cancel()
        return
    score = Score()
    print("seed  pts/m2  points  inside missed  false   rms   max  <1s  <2s   seconds")
    for seed in arguments.seeds:
        density = DENSITIES.get(seed, 600.0)
        before = (len(score.errors), score.inside, score.missed, score.false)
        points, spent = objects(seed, density, score)
        things(seed, density, score)
        errors, sigmas = (np.array(one[before[0] :]) for one in (score.errors, score.sigmas))
        counts = (score.inside - before[1], score.missed - before[2], score.false - before[3])
        said = " ".join(f"{one:6d}" for one in counts)
        print(f"{seed:4d} {density:7.0f} {points / 1e6:6.1f}M  {said} {_row(errors, sigmas)} {spent:9.1f}", flush=True)
    said = " ".join(f"{one:6d}" for one in (score.inside, score.missed, score.false))
    print(f"{'all':22s}{said} {_row(np.array(score.errors), np.array(score.sigmas))}")
    for name, values in (("platform offset, height", score.platforms), ("wire stagger, height", score.wires)):
        table = np.array(values)
        mean, rms, most = table.mean(axis=0), np.sqrt((table**2).mean(axis=0)), np.abs(table).max(axis=0)
        print(f"{name}: mean {mean.round(2)}, rms {rms.round(2)}, largest {most.round(1)} mm")
    distances = np.array(score.distances)
    print(f"track distance: rms {np.sqrt(np.mean(distances**2)):.2f}, largest {np.abs(distances).max():.2f} mm")
    print(f"memory: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6:.2f} GB at most")


def _row(errors: np.ndarray, sigmas: np.ndarray) -> str:
    """Return root mean square, largest, and per cent within one and two standard errors."""
    size = np.abs(errors)
    within = (100 * np.mean(size < factor * sigmas) for factor in (1, 2))
    return f"{np.sqrt(np.mean(errors**2)):5.2f} {size.max():5.1f} " + " ".join(f"{one:4.0f}" for one in within)


def run(scene: scenes.Scene, rng: np.random.RandomState) -> tuple[Clearance, float]:
    """Measure a scene with rails that have errors; returns CPU seconds as well."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "cloud.laz"
        scenes.write_points(path, scene.points, scene.codes)
        request = ask(path, range(256))
        start = time.process_time()
        found = measure(request, _courses(scene, rng), Settings(named()[PROFILE]), Path(folder) / "work", Runner())
        return found, time.process_time() - start


def _courses(scene: scenes.Scene, rng: np.random.RandomState) -> list[Course]:
    """Return the tracks of a scene, whose rails have errors."""
    tracks, rails = scenes.lines_of(scene)
    made = []
    for track in tracks:
        own = []
        for rail in rails:
            if rail.rail_id in (*track.left_ids, *track.right_ids):
                across, up = ACROSS_M * _wandering(rng, len(rail.xyz)), UP_M * _wandering(rng, len(rail.xyz))
                own.append(replace(rail, xyz=rail.xyz + np.column_stack([across[:, None] * rail.line.normals, up])))
        middle = (own[0].xyz + own[1].xyz) / 2
        made.append(course_of(replace(track, xyz=middle), own))
    return made


def _wandering(rng: np.random.RandomState, count: int) -> np.ndarray:
    """Return errors of a line, (count,), with a standard deviation of 1 that wander over some metres."""
    found = gaussian_filter1d(rng.standard_normal(count + 200), CORRELATED_M / scenes.VERTEX_M)[100:-100]
    return found * np.sqrt(2 * np.sqrt(np.pi) * CORRELATED_M / scenes.VERTEX_M)


class Cancelling(Progress):
    """Cancels a run some seconds after its start, if ever."""

    def __init__(self, after_s: float = np.inf) -> None:
        self.moment = time.monotonic() + after_s

    def is_cancelled(self) -> bool:
        """Return whether the moment has come."""
        return time.monotonic() > self.moment


def cancel() -> None:
    """Print how long a run takes to end after it was cancelled, at moments from its start to its end."""
    scene = scenes.double_track(1, MANY_PER_M2, (Element(100.0),), 0.0, apart_m=4.5)
    scenes.bed(scene)
    for side in (1, -1):
        scenes.wall(scene, (1.0, 99.0), side, HALF_M - 0.02, (0.2, 6.0))
    courses = _courses(scene, scene.rng)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "cloud.laz"
        scenes.write_points(path, scene.points, scene.codes)
        given = ask(path, range(256)), courses, Settings(named()[PROFILE])
        start = time.monotonic()
        measure(*given, Path(folder) / "whole", Runner(), Cancelling())
        whole_s = time.monotonic() - start
        print(f"{len(scene.points) / 1e6:.1f}M points, {whole_s:.1f} s; cancelled after, ended after")
        for share in np.arange(1, MOMENTS) / MOMENTS:
            progress = Cancelling(share * whole_s)
            with suppress(Cancelled):
                measure(*given, Path(folder) / f"{share}", Runner(), progress)
            print(f"{share * whole_s:6.1f} s {time.monotonic() - progress.moment:6.2f} s", flush=True)


def objects(seed: int, density: float, score: Score) -> tuple[int, float]:
    """Score objects inside and outside; returns points and CPU seconds."""
    scene = scenes.double_track(seed, density, apart_m=4.5)
    scenes.bed(scene)
    sizes = [sign * size for size in DEPTHS_M for sign in (1, -1)]
    places = [(s, side) for s in np.arange(6.0, 254.0, STEP_M) for side in (1, -1)]
    for number, (s, side) in enumerate(places):
        depth, kind = sizes[number % len(sizes)], number // len(sizes) % 4
        if kind == 0:
            scenes.plate(scene, s, side, HALF_M - depth, (1.5, 2.6))
        elif kind == 3:
            scenes.plate(scene, s, side, FOOT_HALF_M - depth, (0.5, 1.1), 1.0)
        else:
            scenes.pole(scene, s, side, HALF_M - depth, (0.2, 3.1), (0.11, 0.30)[kind - 1])
    for number, depth in enumerate(sizes[:6]):
        scenes.beam(scene, 4.5 + 40.0 * number, TOP_M - depth, 0.6, 0.5)
    scenes.stray(scene, 40)
    found, spent = run(scene, scene.rng)
    mine = [one for one in found.intrusions if one.track_id == 1]
    for truth in scene.truth:
        depth = true_depth(truth)
        here = [one for one in mine if belongs(one, truth)]
        deepest = max(here, key=lambda one: one.pen_mm, default=None)
        score.inside += depth >= SURE_M - 1e-9
        score.missed += depth >= SURE_M - 1e-9 and deepest is None
        score.false += depth <= -SURE_M and deepest is not None and bool(deepest.sure)
        if depth > 0 and deepest is not None:
            score.errors.append(deepest.pen_mm - 1000 * depth)
            score.sigmas.append(deepest.sigma_mm)
    score.false += sum(not any(belongs(one, truth) for truth in scene.truth) for one in mine if one.sure)
    score.distances += (1000 * (found.stations[0].left.distance_m - _distance(found))[2:-2]).tolist()
    return len(scene.points), spent


def _distance(found: Clearance) -> np.ndarray:
    """Return the distance of the tracks' lines as they are, by brute force, (n,)."""
    one, other = found.courses
    fine = np.column_stack(
        [np.interp(np.arange(0, other.length_m, 0.01), other.s, column) for column in other.xyz[:, :2].T]
    )
    return cKDTree(fine).query(found.stations[0].xyz[:, :2])[0]


def belongs(one, truth: scenes.Truth) -> bool:
    """Return whether a result is of an object."""
    is_beam = truth.kind == "beam"
    side = is_beam or one.side == ("left" if truth.side > 0 else "right")
    return side and abs(one.chainage_m - truth.s) < NEAR_M and (one.w_mm > 4200) == is_beam


def true_depth(truth: scenes.Truth) -> float:
    """Return the depth of a surface, metres, by shapely."""
    ring = named()[PROFILE].points
    places = shapely.points(truth.surface[:, 1:])
    away = shapely.distance(shapely.LineString(ring), places)
    depth = np.where(shapely.contains(shapely.Polygon(ring), places), away, -away)
    return float(depth[truth.surface[:, 2] >= ring[0][1]].max())


def things(seed: int, density: float, score: Score) -> None:
    """Score platforms and wires."""
    scene = scenes.double_track(100 + seed, density, apart_m=4.5)
    scenes.bed(scene, 2.0)
    scenes.catenary(scene, per_m=max(60.0, density / 10))
    for start, end, side, offset, height in PLATFORMS:
        scenes.platform(scene, (start, end), side, offset, height)
    found, _ = run(scene, scene.rng)
    for edge in found.platforms:
        start, _, _, offset, height = min(PLATFORMS, key=lambda one: abs(one[0] - edge.s[0]))
        score.platforms.append((1000 * float(np.abs(edge.v).mean() - offset), 1000 * float(edge.w.mean() - height)))
    (course, *_), wires = found.courses, [one for one in found.wires if one.course == 0]
    fine = np.concatenate([low + np.linspace(0, 1, 3001)[:, None] * (high - low) for low, high in scene.wire])
    s, v, w = course.located(fine, cKDTree(course.xyz[:, :2]).query(fine[:, :2])[1])
    order = np.argsort(s)
    s, v, w = (column[order][np.isfinite(s[order])] for column in (s, v, w))
    for wire in wires:
        off = wire.v - np.interp(wire.s, s, v), wire.w - np.interp(wire.s, s, w)
        score.wires += (1000 * np.column_stack(off)).tolist()


if __name__ == "__main__":
    main()
