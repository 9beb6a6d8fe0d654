"""Jobs as functions and as commands: the same names, defaults, limits and messages as in the toolbox."""

import inspect

import numpy as np
import pytest
import rail_extract as rx
from rail_extract.__main__ import main, parse
from rail_extract.core.commands.files import read_value
from rail_extract.core.errors import ParameterError, RailExtractError
from rail_extract.core.jobs import CALLS, JOBS
from rail_extract.core.jobs.declaration import Choice, LayerOutput, Number

REQUIRED = {name: [one.name for one in job.parameters if one.required] for name, job in CALLS.items()}


@pytest.mark.parametrize("job", JOBS, ids=lambda job: job.name)
def test_names_are_those_of_one_thing_and_defaults_are_accepted(job):
    names = [one.name for one in (*job.parameters, *job.outputs)]
    assert len(set(names)) == len(names)
    for one in job.parameters:
        if one.default is not None:
            assert read_value(one, None) == one.default
            assert read_value(one, str(one.default) if isinstance(one, Number) else one.default) == one.default


@pytest.mark.parametrize("name", CALLS)
def test_function_and_command_take_what_the_toolbox_takes(name):
    job = CALLS[name]
    names = [one.name for one in (*job.parameters, *job.outputs)]
    taken = inspect.signature(getattr(rx, name)).parameters
    assert sorted(taken) == sorted([*(one.lower() for one in names), "progress"])
    for one in (*job.parameters, *job.outputs):
        is_needed = one.required and not isinstance(one, LayerOutput)  # the result keeps its layers
        assert taken[one.name.lower()].default == (inspect.Parameter.empty if is_needed else one.default)
    outputs = [word for one in job.outputs if not one.optional for word in (f"--{one.name.lower()}", "out")]
    args = parse([name.replace("_", "-"), *REQUIRED[name], *outputs])
    assert set(names) <= set(vars(args))
    assert job.help in inspect.getdoc(getattr(rx, name))


@pytest.mark.parametrize(
    ("name", "given", "said", "about"),
    [
        ("compare", {"reach": 7}, "{} can't be 7: give a number from 0.01 to 2.", "reach"),
        ("compare", {"step": "nan"}, "{} can't be nan: give a number from 0.1 to 100,000.", "step"),
        ("compare", {"reference_sigma": -1}, "{} can't be -1: give 0 or more.", "reference_sigma"),
        ("compare", {"output": "a.txt"}, "{} can't be a.txt: let it end in .gpkg or .dxf or .csv.", "output"),
        ("compare", {"rails": "a.gpkg"}, "the rails of both surveys: choose {}, too.", "reference_rails"),
        ("fit_alignment", {"transitions": "NO"}, "{} can't be NO: give one of its 2 choices, such as JUMPS.",
         "transitions"),
        ("export_alignment", {"output": "a.xml", "crs": "EPSG:0"},
         "{} EPSG:0 is not a coordinate system: give one such as EPSG:25832.", "crs"),
    ],
)  # fmt: skip
def test_a_value_is_refused_in_one_sentence_that_names_it_as_its_door_does(
    name, given, said, about, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    inputs = ["nothing.gpkg"] * len(REQUIRED[name])
    with pytest.raises(ParameterError) as refused:
        getattr(rx, name)(*inputs, **given)
    assert str(refused.value).endswith(said.format(about))
    words = [word for key, value in given.items() for word in (f"--{key.replace('_', '-')}", str(value))]
    assert main([name.replace("_", "-"), *inputs, *words]) == 1
    assert capsys.readouterr().err.strip().endswith(said.format(f"--{about.replace('_', '-')}"))


def test_an_output_that_must_be_written_is_asked_for():
    with pytest.raises(TypeError, match="missing a required argument: 'output'"):
        rx.export_alignment("elements.gpkg")
    with pytest.raises(ParameterError, match="output can't be empty: give the name of a file."):
        rx.export_alignment("elements.gpkg", None)


def test_two_outputs_are_not_one_file_unless_it_is_a_geopackage(tmp_path):
    with pytest.raises(ParameterError, match="elements and deviations are the same file: give each its own name."):
        rx.fit_alignment("a.gpkg", elements=tmp_path / "a.csv", deviations=tmp_path / "a.csv")


def test_an_unknown_argument_is_refused():
    with pytest.raises(TypeError, match="unexpected keyword argument 'reech'"):
        rx.compare("a.gpkg", "b.gpkg", reech=1.0)


@pytest.mark.parametrize(
    ("one", "given", "value"),
    [
        (Number("N", "", default=1.0, high=9.0), "2.5", 2.5),
        (Number("N", "", default=1, high=9, whole=True), "3", 3),
        (Number("N", "", optional=True), "", None),
        (Choice("C", "", options=("A", "B"), default="A"), "B", "B"),
        (Choice("C", "", options=("A", "B"), several=True, optional=True), "a, B", ("A", "B")),
        (Choice("C", "", options=("Whole", "Part"), numbered=True, default=0), "1", 1),
    ],
)
def test_a_text_is_read_as_its_kind_of_value(one, given, value):
    read = read_value(one, given)
    assert read == value
    assert type(read) is type(value)


@pytest.mark.parametrize("given", ["9.5", "-1", "inf", "nan", "many"])
def test_a_number_out_of_its_limits_is_refused(given):
    with pytest.raises(ParameterError, match=f"N can't be {given}: give a number from 0 to 9."):
        read_value(Number("N", "", default=1.0, high=9.0), given)


def written(path, lines, **fields):
    """Write 3D lines, (n, 3), in UTM zone 43 N."""
    pyogrio, shapely = pytest.importorskip("pyogrio"), pytest.importorskip("shapely")
    shapes = [shapely.to_wkb(shapely.linestrings(line), output_dimension=3) for line in lines]
    values = [np.array(one) for one in fields.values()]
    pyogrio.raw.write(
        str(path), np.array(shapes, object), values, list(fields), geometry_type="LineString Z", crs="EPSG:32643",
        layer="lines",
    )  # fmt: skip
    return path


def straight(left_m=0.0, up_m=0.0, length_m=40):
    """A line that runs east."""
    x = np.linspace(500_000, 500_000 + length_m, length_m + 1)
    return np.column_stack([x, np.full(len(x), 3e6 + left_m), np.full(len(x), 100.0 + up_m)])


def test_two_rails_make_a_track_of_their_gauge(tmp_path, capsys):
    rails = written(tmp_path / "rails.gpkg", [straight(1.507, 0.02), straight()[::-1]], rail_id=[7, 8])
    paired = rx.build_track_centerlines(rails, output=tmp_path / "tracks.gpkg")
    assert paired.figures == {"CENTERLINE_COUNT": 1, "CENTERLINE_LENGTH": pytest.approx(40, abs=0.1)}
    measured = rx.measure_track_geometry(tmp_path / "tracks.gpkg", rails, step=2.0)
    quality = measured.layers["OUTPUT"]()
    values = dict(zip((field.name for field in quality.product.fields), quality.columns))
    np.testing.assert_allclose(values["gauge_mm"], 1000 * (np.hypot(1.507, 0.02) - 0.072), atol=0.2)
    np.testing.assert_allclose(np.abs(values["cant_mm"]), 20, atol=0.2)
    words = ["measure-track-geometry", str(tmp_path / "tracks.gpkg"), str(rails), "--step", "2"]
    assert main([*words, "--report", str(tmp_path / "report.html")]) == 0
    assert "one rail" not in capsys.readouterr().err
    assert "tracks.gpkg" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_a_stray_vertex_is_refused_by_files_as_by_qgis(tmp_path):
    line = straight()
    line[7, 1] = -3e6
    stray = written(tmp_path / "stray.gpkg", [line])
    with pytest.raises(RailExtractError, match="input has a line .feature 1. with a stray vertex: repair or delete"):
        rx.build_track_centerlines(stray, tmp_path / "out.gpkg")


def test_a_function_gives_layers_figures_and_a_report(tmp_path):
    pyogrio = pytest.importorskip("pyogrio")
    for name, rise_m in (("before", 0.0), ("after", 0.012)):
        written(tmp_path / f"{name}.gpkg", [straight(0, rise_m)])
    result = rx.compare(tmp_path / "before.gpkg", tmp_path / "after.gpkg", ignore_shift=False, reference_sigma=1,
                        input_sigma=1, output=tmp_path / "new" / "moved.gpkg")  # fmt: skip
    assert result.figures["COMPARED_LENGTH"] == pytest.approx(40, abs=1)
    assert result.figures["HEIGHT_RMS"] == pytest.approx(12, abs=0.01)
    assert "+12.0 mm up" in result.sentences[1]
    result.save(tmp_path / "again.gpkg")
    result.report(tmp_path / "page.html")
    assert "rail_extract.compare(" in (tmp_path / "page.html").read_text(encoding="utf-8")
    counts = [pyogrio.read_info(tmp_path / name)["features"] for name in ("new/moved.gpkg", "again.gpkg")]
    assert counts[0] == counts[1] > 35
    with pytest.raises(ParameterError, match="There is no layer 'rails': choose one of output"):
        result.save(tmp_path / "out.csv", "rails")


def test_a_constant_shift_of_all_lines_is_said_apart(tmp_path):
    angle = np.linspace(0, 250 / 300, 501)
    curve = np.column_stack([300 * np.sin(angle), 300 - 300 * np.cos(angle), np.zeros(501)]) + [500_000, 3e6, 100]
    before, after = (written(tmp_path / f"{up}.gpkg", [curve + np.array([0.03, -0.02, 0.01]) * up]) for up in (0, 1))
    result = rx.compare(before, after, reference_sigma=1, input_sigma=1, output=tmp_path / "out.gpkg")
    figures = [result.figures[name] for name in ("SHIFT_EAST", "SHIFT_NORTH", "SHIFT_UP", "MOVED_LENGTH")]
    np.testing.assert_allclose(figures, [30, -20, 10, 0], atol=0.2)
    shift = "shifted by +30.0 mm east, -20.0 mm north, +10.0 mm up; apart from that, nothing has moved"
    assert any(shift in sentence for sentence in result.sentences)
