"""The report on alignments: figures, curves and kilometres of its diagram."""

import re
from dataclasses import replace

import numpy as np
import pytest
from rail_extract.core.alignment.elements import Alignment, CantElement, Figures, VerticalElement, chained
from rail_extract.core.alignment.measured import Deviations
from rail_extract.core.frame import LocalFrame
from rail_extract.core.report import build_alignment_page
from rail_extract.core.report.alignment import draw_alignment, measured_curvature, measured_grade
from rail_extract.core.report.plots import LEFT, RIGHT, WIDTH

SHAPES = [(200.0, 0, 0), (100.0, 0, 1 / 500), (300.0, 1 / 500, 1 / 500)]


def design(**changes):
    vertical = (VerticalElement(0, 300, 50, 0.01, 0.01), VerticalElement(300, 300, 53, 0.01, -0.01))
    cant = (CantElement(0, 200, 0, 0), CantElement(200, 100, 0, -0.1), CantElement(300, 300, -0.1, -0.1))
    made = Alignment(4, LocalFrame(np.zeros(3)), chained((0, 0), 0.3, SHAPES), vertical, cant)
    return replace(made, **changes)


def found(alignment, slew_mm=0.0, lift_mm=0.0, cant_mm=0.0, s=None):
    s = np.arange(alignment.s_to + 1) if s is None else s
    columns = (np.broadcast_to(value, s.shape).astype(float) for value in (slew_mm, lift_mm, cant_mm))
    return Deviations(4, s, alignment.xyz(s), *columns)


def with_km(alignment, rises=True, jump_km=0.0):
    km, plan = 12.0, []
    for number, one in enumerate(alignment.plan):
        km += jump_km if number == 1 else 0.0
        after = km + (1 if rises else -1) * one.length_m / 1000
        plan.append(replace(one, figures=Figures(km_from=km, km_to=after, sigma_r_m=1.25)))
        km = after
    return replace(alignment, plan=tuple(plan))


def labels(svg):
    """Return x and text of the marks of the axis above the diagram."""
    marks = re.findall(r'<text x="([\d.]+)" y="([\d.]+)" class="tick middle">(.*?)</text>', svg)
    top = min(float(y) for _, y, _ in marks)
    return [(float(x), words) for x, y, words in marks if float(y) == top]


def across(s, length_m):
    return LEFT + s / length_m * (WIDTH - LEFT - RIGHT)


def test_what_was_measured_follows_from_design_and_deviations():
    alignment = design()
    plain = found(alignment)
    inner = slice(20, -20)
    exact = alignment.curvatures(plain.s)
    np.testing.assert_allclose(measured_curvature(alignment, plain)[inner], exact[inner], atol=6e-5)
    grades = measured_grade(alignment, plain)
    np.testing.assert_allclose(grades[inner], alignment.grades(plain.s)[inner], atol=1e-4)
    assert np.isnan(grades[:5]).all() and np.isnan(grades[-5:]).all()
    wave = found(alignment, slew_mm=5 * np.sin(plain.s / 10))
    bend = measured_curvature(alignment, wave) - measured_curvature(alignment, plain)
    # Of a wave of 63 m, chords of 20 m see 92 % of the curvature a / r².
    assert np.nanmax(bend[60:140]) == pytest.approx(0.92 * 0.005 / 100, rel=0.02)


def test_parts_of_a_track_are_not_connected():
    alignment = design()
    s = np.concatenate([np.arange(100.0), np.arange(400.0, 600.0)])
    svg = draw_alignment(alignment, found(alignment, 1.0, s=s))
    slews = re.findall(r'class="curve" ?|d="(M[^"]*)" class="curve"', svg)
    assert all(path.count("M") == 2 for path in slews if path)
    bends = measured_curvature(alignment, found(alignment, s=s))
    assert np.isnan(bends[90:110]).all()


def test_kilometres_run_along_the_axis_and_jump():
    plain = design()
    (first, second, *_) = labels(draw_alignment(plain, found(plain)))
    assert (first, second) == ((LEFT, "0"), (pytest.approx(across(100, 600), abs=0.01), "100"))
    rising = labels(draw_alignment(with_km(plain), found(plain)))
    assert rising[1] == (pytest.approx(across(100, 600), abs=0.01), "12.1")
    falling = labels(draw_alignment(with_km(plain, rises=False), found(plain)))
    assert (pytest.approx(across(100, 600), abs=0.01), "11.9") in falling
    jumping = draw_alignment(with_km(plain, jump_km=5.0), found(plain))
    assert (pytest.approx(across(300, 600), abs=0.01), "17.3") in labels(jumping)
    assert f'x1="{across(200, 600):.2f}"' in re.findall(r'<line ([^>]*)class="jump"', jumping)[0]


def test_the_design_lies_under_the_measured_curve():
    alignment = design()
    svg = draw_alignment(alignment, found(alignment))
    assert svg.index('class="design"') < svg.index('class="curve"')
    (curvature, *_) = re.findall(r'd="([^"]*)" class="design"', svg)
    corners = [float(x) for x in re.findall(r"[ML]([\d.]+) ", curvature)]
    assert corners[0] == LEFT and corners[-1] == WIDTH - RIGHT
    assert any(x == pytest.approx(across(200, 600), abs=0.06) for x in corners)
    assert svg.count('class="design"') == 3
    texts = re.findall(r'onelement">(.*?)<', svg)
    assert texts == ["200 m", f"A {(100 * 500) ** 0.5:.0f}", "R 500"]


def test_unknown_cant_is_left_out_and_long_tracks_have_rows():
    alignment = design(cant=())
    svg = draw_alignment(alignment, found(alignment, cant_mm=np.nan))
    assert "Cant" not in svg and "Gradient" in svg
    long = replace(alignment, plan=chained((0, 0), 0.0, [(2500.0, 0, 0)]), vertical=())
    drawn = draw_alignment(long, found(long, lift_mm=np.nan, cant_mm=np.nan))
    assert drawn.count("<svg") == 3 and "Lift" not in drawn


def test_the_page_states_figures_elements_and_that_it_is_a_proposal():
    alignment = with_km(design(name="Gleis <7>"))
    deviations = found(alignment, slew_mm=np.where(np.arange(601) % 2, 3.0, -3.0), lift_mm=2.0)
    page = build_alignment_page([(alignment, deviations)], "tracks.gpkg", {"Date": "today"}, fitted=True)
    for words in ("<b>3.0 mm</b><span>slew, RMS", "<b>2.0 mm</b><span>lift, RMS", "<b>8</b><span>elements"):
        assert words in page
    assert "Gleis &lt;7&gt;" in page and "<7>" not in page
    assert "<td>plan 3, arc</td><td>km 12.30000</td><td>300.00 m</td><td>R 500.00 m</td>" in page
    assert "<td>1.25 m</td>" in page
    assert "is a proposal" in page
    warned = build_alignment_page([(alignment, deviations)], "t", {}, fitted=True, warnings=["The cant ends <early>."])
    assert "The cant ends &lt;early&gt;." in warned
    assert "is a proposal" not in build_alignment_page([(alignment, deviations)], "t", {}, fitted=False)
