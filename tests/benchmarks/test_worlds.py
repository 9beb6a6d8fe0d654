"""Fixed worlds are extracted without a fault, and the command takes up a run where it ended."""

import json
import runpy
import sys
from pathlib import Path

import pytest
from rail_extract.laboratory.ruler.worlds import run
from rail_extract.laboratory.worlds.world import CLASSIFIED, RAW, VERSION, make

PROGRAM = Path(__file__).resolve().parents[2] / "benchmarks" / "worlds.py"

FIXED = [(RAW, seed) for seed in (1, 6, 12, 20)] + [(CLASSIFIED, seed) for seed in (1, 4, 6, 8, 19, 20)]
"""Small worlds of several kinds that are extracted without a fault."""


SWITCHES = [(CLASSIFIED, seed) for seed in (10958, 11157, 11383)]
"""Worlds that fail if lines do not keep their partners where rails cross at a small angle, if the rails of a slip are
found one by one, and if a link counts as left out that another join uses."""


FILLED = [(RAW, 15606)]
"""A world that fails if rails 7 to 10 cm above their bed count as clear of it."""


@pytest.mark.parametrize(("cloud", "seed"), FIXED + SWITCHES + FILLED)
def test_a_world_is_extracted_without_a_fault(cloud, seed):
    judged = run(make(seed, cloud))
    assert judged.faults == (), judged.figures
    assert judged.figures["to find m"] > 50


@pytest.fixture
def program(monkeypatch):
    monkeypatch.syspath_prepend(str(PROGRAM.parent))
    yield runpy.run_path(str(PROGRAM))
    sys.modules.pop("processes", None)


def test_worlds_that_the_same_code_has_run_are_not_run_again(program, tmp_path):
    def line(seed, code, version=VERSION, faults=()):
        return json.dumps({"seed": seed, "code": code, "version": version, "faults": list(faults)})

    code = program["fingerprint"]()
    fault = {"cause": "rail not found", "silent": False}
    (tmp_path / "raw.jsonl").write_text(
        "\n".join([line(1, "other", faults=[fault]), line(1, code), line(2, code, faults=[fault]), '{"seed": 3'])
    )
    found = program["collect"](range(1, 3), RAW, tmp_path, 1)
    assert [(one["seed"], len(one["faults"])) for one in found] == [(1, 0), (2, 1)]


def test_a_line_of_a_world_says_what_was_drawn_and_what_came_out(program):
    world = make(6, CLASSIFIED)
    line = program["line_of"](world, run(world), CLASSIFIED, "code")
    again = json.loads(json.dumps(line))
    assert (again["seed"], again["kind"], again["version"]) == (6, CLASSIFIED, VERSION)
    assert again["world"]["survey"] == world.survey.kind
    assert again["found %"] == 100
    assert again["expected"] == [2, 2]
    assert again["within"]["n m"] == pytest.approx(again["to find m"], rel=0.1)
