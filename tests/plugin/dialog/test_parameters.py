import pytest
from qgis.core import QgsProcessingParameterDefinition
from rail_extract.core.jobs.values import CHOICES, GROWTH, NUMBERS, class_numbers
from rail_extract.core.parameters import DEFAULT_STEP_M, DEFAULT_WORKERS, FitParameters, GrowParameters, Parameters

CORE_DEFAULTS = {name: getattr(Parameters, field) for name, field in {**NUMBERS, **CHOICES}.items()}
CORE_DEFAULTS |= {"STEP": DEFAULT_STEP_M, "WORKERS": DEFAULT_WORKERS}
GROW_DEFAULTS = {name: getattr(GrowParameters, field) for name, field in GROWTH.items()}
FIT_DEFAULTS = {"MIN_LENGTH": FitParameters.min_length_m, "TRANSITIONS": FitParameters.transitions}
OWN_DEFAULTS = {"growrailpoints": GROW_DEFAULTS, "fitalignment": FIT_DEFAULTS}


def test_rare_parameters_are_advanced(algorithm):
    advanced = QgsProcessingParameterDefinition.Flag.FlagAdvanced
    in_sight = [one.name() for one in algorithm.parameterDefinitions() if not one.flags() & advanced]
    assert in_sight == ["INPUT", "RAIL_CLASSES", "CLASSIFY", "STANDARD", "RAILS", "REPORT"]


def test_choices_are_the_ids_of_scripts(plugin):
    for algorithm in plugin.provider.algorithms():
        choices = [one for one in algorithm.parameterDefinitions() if one.type() == "enum" and one.name() != "CONTENT"]
        assert all(one.usesStaticStrings() for one in choices)


def test_labels_of_quantities_state_their_unit(algorithm):
    unitless = {"ITERATIONS", "WORKERS"}
    for definition in algorithm.parameterDefinitions():
        if definition.type() == "number" and definition.name() not in unitless:
            assert definition.description().endswith(("[m]", "[mm]", "[°]", "[km]"))


@pytest.mark.parametrize(("text", "numbers"), [("10", (10,)), ("10,11", (10, 11)), (" 11; 10 11", (11, 10))])
def test_class_numbers(text, numbers):
    assert class_numbers(text, "RAIL_CLASSES") == numbers


def test_defaults_match_the_core(plugin):
    seen = set()
    for algorithm in plugin.provider.algorithms():
        for definition in algorithm.parameterDefinitions():
            defaults = OWN_DEFAULTS.get(algorithm.name(), CORE_DEFAULTS)
            if definition.name() in defaults:
                seen.add(definition.name())
                default = defaults[definition.name()]
                assert definition.defaultValue() == default, (algorithm.name(), definition.name())
    assert seen == {*CORE_DEFAULTS, *GROW_DEFAULTS, *FIT_DEFAULTS}
