"""The help panel of a dialog: what the algorithm does, a picture, and the meaning of each parameter."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape
from pathlib import Path

from qgis.core import QgsProcessingParameterDefinition

from ..i18n import tr

Definitions = Sequence[QgsProcessingParameterDefinition]

ADVANCED = QgsProcessingParameterDefinition.Flag.FlagAdvanced


def help_panel(summary: str, picture: Path | None, text: str, definitions: Definitions) -> str:
    """Return the help panel as HTML; QGIS turns each line into a paragraph.

    Parameters
    ----------
    summary, text : str
        What the algorithm does, in one sentence and in detail.
    picture : Path or None
        SVG file, shown at its nominal size.
    definitions : sequence of QgsProcessingParameterDefinition
        Parameters of the dialog, with their help.
    """
    image = [f'<img src="{picture.as_uri()}">'] if picture else []
    prose = [escape(line, quote=False) for line in text.split("\n") if line]
    common = [one for one in definitions if not one.isDestination() and not one.flags() & ADVANCED]
    rare = [one for one in definitions if not one.isDestination() and one.flags() & ADVANCED]
    results = [one for one in definitions if one.isDestination()]
    fields = [
        *_section(tr("Parameters"), common),
        *_section(tr("Advanced parameters"), rare),
        *_section(tr("Results"), results),
    ]
    return "\n".join((escape(summary, quote=False), *image, *prose, *fields))


def _section(title: str, definitions: Definitions) -> Iterator[str]:
    """Yield a heading and a line for each parameter; nothing if there are none."""
    if definitions:
        yield f"<h3>{escape(title)}</h3>"
    for definition in definitions:
        yield f"<b>{escape(definition.description())}</b><br>{escape(definition.help(), quote=False)}"
