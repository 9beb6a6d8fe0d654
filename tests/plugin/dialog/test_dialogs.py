"""The dialogs before a run: labels, icons, fields, help, and refused values."""

import re
from pathlib import Path

import pytest
from dialog_pictures import HELP_SHARE, SIZES
from qgis.PyQt.QtCore import QUrl
from qgis.PyQt.QtWidgets import QGroupBox, QLabel, QScrollArea, QSplitter, QTextBrowser
from rail_extract.rail_extract_plugin.algorithms import ALGORITHMS
from rail_extract.rail_extract_plugin.dialog import guide
from rail_extract.rail_extract_plugin.dialog.choices import WORDS
from rail_extract.rail_extract_plugin.dialog.help_panel import ADVANCED
from rail_extract.rail_extract_plugin.dialog.sections import OTHERS, section_of
from rail_extract.rail_extract_plugin.dialog.wording import for_user, with_labels

NAMES = [one.JOB.name for one in ALGORITHMS]
SMALLEST_ICON = 16


@pytest.fixture
def make(qgis, plugin):
    return lambda name: qgis.processingRegistry().createAlgorithmById(f"railextract:{name}")


@pytest.fixture
def open_dialog(qgis, make):
    opened = []

    def open_dialog(name):
        opened.append(make(name).createCustomParametersWidget())
        opened[-1].show()
        qgis.processEvents()
        return opened[-1]

    yield open_dialog
    for dialog in opened:
        dialog.close()


@pytest.mark.parametrize("name", NAMES)
def test_dialog_shows_every_parameter_at_its_default(open_dialog, name):
    dialog = open_dialog(name)
    definitions = {definition.name(): definition for definition in dialog.algorithm().parameterDefinitions()}
    wrappers = dialog.mainWidget().wrappers
    assert set(wrappers) == set(definitions)
    for key, definition in definitions.items():
        if definition.type() in ("number", "enum") or key == "RAIL_CLASSES":
            default = definition.defaultValue() if (name, key) != ("extractrails", "STANDARD") else "DETECT"
            nothing_chosen = [] if definition.type() == "enum" and definition.allowMultiple() else None
            assert wrappers[key].parameterValue() == (nothing_chosen if default is None else default)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", NAMES)
def test_nothing_is_cut_off_at_the_side(qgis, open_dialog, name, size):
    dialog = open_dialog(name)
    dialog.resize(*SIZES[size])
    splitter = dialog.findChild(QSplitter)
    splitter.setSizes([round(share * dialog.width()) for share in (1 - HELP_SHARE, HELP_SHARE)])
    qgis.processEvents()
    areas = [*dialog.findChildren(QScrollArea), dialog.findChild(QTextBrowser, "textShortHelp")]
    assert [area.horizontalScrollBar().maximum() for area in areas] == [0] * len(areas)


@pytest.mark.parametrize("name", NAMES)
def test_panel_explains_the_algorithm_and_the_fields_in_sight(open_dialog, name):
    dialog = open_dialog(name)
    shown = dialog.findChild(QTextBrowser, "textShortHelp").toPlainText().split("\n")
    algorithm = dialog.algorithm()
    assert shown[:2] == [algorithm.displayName(), algorithm.shortDescription()]
    definitions = algorithm.parameterDefinitions()
    for definition in definitions:
        if not definition.flags() & ADVANCED:
            text = with_labels(definition.help(), definitions, definition.name())
            assert f"{definition.description()}\u2028{text}" in "\n".join(shown).replace("\n", "\u2028")


@pytest.mark.parametrize("name", NAMES)
def test_dialogs_have_few_fields_in_sight_and_a_short_help(open_dialog, name):
    dialog = open_dialog(name)
    definitions = dialog.algorithm().parameterDefinitions()
    assert len([one.name() for one in definitions if not one.flags() & ADVANCED]) <= 6
    fields = [one.name() for one in definitions if one.flags() & ADVANCED and not one.isDestination()]
    assert [field for field in fields if section_of(field) == OTHERS] == []
    assert len(dialog.findChild(QTextBrowser, "textShortHelp").toPlainText().split()) <= 300


def test_advanced_fields_are_in_sections_and_the_limits_are_linked_once(open_dialog):
    dialog = open_dialog("extractrails")
    group = dialog.findChild(QGroupBox, "grpAdvanced")
    layout = group.layout()
    widgets = [layout.itemAt(place).widget() for place in range(layout.count())]
    titles = [widget.text() for widget in widgets if isinstance(widget, QLabel)]
    assert titles == ["Cloud", "Raw clouds", "Network", "Lines", "Tracks", "Axis", "Computer", "More results"]
    panel = dialog.findChild(QTextBrowser, "textShortHelp")
    assert len(re.findall('<a href="(?:.*?)limits.md"', panel.toHtml())) == 1


def test_every_algorithm_has_its_own_icon(make):
    drawn = [make(name).icon().pixmap(SMALLEST_ICON).toImage() for name in NAMES]
    assert {(image.width(), image.height()) for image in drawn} == {(SMALLEST_ICON, SMALLEST_ICON)}
    assert all(first != second for i, first in enumerate(drawn) for second in drawn[:i])
    assert len({make(name).svgIconPath() for name in NAMES}) == len(NAMES)


@pytest.mark.parametrize("word", ["rail", "gleis", "voie", "vía"])
def test_toolbox_search_in_four_languages(make, word):
    assert sum(any(word in tag.lower() for tag in make(name).tags()) for name in NAMES) >= len(NAMES) - 2


@pytest.mark.parametrize("name", NAMES)
def test_help_button_opens_the_guide(make, name, tmp_path, monkeypatch):
    address = make(name).helpUrl()
    assert Path(QUrl(address).toLocalFile()).is_file()  # of the clone
    page = tmp_path / f"{Path(address).stem}.html"
    page.touch()
    monkeypatch.setattr(guide, "GUIDE", tmp_path)  # as in the zip
    assert make(name).helpUrl() == page.as_uri()


def test_no_link_leads_nowhere_until_the_repository_has_an_address(make, tmp_path, monkeypatch):
    for name in ("GUIDE", "ROOT"):
        monkeypatch.setattr(guide, name, tmp_path)
    assert make("extractrails").helpUrl() == guide.tracker() == ""
    metadata = tmp_path / "metadata.txt"
    metadata.write_text("[general]\nrepository=https://host/rails\ntracker=https://host/rails/issues\n")
    monkeypatch.setattr(guide, "METADATA", metadata)
    assert make("extractrails").helpUrl() == "https://host/rails/blob/main/docs/parameters.md"
    assert guide.tracker() == "https://host/rails/issues"


def test_messages_in_dialogs_use_labels(make):
    algorithm = make("extractrails")
    definitions = algorithm.parameterDefinitions()
    said = "STANDARD CUSTOM needs both: fill in GAUGE and HEAD_WIDTH, not MAX_GAPS or OUTPUT/CRS.gpkg."
    labels = {"STANDARD": "Rail standard", "GAUGE": "Gauge [mm]", "HEAD_WIDTH": "Railhead width [mm]"}
    words = {"CUSTOM": WORDS["STANDARD"]["CUSTOM"], **labels}
    shown = re.sub(r"\b(STANDARD|CUSTOM|GAUGE|HEAD_WIDTH)\b", lambda found: f'"{words[found[0]]}"', said)
    assert with_labels(said, definitions) == shown
    assert for_user(said, definitions) == said  # no QGIS with windows runs here


def test_an_id_of_several_choices_has_the_words_of_the_parameter_named_before(make):
    algorithm = make("extractrails")  # which owns its parameters
    definitions = algorithm.parameterDefinitions()
    said = "ENGINE OPENCV can't use DEVICE CUDA: set DEVICE to AUTO, or ENGINE to AUTO."
    assert with_labels(said, definitions) == (
        '"Engine of the network" "OpenCV" can\'t use "Device of the network" "Nvidia GPU": set "Device of the network" '
        'to "GPU if there is one", or "Engine of the network" to "PyTorch if it is installed".'
    )
    assert with_labels("AUTO is best.", definitions, "MODEL") == '"Automatic" is best.'


def test_a_word_is_no_choice_unless_its_parameter_is_named(make):
    algorithm = make("extractrails")  # which owns its parameters
    said = "Network fast, OpenCV 4.13, CPU, float32."
    assert with_labels(said, algorithm.parameterDefinitions()) == said


@pytest.mark.parametrize("name", NAMES)
def test_lists_show_words_and_give_ids(open_dialog, name):
    wrappers = open_dialog(name).mainWidget().wrappers
    for definition in open_dialog(name).algorithm().parameterDefinitions():
        if definition.type() == "enum" and definition.usesStaticStrings():
            combo = wrappers[definition.name()].widget
            texts = [combo.itemText(row) for row in range(combo.count())]
            assert not [text for text in texts if re.fullmatch("[A-Z_]{4,}", text)]
            assert len(set(texts)) == len(texts)


def test_several_choices_are_one_entry_of_a_list(open_dialog):
    wrapper = open_dialog("extractrails").mainWidget().wrappers["LEAVE_OUT"]
    texts = [wrapper.widget.itemText(row) for row in range(wrapper.widget.count())]
    assert texts == ["None", "Overlap of strips", "Synthetic points", "Overlap of strips and synthetic points"]
    for given, value in {"OVERLAP,SYNTHETIC": ["OVERLAP", "SYNTHETIC"], "SYNTHETIC": ["SYNTHETIC"], "": []}.items():
        wrapper.setValue(given)
        assert wrapper.value() == value
