"""Progress: estimates of the remaining time, and relaying of messages."""

import re

import pytest
from heard import Heard
from rail_extract.core.errors import Cancelled
from rail_extract.core.progress import Estimating


class Clock:
    now = 0.0

    def __call__(self):
        return self.now


def run(steps):
    """Report (second, fraction) pairs and return the status messages."""
    heard, clock = Heard(), Clock()
    progress = Estimating(heard, clock)
    for clock.now, fraction in steps:
        progress.set_fraction(fraction)
    assert heard.fractions == [fraction for _, fraction in steps]
    return heard.texts()


def test_the_estimate_is_exact_at_constant_speed():
    texts = run([(second, second / 1000) for second in range(1, 1001)])
    assert texts[0] == "5 % done, about 16 minutes left"
    assert "50 % done, about 8 minutes left" in texts
    assert texts[-1] == "99 % done, about 10 seconds left"


def test_less_than_ten_seconds_are_not_announced():
    assert run([(second, second / 16) for second in range(1, 16)]) == ["31 % done, about 10 seconds left"]


def test_the_estimate_follows_the_second_half_of_the_elapsed_time():
    fast = [(second, 0.5 * second / 100) for second in range(1, 101)]
    slow = [(100 + second, 0.5 + 0.5 * second / 1000) for second in range(1, 401)]
    assert run(fast + slow)[-1] == "70 % done, about 10 minutes left"


def test_nothing_is_said_until_the_time_is_known_to_a_factor_of_two():
    """A run of 53 s that does next to nothing at first; its second half takes turns in being fast and slow."""
    first = [(second, second / 4000) for second in range(1, 21)]
    rest = [(second, 0.005 + 0.02 * (second - 20)) for second in range(21, 53)]
    for text in run(first + rest):
        percent, left_s = (int(re.search(words, text)[1]) for words in (r"(\d+) %", r"about (\d+) seconds"))
        left = 50 * (1 - percent / 100)
        assert left / 2 <= left_s <= 2 * left
    uneven = [(second, (second + 25 * (second // 50)) / 1000) for second in range(1, 200)]
    assert run([(second, min(second / 1e5, 0.04)) for second in range(1, 60)]) == []
    assert len(run(uneven)) < len(run([(second, second / 1000) for second in range(1, 200)]))


def test_the_time_before_an_activity_does_not_count_in_its_speed():
    heard, clock = Heard(), Clock()
    progress = Estimating(heard, clock)
    progress.set_fraction(0.2)
    clock.now = 60.0  # an import
    progress.status("The network has started")
    for second in range(61, 71):
        clock.now = second
        progress.set_fraction(0.2 + (second - 60) / 100)
    assert heard.texts() == ["The network has started", "30 % done, about 70 seconds left"]


def test_nothing_is_estimated_while_files_are_read():
    heard, clock = Heard(), Clock()
    progress = Estimating(heard, clock)
    progress.span(0.0, 0.1).reading()
    for clock.now in range(1, 30):
        progress.set_fraction(0.1 * clock.now / 29)
    progress.status("Searching for rails")
    assert heard.texts() == ["Searching for rails"]
    for clock.now in range(30, 41):
        progress.set_fraction(0.1 + (clock.now - 29) / 90)
    assert heard.texts()[1:] == ["16 % done, about 80 seconds left", "21 % done, about 70 seconds left"]


def test_spans_relay_everything():
    heard = Heard()
    span = Estimating(heard).span(0.2, 0.6)
    span.status("reading")
    span.info("one file")
    span.warning("no coordinate system")
    span.set_fraction(0.5)
    assert heard.texts() == ["reading", "one file", "no coordinate system"]
    assert heard.fractions == [pytest.approx(0.4)]
    assert not span.is_cancelled()
    heard.is_cancelled = lambda: True
    with pytest.raises(Cancelled):
        span.check()


def test_a_step_of_a_step_covers_its_part_of_the_whole():
    heard = Heard()
    heard.span(0.2, 0.6).span(0.5, 1.0).span(0.0, 0.5).set_fraction(1.0)
    assert heard.fractions == [pytest.approx(0.5)]
