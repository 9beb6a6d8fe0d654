"""Surveys of files: the same from tiles as from one file, only what lies along the guides, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from heard import Heard
from rail_extract.core.airborne import files
from rail_extract.core.airborne.files import Run, survey_files
from rail_extract.core.airborne.survey import FLIGHT, GuideLine
from rail_extract.core.clouds.header import catalogue_text
from rail_extract.core.clouds.points import ask
from rail_extract.core.frame import LocalFrame
from rail_extract.core.parameters import AirborneParameters
from rail_extract.core.run.tasks import Runner
from rail_extract.laboratory.airborne.flight import AirborneCloud
from rail_extract.laboratory.airborne.write import ORIGIN, las_of, write_airborne
from rail_extract.laboratory.scenes.copc import write_copc

FOOT_M = 1200 / 3937
"""Length of the US survey foot."""

PARAMETERS = AirborneParameters(1.435, 0.072, footprint_m=0.25)


def guides(flown, move=(0.0, 0.0)):
    return [GuideLine(number + 1, guide + ORIGIN[:2] + move) for number, guide in enumerate(flown.guides)]


def survey(paths, given, folder, parameters=PARAMETERS, codes=(1, 2), progress=None):
    return survey_files(Run(ask(paths, codes), parameters, folder / "points", Runner(), progress or Heard()), given)


def write_tiles(cloud, axis, folder):
    """Write the cloud as two tiles on either side of its middle."""
    half = cloud.xyz[:, axis] < np.median(cloud.xyz[:, axis])
    for name, part in (("a", half), ("b", ~half)):
        write_airborne(AirborneCloud(cloud.xyz[part], cloud.strip[part]), folder / f"{name}.laz")


@pytest.fixture(scope="module")
def cloud(flown, tmp_path_factory):
    path = tmp_path_factory.mktemp("whole") / "cloud.laz"
    write_airborne(flown.cloud, path)
    return path


@pytest.fixture(scope="module")
def whole(flown, cloud):
    heard = Heard()
    return survey(cloud, guides(flown), cloud.parent, progress=heard), heard


def test_both_tracks_are_seen(whole):
    found, heard = whole
    assert [line.guide_id for line in found.lines] == [1, 2]
    assert found.seen_m > 0.95 * found.guides_m
    assert found.density == pytest.approx(10, rel=0.15)
    assert FLIGHT in heard.infos


def test_figures_are_metres_in_a_cloud_in_feet(flown, whole, tmp_path):
    feet = LocalFrame(np.array([984_250.0, 196_850.0, 500.0]), FOOT_M, FOOT_M, "EPSG:2263+6360")
    write_airborne(flown.cloud, tmp_path / "feet.laz", frame=feet)
    flat = [np.column_stack([one, np.zeros(len(one))]) for one in flown.guides]
    given = [GuideLine(number, feet.to_crs(one)[:, :2]) for number, one in enumerate(flat, start=1)]
    found = survey(tmp_path / "feet.laz", given, tmp_path)
    assert found.density == pytest.approx(whole[0].density, rel=0.05)
    for one, other in zip(found.tracks, whole[0].tracks):
        seen = (one.seen & other.seen).astype(bool)
        known = np.isfinite(one.radius_m) & np.isfinite(other.radius_m)
        assert min(seen.mean(), known.mean()) > 0.8
        assert np.array_equal(one.s_m, other.s_m)
        assert one.bed_m[seen] - 500 * FOOT_M == pytest.approx(other.bed_m[seen], abs=0.03)
        assert 1 / one.radius_m[known] == pytest.approx(1 / other.radius_m[known], abs=2e-4)
        assert one.cant_mm[seen] == pytest.approx(other.cant_mm[seen], abs=15)
        assert one.sigma_mm[seen] == pytest.approx(other.sigma_mm[seen], rel=0.5)
    for line, other in zip(found.lines, whole[0].lines):
        assert line.length_m == pytest.approx(other.length_m, abs=0.05)
        assert (line.seen_m, line.gauge_mm) == (other.seen_m, other.gauge_mm)


def test_tiles_and_squares_give_the_lines_of_one_file(flown, whole, tmp_path, monkeypatch):
    monkeypatch.setattr(files, "SIDE_M", 180.0)
    write_tiles(flown.cloud, 0, tmp_path)
    found = survey(tmp_path, guides(flown), tmp_path)
    assert len(list((tmp_path / "points").glob("*/*"))) >= 3
    for one, other in zip(found.tracks, whole[0].tracks):
        seen = (one.seen & other.seen).astype(bool)
        assert seen.mean() > 0.9
        moved = found.frame.to_crs(one.xyz) - whole[0].frame.to_crs(other.xyz)
        assert np.abs(moved[seen, :2]).max() < 0.02


@pytest.mark.parametrize("form", ["tiles", "catalogue", "octree"])
def test_every_form_of_a_cloud_gives_the_same_stations(flown, whole, tmp_path, form):
    if form == "octree":
        low = flown.cloud.xyz.min(axis=0) + ORIGIN - 1.0
        write_copc(las_of(flown.cloud), tmp_path / "cloud.copc.laz", low, 300.0, 4)
    else:
        write_tiles(flown.cloud, 1, tmp_path)
    if form == "catalogue":
        tiles = [(f"{name}.laz", 1, (0.0, 0.0, 1.0, 1.0)) for name in "ab"]
        (tmp_path / "all.vpc").write_text(catalogue_text(tiles, None), encoding="utf-8")
    found = survey(tmp_path / "all.vpc" if form == "catalogue" else tmp_path, guides(flown), tmp_path)
    for one, other in zip(found.tracks, whole[0].tracks):
        assert one.reason == other.reason
        for name in ("xyz", "sigma_mm", "bed_m", "cant_mm", "radius_m"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)


@pytest.mark.parametrize(
    ("change", "run_gauge_m", "seen", "warning"),
    [
        (
            lambda first, second: [replace(first, gauge_m=1.0), second],
            1.435,
            [2],
            "Along guide 1, rails with a gauge of about 1435 mm show, not 1000 mm as its field gauge states: correct "
            "it.",
        ),
        (
            lambda first, second: [first, second],
            1.52,
            [1, 2],
            "Along guides 1 and 2, rails with a gauge of about 1435 mm show, not 1520 mm as the rail standard states: "
            "choose another.",
        ),
        (
            lambda first, second: [first, second, GuideLine(3, np.array([second.xy[0], second.xy[0] + [9.0, 0.0]]))],
            1.435,
            [1, 2],
            "Guide 3 is left out: it is 9.0 m long, too short alone. Join it to the line that it continues.",
        ),
    ],
)
def test_a_wrong_gauge_and_a_short_guide_are_said(flown, cloud, tmp_path, change, run_gauge_m, seen, warning):
    given = change(*guides(flown))
    found = survey(cloud, given, tmp_path, replace(PARAMETERS, gauge_m=run_gauge_m))
    assert [line.guide_id for line in found.lines] == seen
    assert found.warnings == (warning,)


def test_a_sparse_cloud_with_a_wide_footprint_is_a_hint(flown, tmp_path):
    few = AirborneCloud(flown.cloud.xyz[::4], flown.cloud.strip[::4])
    write_airborne(few, tmp_path / "cloud.laz")
    found = survey(tmp_path / "cloud.laz", guides(flown), tmp_path, replace(PARAMETERS, footprint_m=0.5))
    assert "take the lines as hints" in found.warnings[0]
    assert found.lines
    assert all(line.hint for line in found.lines)


def test_points_far_from_the_guides_are_not_kept(flown, tmp_path):
    far = flown.cloud.xyz[:2000] + [0.0, 900.0, 0.0]
    both = AirborneCloud(np.concatenate([flown.cloud.xyz, far]), np.concatenate([flown.cloud.strip, [0] * 2000]))
    write_airborne(both, tmp_path / "cloud.laz")
    survey(tmp_path / "cloud.laz", guides(flown), tmp_path)
    kept = sum(file.stat().st_size for file in (tmp_path / "points").iterdir()) / 28
    assert kept <= len(flown.cloud.xyz)
