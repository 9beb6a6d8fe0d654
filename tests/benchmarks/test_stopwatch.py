"""The stopwatch of the benchmarks: what counts to a stage, and what to the stages within it."""

import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.fixture(scope="module")
def stopwatch():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(FOLDER))
        import stopwatch

        yield stopwatch.Stopwatch
    sys.modules.pop("stopwatch", None)


class Clock:
    now = 0.0

    def __call__(self):
        return self.now

    def work(self, seconds):
        self.now += seconds


def test_the_time_of_a_stage_is_without_that_of_the_stages_within_it(stopwatch):
    clock = Clock()
    watch = stopwatch(clock)
    with watch.stage("outer"):
        clock.work(1.0)
        with watch.stage("inner"):
            clock.work(2.0)
        clock.work(4.0)
    clock.work(8.0)
    assert watch.spent_s["outer"] == 5.0
    assert watch.spent_s["inner"] == 2.0


def test_functions_methods_of_classes_and_generators_count(stopwatch):
    clock = Clock()
    watch = stopwatch(clock)

    class Steps:
        @classmethod
        def make(cls, seconds):
            clock.work(seconds)
            return cls

    def stepwise():
        clock.work(1.0)
        yield "first"
        clock.work(2.0)

    module = SimpleNamespace(stepwise=stepwise, work=clock.work)
    watch.time(module, "stepwise", "steps")
    watch.time(module, "work", "work")
    watch.time(Steps, "make", "make")
    assert Steps.make(4.0) is Steps
    for _ in module.stepwise():
        module.work(8.0)
        clock.work(16.0)  # not in a stage
    assert {name: watch.spent_s[name] for name in ("steps", "work", "make")} == {"steps": 3.0, "work": 8.0, "make": 4.0}
