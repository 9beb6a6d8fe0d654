"""Files of a run are complete or absent, and temporary folders are private and removed when their process is gone."""

import os
import shutil
import signal
import stat
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from rail_extract.core.disk import MARK, MIN_AGE_S, MIN_UNMARKED_AGE_S, PREFIX, Destination, scratch_folder, sweep
from rail_extract.core.errors import DiskError

KILLED = """
import os, signal, sys
from pathlib import Path
from rail_extract.core.disk import scratch_folder

with scratch_folder(Path(sys.argv[1])) as folder:
    (folder / "points").write_text("x")
    print(folder, flush=True)
    if len(sys.argv) == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    sys.stdin.read()
"""


@pytest.fixture
def killed(tmp_path):
    """The temporary folder of a killed process."""
    said = subprocess.run([sys.executable, "-c", KILLED, str(tmp_path)], capture_output=True, text=True)
    assert said.returncode == -signal.SIGKILL
    (folder,) = tmp_path.iterdir()
    assert (folder / "points").exists()
    return folder


def age(folder):
    """Make a temporary folder old enough to be removed."""
    os.utime(folder / MARK, (0, (folder / MARK).stat().st_mtime - MIN_AGE_S - 1))


def test_a_folder_goes_when_the_block_ends_with_or_without_an_error(tmp_path):
    with scratch_folder(tmp_path) as folder:
        (folder / "points").write_text("x")
    with pytest.raises(KeyError), scratch_folder(tmp_path):
        raise KeyError
    assert list(tmp_path.iterdir()) == []


def test_the_folder_of_a_killed_process_is_removed_once_it_is_old(tmp_path, killed):
    sweep(tmp_path)
    assert killed.exists()
    age(killed)
    sweep(tmp_path)
    assert not killed.exists()


def test_the_folder_of_a_running_process_stays_however_old_it_is(tmp_path):
    call = [sys.executable, "-c", KILLED, str(tmp_path), "wait"]
    with subprocess.Popen(call, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        process.stdout.readline()
        (folder,) = tmp_path.iterdir()
        age(folder)
        sweep(tmp_path)
        assert (folder / "points").exists()
        process.stdin.close()
    assert not folder.exists()


def test_own_folders_stay_too(tmp_path):
    with scratch_folder(tmp_path) as folder:
        age(folder)
        sweep(tmp_path)
        assert folder.exists()


def test_folders_of_other_computers_and_users_and_other_names_stay(tmp_path, killed, monkeypatch):
    age(killed)
    other = killed.with_name(".rail_extract_mine")
    shutil.copytree(killed, other)
    link = killed.with_name(killed.name[:-1] + ("0" if killed.name[-1] != "0" else "1"))
    link.symlink_to(other)
    monkeypatch.setattr("platform.node", lambda: "elsewhere")
    sweep(tmp_path)
    assert killed.exists()
    monkeypatch.undo()
    if hasattr(os, "getuid"):
        monkeypatch.setattr(os, "getuid", lambda: -1)
        sweep(tmp_path)
        assert killed.exists()
        monkeypatch.undo()
    sweep(tmp_path)
    assert sorted(tmp_path.iterdir()) == sorted([other, link])
    assert (other / "points").exists()


@pytest.mark.parametrize("unmark", [Path.unlink, lambda mark: mark.write_text("")])
def test_a_folder_without_a_mark_stays_for_a_day(tmp_path, killed, unmark):
    unmark(killed / MARK)
    sweep(tmp_path)
    assert killed.exists()
    os.utime(killed, (0, killed.stat().st_mtime - MIN_UNMARKED_AGE_S - 1))
    sweep(tmp_path)
    assert not killed.exists()


def test_a_folder_is_rescued_before_it_is_removed(tmp_path, killed):
    age(killed)
    seen = []
    sweep(tmp_path, lambda folder: seen.append((folder / "points").read_text()))
    assert seen == ["x"]
    assert not killed.exists()


def fill(folder, **files):
    folder.mkdir(exist_ok=True)
    for name, text in files.items():
        (folder / name.replace("__", "-").replace("_", ".")).write_text(text)
    return folder


def contents(folder):
    return {file.name: file.read_text() for file in folder.iterdir() if file.is_file()}


def write(destination, text="new", *others):
    with destination.replacing() as new:
        for name in (new, *map(new.with_suffix, others)):
            name.write_text(text)


def temporary(folder):
    return [entry.name for entry in folder.iterdir() if entry.name.startswith(PREFIX)]


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
    write(Destination.at(tmp_path / name))
    assert contents(tmp_path) == {name: "new", **dict.fromkeys(others, "old")}


def test_companions_of_the_new_file_are_kept(tmp_path):
    fill(tmp_path, a_shp="old", a_cpg="old", a_prj="old", a_dbf="old")
    write(Destination.at(tmp_path / "a.shp"), "new", ".cpg", ".dbf")
    assert contents(tmp_path) == {"a.shp": "new", "a.cpg": "new", "a.dbf": "new"}


@pytest.mark.parametrize("log", ["a_gpkg__wal", "a_gpkg__journal"])
def test_a_file_with_a_nonempty_log_is_kept(tmp_path, log):
    fill(tmp_path, a_gpkg="old")
    destination = Destination.at(tmp_path / "a.gpkg")
    fill(tmp_path, **{log: "not yet in it"})
    with pytest.raises(DiskError, match=r"is open in another program .* The new file is .*a_new\.gpkg"):
        write(destination)
    assert contents(tmp_path)["a.gpkg"] == "old"
    assert contents(tmp_path)["a_new.gpkg"] == "new"
    with pytest.raises(DiskError, match="is open in another program"):
        Destination.at(tmp_path / "a.gpkg")


def test_a_set_with_a_locked_file_is_kept_and_the_new_files_are_left_next_to_it(tmp_path):
    fill(tmp_path, a_shp="old", a_dbf="old", a_qix="old")
    destination = Destination.at(tmp_path / "a.shp")
    (tmp_path / "a.sbx").mkdir()  # stands for a file that Windows locks
    with pytest.raises(DiskError, match=r"a\.shp can't be replaced \(Is a directory\)\. The new file is .*a_new\.shp"):
        write(destination, "new", ".dbf")
    assert contents(tmp_path) == {
        **dict.fromkeys(("a.shp", "a.dbf", "a.qix"), "old"),
        **dict.fromkeys(("a_new.shp", "a_new.dbf"), "new"),
    }


def test_a_new_name_that_is_taken_is_not_used(tmp_path):
    fill(tmp_path, a_gpkg="old")
    (tmp_path / "a_new.gpkg").write_text("mine")
    destination = Destination.at(tmp_path / "a.gpkg")
    write(Destination.at(tmp_path / "a.gpkg"), "first")
    with pytest.raises(DiskError, match=r"a_new2\.gpkg"):
        write(destination, "second")
    assert contents(tmp_path) == {"a.gpkg": "first", "a_new.gpkg": "mine", "a_new2.gpkg": "second"}


def test_of_two_runs_onto_one_file_the_first_to_finish_wins_and_the_other_is_told(tmp_path):
    for name in ("absent.tif", "present.tif"):
        path = tmp_path / name
        if name == "present.tif":
            path.write_text("old")
        one, two = Destination.at(path), Destination.at(path)
        write(one, "one")
        with pytest.raises(DiskError, match=r"changed by another program in the meantime\. The new file is .*_new"):
            write(two, "two")
        assert path.read_text() == "one"
        assert path.with_name(f"{path.stem}_new.tif").read_text() == "two"


def test_two_runs_that_finish_at_once_do_not_mix_their_files(tmp_path):
    suffixes = (".dbf", ".shx", ".prj", ".cpg")
    fill(tmp_path, **{f"a_{suffix[1:]}": "old" for suffix in (".shp", *suffixes)})
    for _ in range(20):
        destinations = [Destination.at(tmp_path / "a.shp") for _ in range(4)]
        start, refused = threading.Barrier(4), []

        def run(number, destinations=destinations, start=start, refused=refused):
            try:
                with destinations[number].replacing() as new:
                    for name in (new, *map(new.with_suffix, suffixes)):
                        name.write_text(f"run {number}")
                    start.wait()
            except DiskError as error:
                refused.append(str(error))

        threads = [threading.Thread(target=run, args=(number,)) for number in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        texts = {(tmp_path / f"a{suffix}").read_text() for suffix in (".shp", *suffixes)}
        assert len(texts) == 1
        assert len(refused) == 3
        for file in tmp_path.glob("a_new*"):
            file.unlink()


def test_an_edited_copy_does_not_replace_a_file_that_has_changed_since(tmp_path):
    fill(tmp_path, a_gpkg="old")
    with pytest.raises(DiskError, match="in the meantime"), Destination.at(tmp_path / "a.gpkg").replacing(True) as new:
        new.write_text(new.read_text() + " and new")
        (tmp_path / "a.gpkg").write_text("edited meanwhile")
    assert contents(tmp_path) == {"a.gpkg": "edited meanwhile", "a_new.gpkg": "old and new"}


def test_an_error_on_the_way_leaves_the_old_file_only(tmp_path):
    fill(tmp_path, a_tif="old")
    with pytest.raises(KeyError), Destination.at(tmp_path / "a.tif").replacing() as new:
        new.write_text("half")
        raise KeyError
    assert contents(tmp_path) == {"a.tif": "old"}
    assert temporary(tmp_path) == []


def test_temporary_names_are_unpredictable_and_private(tmp_path):
    names = set()
    for _ in range(3):
        with Destination.at(tmp_path / "a.tif").replacing() as new:
            folder = new.parent.parent
            names.add(folder.name)
            assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert len(names) == 3


def test_a_symbolic_link_keeps_pointing_to_its_file_which_is_new(tmp_path):
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "real.gpkg").write_text("old")
    (tmp_path / "link.gpkg").symlink_to(tmp_path / "data" / "real.gpkg")
    write(Destination.at(tmp_path / "link.gpkg"))
    assert (tmp_path / "link.gpkg").is_symlink()
    assert (tmp_path / "data" / "real.gpkg").read_text() == "new"
    (tmp_path / "later.gpkg").symlink_to(tmp_path / "data" / "none.gpkg")
    write(Destination.at(tmp_path / "later.gpkg"))
    assert contents(tmp_path / "data") == {"real.gpkg": "new", "none.gpkg": "new"}


@pytest.mark.parametrize("mode", [0o600, 0o664])
def test_access_rights_of_the_old_file_are_kept(tmp_path, mode):
    fill(tmp_path, a_shp="old", a_dbf="old")
    for name in ("a.shp", "a.dbf"):
        (tmp_path / name).chmod(mode)
    write(Destination.at(tmp_path / "a.shp"), "new", ".dbf", ".cpg")
    assert {stat.S_IMODE(file.stat().st_mode) for file in tmp_path.iterdir()} == {mode}


KILLED_DISK = """
import os, signal, sys
from pathlib import Path
from rail_extract.core.disk import Destination

main, moves = Path(sys.argv[1]), int(sys.argv[2])
replace, done = Path.replace, []

def count(self, target):
    if self.parent.name != main.parent.name or self != Path(target):  # not the check of the old file
        if len(done) == moves:
            os.kill(os.getpid(), signal.SIGKILL)
        done.append(target)
    return replace(self, target)

destination = Destination.at(main)
with destination.replacing() as new:
    for suffix in sys.argv[3:]:
        new.with_suffix(suffix).write_text("new")
    Path.replace = count
"""


KILLED_FOLDER = """
import os, signal, sys
from pathlib import Path
from rail_extract.core.disk import NEW, replace_folder
from rail_extract.core.disk import scratch_folder

target, left, replace = Path(sys.argv[1]), int(sys.argv[2]), Path.replace

def count(self, other):
    global left
    if not left:
        os.kill(os.getpid(), signal.SIGKILL)
    left -= 1
    return replace(self, other)

with scratch_folder(target.parent) as scratch:
    new = scratch / NEW / target.name
    new.mkdir(parents=True)
    (new / "tile").write_text("new")
    Path.replace = count
    replace_folder(scratch, target)
"""


@pytest.mark.parametrize(
    ("has_old", "moves", "text"), [(True, 0, "old"), (True, 1, "new"), (True, 2, "new"), (False, 0, "new")]
)
def test_killed_at_any_move_a_folder_is_old_or_new_after_the_next_run(tmp_path, has_old, moves, text):
    target = tmp_path / "tiles"
    if has_old:
        target.mkdir()
        (target / "tile").write_text("old")
    subprocess.run([sys.executable, "-c", KILLED_FOLDER, str(target), str(moves)])
    for made in temporary(tmp_path):
        age(tmp_path / made)
    Destination.at(tmp_path / "other.txt")
    assert (target / "tile").read_text() == text
    assert temporary(tmp_path) == []


@pytest.mark.parametrize(
    ("name", "before", "after"),
    [
        ("a.shp", (".shp", ".dbf", ".prj", ".qix"), (".shp", ".dbf", ".prj", ".cpg")),
        ("a.shp", (), (".shp", ".dbf", ".prj", ".cpg")),
        ("a.tif", (".tif", ".tif.ovr", ".tif.aux.xml"), (".tif",)),
    ],
)
def test_killed_at_any_move_a_set_is_old_or_new_or_cannot_be_opened_until_the_next_run(tmp_path, name, before, after):
    """The set that opens has files of one run, and the next run into the folder leaves a complete set."""
    survived = False
    for moves in range(12):
        folder = tmp_path / f"{moves}"
        folder.mkdir()
        for suffix in before:
            (folder / f"a{suffix}").write_text("old")
        call = [sys.executable, "-c", KILLED_DISK, str(folder / name), str(moves), *after]
        survived = subprocess.run(call).returncode != -signal.SIGKILL
        if (folder / name).exists():
            assert len(set(contents(folder).values())) == 1
        elif before:
            assert len(after) > 1  # a single file is never absent
        for made in temporary(folder):
            age(folder / made)
        write(Destination.at(folder / "other.txt"))
        (folder / "other.txt").unlink()
        sets = [{f"a{suffix}": text for suffix in suffixes} for suffixes, text in ((before, "old"), (after, "new"))]
        assert contents(folder) in sets
        assert temporary(folder) == []
        if survived:
            break
    assert survived and moves >= len(after)


def test_an_interrupted_move_does_not_overwrite_what_the_user_has_written_since(tmp_path):
    call = [sys.executable, "-c", KILLED_DISK, str(tmp_path / "a.shp"), "1", ".shp", ".dbf"]
    assert subprocess.run(call).returncode == -signal.SIGKILL
    (tmp_path / "a.shp").write_text("mine")
    (tmp_path / "a.dbf").write_text("mine")
    for made in temporary(tmp_path):
        age(tmp_path / made)
    Destination.at(tmp_path / "other.txt")
    assert contents(tmp_path) == {"a.shp": "mine", "a.dbf": "mine"}
    assert temporary(tmp_path) == []
