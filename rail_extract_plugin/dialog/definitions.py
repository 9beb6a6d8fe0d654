"""Helpers that define parameters.

Labels state the unit. Numbers are plain numbers, so that QGIS does not convert them to the unit of a layer.
"""

from __future__ import annotations

from typing import Union

from qgis.core import (
    QgsProcessing,
    QgsProcessingOutputDefinition,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterEnum,
    QgsProcessingParameterNumber,
)

Definitions = tuple[Union[QgsProcessingParameterDefinition, QgsProcessingOutputDefinition], ...]
"""Parameters and outputs."""

_TYPES = QgsProcessing.SourceType
LINE, POINT, ANY, TABLE = _TYPES.TypeVectorLine, _TYPES.TypeVectorPoint, _TYPES.TypeVectorAnyGeometry, _TYPES.TypeVector
"""Kinds of layers."""

UNBOUNDED = 1e9
"""Maximum of a number without an upper limit."""

M_DECIMALS, FINE_M_DECIMALS, MM_DECIMALS = 3, 4, 2
"""Decimals that the widgets show for metres, for metres where tenths of a millimetre count, and for millimetres."""


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
    """Define a number.

    Parameters
    ----------
    name, label : str
        The label states the unit.
    default : float, optional
    minimum, maximum : float
    whole : bool
        Whether it is an integer.
    optional : bool
    decimals : int
        Decimals that the widget shows.
    """
    kinds = QgsProcessingParameterNumber.Type
    kind = kinds.Integer if whole else kinds.Double
    made = QgsProcessingParameterNumber(name, label, kind, default, optional, minimum, maximum)
    if not whole:
        made.setMetadata({"widget_wrapper": {"decimals": decimals}})
    return made


CHOICE_WIDGET = {"widget_wrapper": {"class": f"{__package__}.choice_widget.ChoiceWidgetWrapper"}}
"""Metadata by which QGIS finds the list in words. Models contain it: the class never changes its place."""


def choice(name: str, label: str, options: tuple[str, ...], default: str) -> QgsProcessingParameterEnum:
    """Define a choice among ids; `choices.WORDS` has the words that dialogs show for them.

    Parameters
    ----------
    name, label : str
    options : tuple of str
    default : str
    """
    made = QgsProcessingParameterEnum(name, label, list(options), defaultValue=default, usesStaticStrings=True)
    made.setMetadata(CHOICE_WIDGET)
    return made


def choices(name: str, label: str, options: tuple[str, ...]) -> QgsProcessingParameterEnum:
    """Define a choice of any number of ids, none by default; see `choice`."""
    made = QgsProcessingParameterEnum(
        name, label, list(options), allowMultiple=True, optional=True, usesStaticStrings=True
    )
    made.setMetadata(CHOICE_WIDGET)
    return made


def helped(definition: QgsProcessingParameterDefinition, text: str) -> QgsProcessingParameterDefinition:
    """Add the help text of a parameter."""
    definition.setHelp(text)
    return definition


def advanced(definition: QgsProcessingParameterDefinition, text: str) -> QgsProcessingParameterDefinition:
    """Add the help text of a parameter and list it among the advanced ones."""
    definition.setFlags(definition.flags() | QgsProcessingParameterDefinition.Flag.FlagAdvanced)
    return helped(definition, text)
