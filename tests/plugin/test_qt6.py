import pytest
import qt6

REFUSED = [
    ("from PyQt5.QtCore import QObject", "PyQt5"),
    ("def f():\n    import sip", "sip"),
    ("from qgis.PyQt.QtGui import QIcon, QAction", "QAction"),
    ("from qgis.PyQt import QtCore\nQtCore.QRegExp('a')", "QRegExp"),
    ("dialog.exec_()", "exec_"),
    ("from qgis.PyQt.QtCore import QVariant\nkind = QVariant.Int", "QVariant.Int"),
    ("from qgis.core import QgsProcessing\nkind = QgsProcessing.TypeVectorLine", "QgsProcessing.TypeVectorLine"),
    ("from qgis.PyQt.QtCore import Qt\ncolour = Qt.red", "Qt.red"),
    ("from qgis.PyQt.QtCore import QProcess\nif p.state() == QProcess.NotRunning: pass", "QProcess.NotRunning"),
    ("import qgis.core\nfrom qgis.core import Qgis\nQgis.NotKnownHere", "Qgis.NotKnownHere"),
]

ACCEPTED = [
    "from qgis.PyQt.QtCore import QObject, Qt\ncolour = Qt.GlobalColor.red",
    "from qgis.core import QgsProcessing\nkinds = QgsProcessing.SourceType\nkind = kinds.TypeVectorLine",
    "from qgis.core import Qgis\nif Qgis.QGIS_VERSION_INT >= 33800: pass",
    "from qgis.core import QgsCoordinateReferenceSystem\nQgsCoordinateReferenceSystem.fromEpsgId(25832)",
    "from qgis.core import QgsProject\nQgsProject.instance().clear()",
    "from qgis.PyQt.QtCore import QVariant\nempty = QVariant()",
    "from .compat import INTEGER\nimport numpy as np\nnp.Inf",
    "application.exec()",
]


@pytest.mark.parametrize(("source", "name"), REFUSED)
def test_names_missing_in_qt6_are_refused(source, name):
    (finding,) = qt6.findings(source, "module.py")
    line, text = finding.split(" ", 1)
    assert line == f"module.py:{len(source.splitlines())}"
    assert text.startswith(name)


@pytest.mark.parametrize("source", ACCEPTED)
def test_names_of_both_versions_are_accepted(source):
    assert qt6.findings(source, "module.py") == []


def test_field_types_of_old_versions_are_allowed_in_one_place():
    source = "from qgis.PyQt.QtCore import QVariant\nkind = QVariant.Int"
    assert qt6.findings(source, "rail_extract_plugin/compat.py") == []


def test_the_plugin_is_clean():
    assert qt6.main() == 0
