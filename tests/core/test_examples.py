"""The examples in the docstrings of the core run and give what they show."""

import doctest
import importlib
import importlib.util
import pkgutil

import pytest
import rail_extract.core

MODULES = [
    "rail_extract",
    "rail_extract.core",
    *(module.name for module in pkgutil.walk_packages(rail_extract.core.__path__, "rail_extract.core.")),
]


def has_examples(name):
    return ">>> " in importlib.util.find_spec(name).loader.get_source(name)


@pytest.mark.parametrize("name", [name for name in MODULES if has_examples(name)])
def test_examples_give_what_they_show(name):
    results = doctest.testmod(importlib.import_module(name), optionflags=doctest.NORMALIZE_WHITESPACE)
    assert results.attempted > 0
    assert results.failed == 0


def test_the_front_door_has_an_example():
    assert has_examples("rail_extract.core")
    assert has_examples("rail_extract.core.front")
