"""The command `extract`: its outputs are those of the walk, and what it refuses, it refuses before the run."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys

import numpy as np
import pyproj
import pytest

pyogrio = pytest.importorskip("pyogrio")
rasterio = pytest.importorskip("rasterio")
shapely = pytest.importorskip("shapely")
pytest.importorskip("distributed")

from rail_extract.__main__ import INTERRUPTED, main  # noqa: E402
from rail_extract.core import pipeline  # noqa: E402
from rail_extract.core.checks.findings import list_findings  # noqa: E402
from rail_extract.core.clouds.points import read_rail_points  # noqa: E402
from rail_extract.core.commands.extract import INCOMPLETE  # noqa: E402
from rail_extract.core.fields import FINDING_FIELDS, QUALITY_FIELDS, RAIL_FIELDS  # noqa: E402
from rail_extract.core.pipeline import Parameters, extract_files, extract_rails  # noqa: E402
from rail_extract.core.report import Origin  # noqa: E402
from rail_extract.core.standards import STANDARDS  # noqa: E402
from rail_extract.laboratory.scenes.las import write_las  # noqa: E402

STANDARD = STANDARDS["EN_60E1_1435"]
FAST = ["--iterations", "1", "--square-tiles", "4", "--engine", "OPENCV"]
PARAMETERS = Parameters(
    STANDARD.gauge_m,
    STANDARD.head_width_m,
    passes=1,
    engine="OPENCV",
    square_tiles=4,
    quality_step_m=2.0,
    keep_cleaned=True,
)


def values(path, layer):
    """Values by field."""
    meta, _, _, columns = pyogrio.raw.read(path, layer=layer)
    return dict(zip(meta["fields"], columns))


def test_an_axis_gives_stations_kilometres(tiles, scheduler, tmp_path):
    (points,) = read_rail_points(tiles, [10])
    low, high = (getattr(points.frame.to_crs(points.xyz)[:, :2], name)(axis=0) for name in ("min", "max"))
    along = (high - low) / np.hypot(*(high - low))
    ends = np.array([low - 100 * along, high + 100 * along])
    axis, out = tmp_path / "axis.gpkg", tmp_path / "out.gpkg"
    pyogrio.raw.write(
        str(axis), layer="axis", driver="GPKG", geometry_type="LineString", crs=points.frame.crs_wkt,
        geometry=np.array([shapely.to_wkb(shapely.linestrings(ends))], object),
        field_data=[np.array(["main"])], fields=["name"],
    )  # fmt: skip
    words = ["extract", str(tiles), *FAST, *scheduler, "--rails", str(out), "--quality", str(out)]
    assert main([*words, "--axis", str(axis), "--start-km", "5"]) == 0
    _, _, shapes, _ = pyogrio.raw.read(out, layer="quality")
    places = shapely.get_coordinates(shapely.from_wkb(shapes))
    quality = values(out, "quality")
    np.testing.assert_allclose(quality["km"], 5 + (places - ends[0]) @ along / 1000, atol=2e-6)
    assert set(quality["axis"]) == {"main"}


def test_all_outputs_are_those_of_the_walk(tiles, scheduler, tmp_path):
    out, report, cleaned = tmp_path / "out.gpkg", tmp_path / "report.html", tmp_path / "cleaned.tif"
    words = ["extract", str(tiles), *FAST, *scheduler, "--step", "2"]
    words += ["--rails", str(out), "--centerlines", str(out), "--quality", str(out), "--findings", str(out)]
    words += ["--report", str(report), "--cleaned", str(cleaned)]
    assert main(words) == 0
    network = extract_rails(read_rail_points(tiles, [10]), PARAMETERS)
    rails = values(out, "rails")
    assert list(rails) == [field.name for field in RAIL_FIELDS]
    assert rails["points"].tolist() == [rail.points for rail in network.rails]
    (track,) = network.geometry
    quality = values(out, "quality")
    assert len(quality["track_id"]) == len(track.chainage_m) > 20
    for field in QUALITY_FIELDS[1:]:
        known = [field.value(value) for value in getattr(track, field.name)]
        np.testing.assert_allclose(quality[field.name], np.array(known, dtype=float), atol=10.0**-field.decimals)
    with rasterio.open(cleaned) as file:
        assert np.count_nonzero(file.read(1)) == network.cleaned[0].count()
        assert file.tags()["RAIL_GAUGE_MM"] == "1435"
    command = " ".join(["python -m rail_extract", *words])
    written = report.read_text(encoding="utf-8")
    origin = Origin((tiles,), STANDARD, (), command, PARAMETERS)
    undated = [re.sub(r"<dd>[\d-]+ [\d:]+</dd>", "", page) for page in (written, origin.report(network))]
    assert undated[0] == undated[1]
    findings, listed = values(out, "findings"), list_findings(network, (STANDARD.gauge_m,))
    assert list(findings) == [field.name for field in FINDING_FIELDS]
    assert findings["reason"].tolist() == [found.reason for found in listed]
    assert findings["track_id"].tolist() == [found.track_id for found in listed]
    assert {file.name for file in tmp_path.iterdir()} == {"out.gpkg", "report.html", "cleaned.tif"}


def test_a_mask_limits_the_points(tiles, scheduler, tmp_path):
    """Polygons in a file, in another coordinate system than the cloud."""
    (points,) = read_rail_points(tiles, [10], "EPSG:32643")
    west, south = points.frame.to_crs(points.xyz)[:, :2].min(axis=0) - 1
    ring = [(west, south), (west + 41, south), (west + 41, south + 500), (west, south + 500), (west, south)]
    change = pyproj.Transformer.from_crs(points.frame.crs_wkt, "EPSG:4326", always_xy=True)
    polygon = {"type": "Polygon", "coordinates": [[change.transform(*corner) for corner in ring]]}
    mask, out = tmp_path / "mask.geojson", tmp_path / "out.gpkg"
    mask.write_text(json.dumps(polygon))
    words = ["extract", str(tiles), "--rails", str(out), "--mask", str(mask), "--crs", "EPSG:32643"]
    assert main([*words, *FAST, *scheduler]) == 0
    assert values(out, "rails")["length_m"].sum() == pytest.approx(80, abs=3)


@pytest.mark.parametrize("on_dask", [False, True])
def test_a_corrupt_tile_is_named_and_the_rest_is_written(tiles, scheduler, tmp_path, capsys, on_dask):
    for name in ("tile0.laz", "tile1.laz"):
        (tmp_path / name).write_bytes((tiles / name).read_bytes())
    whole = (tiles / "tile2.laz").read_bytes()
    (tmp_path / "tile2.laz").write_bytes(whole[: len(whole) // 2])
    out = tmp_path / "out.gpkg"
    words = ["extract", str(tmp_path), "--rails", str(out), "--centerlines", str(out)]
    assert main([*words, *(scheduler if on_dask else ()), *FAST]) == INCOMPLETE
    assert "tile2.laz" in capsys.readouterr().err
    assert len(values(out, "rails")["length_m"]) == 2
    assert 50 < values(out, "rails")["length_m"].sum() < 85
    assert pyogrio.read_info(out, layer="centerlines")["features"] == 1
    assert {file.name for file in tmp_path.iterdir()} == {"out.gpkg", "tile0.laz", "tile1.laz", "tile2.laz"}


def test_warnings_are_on_the_error_output(tiles, scheduler, tmp_path, capsys):
    words = ["extract", str(tiles), "--rails", str(tmp_path / "out.gpkg"), "--min-length", "1000", *FAST]
    assert main([*words, *scheduler]) == 0
    said = capsys.readouterr()
    assert "Warning: Class 10 has no rails" in said.err
    assert "0 rails (0.0 m)" in said.out


def test_rails_without_a_track_are_written_and_the_reason_is_named(tiles, scheduler, tmp_path, capsys):
    out = tmp_path / "out.gpkg"
    words = ["extract", str(tiles), "--rails", str(out), "--standard", "AS_60_1600", *FAST]
    assert main([*words, *scheduler]) == INCOMPLETE
    assert "No track of 1600 mm gauge" in capsys.readouterr().err
    assert len(values(out, "rails")["rail_id"]) == 2


def test_a_raw_cloud_without_rails_is_searched_and_said(tmp_path, capsys):
    ground = np.random.RandomState(1).uniform(0, 5, (2000, 3)) * [1, 1, 0.01]
    cloud = write_las(tmp_path / "raw.las", ground)
    assert main(["extract", str(cloud), "--classify", *FAST, "--rails", str(tmp_path / "rails.gpkg")]) == 1
    assert "No rail was found in the raw cloud" in capsys.readouterr().err
    assert [one.name for one in tmp_path.iterdir()] == ["raw.las"]


def test_an_output_that_fails_does_not_stop_the_others(tiles, scheduler, tmp_path, monkeypatch, capsys):
    out, report, cleaned = tmp_path / "out.gpkg", tmp_path / "pages" / "report.html", tmp_path / "cleaned.tif"

    def remove_folder(*arguments):
        shutil.rmtree(report.parent)
        return extract_files(*arguments)

    monkeypatch.setattr(pipeline, "extract_files", remove_folder)
    words = ["extract", str(tiles), "--rails", str(out), "--report", str(report)]
    assert main([*words, "--cleaned", str(cleaned), *scheduler, *FAST]) == 1
    assert f"{report} can't be written" in capsys.readouterr().err
    assert len(values(out, "rails")["rail_id"]) == 2
    assert cleaned.exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--rails", "out.shp"], "--rails can't be out.shp: let it end in .gpkg or .dxf or .csv."),
        (["--other-gauges", "wide"], '--other-gauges "wide" must be millimetres'),
        (["--extent", "1,2,3"], "four numbers"),
        (["--scheduler", "nonsense"], "scheduler"),
        (["--scheduler", "tls://127.0.0.1:1"], "needs the options --tls-ca, --tls-cert and --tls-key"),
        (["--scheduler", "tcp://127.0.0.1:1", "--tls-ca", "ca.pem"], "need a --scheduler at tls://"),
        (["--tls-key", "key.pem"], "need a --scheduler at tls://"),
        (["--scheduler", "tcp://127.0.0.1:1", "--dashboard", "0"], "--dashboard is for local workers"),
        (["--dashboard", "99999"], "--dashboard must be a number from 0 to 65535, not 99999."),
        (
            ["--scheduler", "tls://127.0.0.1:1", *(f"--tls-{one}=gone.pem" for one in ("ca", "cert", "key"))],
            "can't be used (No such file or directory): give PEM files",
        ),
    ],
)
def test_a_wrong_option_is_refused_before_the_run(tiles, tmp_path, monkeypatch, capsys, words, said):
    monkeypatch.chdir(tmp_path)
    assert main(["extract", str(tiles), "--workers", "1", "--rails", "out.gpkg", *words]) == 1
    assert said in capsys.readouterr().err


def test_options_are_read_from_a_file(tmp_path, capsys):
    (tmp_path / "tiles.txt").write_text("gone.laz\n--rails\nout.gpkg\n")
    assert main(["extract", f"@{tmp_path / 'tiles.txt'}"]) == 1
    assert "gone.laz does not exist" in capsys.readouterr().err


@pytest.mark.parametrize("content", [b"\xff\xfe\xff", b"@names.txt"])
def test_a_file_of_options_that_can_not_be_one_is_refused(tmp_path, monkeypatch, capsys, content):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "names.txt").write_bytes(content)
    with pytest.raises(SystemExit, match="2"):
        main(["extract", "@names.txt"])
    assert "error: a file that is given as @FILE is not text, or names itself" in capsys.readouterr().err


@pytest.mark.skipif(sys.platform == "win32", reason="Windows sends Ctrl-C to consoles, not to processes")
def test_an_interrupted_command_says_so_in_one_sentence(tiles, tmp_path):
    """A terminal sends Ctrl-C to the command and to its workers."""
    out, words = tmp_path / "out.gpkg", [sys.executable, "-m", "rail_extract", "extract", str(tiles)]
    slow = ["--engine", "OPENCV", "--model", "base", "--iterations", "5"]  # or it ends before the signal comes
    process = subprocess.Popen(
        [*words, "--rails", str(out), *slow, "--workers", "1"],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    while not process.stderr.readline().startswith("Class 10"):  # said when the workers have begun
        assert process.poll() is None
    os.killpg(process.pid, signal.SIGINT)
    _, said = process.communicate()
    assert process.returncode == INTERRUPTED
    progress = ("Starting the network", "The network has started")
    lines = [line for line in said.splitlines() if " done, " not in line and line not in progress]
    assert lines == ["Cancelled; nothing was written."]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGKILL")
def test_a_run_that_was_killed_continues_where_it_stopped(tiles, tmp_path):
    """On one computer, without Dask."""
    work, out = tmp_path / "work", tmp_path / "out.gpkg"
    words = ["extract", str(tiles), *FAST, "--rails", str(out), "--workers", "2", "--work", str(work)]
    with subprocess.Popen([sys.executable, "-m", "rail_extract", *words], stderr=subprocess.DEVNULL) as process:
        while not list(work.glob("clean_*.npz")):
            assert process.poll() is None
        process.kill()
    before = {file: file.stat().st_mtime_ns for file in work.glob("*.npz")}
    assert not out.exists()
    assert main(words) == 0
    after = {file: file.stat().st_mtime_ns for file in work.glob("*.npz")}
    assert before.items() < after.items()
    assert values(out, "rails")["length_m"].sum() == pytest.approx(100, abs=1)
