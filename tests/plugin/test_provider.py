"""What the toolbox offers."""

GROUPS = {
    "Rails and tracks": {"extractrails", "measuretrackgeometry", "measureclearance"},
    "Alignment": {"stationalongaxis", "fitalignment", "comparetracks", "exportalignment", "importalignment"},
    "Raw clouds": {"classifyrailpoints", "growrailpoints", "airbornecenterlines", "trainrailclassifier"},
    "Single steps": {"rasterizerailpoints", "frpdfcleanup", "vectorizerails", "buildtrackcenterlines"},
    "Setup": {"installpackages", "checkinstallation"},
}


def test_the_main_job_stands_apart_from_raw_clouds_and_single_steps(qgis, plugin):
    groups = {}
    for algorithm in qgis.processingRegistry().providerById("railextract").algorithms():
        groups.setdefault(algorithm.group(), set()).add(algorithm.name())
    assert groups == GROUPS


def test_every_parameter_explains_itself(plugin):
    for algorithm in plugin.provider.algorithms():
        for definition in algorithm.parameterDefinitions():
            assert definition.help(), (algorithm.id(), definition.name())


def test_a_report_is_no_output_that_stops_the_batch_dialog(plugin):
    outputs = [one.outputDefinition("REPORT") for one in plugin.provider.algorithms()]
    assert {output.type() for output in outputs if output} == {"outputFile"}


def test_unloading_takes_the_provider_away(qgis, plugin):
    registry = qgis.processingRegistry()
    plugin.unload()
    assert registry.providerById("railextract") is None
    plugin.initGui()
    assert registry.providerById("railextract") is not None
