"""Writes the reports."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from html import escape
from pathlib import Path

from ...core.disk import Destination
from ..dialog.parameter_values import ParameterValues
from ..notices import notices

REPORT = "REPORT"
"""Name of the page that a run shows."""


def write_shown(values: ParameterValues, build: Callable[[], str], name: str = REPORT) -> dict[str, str]:
    """Write a page if the user wants it, and have QGIS show a report; an existing file stays until it is complete.

    Returns the path of the file by the name of the output, and nothing if it is skipped. Raises RailExtractError if the
    file cannot be written.
    """
    path = values.output_file(name)
    if not path:
        return {}
    written = write_page(values, name, path, build())
    if name == REPORT:
        notices.report_written.emit(path)
    return written


def write_check(values: ParameterValues, verdict: str, facts: Mapping[str, str]) -> dict[str, str]:
    """Write the result of Check Installation, a sentence and findings by name, which no run shows by itself."""
    path = values.output_file("REPORT")
    if not path:
        return {}
    rows = "".join(f"<tr><th align='left'>{escape(key)}</th><td>{escape(facts[key])}</td></tr>" for key in facts)
    title = f"<title>{escape(values.algorithm.displayName())}</title>"
    page = f'<!DOCTYPE html><meta charset="utf-8">{title}<h1>{escape(verdict)}</h1><table>{rows}</table>'
    return write_page(values, "REPORT", path, page)


def write_page(values: ParameterValues, name: str, path: str, page: str) -> dict[str, str]:
    """Write a page to an output; QGIS chooses the path of a temporary one during the run."""
    destination = values.algorithm.destinations.get(name) or Destination.at(Path(path))
    destination.write_text(page)
    return {name: path}
