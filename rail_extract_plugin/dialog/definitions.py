"""How parameters are made.

Labels carry the unit; numbers are plain numbers, so that no layer's unit is put in their place.
"""

from __future__ import annotations

from qgis.core import QgsProcessingParameterDefinition, QgsProcessingParameterEnum, QgsProcessingParameterNumber

Definitions = tuple[QgsProcessingParameterDefinition, ...]

UNBOUNDED = 1e9
"""Largest value of a number that has no upper limit."""

M_DECIMALS, MM_DECIMALS = 3, 2
"""Digits that the widgets show after the point of metres and of millimetres."""


def number(
    name: str,
    label: str,
    default: float | None = None,
    minimum: float = 0.0,
    maximum: float = UNBOUNDED,
    whole: bool = False,
    optional: bool = False,
    decimals: int = M_DECIMALS,
) -> QgsProcessingParameterNumber:
    """Make a number; its widget shows the unit of the label and no layer's."""
    kinds = QgsProcessingParameterNumber.Type
    kind = kinds.Integer if whole else kinds.Double
    made = QgsProcessingParameterNumber(name, label, kind, default, optional, minimum, maximum)
    if not whole:
        made.setMetadata({"widget_wrapper": {"decimals": decimals}})
    return made


def choice(name: str, label: str, options: tuple[str, ...], default: str) -> QgsProcessingParameterEnum:
    """Make a choice of static strings."""
    return QgsProcessingParameterEnum(name, label, list(options), defaultValue=default, usesStaticStrings=True)


def helped(definition: QgsProcessingParameterDefinition, text: str) -> QgsProcessingParameterDefinition:
    """Add the text that explains a parameter."""
    definition.setHelp(text)
    return definition


def advanced(definition: QgsProcessingParameterDefinition, text: str) -> QgsProcessingParameterDefinition:
    """Explain a parameter, and show it among the rare ones."""
    definition.setFlags(definition.flags() | QgsProcessingParameterDefinition.Flag.FlagAdvanced)
    return helped(definition, text)
