import pytest
from qgis.core import QgsProcessingParameterDefinition
from rail_extract.core.parameters import DEFAULT_STEP_M, DEFAULT_WORKERS, FitParameters, GrowParameters, Parameters
from rail_extract.core.standards import STANDARDS
from rail_extract.rail_extract_plugin.dialog.parameter_values import CHOICES, GROWTH, NUMBERS, class_numbers

PARAMETERS = [
    ("INPUT", "pointcloud", None),
    ("RAIL_CLASSES", "string", "10"),
    ("MERGE_CLASSES", "boolean", False),
    ("CLASSIFY", "boolean", False),
    ("METHOD", "enum", "GEOMETRY"),
    ("WEIGHTS", "file", None),
    ("SEEDS", "source", None),
    ("STANDARD", "enum", "EN_60E1_1435"),
    ("GAUGE", "number", None),
    ("HEAD_WIDTH", "number", None),
    ("EXTENT", "extent", None),
    ("MASK", "source", None),
    ("CRS", "crs", None),
    ("LEAVE_OUT", "enum", None),
    ("MODEL", "enum", "AUTO"),
    ("ITERATIONS", "number", 2),
    ("ENGINE", "enum", "AUTO"),
    ("DEVICE", "enum", "AUTO"),
    ("SMOOTHING_XY", "number", 0.8),
    ("SMOOTHING_Z", "number", None),
    ("TOLERANCE_XY", "number", 0.10),
    ("TOLERANCE_Z", "number", 0.03),
    ("CROWN_RADIUS", "number", 20.0),
    ("MAX_GAP", "number", 5.0),
    ("GAP_ANGLE", "number", 10.0),
    ("SIMPLIFY_XY", "number", 0.001),
    ("SIMPLIFY_Z", "number", 0.0005),
    ("MIN_LENGTH", "number", 1.0),
    ("OTHER_GAUGES", "string", None),
    ("CENTERLINE_TOLERANCE", "number", 0.05),
    ("STRIPS", "enum", "AS_THEY_ARE"),
    ("STEP", "number", 1.0),
    ("WORKERS", "number", 0),
    ("AXIS", "source", None),
    ("START_KM", "number", None),
    ("DIRECTION", "enum", "INCREASING"),
    ("POSTS", "source", None),
    ("POST_FIELD", "field", None),
    ("JUMPS", "source", None),
    ("FORMAT", "enum", "HECTOMETRES"),
    ("RAILS", "sink", None),
    ("CENTERLINES", "sink", None),
    ("QUALITY", "sink", None),
    ("FINDINGS", "sink", None),
    ("CLEANED", "rasterDestination", None),
    ("REPORT", "fileDestination", None),
]
"""The interface on which users' scripts depend."""

OUTPUTS = {
    "RAILS": "outputVector",
    "CENTERLINES": "outputVector",
    "QUALITY": "outputVector",
    "FINDINGS": "outputVector",
    "CLEANED": "outputRaster",
    "REPORT": "outputFile",
    "RAIL_COUNT": "outputNumber",
    "RAIL_LENGTH": "outputNumber",
    "CENTERLINE_COUNT": "outputNumber",
    "CENTERLINE_LENGTH": "outputNumber",
    "STATION_COUNT": "outputNumber",
    "SIGMA": "outputNumber",
    "BRIDGED_LENGTH": "outputNumber",
    "ENGINE_USED": "outputString",
}

RESULTS = {"RAILS", "CENTERLINES", "QUALITY", "FINDINGS", "CLEANED", "REPORT"}
ESSENTIAL = {"INPUT", "RAIL_CLASSES", "CLASSIFY", "STANDARD", "RAILS", "REPORT"}
OPTIONAL = {"WEIGHTS", "SEEDS", "GAUGE", "HEAD_WIDTH", "EXTENT", "MASK", "CRS", "LEAVE_OUT", "OTHER_GAUGES"} | RESULTS
OPTIONAL |= {"SMOOTHING_Z", "AXIS", "START_KM", "POSTS", "POST_FIELD", "JUMPS"}


CORE_DEFAULTS = {name: getattr(Parameters, field) for name, field in {**NUMBERS, **CHOICES}.items()}
CORE_DEFAULTS |= {"ITERATIONS": Parameters.passes, "STEP": DEFAULT_STEP_M, "WORKERS": DEFAULT_WORKERS}
GROW_DEFAULTS = {name: getattr(GrowParameters, field) for name, field in GROWTH.items()}
GROW_DEFAULTS |= {"BOTH": GrowParameters.both, "MAX_OUTLIERS": GrowParameters.max_outliers}
FIT_DEFAULTS = {"MIN_LENGTH": FitParameters.min_length_m, "TRANSITIONS": FitParameters.transitions}
OWN_DEFAULTS = {"growrailpoints": GROW_DEFAULTS, "fitalignment": FIT_DEFAULTS}


def having(algorithm, flag):
    return {definition.name() for definition in algorithm.parameterDefinitions() if definition.flags() & flag}


def test_parameters_match_the_interface(algorithm):
    found = [(one.name(), one.type(), one.defaultValue()) for one in algorithm.parameterDefinitions()]
    assert found == PARAMETERS


def test_outputs_match_the_interface(algorithm):
    assert {output.name(): output.type() for output in algorithm.outputDefinitions()} == OUTPUTS


def test_rare_parameters_are_advanced(algorithm):
    advanced = having(algorithm, QgsProcessingParameterDefinition.Flag.FlagAdvanced)
    assert advanced == {name for name, _, _ in PARAMETERS} - ESSENTIAL | RESULTS - ESSENTIAL


def test_optional_parameters(algorithm):
    assert having(algorithm, QgsProcessingParameterDefinition.Flag.FlagOptional) == OPTIONAL


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("STANDARD", [*STANDARDS, "CUSTOM", "DETECT"]),
        ("MODEL", ["AUTO", "base", "fast"]),
        ("ENGINE", ["AUTO", "TORCH", "OPENCV"]),
        ("DEVICE", ["AUTO", "CPU", "CUDA"]),
    ],
)
def test_choices_are_static_strings(algorithm, name, options):
    definition = algorithm.parameterDefinition(name)
    assert definition.usesStaticStrings()
    assert definition.options() == options


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
