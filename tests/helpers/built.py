"""Lines, points and results as tests make them: plain values everywhere, but for what a test is about."""

from __future__ import annotations

import numpy as np
from rail_extract.core.clouds.points import RailPoints
from rail_extract.core.frame import LocalFrame
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.rails import Centerline, RailLine, Support, TrackGeometry
from rail_extract.core.tiles.grid import MemorySource
from rail_extract.laboratory.scenes.raw_shapes import flat, rough, with_track

ORIGIN = LocalFrame(np.zeros(3))
IN_FEET = LocalFrame(np.array([387_600.0, 1_430_200.0, 500.0]), 0.3048, 0.3048)


def arc(radius_m, length_m, step_m=0.1):
    """Places on an arc to the left from the origin, eastward, (n, 2)."""
    angle = np.linspace(0.0, length_m / radius_m, round(length_m / step_m) + 1)
    return radius_m * np.column_stack([np.sin(angle), 1 - np.cos(angle)])


def rail_of(line, rail_id=1, **fields):
    """A rail along a line, (n, 2) or (n, 3), of class 10; a plan is at height 0."""
    line = np.asarray(line, dtype=float)
    xyz = line if line.shape[1] == 3 else np.column_stack([line, np.zeros(len(line))])
    plain = {"class_code": 10, "points": 0, "resid_mm": 0.0, "sigma_mm": 0.0, "bridged_m": 0.0}
    return RailLine(xyz, rail_id, **{**plain, **fields})


def rails_of(*lines, **fields):
    """Rails 1, 2 and so on along lines."""
    return [rail_of(line, number, **fields) for number, line in enumerate(lines, start=1)]


def beside(curve, *lefts):
    """Lines, (n, 2), at distances to the left of a curve."""
    return [curve.offset(left)[::10] for left in lefts]


def tracks(curve, *axes, spacing=1.507):
    """Lines of the rails, left and right, of tracks whose axes are at distances to the left of a curve."""
    return beside(curve, *(axis + side * spacing / 2 for axis in axes for side in (1, -1)))


def centerline_of(xyz, track_id=1, left_ids=(1,), right_ids=(2,), gauge_mm=1435.0, gaugesd_mm=0.0, **fields):
    """A centerline, (n, 3), of class 10 without cant and gaps."""
    plain = {"class_code": 10, "cant_mm": 0.0, "cantmax_mm": 0.0, "bridged_m": 0.0}
    names = {"left_ids": left_ids, "right_ids": right_ids, "gauge_mm": gauge_mm, "gaugesd_mm": gaugesd_mm}
    return Centerline(np.asarray(xyz), track_id, **{**plain, **names, **fields})


def geometry_of(xyz, chainage_m, track_id=1, **profiles):
    """Stations of a straight and level track at gauge that one strip shows well, but for `profiles`."""
    zero = np.zeros(len(chainage_m))
    plain = {"gauge_mm": zero + 1435.0, "cant_mm": zero, "twist_mm": zero, "radius_m": zero + np.nan, "grade_pm": zero}
    plain |= {"sigma_mm": zero + 1.5, "sigmaz_mm": zero + 0.5, "points": np.full(len(zero), 200), "bridged": zero > 0}
    plain |= {"strips": np.ones(len(zero), dtype=int), "strip_mm": zero + np.nan}
    return TrackGeometry(track_id, xyz, np.asarray(chainage_m), **{**plain, **profiles})


def support_of(length_m, sigma_m=0.001, points=10, step_m=0.25):
    """Evidence for a rail at stations along it: as many points at each, and their standard error."""
    t = np.arange(step_m / 2, length_m, step_m)
    return Support.of_one_strip(t, np.full(len(t), points), np.full(len(t), sigma_m))


def network_of(*lines):
    """Lines, (n, 2), that meet nowhere."""
    lines = tuple(np.asarray(line, dtype=float) for line in lines)
    return LineNetwork(
        lines, np.concatenate([line[[0, -1]] for line in lines]), np.arange(2 * len(lines)).reshape(-1, 2)
    )


def check_meeting(network):
    """Assert that lines end in their nodes and pass through those of others."""
    for line, ends in zip(network.lines, network.ends):
        np.testing.assert_array_equal(line[[0, -1]], network.nodes[ends])
    for node, line, vertex in network.passes.tolist():
        assert 0 < vertex < len(network.lines[line]) - 1
        np.testing.assert_array_equal(network.lines[line][vertex], network.nodes[node])


def cloud_of(*parts, code=10, **fields):
    """Rail points of a class from parts, (n, 3) local metres."""
    return RailPoints(np.concatenate(parts), ORIGIN, code, **fields)


def source_of(*parts, code=10, side_m=500.0):
    """The same, to be read square by square."""
    return MemorySource(cloud_of(*parts, code=code), side_m)


def raw_track(size_m, per_m2, seed=3, angle=0.3):
    """Points of a square of raw cloud with a track on ballast, (n, 3), and which are on heads."""
    rng = np.random.RandomState(seed)
    xyz, on = with_track(flat(size_m, rng=rng, per_m2=per_m2), 1.435, 0.072, angle)
    return rough(xyz, rng), on


def rms(values):
    """Root mean square of the values that are known."""
    return float(np.sqrt(np.nanmean(np.square(values))))


def slanted_cloud(seed=0, count=4000, length=150.0):
    """Rail points along a slanted line, in a coordinate system in feet."""
    along = np.random.RandomState(seed).uniform(0, length, count)
    return RailPoints(np.column_stack([along, 0.4 * along, np.full(count, 3.0)]), IN_FEET, 10)
