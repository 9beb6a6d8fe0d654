"""Progress: the remaining time is told in turn, and by the speed of late."""

from rail_extract.core.progress import Estimating, Progress


class Listener(Progress):
    def __init__(self):
        self.texts, self.fractions = [], []

    def set_fraction(self, fraction):
        self.fractions.append(fraction)

    def status(self, text):
        self.texts.append(text)


class Clock:
    now = 0.0

    def __call__(self):
        return self.now


def run(steps):
    """Feed (second, fraction) pairs; give what was told."""
    listener, clock = Listener(), Clock()
    progress = Estimating(listener, clock)
    for clock.now, fraction in steps:
        progress.set_fraction(fraction)
    assert listener.fractions == [fraction for _, fraction in steps]
    return listener.texts


def test_even_work_is_foretold_exactly():
    texts = run([(second, second / 1000) for second in range(1, 1001)])
    assert texts[0] == "0 % done, about 17 minutes left"
    assert texts[99] == "50 % done, about 8 minutes left"
    assert texts[-1].startswith("100 % done") or texts[-1].endswith("about 10 seconds left")


def test_work_that_slows_down_is_judged_by_its_latest_half():
    fast = [(second, 0.5 * second / 100) for second in range(1, 101)]
    slow = [(100 + second, 0.5 + 0.5 * second / 1000) for second in range(1, 401)]
    assert run(fast + slow)[-1] == "70 % done, about 10 minutes left"


def test_nothing_is_told_at_once_nor_too_often():
    assert run([(0.1 * step, step / 100) for step in range(1, 40)]) == []
    assert len(run([(0.1 * step, step / 1000) for step in range(1, 1000)])) <= 20


def test_spans_pass_the_status_on():
    listener = Listener()
    Estimating(listener).span(0.2, 0.6).status("reading")
    assert listener.texts == ["reading"]
