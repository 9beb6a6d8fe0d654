import numpy as np
import pytest
from rail_extract.core.standards import STANDARDS
from rail_extract.laboratory.rasters.turnouts import FORMS, branch
from rail_extract.laboratory.ruler.classification import hectares, lines_from, score
from rail_extract.laboratory.ruler.lines import cut, match, nearest
from rail_extract.laboratory.scenes.plain import spacing
from rail_extract.laboratory.scenes.raw import scan_world
from rail_extract.laboratory.scenes.raw_catalogue import MOBILE, NEGATIVE, parallel
from rail_extract.laboratory.scenes.raw_catalogue import line as plan
from rail_extract.laboratory.scenes.raw_scanner import MIXED, RawScanner, Segments, cast
from rail_extract.laboratory.scenes.raw_world import (
    FASTENING,
    FOOT,
    GROUND,
    HEAD,
    SLEEPER,
    ground,
    outline,
    rail_place,
    running_rails,
    ways_of,
)
from rail_extract.laboratory.scenes.tracks import Track


@pytest.fixture(scope="module")
def plain():
    curve = plan(15.0, 1 / 300, 0.4)
    return scan_world(
        "plain", parallel(curve, (0.0,)), STANDARDS["EN_60E1_1435"], [RawScanner()], [ground, running_rails], 3
    )


def test_rays_hit_what_comes_first():
    number = np.zeros(3, dtype=int)
    start, end = np.array([[-5.0, 0.0], [-0.5, 1.0], [2.0, 0.0]]), np.array([[5.0, 0.0], [0.5, 1.0], [2.0, 3.0]])
    segments = Segments(number, start, end, np.array([1, 2, 3], dtype=np.uint8))
    scanner = RawScanner(ray_step_rad=0.001, noise_m=0.0, footprint_m=0.0, half_range_m=1e9)
    hits = cast(segments, np.array([[0.0, 2.0]]), scanner, np.random.RandomState(1))
    across, height = hits.place.T
    assert (np.abs(height[hits.kind == 2] - 1.0) < 1e-9).all()
    assert (np.abs(across[hits.kind == 3] - 2.0) < 1e-9).all()
    shadow = np.abs(across[hits.kind == 1])
    assert shadow.min() == pytest.approx(1.0, abs=0.01)
    assert across[hits.kind == 1].max() == pytest.approx(2.0, abs=0.01)


def test_a_rail_has_the_width_of_its_head_and_a_foot():
    shape, head = outline(0.072)
    assert np.ptp(shape[:, 0]) == pytest.approx(0.150)
    of_head = shape[np.append(head, False) | np.insert(head, 0, False)]
    # 72 mm at 14 mm below the top; the faces widen by 1 in 20 and end 37.5 mm below it.
    assert np.ptp(of_head[:, 0]) == pytest.approx(0.0743, abs=1e-4)
    assert np.ptp(of_head[of_head[:, 1] > -0.015, 0]) == pytest.approx(0.072)
    assert of_head[:, 1].min() == pytest.approx(-0.0375)
    assert shape[:, 1].max() == pytest.approx(0.0)
    assert shape[:, 1].min() == pytest.approx(-0.172)


def test_points_at_both_edges_of_a_head_are_mixed():
    count = 2000
    number = np.arange(count)
    kinds = np.repeat(np.array([GROUND, HEAD], dtype=np.uint8), count)
    ends = [np.tile(place, (count, 1)) for place in ([-1.0, 0.0], [1.0, 0.0], [-0.036, 0.15], [0.036, 0.15])]
    segments = Segments(np.concatenate([number, number]), np.concatenate(ends[::2]), np.concatenate(ends[1::2]), kinds)
    order = np.argsort(segments.profile, kind="stable")
    segments = Segments(*(values[order] for values in (segments.profile, segments.start, segments.end, segments.kind)))
    scanner = RawScanner(noise_m=0.0, view_rad=(-0.1, 0.1))
    hits = cast(segments, np.tile([0.0, 4.0], (count, 1)), scanner, np.random.RandomState(1))
    head = hits.place[hits.kind == HEAD, 0]
    assert np.mean(head) == pytest.approx(0.0, abs=2e-4)
    mixed = hits.place[hits.kind == MIXED]
    assert np.mean(mixed[:, 0] > 0) == pytest.approx(0.5, abs=0.05)
    assert np.mean(mixed[:, 1] > 0.075) == pytest.approx(0.5, abs=0.05)


def test_the_rails_of_a_branch_and_of_a_canted_track_are_a_gauge_apart():
    main = plan(60.0, 0.0, 0.4)
    side = branch(main, 5.0, next(form for form in FORMS if form.name == "300-1:9"), 1, 20.0)
    standard = STANDARDS["EN_60E1_1435"]
    tracks = [Track(curve, spacing(standard), cant_m=cant) for curve, cant in ((main, 0.1), (side, 0.0))]
    station = np.arange(0.0, 60.0, 0.1)
    for way, track in zip(ways_of(main, station, tracks), tracks):
        for number, one in zip((1, -1), track.rails()):
            left, top = rail_place(way, number)
            there = np.flatnonzero(np.isfinite(left))[5:-5]
            xy = [
                np.interp(station, main.chainage, main.xy[:, axis])
                + left * np.interp(station, main.chainage, main.left_normal[:, axis])
                for axis in (0, 1)
            ]
            places = np.column_stack([*xy, top])[there]
            feet, _ = nearest(places, cut([one]))
            assert np.abs(places - feet).max() < 0.0005


def test_points_lie_where_their_kind_says(plain):
    def above(kind):
        return plain.xyz[plain.kind == kind, 2]

    assert {HEAD, FOOT, SLEEPER, FASTENING} <= set(np.unique(plain.kind))
    assert np.median(above(HEAD)) == pytest.approx(0.0, abs=0.08)
    assert np.median(above(SLEEPER)) == pytest.approx(np.median(above(HEAD)) - 0.18, abs=0.02)


def test_a_scene_is_the_same_each_time():
    one, other = (MOBILE["narrow"](4) for _ in range(2))
    np.testing.assert_array_equal(one.xyz, other.xyz)


def test_heads_are_found_and_nothing_else(plain):
    result, rail = score(plain)
    assert result.recall > 0.99
    assert result.precision > 0.99
    assert rail.sum() == result.figures.points


def test_labels_of_everything_score_badly(plain, monkeypatch):
    from rail_extract.core.classify.square import Classified
    from rail_extract.core.rails import SearchFigures
    from rail_extract.laboratory.ruler import classification

    everything = Classified(np.ones(len(plain.xyz), dtype=bool), SearchFigures())
    monkeypatch.setattr(classification, "classify_cloud", lambda *_: everything)
    result, _ = score(plain)
    assert result.recall == 1.0
    assert result.precision < 0.1


def test_lines_of_the_labels_lie_on_the_rails(plain):
    pytest.importorskip("torch")
    found = lines_from(plain, plain.head).within(0.05)
    assert found.completeness > 0.98


def test_lines_without_truth_are_wrong_over_their_whole_length(plain):
    found = match([np.array([[0.0, 0, 0], [30, 0, 0]]), np.array([[0.0, 5, 0], [0, 17, 0]])], [])
    assert found.wrong_m() == pytest.approx(42.0)
    assert found.within(0.05).correctness == 0.0
    assert np.isnan(found.within(0.05).completeness)
    nothing = lines_from(plain, np.zeros(len(plain.xyz), dtype=bool))
    assert nothing.wrong_m() == 0.0 and nothing.within(0.05).completeness == 0.0
    # 15 m long and 28 m wide; squares at its edges are partly outside.
    assert hectares(plain) == pytest.approx(0.042, rel=0.15)


@pytest.mark.parametrize("name", ["street", "car park", "quarry from the air"])
def test_nothing_is_found_where_there_are_no_rails(name):
    result, _ = score(NEGATIVE[name](5))
    assert result.wrong == 0
    assert np.isnan(result.recall)
