"""Pictures of the dialogs, taken from the widgets themselves: no screen is needed.

Runs in the environment that `make env` prints: ``python tools/dialog_pictures.py FOLDER``.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

from qgis.core import QgsApplication, QgsProcessingAlgorithm
from qgis.gui import QgsCollapsibleGroupBoxBasic
from qgis.PyQt.QtWidgets import QScrollArea, QSplitter, QTextBrowser, QWidget

SIZES = {"wide": (1180, 860), "narrow": (760, 560)}
"""Pixels of a dialog on a large screen, and of one that is as small as users make it."""

HELP_WIDTH = 430
"""Pixels of the help panel where there is room."""

PROVIDER = "railextract"


def dialog_pictures(folder: Path) -> tuple[Path, ...]:
    """Write pictures of every dialog of the plugin, which must be registered in a QGIS with widgets.

    Parameters
    ----------
    folder : Path
        Where ALGORITHM_SIZE.png goes for each of `SIZES`, and ALGORITHM_all.png with every field and all the help.

    Returns
    -------
    tuple of Path
        The pictures.
    """
    folder.mkdir(parents=True, exist_ok=True)
    algorithms = QgsApplication.processingRegistry().providerById(PROVIDER).algorithms()
    return tuple(picture for algorithm in algorithms for picture in _pictures(algorithm, folder))


def _pictures(algorithm: QgsProcessingAlgorithm, folder: Path) -> Iterator[Path]:
    from processing.gui.AlgorithmDialog import AlgorithmDialog

    dialog = AlgorithmDialog(algorithm.create())
    dialog.show()
    for name, size in SIZES.items():
        yield _grab(dialog, size, folder / f"{algorithm.name()}_{name}.png")
    for group in dialog.findChildren(QgsCollapsibleGroupBoxBasic):
        group.setCollapsed(False)
    width, height = SIZES["wide"]
    yield _grab(dialog, (width, height + _hidden_height(dialog)), folder / f"{algorithm.name()}_all.png")
    dialog.close()


def _grab(dialog: QWidget, size: tuple[int, int], picture: Path) -> Path:
    dialog.resize(*size)
    QgsApplication.processEvents()
    splitter = dialog.findChild(QSplitter)
    splitter.setSizes([dialog.width() - HELP_WIDTH, min(HELP_WIDTH, dialog.width() // 2)])
    QgsApplication.processEvents()
    dialog.grab().save(str(picture))
    return picture


def _hidden_height(dialog: QWidget) -> int:
    """Pixels by which the fields or the help, whichever is longer, do not fit into the dialog."""
    QgsApplication.processEvents()
    areas = [*dialog.findChildren(QScrollArea), *dialog.findChildren(QTextBrowser)]
    return max(area.verticalScrollBar().maximum() for area in areas)


def _start() -> QgsApplication:
    """Start QGIS with widgets, its processing framework and the plugin."""
    application = QgsApplication([], True)
    application.initQgis()
    sys.path.append(str(Path(application.pkgDataPath()) / "python" / "plugins"))
    from processing.core.Processing import Processing
    from rail_extract import classFactory

    Processing.initialize()
    application.plugin = classFactory(None)
    application.plugin.initProcessing()
    return application


if __name__ == "__main__":
    started = _start()
    print(*dialog_pictures(Path(sys.argv[1])), sep="\n")
