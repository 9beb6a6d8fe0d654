"""Runners: tasks wait for their inputs, start as early as they can, and results are released."""

import weakref

import pytest
from heard import Heard
from hypothesis import given
from hypothesis import strategies as st
from rail_extract.core.errors import Cancelled
from rail_extract.core.run.tasks import Once, Runner, Task
from rail_extract.core.tiles.grid import around

keys = st.sets(st.tuples(st.integers(-3, 3), st.integers(-3, 3)), min_size=1)


class Raster:
    """Stands for a result that takes memory."""


def square_tasks(squares, clean, draw):
    cleaning = {("clean", key): Task("clean", clean, (key,), weight=7, returned=False) for key in sorted(squares)}
    drawing = {
        ("draw", key): Task(
            "draw",
            draw,
            (key,),
            needs=(("clean", key),),
            uses=tuple(("clean", near) for near in around(key) if near in squares and near != key),
            weight=3,
        )
        for key in sorted(squares)
    }
    return {**cleaning, **drawing}


@given(keys)
def test_every_square_is_drawn_once_as_soon_as_its_neighbours_are_clean(squares):
    cleaned, drawn, alive = [], [], weakref.WeakSet()

    def clean(key, context):
        assert not [one for one in set(cleaned) - set(drawn) if squares & set(around(one)) <= set(cleaned)]
        cleaned.append(key)
        raster = Raster()
        alive.add(raster)
        return raster

    def draw(key, context):
        neighbours = squares & set(around(key))
        assert {near for _, near in context.results} == neighbours <= set(cleaned)
        drawn.append(key)
        needed = {near for one in squares - set(drawn) for near in squares & set(around(one))}
        assert len(alive) == len(set(cleaned) & (needed | neighbours))
        return key

    found = list(Runner().run(square_tasks(squares, clean, draw)))
    assert cleaned == sorted(squares)
    assert found == [(("draw", key), key) for key in drawn]
    assert sorted(drawn) == sorted(squares)
    assert len(alive) == 0


def test_the_progress_follows_the_weights():
    def half(key, context):
        context.progress.set_fraction(0.5)

    heard = Heard()
    tasks = {number: Task("", half, (number,), weight=weight) for number, weight in enumerate((1, 6, 3))}
    list(Runner().run(tasks, heard))
    assert heard.fractions == pytest.approx([0.05, 0.1, 0.4, 0.7, 0.85, 1.0])


def test_a_cancel_is_noticed_between_tasks():
    ran = []
    tasks = {number: Task("", lambda one, context: ran.append(one), (number,)) for number in range(4)}
    with pytest.raises(Cancelled):
        list(Runner().run(tasks, Heard(cancel_at=0.5)))
    assert ran == [0, 1]


def test_an_engine_is_set_up_once_and_again_for_other_parameters():
    made = []

    def make(name):
        made.append(name)
        return name.upper()

    once = Once()
    assert [once(make, name) for name in ("a", "a", "b", "b", "a")] == ["A", "A", "B", "B", "A"]
    assert made == ["a", "b", "a"]


def test_the_start_of_a_network_is_said_once():
    def clean(key, context):
        return context.network(len, key)

    heard = Heard()
    tasks = {key: Task("", clean, (key,)) for key in ("aa", "bbb")}
    tasks["again"] = Task("", clean, ("bbb",))
    assert dict(Runner().run(tasks, heard)) == {"aa": 2, "bbb": 3, "again": 3}
    assert heard.texts("status") == 2 * ["Starting the network", "The network has started"]
