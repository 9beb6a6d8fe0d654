"""The fuzzer itself: the same seed gives the same file, and every way to fail is seen and named."""

import random

import fuzz
import pytest
from fuzzing.kinds import KINDS, Kind
from fuzzing.mutators import damaged

SCRIPT = """
import os, sys, time
import fuzz
from fuzzing.kinds import KINDS, Kind
from rail_extract.core.errors import CloudError

def make(folder):
    (folder / "good.txt").write_bytes(b"good")
    return [folder / "good.txt"]

def read(path):
    data = path.read_bytes()
    if data == b"good":
        return
    if data == b"refused":
        raise CloudError("It is bad: make it again.")
    if data == b"two lines":
        raise CloudError("It is bad:\\nmake it again.")
    if data == b"panic":
        raise BaseException("at the disco")
    if data == b"memory":
        bytearray(2**31)
    if data == b"signal":
        os.abort()
    while data == b"hang":
        pass

WORDS = [b"good", b"refused", b"two lines", b"panic", b"memory", b"signal", b"hang", b"good"]
KINDS["test"] = Kind("test", make, read)
Kind.copied = lambda self, folder, path: path
Kind.mutant = lambda self, folder, good, seed: (good[0].write_bytes(WORDS[seed]), good[0])[1]
fuzz.MAX_CPU_S = 2.0
if __name__ == "__main__":
    sys.exit(fuzz.main())
"""


def test_every_failure_is_seen_and_the_next_file_is_read(tmp_path, monkeypatch):
    (tmp_path / "script.py").write_text(SCRIPT, encoding="utf-8")
    monkeypatch.setattr(fuzz, "SCRIPT", tmp_path / "script.py")
    monkeypatch.setattr(fuzz, "MAX_CPU_S", 2.0)
    counts, failures = fuzz.fuzz(Kind("test", list, print), range(8))
    assert counts == {"read": 2, "refused": 1, "failed": 5}
    assert {seed: reason.split(":")[0] for seed, reason in failures.items()} == {
        2: "not one line",
        3: "BaseException",
        4: "memory",
        5: "SIGABRT script.py",
        6: "hang",
    }


def test_damage_changes_a_file(tmp_path):
    (tmp_path / "zeros").write_bytes(bytes(8))
    assert all(damaged(tmp_path / "zeros", random.Random(seed)) != bytes(8) for seed in range(200))


@pytest.mark.parametrize("name", ["laz", "vpc"])
def test_a_seed_gives_the_same_file_again(tmp_path, name):
    kind = KINDS[name]
    good = kind.make(tmp_path)
    first = [kind.mutant(tmp_path, good, seed).read_bytes() for seed in range(20)]
    again = [kind.mutant(tmp_path, good, seed).read_bytes() for seed in range(20)]
    assert first == again
    assert len(set(first)) > 15
