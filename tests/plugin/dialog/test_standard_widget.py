import pytest
from qgis.core import QgsSettings
from rail_extract.core.standards import STANDARDS

LAST = "rail_extract/standard"


@pytest.fixture
def wrapper(qgis, plugin):
    """Open a dialog and give what connects it with the list of standards."""
    from processing.gui.AlgorithmDialog import AlgorithmDialog

    opened = []

    def wrapper(name="extractrails"):
        opened.append(AlgorithmDialog(qgis.processingRegistry().createAlgorithmById(f"railextract:{name}")))
        return opened[-1].mainWidget().wrappers["STANDARD"]

    yield wrapper
    QgsSettings().remove(LAST)
    for dialog in opened:
        dialog.close()


def test_standards_are_listed_in_words_by_region(wrapper):
    combo = wrapper().widget
    texts = [combo.itemText(row) for row in range(combo.count())]
    assert texts[:3] == [
        "Detect from the points",
        "Custom: gauge and railhead width as below",
        "Australia: AS 41 kg/m, 1067 mm, head 63.5 mm",
    ]
    assert texts[2:] == sorted(texts[2:])
    assert {combo.itemData(row) for row in range(combo.count())} == {*STANDARDS, "CUSTOM", "DETECT"}
    assert combo.currentText() == "Europe: EN 60E1 (UIC 60), 1435 mm, head 72 mm"


def test_only_extract_rails_detects(wrapper):
    combo = wrapper("buildtrackcenterlines").widget
    assert combo.findData("DETECT") == -1
    assert combo.findData("CUSTOM") == 0


def test_last_choice_of_a_user_is_remembered(wrapper):
    first = wrapper()
    first.setValue("IN_75R_1000")
    assert wrapper().value() == "EN_60E1_1435"
    first.widget.activated.emit(first.widget.currentIndex())
    assert wrapper().value() == "IN_75R_1000"
    assert wrapper("rasterizerailpoints").value() == "IN_75R_1000"
    first.setValue("DETECT")
    first.widget.activated.emit(first.widget.currentIndex())
    assert wrapper("rasterizerailpoints").value() == "EN_60E1_1435"
