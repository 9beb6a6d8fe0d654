"""Clean rasters of synthetic layouts, vectorized and smoothed, come back as the rails they were drawn from.

A line nearly parallel to the grid, or at 45 degrees to it, is quantized by up to half a cell over its whole length,
which smoothing cannot undo (docs/method.md section 4.15). Sections more than 4 degrees away from both show what the
vectorization itself adds. Rails that merge at a turnout's toe or cross at a small angle share cells there, so only
sections where a rail is apart from all others count.
"""

from dataclasses import replace

import numpy as np
import pytest
from rail_extract.core.lines.network_smoothing import smooth_network
from rail_extract.core.polyline import length_along
from rail_extract.core.raster import rasterize
from rail_extract.core.vectorize import vectorize
from rail_extract.laboratory.rasters.drawing import Window, draw_label
from rail_extract.laboratory.rasters.layouts import Layout, random_layout
from rail_extract.laboratory.rasters.pairs import BASE_RATIO, CELL_M, SPACING_M
from rail_extract.laboratory.rasters.paths import TrackSize
from scipy.ndimage import minimum_filter1d
from scipy.spatial import cKDTree

SIZE = TrackSize(SPACING_M, SPACING_M / (1 + BASE_RATIO))
SIDE = 768
SIGMA_M = 0.8
END_M = 3 * SIGMA_M
"""Length that is ignored next to free ends: the reach of smoothing."""
APART_M = 0.19
"""Distance between railhead centres from which two rails have separate cells, as at the narrowest third rail."""
OFF_GRID_DEG = 4.0
JUNCTION_M = 5 * SIGMA_M
"""Length over which the correction fades where lines are bent to a node."""


def clean_lines(layout, heading):
    """Turn a layout about its first spot, draw it on the grid of the product, vectorize it and turn the lines back."""
    turn = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
    half = SIDE * CELL_M / 2
    window = Window(SIDE, CELL_M, -half, half)
    label = np.zeros((SIDE, SIDE), dtype=bool)
    for rail in layout.rails:
        draw_label(label, window, (rail.xy - layout.spots[0]) @ turn, rail.normal @ turn, SIZE.head_width_m)
    rows, columns = np.nonzero(label)
    centres = np.column_stack([window.x0 + (columns + 0.5) * CELL_M, window.y0 - (rows + 0.5) * CELL_M])
    network = smooth_network(vectorize(rasterize(centres, CELL_M), SIZE.head_width_m), SIGMA_M)
    return [line @ turn.T + layout.spots[0] for line in network.lines]


def lateral_errors(lines, layout, heading):
    """Lateral distance, metres, from the nearest rail every 0.1 m along lines, where it is apart and off the grid."""
    errors = []
    trees = [cKDTree(rail.xy) for rail in layout.rails]
    for line in lines:
        along = length_along(line)
        stations = np.arange(END_M, along[-1] - END_M, 0.1)
        points = np.column_stack([np.interp(stations, along, column) for column in line.T])
        if len(points) == 0:
            continue
        distance, sample = (np.stack(values) for values in zip(*(tree.query(points) for tree in trees)))
        order = np.argsort(distance, axis=0)
        clear = np.take_along_axis(distance, order[1:2], axis=0)[0] > APART_M
        clear = minimum_filter1d(clear, 2 * int(JUNCTION_M / 0.1) + 1)
        for number, rail in enumerate(layout.rails):
            own = clear & (order[0] == number)
            nearest = sample[number, own]
            across = ((points[own] - rail.xy[nearest]) * rail.normal[nearest]).sum(axis=1)
            direction = np.degrees(np.arctan2(*rail.normal[nearest, ::-1].T) + heading)
            errors.append(across[np.abs((direction + 22.5) % 45.0 - 22.5) > OFF_GRID_DEG])
    return np.concatenate(errors)


def away_from_axes(layout):
    """Rotation that brings the first spot's track to 17 degrees with the grid."""
    rail = min(layout.rails, key=lambda rail: np.linalg.norm(rail.xy - layout.spots[0], axis=1).min())
    normal = rail.normal[np.linalg.norm(rail.xy - layout.spots[0], axis=1).argmin()]
    return np.radians(17.0) - np.arctan2(-normal[0], normal[1])


@pytest.mark.parametrize(
    ("family", "limit_m"),
    [
        *((family, 0.002) for family in ("plain", "curve", "parallel", "dual gauge", "diamond")),
        *((family, 0.003) for family in ("turnout", "crossover", "ladder", "yard")),
    ],
)
@pytest.mark.parametrize("seed", [1, 2])
def test_clean_rasters_come_back_as_their_rails(family, limit_m, seed):
    """Within 2 mm rms where rails cross or are alone; merging rails add up to 1 mm."""
    layout = random_layout(np.random.default_rng([40, seed]), SIZE, family)
    heading = away_from_axes(layout)
    errors = lateral_errors(clean_lines(layout, heading), layout, heading)
    assert len(errors) > 200
    assert np.sqrt(np.mean(errors**2)) < limit_m


def test_the_position_on_the_grid_does_not_matter():
    layout = random_layout(np.random.default_rng(5), SIZE, "plain")
    heading = away_from_axes(layout)
    for shift in ([0.013, 0.0], [0.007, 0.031]):
        moved = tuple(replace(rail, xy=rail.xy + shift) for rail in layout.rails)
        layout_there = Layout(moved, spots=layout.spots)
        errors = lateral_errors(clean_lines(layout_there, heading), layout_there, heading)
        assert abs(errors.mean()) < 0.0005
