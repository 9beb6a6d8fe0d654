"""The link by which a message about missing packages leads to their installation."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from qgis.PyQt.QtWidgets import QApplication, QWidget

from ..links import links
from ..setup.dependencies import INSTALL, OPTIONAL, Package

_kept: list[QWidget] = []
"""The dialog, which Python would remove otherwise."""


def with_link(reason: str, packages: Sequence[Package]) -> str:
    """Return a message in HTML with a link that opens Install Packages, set to what is missing."""
    with_torch = any(package.module in OPTIONAL for package in packages)
    text = "Install packages, with PyTorch for the processor" if with_torch else "Install packages"
    return f"<p>{escape(reason)}</p><p>{links.to(text, lambda: open_installation(with_torch))}</p>"


def open_installation(with_torch: bool = False) -> None:
    """Open Install Packages, in place of the window that said that something is missing."""
    from .run_dialog import open_dialog

    window = QApplication.activeModalWidget()
    if window is not None:
        window.close()
    _kept[:] = [open_dialog(INSTALL, {"TORCH": "CPU"} if with_torch else {})]
