"""Guides proposed for a cloud without any: on the tracks, none in a landscape without a railway."""

from dataclasses import replace

import numpy as np
import pytest
from rail_extract.core.airborne.proposals import propose_guides
from rail_extract.core.airborne.run import Run
from rail_extract.core.clouds.points import ask
from rail_extract.core.errors import CloudError, NoRailPointsError, ParameterError
from rail_extract.core.parameters import AirborneParameters
from rail_extract.core.tasks import InTurn
from rail_extract.laboratory.airborne.flight import AirborneCloud, Flight, fly
from rail_extract.laboratory.airborne.landscapes import countryside
from rail_extract.laboratory.airborne.write import ORIGIN, write_airborne
from scipy.spatial import cKDTree

PARAMETERS = AirborneParameters(1.435, 0.072, footprint_m=0.25)


def proposed(cloud, folder, codes=(1, 2), parameters=PARAMETERS):
    write_airborne(cloud, folder / "cloud.las")
    return propose_guides(Run(ask(folder / "cloud.las", codes), parameters, folder / "points", InTurn()))


def test_guides_lie_on_both_tracks_and_have_few_vertices(flown, tmp_path):
    found = proposed(flown.cloud, tmp_path)
    assert [one.guide_id for one in found.guides] == [1, 2]
    assert found.density == pytest.approx(10, rel=0.15)
    truths = cKDTree(np.concatenate([flown.design.truth(number)[:, :2] for number in (0, 1)]))
    for one in found.guides:
        places = found.frame.to_crs(one.xyz)[:, :2] - ORIGIN[:2]
        assert np.median(truths.query(places)[0]) < 0.2
        assert one.score > 90
        assert one.length_m > 200
        assert len(one.xyz) <= one.length_m / 10
    assert found.length_m == sum(one.length_m for one in found.guides)
    assert not list((tmp_path / "points").glob("*/*_*"))


def test_a_landscape_without_a_railway_has_none(tmp_path):
    made = replace(countryside(4), width_m=30.0)
    found = proposed(fly(made.world, made.where[:120], made.width_m, Flight(8.0, 0.25), seed=4), tmp_path)
    assert found.guides == ()
    assert "No track was found" in found.summary


def test_other_classes_and_mobile_clouds_are_refused(flown, tmp_path):
    with pytest.raises(NoRailPointsError, match="no points of class 6"):
        proposed(flown.cloud, tmp_path, (6,))
    xyz = np.random.RandomState(1).uniform(0, 1, (72_000, 3)) * [12.0, 10.0, 0.05] + [0, 0, 100.0]
    with pytest.raises(CloudError, match="use Extract Rails"):
        proposed(AirborneCloud(xyz, np.zeros(len(xyz), int)), tmp_path)


def test_a_wide_footprint_is_refused_before_anything_is_read(flown, tmp_path):
    with pytest.raises(ParameterError, match="With a footprint of 0.5 m, tracks can't be told from roads: draw guides"):
        proposed(flown.cloud, tmp_path, parameters=replace(PARAMETERS, footprint_m=0.5))
    assert not (tmp_path / "points").exists()
