"""What QGIS's windows show: the report after a run in a dialog, and the sample."""

import pytest
from qgis.PyQt.QtCore import QObject, QUrl, pyqtSlot
from qgis.PyQt.QtGui import QDesktopServices
from qgis.PyQt.QtWidgets import QDialog
from rail_extract.rail_extract_plugin.notices import notices


class Browser(QObject):
    """Keeps the addresses that it is told to show."""

    def __init__(self):
        super().__init__()
        self.urls = []
        QDesktopServices.setUrlHandler("file", self, "show")

    @pyqtSlot(QUrl)
    def show(self, url):
        self.urls.append(url.toLocalFile())


@pytest.fixture
def browser(qgis, plugin):
    plugin.unload()
    plugin.initGui()
    yield Browser()
    QDesktopServices.unsetUrlHandler("file")
    plugin.unload()
    plugin.initProcessing()


def dialog(kind):
    """A visible window of a class with this name."""
    window = type(kind, (QDialog,), {})()
    window.show()
    return window


@pytest.mark.parametrize(
    ("windows", "wanted", "opened"),
    [
        (["AlgorithmDialog"], True, 1),
        (["AlgorithmDialog"], False, 0),
        ([], True, 0),
        (["AlgorithmDialog", "BatchAlgorithmDialog"], True, 0),
    ],
)
def test_the_report_opens_after_a_single_run_in_a_dialog(browser, windows, wanted, opened):
    from processing.core.ProcessingConfig import ProcessingConfig
    from rail_extract.rail_extract_plugin.review.report import OPEN_REPORT

    shown = [dialog(kind) for kind in windows]
    ProcessingConfig.setSettingValue(OPEN_REPORT, wanted)
    notices.report_written.emit("/data/report.html")
    assert browser.urls == opened * ["/data/report.html"]
    ProcessingConfig.setSettingValue(OPEN_REPORT, True)
    for window in shown:
        window.close()


def test_the_sample_opens_with_its_standard(browser):
    from rail_extract.rail_extract_plugin.sample_action import OpenSampleAction

    action = OpenSampleAction()
    action.execute()
    parameters = action.dialog.mainWidget().createProcessingParameters()
    assert parameters["INPUT"].endswith("sample.laz")
    assert parameters["STANDARD"] == "IN_75R_1000"
    action.dialog.close()
