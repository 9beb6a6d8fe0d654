"""Temporary folders: exclusive, private, and removed by the next run if and only if their process is gone."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from rail_extract.core.scratch import MARK, MIN_AGE_S, MIN_UNMARKED_AGE_S, scratch_folder, sweep

KILLED = """
import os, signal, sys
from pathlib import Path
from rail_extract.core.scratch import scratch_folder

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
