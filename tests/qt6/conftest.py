"""Our own widgets and dialogs under PyQt6, as in QGIS 4, which no Linux distribution has yet.

Here and nowhere else, `qgis_stub` takes the place of QGIS. The tests show that the widgets are made, painted and used
with Qt 6, whose enums, events and signals differ; what they do in QGIS is tested in QGIS 3.
"""

import os
import sys

import pytest

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")


@pytest.fixture(scope="session")
def application():
    from PyQt6.QtWidgets import QApplication

    return QApplication([])


@pytest.fixture(autouse=True)
def errors(application, monkeypatch):
    """An exception in a slot or an event fails the test; without this, PyQt6 would end the program."""
    found = []
    monkeypatch.setattr(sys, "excepthook", lambda kind, error, trace: found.append(error))
    yield found
    application.processEvents()
    assert found == []
