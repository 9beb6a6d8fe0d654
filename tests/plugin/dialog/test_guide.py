"""The guide and the algorithms: every parameter is explained, and commands use only existing parameters."""

import re
from pathlib import Path

import reference

DOCS = Path(__file__).resolve().parents[3] / "docs"


def algorithms(plugin):
    return {algorithm.id(): algorithm for algorithm in plugin.provider.algorithms()}


def inputs(algorithm):
    return [one for one in algorithm.parameterDefinitions() if not one.isDestination()]


def test_every_parameter_is_explained(plugin):
    explained = set(re.findall(r"`([A-Z_]+)`", (DOCS / "parameters.md").read_text(encoding="utf-8")))
    names = {one.name() for algorithm in algorithms(plugin).values() for one in inputs(algorithm)}
    assert len(names) > 20
    assert not names - explained


def test_commands_name_algorithms_and_parameters_that_exist(plugin):
    text = (DOCS / "tutorial.md").read_text(encoding="utf-8").replace("\\\n", " ")
    commands = re.findall(r"run (railextract:\w+)(.*)", text)
    assert len(commands) > 7
    for name, words in commands:
        known = {one.name() for one in algorithms(plugin)[name].parameterDefinitions()}
        assert not set(re.findall(r"\b([A-Z_]+)=", words)) - known, name


def test_reference_is_up_to_date(plugin):
    assert reference.page(plugin.provider) == reference.PAGE.read_text(encoding="utf-8")
