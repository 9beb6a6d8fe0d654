"""The text beside a dialog: what an algorithm does, with a picture, and what each of its fields means."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape
from pathlib import Path

from qgis.core import QgsProcessingParameterDefinition

from ..i18n import tr

Definitions = Sequence[QgsProcessingParameterDefinition]

ADVANCED = QgsProcessingParameterDefinition.Flag.FlagAdvanced


def help_panel(summary: str, picture: Path | None, text: str, definitions: Definitions) -> str:
    """Put the parts together: HTML, in which QGIS makes a paragraph of each line.

    Parameters
    ----------
    summary, text : str
        What the algorithm does, in one sentence and in paragraphs.
    picture : Path or None
        SVG file, shown at its own size.
    definitions : sequence of QgsProcessingParameterDefinition
        Fields of the dialog, with their help.
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
    """Give a title and a line for each field; nothing where there is no field."""
    if definitions:
        yield f"<h3>{escape(title)}</h3>"
    for definition in definitions:
        yield f"<b>{escape(definition.description())}</b><br>{escape(definition.help(), quote=False)}"
