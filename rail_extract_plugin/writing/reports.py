"""Writes the reports."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from qgis.core import QgsProcessingAlgorithm, QgsProcessingContext

from ...core.errors import RailExtractError
from ...core.standards import RailStandard
from ..systems import system

if TYPE_CHECKING:
    from ...core.rails import RailNetwork


@dataclass(frozen=True)
class Origin:
    """The input and the command of a result.

    Attributes
    ----------
    paths : tuple of Path
        Files and folders of the cloud.
    standard : RailStandard
    other_gauges_m : tuple of float
    command : str
        Python command that repeats the run.
    """

    paths: tuple[Path, ...]
    standard: RailStandard
    other_gauges_m: tuple[float, ...]
    command: str

    @property
    def gauges_m(self) -> tuple[float, ...]:
        """The gauges of all tracks."""
        return (self.standard.gauge_m, *self.other_gauges_m)

    @property
    def title(self) -> str:
        """The name of the cloud."""
        first, *more = self.paths
        return f"{first.name} and {len(more)} more" if more else first.name


def write_report(
    algorithm: QgsProcessingAlgorithm,
    name: str,
    network: RailNetwork,
    origin: Origin,
    parameters: dict[str, Any],
    context: QgsProcessingContext,
) -> dict[str, str]:
    """Write the report on a network with its geometry to an output; an existing file stays until it is complete.

    Parameters
    ----------
    algorithm : QgsProcessingAlgorithm
    name : str
        Name of the output.
    network : RailNetwork
    origin : Origin
    parameters : dict
    context : QgsProcessingContext

    Returns
    -------
    dict of str to str
        The path of the file by the name of the output; empty if the user skipped it.

    Raises
    ------
    RailExtractError
        The file cannot be written.
    """
    from ...core.report import build_page

    path = algorithm.parameterAsFileOutput(parameters, name, context)
    if not path:
        return {}
    _write_page(path, build_page(network, origin.gauges_m, origin.title, _facts(network, origin)))
    return {name: path}


def write_check(
    algorithm: QgsProcessingAlgorithm,
    name: str,
    verdict: str,
    facts: Mapping[str, str],
    parameters: dict[str, Any],
    context: QgsProcessingContext,
) -> dict[str, str]:
    """Write the result of Check Installation to an output; see `write_report`.

    Parameters
    ----------
    algorithm : QgsProcessingAlgorithm
    name : str
    verdict : str
        A sentence.
    facts : mapping of str to str
        Findings by name.
    parameters : dict
    context : QgsProcessingContext
    """
    path = algorithm.parameterAsFileOutput(parameters, name, context)
    if not path:
        return {}
    rows = "".join(f"<tr><th align='left'>{escape(key)}</th><td>{escape(facts[key])}</td></tr>" for key in facts)
    title = f"<title>{escape(algorithm.displayName())}</title>"
    _write_page(path, f'<!DOCTYPE html><meta charset="utf-8">{title}<h1>{escape(verdict)}</h1><table>{rows}</table>')
    return {name: path}


def _write_page(path: str, page: str) -> None:
    """Write a page; an older file stays until it is complete."""
    part = Path(f"{path}.part")
    try:
        try:
            part.write_text(page, encoding="utf-8")
            part.replace(path)
        finally:
            part.unlink(missing_ok=True)
    except OSError as error:
        raise RailExtractError(f"{path} can't be written ({error.strerror}): choose another place.") from error


def _facts(network: RailNetwork, origin: Origin) -> dict[str, str]:
    """Return the settings on which the figures depend."""
    crs = system(network.frame.crs_wkt)
    return {
        "Rail": origin.standard.label,
        "Gauge": ", ".join(f"{1000 * gauge_m:g} mm" for gauge_m in origin.gauges_m),
        "Railhead width": f"{1000 * origin.standard.head_width_m:g} mm",
        "Coordinate system": crs.userFriendlyIdentifier() if crs.isValid() else "none stated: metres",
        "Command": origin.command,
    }
