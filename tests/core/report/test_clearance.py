"""The page about the clearance: its verdicts."""

import numpy as np
import pytest
from rail_extract.core.clearance.measure import measure
from rail_extract.core.clearance.profiles import named
from rail_extract.core.clearance.settings import Settings
from rail_extract.core.clouds.points import ask
from rail_extract.core.report.clearance import clearance_page, summary, verdict
from rail_extract.core.report.clearance_pictures import diagram, slices
from rail_extract.core.run.tasks import Runner
from rail_extract.laboratory.curves import Element
from rail_extract.laboratory.scenes import clearance as scenes


@pytest.fixture
def measured(tmp_path):
    """Return a function that measures a short straight with a plate at a depth."""

    def measured(depth_m, bed=True, with_rails=True, cant_m=0.0):
        scene = scenes.double_track(1, 400.0, (Element(60.0, 1 / 300, 1 / 300),), cant_m, 0.0, apart_m=0)
        if bed:
            scenes.bed(scene, 3.0)
        scenes.plate(scene, 30.0, -1, 1.645 - depth_m, (1.5, 2.5))
        scenes.write_points(tmp_path / "cloud.laz", scene.points, scene.codes)
        request = ask(tmp_path / "cloud.laz", range(256))
        courses = scenes.courses_of(scene, with_rails)
        return measure(request, courses, Settings(named()["EBO_G1"]), tmp_path / "work", Runner())

    return measured


def test_a_place_inside(measured):
    kind, words = verdict(measured(0.050))
    assert (kind, words.split(",")[0]) == ("poor", "1 place inside the profile")
    assert "of track 1 on the right" in words
    assert words.endswith("on the right.")


def test_free(measured):
    found = measured(-0.100)
    kind, words = verdict(found)
    assert kind == "good"
    assert words.startswith("Free. The least margin is ")
    assert 80 < 1000 * found.least_margin_m < 100


def test_the_diagram_shows_platforms_on_their_side(tmp_path):
    scene = scenes.double_track(1, 400.0, (Element(60.0),), 0.0, 0.0, apart_m=0)
    scenes.platform(scene, (10.0, 50.0), -1, 1.70, 0.55)
    scenes.write_points(tmp_path / "cloud.laz", scene.points, scene.codes)
    given = ask(tmp_path / "cloud.laz", range(256)), scenes.courses_of(scene), Settings(named()["EBO_G1"])
    left, right = diagram(measure(*given, tmp_path / "work", Runner()), 0).split("Least margin on the right")
    assert "platform, 1,700 mm aside and 550 mm high" in right and "platform, " not in left


def test_nothing_beside_the_track(measured):
    assert verdict(measured(-1.8)) == ("good", "Free. Nothing stands within reach.")


def test_too_few_points(measured):
    assert verdict(measured(-0.100, bed=False)) == ("poor", "Cannot be judged.")


def test_canted_track_without_rails(measured):
    assert verdict(measured(-0.100, with_rails=False, cant_m=0.12)) == ("poor", "Cannot be judged.")


def test_the_page_states_profile_and_cross_section(measured):
    found = measured(0.050)
    page = clearance_page(found, tuple(slices(found)), "cloud.laz", {"Command": "clearance"})
    assert "annex 7 picture 1" in page
    assert page.count('aria-label="Cross-section') == 1
    assert "no proof of conformity" in page
    assert len(summary(found)) == 2
    assert np.isfinite(found.least_margin_m)


@pytest.mark.parametrize(("depth_m", "marked"), [(0.050, True), (-0.100, False)])
def test_the_map_marks_the_stretch_inside(measured, depth_m, marked):
    found = measured(depth_m)
    page = clearance_page(found, (), "cloud.laz", {})
    plan = page[page.index('aria-label="Map of the tracks"') :]
    assert ('class="offgauge mark"' in plan[: plan.index("</svg>")]) == marked
