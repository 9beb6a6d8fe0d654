"""Notices from runs to QGIS's windows; without windows, nobody listens."""

from __future__ import annotations

from qgis.PyQt.QtCore import QObject, pyqtSignal


class _Notices(QObject):
    """Signals of runs, which may come from any thread."""

    report_written = pyqtSignal(str)
    """Path of a report."""

    run_failed = pyqtSignal(object, object)
    """Feedback of a run, and the class of the error that ended it."""

    run_left = pyqtSignal(object)
    """Frame of the function in which a run failed."""

    standard_proposed = pyqtSignal(object, str)
    """Feedback of a run, and the name of a rail standard that fits the points better."""

    standard_used = pyqtSignal(str)
    """Rail standard of a run that a dialog started."""

    findings_loaded = pyqtSignal(str)
    """Id of a layer of findings in the project."""

    sample_wanted = pyqtSignal()
    """From a link in a log, or the menu."""

    packages_installed = pyqtSignal()
    """After a run after which no Python package is missing that it was to install."""


notices = _Notices()
