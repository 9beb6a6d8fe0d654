"""The layers that a run can write: fields, style, and layer of a drawing, declared once for QGIS and the commands."""

from __future__ import annotations

from dataclasses import dataclass

from .fields import (
    AIRBORNE_FIELDS,
    AIRBORNE_STATION_FIELDS,
    AXIS_FIELDS,
    CENTERLINE_FIELDS,
    DEVIATION_FIELDS,
    DIFFERENCE_FIELDS,
    ELEMENT_FIELDS,
    EXTENT_FIELDS,
    FINDING_FIELDS,
    KM_FIELDS,
    PROPOSED_FIELDS,
    QUALITY_FIELDS,
    RAIL_FIELDS,
    STATION_FIELDS,
    STOP_FIELDS,
    Field,
)


@dataclass(frozen=True)
class Product:
    """A kind of layer.

    Attributes
    ----------
    style : str
        Name of the style that QGIS gives it.
    fields : tuple of Field
    drawn : str
        First word of its layers in a drawing.
    is_line : bool
        Whether its features are lines; else they are points.
    layer : str
        Its name in the GeoPackages of the commands; that of the style if empty.
    """

    style: str
    fields: tuple[Field, ...]
    drawn: str
    is_line: bool = True
    layer: str = ""

    @property
    def name(self) -> str:
        """Name of the layer in the GeoPackages of the commands."""
        return self.layer or self.style


RAILS = Product("rails", RAIL_FIELDS, "RAILS")
CENTERLINES = Product("centerlines", CENTERLINE_FIELDS, "TRACK")
QUALITY = Product("quality", QUALITY_FIELDS, "STATIONS", is_line=False)
LOCATED_QUALITY = Product("quality", (*QUALITY_FIELDS, *STATION_FIELDS), "STATIONS", is_line=False)
"""With an axis."""

FINDINGS = Product("findings", FINDING_FIELDS, "FINDINGS")
LOCATED_FINDINGS = Product("findings", (*FINDING_FIELDS, *KM_FIELDS), "FINDINGS")
"""With an axis."""

STOPS = Product("stops", STOP_FIELDS, "STOPS", is_line=False)
PROPOSED = Product("proposed", PROPOSED_FIELDS, "GUIDES")
AIRBORNE = Product("airborne", AIRBORNE_FIELDS, "TRACK", layer="centerlines")
STATIONS = Product("stations", AIRBORNE_STATION_FIELDS, "STATIONS", is_line=False)
DIFFERENCES = Product("differences", DIFFERENCE_FIELDS, "DIFFERENCES", is_line=False)
ELEMENTS = Product("elements", ELEMENT_FIELDS, "ELEMENTS")
AXES = Product("axes", AXIS_FIELDS, "ALIGNMENT", layer="axis")
DEVIATIONS = Product("deviations", DEVIATION_FIELDS, "DEVIATIONS", is_line=False)
PLACES = Product("places", (*STATION_FIELDS, *EXTENT_FIELDS), "PLACES")
"""The fields that copies of layers of any kind get in addition; their style only names these."""

PRODUCTS = (
    *(RAILS, CENTERLINES, QUALITY, LOCATED_QUALITY, FINDINGS, LOCATED_FINDINGS, STOPS, PROPOSED, AIRBORNE, STATIONS),
    *(DIFFERENCES, ELEMENTS, AXES, DEVIATIONS, PLACES),
)
"""Every kind of layer that a run can write."""
