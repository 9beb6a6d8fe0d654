"""Replacement of files: companions of the old file, and files that can't be replaced."""

import pytest
from rail_extract.core.disk import take_names
from rail_extract.core.errors import DiskError


def fill(folder, **files):
    folder.mkdir(exist_ok=True)
    for name, text in files.items():
        (folder / name.replace("__", "-").replace("_", ".")).write_text(text)
    return folder


def contents(folder):
    return {file.name: file.read_text() for file in folder.iterdir() if file.is_file()}


def move(folder, path):
    take_names(path, {file: path.with_name(file.name) for file in (folder / "new").iterdir()})


@pytest.mark.parametrize(
    ("name", "companions", "others"),
    [
        ("a.gpkg", ("a.gpkg-shm",), ("a.qml", "b.gpkg-shm")),
        ("a.tif", ("a.tif.ovr", "a.tif.aux.xml", "a.tif.msk"), ("a.tfw.txt",)),
        ("a.shp", ("a.qix", "a.sbn", "a.sbx", "a.cpg"), ("a.qml", "ab.qix")),
        ("a.geojson", (), ("a.qix",)),
    ],
)
def test_companions_of_the_old_file_are_removed(tmp_path, name, companions, others):
    for file in (name, *companions, *others):
        (tmp_path / file).write_text("old")
    fill(tmp_path / "new", **{name.replace(".", "_"): "new"})
    move(tmp_path, tmp_path / name)
    assert contents(tmp_path) == {name: "new", **dict.fromkeys(others, "old")}


def test_companions_of_the_new_file_are_kept(tmp_path):
    fill(tmp_path, a_shp="old", a_cpg="old", a_prj="old", a_dbf="old")
    fill(tmp_path / "new", a_shp="new", a_cpg="new", a_dbf="new")
    move(tmp_path, tmp_path / "a.shp")
    assert contents(tmp_path) == {"a.shp": "new", "a.cpg": "new", "a.dbf": "new"}


@pytest.mark.parametrize("log", ["a_gpkg__wal", "a_gpkg__journal"])
def test_a_file_with_a_nonempty_log_is_kept(tmp_path, log):
    fill(tmp_path, a_gpkg="old", **{log: "not yet in it"})
    fill(tmp_path / "new", a_gpkg="new")
    with pytest.raises(DiskError, match=r"is open in another program .* The new file is .*a_new\.gpkg"):
        move(tmp_path, tmp_path / "a.gpkg")
    assert contents(tmp_path)["a.gpkg"] == "old"
    assert contents(tmp_path)["a_new.gpkg"] == "new"


def test_a_locked_file_is_kept_and_the_new_files_are_left_next_to_it(tmp_path):
    fill(tmp_path, a_qix="old")
    (tmp_path / "a.shp").mkdir()  # stands for a file that Windows locks
    fill(tmp_path / "new", a_shp="new", a_dbf="new")
    with pytest.raises(DiskError, match=r"a\.shp can't be replaced \(Is a directory\)\. The new file is .*a_new\.shp"):
        move(tmp_path, tmp_path / "a.shp")
    assert contents(tmp_path) == {"a.qix": "old", "a_new.shp": "new", "a_new.dbf": "new"}
