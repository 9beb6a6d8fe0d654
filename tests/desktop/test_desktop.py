"""What a new user meets in the real QGIS; each test looks at what one of the scenarios found."""

import re
from pathlib import Path

import pytest
from osgeo import ogr

SCENARIOS = (
    *("dialogs", "unload", "raw", "missing", "welcome"),
    *("review", "reopened", "again", "tried", "onwards", "growing", "steps", "train", "batch", "model"),
    "clearance",
)

NAMES = [
    *("extractrails", "classifyrailpoints", "growrailpoints", "airbornecenterlines"),
    *("rasterizerailpoints", "frpdfcleanup", "vectorizerails"),
    *("buildtrackcenterlines", "measuretrackgeometry", "stationalongaxis", "fitalignment", "comparetracks"),
    "measureclearance",
    *("exportalignment", "importalignment", "trainrailclassifier", "installpackages", "checkinstallation"),
]


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_no_error_and_no_crash(run_scenario, scenario):
    session = run_scenario(scenario)
    assert session["exceptions"] == []
    assert session["ended"]
    assert session.code == 0, session.said


def test_every_dialog_opens_and_its_help(run_scenario):
    session = run_scenario("dialogs")
    unable = session["without their packages"]
    assert unable in ([], ["trainrailclassifier"])  # it needs PyTorch, of which some Pythons have no build
    assert sorted([*session["dialogs"], *unable]) == sorted(NAMES)
    pages = [Path(address.replace("file://", "")).name for address in session["help"]]
    own = {"airborne", "clearance", "stationing", "alignment", "comparison", "alignment_files", "troubleshooting"}
    assert {page.partition(".")[0] for page in pages} == {*own, "parameters"}
    assert len(pages) == len(NAMES) - len(unable)


def test_dialogs_and_logs_have_words_for_ids(run_scenario):
    assert {name: ids for name, ids in run_scenario("dialogs")["ids"].items() if ids} == {}
    log = run_scenario("again")["wrong"].partition("Results:")[0]
    said = "\n".join(line for line in log.splitlines() if not line.startswith("{"))  # QGIS lists inputs by id
    assert re.findall(r"\b(?:[A-Z]+_[A-Z_]+|AUTO|NONE|GEOMETRY|LEARNED|STANDARD)\b", said) == []
    assert re.search(r"Engine of the network: .*, CPU, ", said)


def test_cloud_is_chosen_from_clouds_alone(run_scenario):
    session = run_scenario("dialogs")
    assert session["list without clouds"] == []
    assert session["list with a cloud"] == ["my cloud"]
    assert session["chosen layer"]


def test_cloud_is_selected_as_file_or_folder_or_typed(run_scenario):
    session = run_scenario("dialogs")
    assert session["file filters"][0] == "Point clouds (*.las *.LAS *.laz *.LAZ *.vpc *.VPC)"
    assert Path(session["selected file"]).name == "sample.laz"
    assert session["folders only"]
    assert Path(session["selected folder"]).name == "sample"
    assert session["typed path"] == "/data/typed.laz"


def test_a_wheel_that_passes_over_fields_changes_nothing(run_scenario):
    session = run_scenario("dialogs")
    assert len(session["changed"]) >= 12
    assert {name: new for name, new in session["changed"].items() if new} == {}
    assert session["what is around a list gets the wheel"]
    assert session["changed with the focus"] == 1


def test_a_standard_is_remembered_from_runs_only(run_scenario):
    session = run_scenario("dialogs")
    assert session["chosen and closed"] != "EN_60E1_1435"
    assert session["after it was closed"] == "EN_60E1_1435"
    assert session["chosen and run"] == session["after it was run"] == session["chosen and closed"]


def test_the_plugin_is_disabled_and_updated_during_a_run(run_scenario):
    session = run_scenario("unload")
    for name in ("disabled", "updated"):
        assert "Cancelled; nothing was written." in session[f"said when {name}"]
    assert session["without the plugin"]
    assert "Results:" in session["log"]


def test_a_raw_cloud_without_the_tick_is_explained_and_its_rails_are_found(run_scenario):
    session = run_scenario("raw")
    assert session["standard at first"] == "Detect from the points"
    refusal = session["refusal"]
    assert "The cloud has no points of class 10" in refusal
    assert 'if nobody has classified the cloud, "Find the rail points of a raw cloud"' in refusal
    assert session["why"] == "No point of the cloud has a rail class."
    assert session["offer"] == "Find the rail points of this raw cloud, and run again"
    assert f"Next: {session['offer']}" in refusal
    found = session["log"].rpartition("starting")[2]
    assert re.search(r"Detected .* head \d\d ± \d mm; fits .*, also ", found)
    assert "RAIL_COUNT: 2" in found.replace("'", "")
    assert "Review the findings" in found or "0 findings" in found


def test_layers_of_a_cloud_without_a_system_have_none(run_scenario):
    session = run_scenario("raw")
    assert set(session["systems"].values()) == {""}
    assert 'choose it as "CRS of a cloud without one"' in session["log"]
    assert not [text for text in session["bars"] if "Undefined" in text]


def test_everything_is_saved_as_one_file_with_a_project(run_scenario):
    session = run_scenario("raw")
    assert session["project is read"]
    assert session["saved layers"] == ["Findings", "Track centerlines", "Rails"]
    assert session["saved sources"] == ["all of it.gpkg"]
    assert session["saved alias"] == "Standard error [mm]"


def test_the_first_message_leads_to_packages_and_then_to_the_sample(run_scenario):
    session = run_scenario("welcome")
    ready = ["Ready: the sample shows what the plugin does.", "Open the sample…"]
    assert session["at first"] == session["when all is installed"] == ready
    text, button = session["with a missing package"]
    assert (text.rpartition(": ")[2], button) == ("torch_of_nobody.", "Install packages…")
    assert session["first button opens"] == "installpackages"
    assert session["log of the installation"].rstrip().endswith("Next: Open the sample…")
    assert session["second button opens"].endswith("rail_extract/resources/sample/sample.laz")
    assert session["at last"] == []


def test_an_empty_dock_is_closed_at_the_start_and_no_message_comes_twice(run_scenario):
    session = run_scenario("reopened")
    assert not session["dock is visible"]
    assert session["message"] == []
    assert session["dock opens"]
    assert "ProcessingToolbox" in session["tabs beside the dock"]


def test_a_wrong_gauge_is_corrected_by_a_link(run_scenario):
    session = run_scenario("again")
    steps = ["Review the findings", "Open the report", "Save all layers with styles and a project in one GeoPackage…"]
    assert session["wrong"].rstrip().endswith("Next: " + "  ·  ".join(["Run again as India 75R, 1000 mm", *steps]))
    assert session["wrong"].count("is it India 75R, 1000 mm") == 1
    assert session["standard"] == "IN_75R_1000"
    assert session["results"]["CENTERLINE_COUNT"] == 3
    assert session["right"].rstrip().endswith("Next: " + "  ·  ".join(steps))
    (opened,) = session["opened"]
    assert opened.endswith("report.html")
    assert session["dock is visible"]
    assert session["first finding"] == "A rail has no points"  # not that of the first run, whose file is the same


def test_missing_pytorch_leads_to_its_installation(run_scenario):
    session = run_scenario("missing")
    assert "run Install packages, with PyTorch set to CPU" in session["message"]
    assert (session["opened"], session["PyTorch"]) == ("installpackages", "CPU")
    assert session["message is closed"]


def test_the_menu_opens_the_sample(run_scenario):
    session = run_scenario("review")
    in_3d = ["Show Lines in 3D"] if session["version"] >= 33600 else []
    first = ["Extract Rails…", "Classify Rail Points…", "Grow Rails", "Review Findings"]
    assert session["menu"] == [*first, *in_3d, "Open the Sample…", "Install Packages…", "Help"]
    assert session["sample"].endswith("rail_extract/resources/sample/sample.laz")
    assert session["standard"] == "IN_75R_1000"


def test_the_report_opens_after_a_run(run_scenario):
    (opened,) = run_scenario("review")["opened"]
    assert opened.startswith("file://") and opened.endswith(".html")


def test_findings_are_reviewed_in_the_dock(run_scenario):
    session = run_scenario("review")
    assert session["dock is visible"]
    total = int(session["count"].split()[2].rstrip(";"))
    assert session["count"] == f"1 of {total}; 0 reviewed"
    assert session["count after"].endswith("2 reviewed")
    assert 20 <= session["scale"] < 100
    assert session["order"] == ["findings", "Track centerlines: sample", "Rails: sample"]
    dataset = ogr.Open(str(session.folder / "findings.gpkg"))
    layer = dataset.GetLayer(0)
    decided = {feature["finding"]: feature["review"] for feature in layer}
    assert len(decided) == total
    assert (decided[1], decided[2], set(list(decided.values())[2:])) == ("accepted", "rejected", {""})


def test_clearance_is_measured_and_intrusions_are_reviewed_in_the_dock(run_scenario):
    session = run_scenario("clearance")
    assert "INTRUSION_COUNT: 2" in session["log"].replace("'", "")
    (opened,) = session["opened"]
    assert opened.endswith(".html")
    names = {name.partition(":")[0]: rows for name, rows in session["layers"].items()}
    assert names == {"intrusions": 2, "Clearance": 90, "Platforms": 1}
    assert session["dock is visible"]
    assert session["depths"] == pytest.approx([80, 30], abs=4)
    assert session["counts"] == ["1 of 2; 0 reviewed", "2 of 2; 1 reviewed"]
    assert [reason.partition(" ")[2] for reason in session["reasons"]] == ["mm inside"] * 2
    (in_curve, up), (on_straight, _) = session["marks"]
    assert 1000 * on_straight == pytest.approx(-1615, abs=6)
    assert 1000 * in_curve == pytest.approx(-1565 - 80 * up, abs=15)  # cant leans the profile, and the picture is level
    assert min(session["points"]) > 100
    assert [1000 * inside for inside in session["inside"]] == pytest.approx(session["depths"], abs=0.5)
    assert session["legends"] == ["profile EBO_G1"] * 2
    assert session["decisions"] == ["accepted", ""]


def test_a_3d_view_opens_on_the_lines(run_scenario):
    session = run_scenario("review")
    if session["version"] < 33600:
        pytest.skip("This QGIS does not let a plugin open a 3D view.")
    assert session["looks at the rails"]
    assert 1.2 < session["distance to extent"] < 4
    assert abs(session["height looked at"] - session["height of rails"]) < 2


def test_a_clicked_rail_grows_and_is_classified(run_scenario):
    session = run_scenario("growing")
    assert session["said beside"].startswith("No railhead within 25 cm of the click: zoom in")
    assert session["said"].startswith("Followed 1")
    assert session["left after undo"] == session["left after the dialog"] == 1
    assert session["standard"] == "EN_60E1_1435"
    assert session["results"]["PAIRED_LENGTH"] > 20
    assert "Followed 1" in session["log"]
    assert (session.folder / "classified.las").stat().st_size > 100_000
    assert session["extract"] == [str(session.folder / "classified.las"), "20", "EN_60E1_1435"]


def test_single_steps_lead_from_the_cloud_to_the_track_geometry(run_scenario):
    session = run_scenario("steps")
    proposed = session["proposed"]
    assert proposed["frpdfcleanup"]["INPUT"] == "Rail raster: sample"
    assert proposed["vectorizerails"]["INPUT"] == "Cleaned rail raster: sample"
    assert Path(proposed["vectorizerails"]["POINTS"]).name == "sample.laz"
    pairing = proposed["buildtrackcenterlines"]
    assert (pairing["INPUT"], pairing["STANDARD"]) == ("Rails: sample", "IN_75R_1000")
    last = proposed["measuretrackgeometry"]
    assert (last["INPUT"], last["RAILS"]) == ("Track centerlines: sample", "Rails: sample")
    assert (Path(last["POINTS"]).name, last["STANDARD"]) == ("sample.laz", "IN_75R_1000")
    assert session["stations"] > 50
    assert session["standard that is remembered"] is None  # as that of a demonstration


def test_a_training_leads_to_its_page_and_to_the_use_of_its_weights(run_scenario):
    session = run_scenario("train")
    if not session["able"]:
        pytest.skip("It needs PyTorch, of which some Pythons have no build.")
    (opened,) = session["opened"]
    assert opened.endswith("CARD.html")
    assert (session["weights"], session["method"]) == (True, "LEARNED")


def test_batch_writes_what_is_named_and_skips_what_is_blank(run_scenario):
    session = run_scenario("batch")
    assert session["log"].count("correctly executed") == 2
    assert "Batch execution completed" in session["log"]
    assert session["files"] == ["RAILS0.gpkg", "RAILS1.gpkg", "REPORT0.html", "REPORT1.html"]
    assert session["layers"] == ["RAILS0", "RAILS1"]


def test_a_part_is_tried_and_nothing_of_it_is_kept(run_scenario):
    session = run_scenario("tried")
    preview = {"Preview of Extract rails: sample": ["Track centerlines: sample", "Rails: sample"]}
    assert session["without a map"] == session["in the map"] == preview
    west, south, east, north = session["extent without a map"]
    assert 40 < max(east - west, north - south) <= 101
    west, south, east, north = session["extent in the map"]
    assert 10 < max(east - west, north - south) < 60
    assert session["offered"] == "Next: Run on all that is chosen"
    assert (session["file"], session["standard that is remembered"]) == (False, None)
    (run,) = session["at last"]
    assert run == "Extract rails: sample"


def test_a_failed_batch_leaves_no_task(run_scenario):
    session = run_scenario("batch")
    assert session["failed log"].count("The cloud has no points of class 99") == 2
    assert session["tasks left"] == []


def test_the_standard_of_the_sample_is_not_that_of_the_user(run_scenario):
    assert run_scenario("onwards")["standard of the next dialog"] == "DETECT"


def test_saved_layers_are_those_of_the_file(run_scenario):
    session = run_scenario("onwards")
    said, *files = session["saved"]
    assert said == "Saved run.gpkg and run report.html. The project uses this file from now on."
    assert files == ["run report.html", "run.gpkg"]
    assert session["sources"] == ["run.gpkg"]
    assert session["decided"] == ["rejected", ""]


def test_runs_are_in_groups_and_named_by_their_input(run_scenario):
    assert run_scenario("onwards")["groups"] == {
        "Station along axis: sample": ["Layer with kilometres: sample"],
        "Fit alignment: sample": ["Elements: sample", "Deviations: sample"],
        "Extract rails: sample": [
            *("Findings: sample", "Track centerlines: sample", "Rails: sample", "Track geometry: sample"),
        ],
    }


def test_the_next_step_after_a_fit_exports_its_elements(run_scenario):
    session = run_scenario("onwards")
    assert session["fit"].startswith("Next: Export the elements for design software…")
    assert session["exported"] == "Elements: sample"


def test_a_copy_with_kilometres_has_the_style_of_its_layer(run_scenario):
    session = run_scenario("onwards")
    assert session["aliases"] == ["In doubt [m]", "Kilometre"]
    assert "#d62839" in session["colours"]


def test_model_takes_a_folder_and_runs(run_scenario):
    session = run_scenario("model")
    assert session["choice of a step"] == "Point cloud (layer, file or folder)"
    assert session["choice of a step"] in session["choices of a step"]
    made = {name for name, value in session["results"].items() if value}
    assert made == {"rails:RAILS", "centerlines:CENTERLINES", "quality:QUALITY", "quality:REPORT"}
    assert "Execution completed" in session["log"]
    standard, text = session["standard of the model"]
    assert standard != "DETECT" and "DETECT" not in text  # steps after the first have no points
