"""The help panel of a dialog: what the algorithm does, a picture, the fields in sight, and links to the guide."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape
from pathlib import Path

from qgis.core import QgsProcessingParameterDefinition

from .guide import guide
from .wording import with_labels

Definitions = Sequence[QgsProcessingParameterDefinition]

ADVANCED = QgsProcessingParameterDefinition.Flag.FlagAdvanced


PAGES = {
    "parameters": "All parameters, with pictures",
    "reference": "All fields of the results",
    "airborne": "Tracks in airborne clouds",
    "stationing": "Kilometres along an axis",
    "alignment": "How elements are fitted",
    "comparison": "How surveys are compared",
    "clearance": "Clearance: frame, profiles, limits",
    "tutorial": "Tutorial",
    "limits": "Limits",
    "troubleshooting": "If something is wrong",
}
"""Titles of the guide's pages."""


def help_panel(summary: str, picture: Path | None, text: str, definitions: Definitions, pages: Sequence[str]) -> str:
    """Return the help panel as HTML; QGIS turns each line into a paragraph.

    It has what the algorithm does, in one sentence and in detail, an SVG picture at its nominal size, the parameters
    with their help, and links to pages of the guide, of `PAGES`. Advanced parameters are explained by their tooltips
    and by the guide.
    """
    image = [f'<img src="{picture.as_uri()}">'] if picture else []
    prose = [escape(with_labels(line, definitions), quote=False) for line in text.split("\n") if line]
    common = [one for one in definitions if not one.flags() & ADVANCED]
    fields = [
        *_section("Parameters", [one for one in common if not one.isDestination()], definitions),
        *_section("Results", [one for one in common if one.isDestination()], definitions),
    ]
    addresses = [(PAGES[page], guide(page)) for page in pages if guide(page)]
    more = " · ".join(f'<a href="{address}">{escape(title)}</a>' for title, address in addresses)
    return "\n".join((escape(summary, quote=False), *image, *prose, *fields, *filter(None, [more])))


def _section(title: str, shown: Definitions, definitions: Definitions) -> Iterator[str]:
    """Yield a heading and a line for each parameter, in words; nothing if there are none."""
    if shown:
        yield f"<h3>{escape(title)}</h3>"
    for one in shown:
        text = with_labels(one.help(), definitions, one.name())
        yield f"<b>{escape(one.description())}</b><br>{escape(text, quote=False)}"
