"""Points around places, and how a cross-section shows them."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rail_extract.core.clouds import cross_sections
from rail_extract.core.clouds.cross_sections import CrossSection, cross_section_at, points_near
from rail_extract.core.clouds.points import ask, read_rail_points

SAMPLE = Path(__file__).resolve().parents[3] / "resources" / "sample" / "sample.laz"


def test_points_are_those_within_reach_of_each_place():
    (cloud,) = read_rail_points(SAMPLE, [10])
    xyz = cloud.frame.to_crs(cloud.xyz)
    places = [*xyz[[0, 40_000, 40_000]], xyz[0] + [500.0, 0.0, 0.0]]
    found = points_near(ask(SAMPLE, [10]), places, 1.5)
    for place, near in zip(places, found):
        expected = xyz[np.hypot(*(xyz - place)[:, :2].T) <= 1.5]
        np.testing.assert_allclose(near, expected, atol=1e-6)
    assert len(found[0]) > 50 and not len(found[3])


def test_files_without_a_place_are_not_read(monkeypatch):
    request, read = ask(SAMPLE, [10]), []
    monkeypatch.setattr(cross_sections.Request, "read", lambda self, header, progress: read.append(header) or iter(()))
    west, south, east, north = request.headers[0].extent
    points_near(request, [np.array([east + 2.0, south, 0.0])], 1.5)
    assert not read
    points_near(request, [np.array([east + 1.0, south, 0.0])], 1.5)
    assert len(read) == 1


@given(st.floats(-3.1, 3.1), st.tuples(*3 * [st.floats(-5, 5)]))
def test_a_section_keeps_distances_and_the_right_is_on_the_right(angle, point):
    section = CrossSection(np.array([7.0, -3.0, 2.0]), np.array([np.cos(angle), np.sin(angle)]))
    ((ahead, right, up),) = section.seen(np.array([section.place + point]))
    assert np.hypot(ahead, right) == pytest.approx(np.hypot(point[0], point[1]), abs=1e-9)
    assert up == pytest.approx(point[2], abs=1e-9)
    turned = section.direction[1], -section.direction[0]
    assert right == pytest.approx(point[0] * turned[0] + point[1] * turned[1], abs=1e-9)


def test_lines_cross_a_section_where_they_are():
    line = np.array([[0.0, 0.0, 10.0], [10.0, 0.0, 11.0], [10.0, 10.0, 12.0]])
    section = cross_section_at(line, 0.75)
    np.testing.assert_allclose(section.place, [10, 5, 11.5])
    np.testing.assert_allclose(section.direction, [0, 1])
    rail = np.array([[9.0, 0.0, 11.0], [9.5, 10.0, 12.0], [8.0, 20.0, 12.0], [12.0, 4.0, 14.0]])
    np.testing.assert_allclose(section.crossings(rail), [[-0.75, 0.0], [1.75, 2.375]])
    assert cross_section_at(line, 1.0).direction.tolist() == [0, 1]
    assert section.crossings(rail[:1]).shape == (0, 2)
