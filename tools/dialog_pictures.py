"""Pictures of the dialogs, rendered from the widgets without a screen.

Runs in the environment that `make env` prints: ``python tools/dialog_pictures.py FOLDER``.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from qgis.core import QgsApplication, QgsProcessingAlgorithm
from qgis.PyQt.QtWidgets import QGroupBox, QScrollArea, QSplitter, QWidget

SIZES = {"wide": (1180, 860), "narrow": (760, 560)}
"""Size of a dialog on a large screen, and of a small one, in pixels."""

HELP_SHARE = 0.36
"""Fraction of the width for the help panel."""

PROVIDER = "railextract"


def dialog_pictures(folder: Path, filled: Mapping[str, Mapping[str, Any]] | None = None) -> tuple[Path, ...]:
    """Write and return pictures of every dialog of the plugin, which must be registered in a QGIS with widgets.

    They are ALGORITHM_SIZE.png, for each of `SIZES`, and ALGORITHM_all.png with all fields; `filled` has values instead
    of the defaults, by parameter, by algorithm.
    """
    folder.mkdir(parents=True, exist_ok=True)
    algorithms = QgsApplication.processingRegistry().providerById(PROVIDER).algorithms()
    values = filled or {}
    return tuple(picture for one in algorithms for picture in _pictures(one, values.get(one.name(), {}), folder))


def _pictures(algorithm: QgsProcessingAlgorithm, values: Mapping[str, Any], folder: Path) -> Iterator[Path]:
    dialog = algorithm.create().createCustomParametersWidget(None)
    dialog.mainWidget().setParameters(values)
    dialog.show()
    _fold(dialog, True)
    for name, size in SIZES.items():
        yield _grab(dialog, size, folder / f"{algorithm.name()}_{name}.png")
    _fold(dialog, False)
    width, height = SIZES["wide"]
    yield _grab(dialog, (width, height + _hidden_height(dialog)), folder / f"{algorithm.name()}_all.png")
    dialog.close()


def _fold(dialog: QWidget, folded: bool) -> None:
    """Hide or show the advanced parameters; QGIS keeps the state of the last dialog."""
    for group in dialog.findChildren(QGroupBox):
        group.setProperty("collapsed", folded)


def _grab(dialog: QWidget, size: tuple[int, int], picture: Path) -> Path:
    dialog.resize(*size)
    QgsApplication.processEvents()
    splitter = dialog.findChild(QSplitter)
    splitter.setSizes([round(share * dialog.width()) for share in (1 - HELP_SHARE, HELP_SHARE)])
    QgsApplication.processEvents()
    dialog.grab().save(str(picture))
    return picture


def _hidden_height(dialog: QWidget) -> int:
    """Return the height of the fields that does not fit into the dialog, in pixels."""
    QgsApplication.processEvents()
    return max(area.verticalScrollBar().maximum() for area in dialog.findChildren(QScrollArea))


def start_qgis() -> QgsApplication:
    """Start QGIS with widgets, the processing framework and the plugin."""
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
    started = start_qgis()
    print(*dialog_pictures(Path(sys.argv[1])), sep="\n")
