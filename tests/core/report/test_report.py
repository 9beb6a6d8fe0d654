"""The report: its findings, its words, and that it is a valid page for every network."""

import re
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
from built import centerline_of, geometry_of, rail_of
from hypothesis import given
from hypothesis import strategies as st
from rail_extract.core.checks.findings import (
    HOLE,
    LONE_RAIL,
    OFF_GAUGE,
    OFF_RAIL_MM,
    UNSUPPORTED,
    UNSURE,
    examine,
    list_findings,
    summary,
)
from rail_extract.core.frame import LocalFrame
from rail_extract.core.progress import metres
from rail_extract.core.rails import (
    HeadWidths,
    RailNetwork,
    SearchFigures,
    StripCourse,
)
from rail_extract.core.report import build_page
from rail_extract.core.report.markup import table, tag, text
from rail_extract.core.report.page import ADVICE, CLASSES_ADVICE
from rail_extract.core.report.plots import ticks

GAUGE_MM = 1435.0
FRAME = LocalFrame(np.array([500_000.0, 3_000_000.0, 400.0]))


def track(track_id=1, length_m=100.0, step_m=1.0, **profiles):
    """Return a straight track to the east; nothing is in doubt at its stations except as set by `profiles`."""
    along = np.arange(0.0, length_m + step_m / 2, step_m)
    count = len(along)
    xyz = np.column_stack([along, np.full(count, 5.0 * track_id), 0.002 * along])
    geometry = geometry_of(xyz, along, track_id, **{"grade_pm": np.full(count, 2.0), **profiles})
    return centerline_of(xyz, track_id, (2 * track_id - 1,), (2 * track_id,), GAUGE_MM, 0.5), geometry


def lone(length_m, rail_id=99):
    return rail_of([[0.0, 9.0], [length_m, 9.0]], rail_id, points=900, sigma_mm=1.0)


def network(*tracks, more_rails=(), frame=FRAME):
    rails = [
        rail_of(line.xyz, rail_id, points=9000, sigma_mm=1.0)
        for line, _ in tracks
        for rail_id in (*line.left_ids, *line.right_ids)
    ]
    lines, geometry = zip(*tracks) if tracks else ((), ())
    return RailNetwork((*rails, *more_rails), lines, frame, "PyTorch 2.0, CPU", geometry)


def page(*tracks, gauges_m=(1.435,), source="cloud.laz", facts=None, **more):
    return build_page(network(*tracks, **more), gauges_m, source, facts)


def elements(html, name):
    return [ET.fromstring(one) for one in re.findall(rf"<{name}\b.*?</{name}>", html, re.DOTALL)]


def headline(html):
    return re.search("<strong>(.*?)</strong>", html).group(1)


def at(count, *numbers):
    marked = np.zeros(count, dtype=bool)
    marked[list(numbers)] = True
    return marked


def stepping(size_m):
    """A track that steps to the side at 50 m."""
    line, geometry = track()
    along = line.xyz[:, 0]
    bent = line.xyz + np.column_stack([0 * along, size_m * np.clip((along - 49) / 2, 0, 1), 0 * along])
    return replace(line, xyz=bent), geometry


def first(count, value, other):
    return np.where(np.arange(101) < count, value, other)


GOOD = "Good throughout: every metre is supported by points, at gauge, with a small standard error."
LESS = "Less accurate than a track survey accepts: the standard error is above 5 mm across or in height on 80 % of the "


@pytest.mark.parametrize(
    ("one", "more", "words"),
    [
        (track(bridged=at(101, *range(20))), {}, "Usable"),
        (track(bridged=at(101, *range(60))), {}, "Poor"),
        (track(sigma_mm=first(80, 7.0, 1.0)), {}, LESS),
        (track(sigma_mm=first(80, 7.0, 1.0), bridged=at(101, *range(40))), {}, "Poor"),
        (track(), {"rails": [lone(3.0)]}, f"{GOOD} 1 rail does not belong to a track"),
        (track(), {"rails": [lone(9.0)]}, "Good, except for a few places to look at. 1 rail does not"),
        (
            track(),
            {"rails": [lone(90.0)]},
            "Usable, but look at the findings before you rely on the lines. 1 rail does",
        ),
        (track(strip_mm=np.full(101, 2.9)), {}, GOOD),
        (track(strip_mm=first(2, 3.1, np.nan)), {}, GOOD),
        (track(strip_mm=first(4, 3.1, np.nan)), {}, "Good, except"),
        (track(strip_mm=np.full(101, 8.0)), {}, "Usable"),
        *((track(), {"heads": HeadWidths(seen_m, 0.072)}, "Usable") for seen_m in (0.062, 0.082)),
        *((track(), {"heads": HeadWidths(seen_m, 0.072)}, GOOD) for seen_m in (0.0765, np.nan)),
        (stepping(0.03), {}, "Usable"),
        (track(), {"warnings": ("1 rail bends by more than 10° within a metre.",)}, GOOD),
    ],
)
def test_the_headline_follows_what_is_in_doubt(one, more, words):
    more = dict(more)
    whole = network(one, more_rails=more.pop("rails", ()))
    html = build_page(replace(whole, **more), (1.435,), "cloud.laz")
    assert headline(html).startswith(words)
    assert all(f"<li>{warning}</li>" in html for warning in more.get("warnings", ()))


def test_a_network_without_doubt_is_called_good():
    html = page(track())
    assert headline(html).startswith("Good throughout")
    assert "Where to look" not in html
    (tiles,) = elements(html, "h1")
    assert tiles.text == "Rail Extract report"
    for words in ("100.0 %", "1.5 mm", "1435.0 ± 0.5 mm", "straight", "PyTorch 2.0, CPU"):
        assert words in html


def test_every_metre_in_doubt_counts_once_under_the_most_severe_reason():
    gauge = np.full(101, GAUGE_MM)
    gauge[[20, 21, 50]] = GAUGE_MM + 40, GAUGE_MM - 15, np.nan
    sigma = np.full(101, 1.0)
    sigma[[20, 80, 81, 82]] = 9.0
    findings = examine(network(track(gauge_mm=gauge, sigma_mm=sigma, bridged=at(101, 21, 22))), (1.435,))
    assert findings.length_of(UNSUPPORTED) == pytest.approx(3)  # 21, 22, and 50, where the gauge is unknown
    assert findings.length_of(OFF_GAUGE) == pytest.approx(1)
    assert findings.length_of(UNSURE) == pytest.approx(3)
    assert findings.share == pytest.approx(0.07)
    assert findings.length_m == pytest.approx(100)


def test_a_gauge_is_off_only_beyond_its_own_standard_error():
    gauge, sigma = np.full(101, GAUGE_MM), np.full(101, 1.0)
    gauge[20:40] = GAUGE_MM - 15.0
    sigma[30:50] = 6.0
    findings = examine(network(track(gauge_mm=gauge, sigma_mm=sigma)), (1.435,))
    assert findings.length_of(OFF_GAUGE) == pytest.approx(10)
    assert findings.length_of(UNSURE) == pytest.approx(20)


def test_geometry_is_matched_by_track_whatever_its_order():
    """With the classes (11, 10), for example, the geometry is in the order of the classes."""
    whole = network(track(1, bridged=at(101, 10, 11)), track(2))
    for one in (whole, replace(whole, geometry=whole.geometry[::-1])):
        findings = examine(one, (1.435,))
        assert [(found.line.track_id, found.geometry.track_id) for found in findings.tracks] == [(1, 1), (2, 2)]
        assert [place.track_id for place in findings.places()] == [1]


def test_places_state_where_and_how_much():
    bridged = at(101, 10, 11, 14, 40)
    html = page(track(), track(2, bridged=bridged))
    found = examine(network(track(2, bridged=bridged)), (1.435,)).places()
    assert [(place.start_m, place.end_m, place.length_m) for place in found] == [(9.5, 14.5, 3.0), (39.5, 40.5, 1.0)]
    assert headline(html) == "Good, except for a few places to look at."
    assert "4.0 m of 200 m (2.0 %): a rail has no points. Longest: 3.0 m of track 2 between 9.5 and 14.5 m." in html
    assert "9.5 to 14.5 m" in html


def test_each_track_is_judged_by_its_own_gauge():
    line, geometry = track(2, gauge_mm=np.full(101, 1001.0))
    findings = examine(network(track(), (replace(line, gauge_mm=1001.0), geometry)), (1.435, 1.0))
    assert [one.nominal_mm for one in findings.tracks] == [1435, 1000]
    assert findings.share == 0


def test_every_place_is_listed_the_most_harmful_first():
    sigma = np.full(1001, 1.0)
    sigma[100:900:20] = 9.0
    sigma[950], bridged = 30.0, at(1001, 950)
    html = page(track(length_m=1000.0, sigma_mm=sigma, bridged=bridged))
    rows = elements(html, "tbody")[0].findall("tr")
    unsure = "standard error above 5 mm across or in height"
    assert [row.findall("td")[8].text for row in rows] == ["a rail has no points"] + 40 * [unsure]
    assert [cell.text for cell in rows[0].findall("td")][:7] == [
        *("1", "track 1", "949.5 to 950.5 m", "1.0 m", "950.0 m", "1435.0 mm", "30.0 mm")
    ]
    marks = [one.get("class") for one in elements(html, "svg")[0].iter("path") if "mark" in one.get("class")]
    assert marks == ["unsure mark", "unsupported mark"]  # the most severe on top


def test_rails_without_a_track_are_reported():
    alone = lone(35.0)
    assert "1 rail does not belong to a track (35 m)." in page(track(), more_rails=(alone,))
    html = page(more_rails=(alone, replace(alone, rail_id=98)))
    assert headline(html).startswith("No track was found. There are 2 rails")
    assert not elements(html, "svg")


def test_without_a_track_the_report_says_what_to_try():
    html = page()
    assert headline(html) == "No rail was found. What to try:"
    assert [one.text for one in elements(html, "li")] == [CLASSES_ADVICE, *ADVICE]
    searched = build_page(replace(network(), search=SearchFigures(points=500)), (1.435,), "cloud.laz")
    assert [one.text for one in elements(searched, "li")] == list(ADVICE)


def test_radii_and_heights_are_those_of_the_cloud():
    radius = np.where(np.arange(101) < 50, np.nan, -600.0)
    html = page(track(radius_m=radius))
    assert "600 m right" in html
    assert ">400<" in html  # a tick on the axis of heights
    feet = replace(FRAME, horizontal_unit_m=0.3048, vertical_unit_m=0.3048)
    assert ">122<" in page(track(), frame=feet)


def test_the_page_needs_no_other_file_and_is_valid():
    unknown = np.full(101, np.nan)
    doubtful = track(2, gauge_mm=unknown, cant_mm=unknown, grade_pm=unknown, sigma_mm=unknown, bridged=at(101, 3, 4))
    html = page(track(), doubtful)
    assert not re.search(r"<link|<img|\bsrc=|href=|https?:|url\(|@import|fetch|XMLHttp|Storage|cookie", html)
    pictures = elements(html, "svg")
    assert len(pictures) == 3
    for picture in pictures:
        assert "nan" not in ET.tostring(picture, encoding="unicode").lower()
    assert html.count("<section>") == html.count("</section>") == 7


PAPER_PX = 703
"""Width of A4 upright between its margins."""

HIDDEN = """
var most = 0, boxes = document.querySelectorAll(".scroll");
for (var i = 0; i < boxes.length; i++) { most = Math.max(most, boxes[i].scrollWidth - boxes[i].clientWidth); }
most;
"""


def test_pages_are_as_wide_as_the_window_and_paper_shows_every_column(in_browser):
    html = page(track(sigma_mm=np.full(101, 9.0)), source="cloud.laz")
    (width,) = in_browser(html, ["document.querySelector('section').offsetWidth"], 1900)
    assert width > 1800
    assert in_browser(html.replace("@media print", "@media screen"), [HIDDEN], PAPER_PX) == [0]


def test_all_text_is_escaped():
    nasty = '<script>alert("1")</script>&'
    html = page(track(), source=nasty, facts={nasty: nasty})
    assert html.count("<script") == 1  # the page's own
    assert html.count("&lt;script&gt;") == 4  # title, heading, and name and value of the fact
    assert tag("p", text("<&>"), title='"<') == '<p title="&quot;&lt;">&lt;&amp;&gt;</p>'
    assert "<td>&lt;b&gt;</td>" in table(["a"], [["<b>"]])


def test_every_panel_marks_the_places_in_doubt():
    html = page(track(bridged=at(101, *range(40, 60))))
    plan, profiles = elements(html, "svg")
    marks = [one for one in profiles.iter("rect") if one.get("class") == "unsupported"]
    assert len(marks) == 6
    panel = next(one for one in profiles.iter("rect") if one.get("class") == "panel")
    left, width = float(panel.get("x")), float(panel.get("width"))
    for mark in marks:
        assert float(mark.get("x")) == pytest.approx(left + 0.395 * width, abs=0.1)
        assert float(mark.get("width")) == pytest.approx(0.2 * width, abs=0.1)
    assert [one for one in plan.iter("path") if one.get("class") == "unsupported mark"]


def test_the_page_of_a_long_line_is_small():
    """50 km with a station every metre: peaks are kept, and the page has less than 1.5 MB."""
    gauge = GAUGE_MM + np.random.default_rng(1).normal(0, 2, 50_001)
    gauge[31_234] = GAUGE_MM + 40
    html = page(track(length_m=50_000.0, gauge_mm=gauge, bridged=np.arange(50_001) % 100 == 0))
    assert len(html) < 1_500_000
    assert "50.0 km" in html
    _, profiles = elements(html, "svg")
    paths = [one.get("d") for one in profiles.iter("path")]
    heights = [float(y) for y in re.findall(r"[ML][\d.]+ (-?[\d.]+)", paths[1])]
    assert min(heights) < sorted(heights)[1] - 10


@given(st.floats(-1e6, 1e6), st.floats(1e-3, 1e6), st.integers(2, 12))
def test_ticks_are_round_few_and_inside_the_axis(low, span, count):
    marks = ticks(low, low + span, count)
    assert len(marks) <= count + 1
    assert len(marks) >= count / 2.5 - 1
    assert ((marks >= low - 1e-6 * span - 1e-8) & (marks <= low + span + 1e-6 * span + 1e-8)).all()
    if len(marks) > 1:
        step = marks[1] - marks[0]
        np.testing.assert_allclose(np.diff(marks), step, rtol=1e-6, atol=1e-8)


def on_arc(track_id, start_m, end_m, radius_m=600.0, left_m=0.0):
    t = np.arange(start_m, end_m + 0.5, 1.0) / radius_m
    radius_m -= left_m
    xyz = np.column_stack([radius_m * np.sin(t), 600.0 - radius_m * np.cos(t), np.zeros(len(t))])
    line, geometry = track(track_id, len(t) - 1.0)
    return replace(line, xyz=xyz), replace(geometry, xyz=xyz)


@pytest.mark.parametrize("radius_m", [250.0, -600.0, 1e6])
@pytest.mark.parametrize("turned", [False, True])
def test_two_tracks_that_end_on_one_curve_are_likely_one(radius_m, turned):
    one, other = on_arc(1, 0, 60, radius_m), on_arc(2, 140, 200, radius_m)
    if turned:
        other = (replace(other[0], xyz=other[0].xyz[::-1]), other[1])
    html = page(one, other)
    assert "Track 1 likely goes on as track 2: no rails were found in the " in html
    assert re.search(r"in the (79|80)(\.\d)? m between", html)
    assert not headline(html).startswith("Good")


def test_the_next_track_is_not_the_continuation():
    shifted = on_arc(2, 140, 200, 600.0, 4.5)
    assert examine(network(on_arc(1, 0, 60), shifted), (1.435,)).holes == ()
    assert examine(network(on_arc(1, 0, 60), on_arc(2, 300, 360)), (1.435,)).holes == ()
    (hole,) = examine(network(on_arc(1, 0, 60), shifted, on_arc(3, 100, 200)), (1.435,)).holes
    assert (hole.first, hole.second) == (1, 3)


def test_a_track_that_ends_on_another_one_has_no_hole():
    assert examine(network(on_arc(1, 0, 100), on_arc(2, 60, 100), on_arc(3, 0, 30)), (1.435,)).holes == ()


def test_findings_are_in_the_order_of_possible_error_times_length():
    """100 mm m off gauge, 90 of standard error, 12 of it where a rail has no points, and lines that may be wrong."""
    gauge, sigma = np.full(101, GAUGE_MM), np.full(101, 1.5)
    gauge[10:15] = GAUGE_MM + 20
    sigma[30:40], sigma[60:62] = 9.0, 6.0
    one = track(1, gauge_mm=gauge, sigma_mm=sigma, bridged=at(101, 60, 61))
    findings = list_findings(network(one, more_rails=[lone(30.0)]), (1.435,))
    assert [found.finding for found in findings] == [1, 2, 3, 4]
    assert [found.harm for found in findings] == pytest.approx([30 * OFF_RAIL_MM, 100, 90, 12])
    assert [found.reason for found in findings] == [LONE_RAIL, OFF_GAUGE.label, UNSURE.label, UNSUPPORTED.label]
    off = findings[1]
    assert (off.track_id, off.rail_id, off.from_m, off.to_m, off.doubt_m) == (1, None, 9.5, 14.5, 5.0)
    assert (off.worst_m, off.gauge_mm, off.sigma_mm, off.points, off.review) == (10.0, 1455.0, 1.5, 1000, "")
    np.testing.assert_allclose(off.xyz[[0, -1], 0], [9.5, 14.5])
    assert (findings[0].track_id, findings[0].rail_id, findings[0].to_m) == (None, 99, 30.0)


def test_a_missing_rail_counts_like_a_line_off_its_rail():
    unknown = np.full(101, GAUGE_MM)
    unknown[20:30] = np.nan
    (found,) = list_findings(network(track(gauge_mm=unknown, sigma_mm=unknown / 1000)), (1.435,))
    assert found.harm == pytest.approx(10 * OFF_RAIL_MM)
    assert np.isnan(found.gauge_mm)


def test_a_section_between_two_tracks_is_a_finding():
    one, other = on_arc(1, 0, 60), on_arc(2, 140, 200)
    (found,) = list_findings(network(one, other), (1.435,))
    assert found.reason == HOLE.format(1, 2)
    np.testing.assert_allclose(found.xyz, [one[0].xyz[-1], other[0].xyz[0]])
    assert HOLE.format(1, 2) in page(one, other)


def test_rails_are_not_lone_if_a_track_does_not_name_its_rails():
    line, geometry = track()
    nameless = replace(line, left_ids=(), right_ids=())
    assert list_findings(network(track(), more_rails=[lone(9.0)]), (1.435,))
    assert list_findings(network((nameless, geometry), more_rails=[lone(9.0)]), (1.435,)) == ()


def test_the_summary_has_the_verdict_and_its_figures():
    whole = network(track(bridged=at(101, 40, 41)), track(2), more_rails=[lone(2.0)])
    assert summary(whole, (1.435,)) == (
        "Good, except for a few places to look at.",
        "5 rails (402 m), 2 tracks (200 m): standard error 1.5 mm (median), 1.5 mm (rms), 1.0 % of the tracks in "
        "doubt, 2 findings.",
    )
    assert summary(replace(whole, geometry=()), (1.435,))[1] == "5 rails (402 m), 2 tracks (200 m)."
    assert summary(network(), (1.435,)) == ("No track was found.", "0 rails (0.0 m), 0 tracks (0.0 m).")


def test_what_was_found_in_a_raw_cloud_is_listed():
    found = SearchFigures(12345, 240.0, 12.6, 2500, 6, 2, 1)
    html = build_page(replace(network(track()), search=found), (1.435,), "cloud.laz")
    rows = re.findall(r"<tr>(.*?)</tr>", html[html.index("Rail points in the raw cloud") :])
    cells = dict(re.findall(r"<td>(.*?)</td>", row)[:2] for row in rows if "<td>" in row)
    assert cells["Rail points"] == "12,345"
    assert cells["Rails with a partner"] == metres(240.0)
    assert cells["Rails without a partner"] == metres(12.6)
    assert cells["Cells with points per metre"] == "10"
    assert (cells["Squares with rails"], cells["Thin squares"], cells["Paved squares"]) == ("6", "2", "1")
    assert "Rails with blunt heads" not in html
    blunt = replace(network(track()), search=replace(found, blunt_m=200.0, blur_m2=200.0 * 0.055))
    assert f"{metres(200.0)}, by 55 mm" in build_page(blunt, (1.435,), "cloud.laz")
    assert "Rail points in the raw cloud" not in page(track())
    grown = replace(network(track()), search=SearchFigures(points=500, paired_m=20.0))
    assert "Squares with rails" not in build_page(grown, (1.435,), "cloud.laz")


def test_strips_have_a_table_and_profiles_in_colours():
    at = np.arange(0.5, 60.0)
    courses = tuple(
        StripCourse(1, strip, at, across + 0 * at, 2.0 + 0 * at) for strip, across in ((7, 10.2), (9, -10.2), (12, 0.0))
    )
    html = build_page(replace(network(track(1)), strips=courses), [1.435], "a.laz")
    assert "<h2>Strips</h2>" in html and "Strips of track 1" in html
    for strip, across in ((7, "+10.2 mm"), (9, "-10.2 mm"), (12, "+0.0 mm")):
        assert f"<td>{strip}</td><td>60 m</td><td>{across}</td>" in html
        assert f"strip {strip}" in html
    assert html.count('class="curve" style="stroke: #') == 6
    assert "<h2>Strips</h2>" not in build_page(network(track(1)), [1.435], "a.laz")


def test_a_step_to_the_side_is_a_finding_with_its_size():
    (found,) = list_findings(network(stepping(0.03)), (1.435,))
    assert found.worst_m == pytest.approx(50, abs=0.5)
    assert (found.from_m, found.to_m) == pytest.approx((found.worst_m - 5, found.worst_m + 5))
    size_mm = float(re.fullmatch(r"the track steps (\d+) mm to the side", found.reason).group(1))
    assert size_mm == pytest.approx(30, abs=3)
    assert found.harm == pytest.approx(10 * size_mm, abs=10)


def test_the_larger_standard_error_counts():
    high = np.full(101, 1.0)
    high[40:50] = 8.0
    (found,) = list_findings(network(track(sigmaz_mm=high)), (1.435,))
    assert (found.reason, found.sigmaz_mm) == (UNSURE.label, 8.0)
    assert found.harm == pytest.approx(80)
