"""Writes the reports."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from qgis.core import QgsProcessingAlgorithm, QgsProcessingContext

from ...core.disk import Destination
from ..notices import notices

if TYPE_CHECKING:
    from ...core.alignment.deviations import Deviations
    from ...core.alignment.elements import Alignment
    from ...core.comparison.tracks import TrackComparison
    from ...core.rails import RailNetwork
    from ...core.report import Origin


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
    return write_shown(algorithm, name, lambda: origin.report(network), parameters, context)


def write_shown(
    algorithm: QgsProcessingAlgorithm,
    name: str,
    build: Callable[[], str],
    parameters: dict[str, Any],
    context: QgsProcessingContext,
) -> dict[str, str]:
    """Write a report that is built only if the user wants it, and have QGIS show it; see `write_report`.

    Parameters
    ----------
    build : callable
        Returns the page.
    algorithm, name, parameters, context
        See `write_report`.
    """
    path = algorithm.parameterAsFileOutput(parameters, name, context)
    if not path:
        return {}
    written = write_page(algorithm, name, path, build())
    notices.report_written.emit(path)
    return written


def write_alignment_report(
    algorithm: QgsProcessingAlgorithm,
    name: str,
    courses: Sequence[tuple[Alignment, Deviations]],
    source: str,
    facts: Mapping[str, str],
    fitted: bool,
    parameters: dict[str, Any],
    context: QgsProcessingContext,
) -> dict[str, str]:
    """Write the report on alignments to an output; see `write_report`.

    Parameters
    ----------
    courses : sequence of (Alignment, Deviations)
    source : str
        Name of the measured tracks.
    facts : mapping of str to str
        Facts to state by name, besides date, version and coordinate system.
    fitted : bool
        Whether the alignments were fitted to the tracks.
    algorithm, name, parameters, context
        See `write_report`.
    """
    from ...core.report import build_alignment_page

    def build() -> str:
        return build_alignment_page(courses, source, facts, fitted)

    return write_shown(algorithm, name, build, parameters, context)


def write_comparison(
    algorithm: QgsProcessingAlgorithm,
    name: str,
    found: TrackComparison,
    counts_shift: bool,
    source: str,
    facts: Mapping[str, str],
    parameters: dict[str, Any],
    context: QgsProcessingContext,
) -> dict[str, str]:
    """Write the report on a comparison to an output; see `write_report`.

    Parameters
    ----------
    algorithm : QgsProcessingAlgorithm
    name : str
    found : TrackComparison
    counts_shift, source, facts
        See `build_comparison`.
    parameters : dict
    context : QgsProcessingContext
    """
    from ...core.report.comparison import build_comparison

    return write_shown(
        algorithm, name, lambda: build_comparison(found, counts_shift, source, facts), parameters, context
    )


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
    page = f'<!DOCTYPE html><meta charset="utf-8">{title}<h1>{escape(verdict)}</h1><table>{rows}</table>'
    return write_page(algorithm, name, path, page)


def write_page(algorithm: QgsProcessingAlgorithm, name: str, path: str, page: str) -> dict[str, str]:
    """Write a page to an output; QGIS chooses the path of a temporary one during the run."""
    destination = algorithm.destinations.get(name) or Destination.at(Path(path))
    destination.write_text(page)
    return {name: path}
