"""Each rule that can be switched off is one of the core, and worlds judge rules by the failures that they decide."""

import json
import sys
from importlib import import_module
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"

OWN = ("ablation_of_worlds", "processes", "rules", "worlds")
"""Programs of the benchmarks, and modules that they import."""


@pytest.fixture
def program(monkeypatch):
    """Return a function that imports a program of the benchmarks."""
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    yield import_module
    for name in OWN:
        sys.modules.pop(name, None)


def line(seed, fails, asked, without):
    return {"seed": seed, "fails": fails, "asked": asked, "without": without}


def test_every_rule_is_one_of_the_core(program):
    rules = program("rules")
    off = [(module, attribute) for switch in rules.SWITCHES for module, attribute, _ in switch.off]
    assert len(off) > 80
    missing = [one for one in off if not hasattr(rules.module_of(one[0]), one[1])]
    assert not missing


def test_a_rule_is_judged_by_the_worlds_that_fail_without_it_alone(program):
    both = ["needed", "idle"]
    lines = [
        *(line(seed, False, both, {"needed": True, "idle": False}) for seed in range(8)),
        *(line(seed, True, both, {"needed": True}) for seed in range(8, 10)),
        *(line(seed, False, both, {}) for seed in range(10, 20)),
    ]
    ablation = program("ablation_of_worlds")
    table = list(ablation.rows(both, lines))
    assert table[0] == "20 worlds, 2 fail with all rules."
    assert table[2] == "| `needed` | 20 | 10 | 8 | 0 | 0.008 |"
    assert table[3] == "| `idle` | 20 | 8 | 0 | 0 | 1.000 |"
    assert ablation.undecided(both, lines) == ["idle"]


def test_worlds_that_were_not_asked_say_nothing_about_a_rule(program):
    lines = [line(1, True, ["old"], {"old": False}), line(2, False, ["old", "new"], {"new": True})]
    table = list(program("ablation_of_worlds").rows(["new"], lines))
    assert table[2] == "| `new` | 1 | 1 | 1 | 0 | 1.000 |"


def test_a_world_is_asked_once_for_each_rule(program, tmp_path):
    """The second run asks for another rule, and the third for none; all that is known counts."""
    ablation, path = program("ablation_of_worlds"), tmp_path / "classified.jsonl"
    slips, guides = "vectorize.open_slips", "vectorize.attach_branches"
    for names, lines in (([slips], 1), ([guides, slips], 2), ([slips, guides], 2)):
        (known,) = ablation.collect([12], "classified", names, path, 1)
        assert len(path.read_text("utf-8").splitlines()) == lines
    assert known["asked"] == [slips, guides]


def test_a_world_says_without_which_rules_it_fails(program):
    """Without the courses this world fails; it has no slip, so the rule of slips is not run again."""
    names = ["vectorize.follow_courses", "vectorize.open_slips"]
    result = program("ablation_of_worlds").ablate((4, "classified", names))
    assert json.loads(json.dumps(result)) == line(4, False, names, {"vectorize.follow_courses": True})
