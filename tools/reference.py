"""Write docs/reference.md: the algorithms, parameters, outputs, fields and rail standards of the code.

Run it after a change to any of them, in the environment that `make env` prints.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from dialog_pictures import start_qgis  # noqa: E402
from qgis.core import (  # noqa: E402
    QgsProcessingAlgorithm,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterEnum,
    QgsProcessingParameterNumber,
    QgsProcessingProvider,
)
from rail_extract.core.fields import (  # noqa: E402
    AIRBORNE,
    AXES,
    CENTERLINES,
    CLEARANCE,
    DEVIATIONS,
    DIFFERENCES,
    ELEMENTS,
    FINDINGS,
    INTRUSIONS,
    PLACES,
    PLATFORMS,
    QUALITY,
    RAILS,
    STATIONS,
    STOPS,
    WIRES,
    Field,  # noqa: E402
)
from rail_extract.core.jobs.declaration import UNBOUNDED  # noqa: E402
from rail_extract.core.standards import CUSTOM, SOURCES, STANDARDS  # noqa: E402
from rail_extract.rail_extract_plugin.algorithms import ALGORITHMS  # noqa: E402

PAGE = Path(__file__).resolve().parent.parent / "docs" / "reference.md"

INTRODUCTION = """# Reference

Ids and names for models, batch files and `qgis_process`; they never change. [parameters.md](parameters.md) explains the
parameters with pictures.

`python tools/reference.py` writes this page from the code, and a test checks that it is up to date.
"""

LAYERS = {
    "Rails": RAILS,
    "Centerlines": CENTERLINES,
    "Track geometry": QUALITY,
    "Kilometres": PLACES,
    "Differences": DIFFERENCES,
    "Findings": FINDINGS,
    "Stops": STOPS,
    "Centerlines from airborne lidar": AIRBORNE,
    "Stations from airborne lidar": STATIONS,
    "Elements": ELEMENTS,
    "Deviations": DEVIATIONS,
    "Axes": AXES,
    "Intrusions": INTRUSIONS,
    "Clearance": CLEARANCE,
    "Platforms": PLATFORMS,
    "Contact wires": WIRES,
}


def page(provider: QgsProcessingProvider) -> str:
    """Return the page."""
    parts = [INTRODUCTION, "\n## Algorithms\n"]
    for algorithm in (provider.algorithm(one.JOB.name) for one in ALGORITHMS):
        parts += [f"\n### {algorithm.displayName()}: `{algorithm.id()}`\n\n{algorithm.shortDescription()}\n"]
        parts += _table(("parameter", "in the dialog", "default", "values"), _inputs(algorithm))
        parts += _table(("output", "meaning"), _outputs(algorithm))
    parts += ["\n## Fields\n"]
    for title, product in LAYERS.items():
        parts += [f"\n### {title}\n", *_table(("field", "type", "meaning"), map(_field, product.fields))]
    parts += ["\n## Rail standards\n", *_table(("STANDARD", "rail", "gauge", "railhead", "source"), _standards())]
    parts += [
        f"\n`{CUSTOM}` takes GAUGE and HEAD_WIDTH. No table of rail sections confirms a width without a source.\n\n",
        *_table(("source", "table"), SOURCES.items()),
    ]
    return "".join(parts)


def _table(titles: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Return an empty line and the lines of a table; nothing if there are no rows."""
    rows = list(rows)
    lines = [titles, ["---"] * len(titles), *rows] if rows else []
    return [*"\n" * bool(rows), *(f"| {' | '.join(cells)} |\n" for cells in lines)]


def _inputs(algorithm: QgsProcessingAlgorithm) -> Iterator[tuple[str, ...]]:
    """Yield name, label, default and values of each parameter except destinations."""
    for one in algorithm.parameterDefinitions():
        if not one.isDestination():
            flags = QgsProcessingParameterDefinition.Flag
            optional, rare = (bool(one.flags() & flag) for flag in (flags.FlagOptional, flags.FlagAdvanced))
            default = "" if one.defaultValue() is None else f"{one.defaultValue()}"
            label = f"{one.description()}, *advanced*" if rare else one.description()
            yield f"`{one.name()}`", label, default or ("optional" if optional else "required"), _values(one)


def _values(definition: QgsProcessingParameterDefinition) -> str:
    """Return the values that a number or a choice accepts."""
    if isinstance(definition, QgsProcessingParameterNumber):
        if definition.maximum() >= UNBOUNDED:
            return f"from {definition.minimum():g}"
        return f"{definition.minimum():g} to {definition.maximum():g}"
    if isinstance(definition, QgsProcessingParameterEnum):
        options = definition.options()
        return "[rail standards](#rail-standards)" if CUSTOM in options else ", ".join(options)
    return ""


def _outputs(algorithm: QgsProcessingAlgorithm) -> Iterator[tuple[str, str]]:
    """Yield the name and label of each output."""
    for one in algorithm.outputDefinitions():
        destination = algorithm.parameterDefinition(one.name())
        yield f"`{one.name()}`", destination.help() if destination and destination.help() else one.description()


def _field(field: Field) -> tuple[str, str, str]:
    kind = {int: "whole number", float: f"number, {field.decimals} decimals", str: "text"}[field.kind]
    return f"`{field.name}`", kind, field.meaning


def _standards() -> Iterator[tuple[str, ...]]:
    for standard in STANDARDS.values():
        rail = standard.label.rpartition(",")[0]
        yield (
            f"`{standard.name}`",
            rail,
            f"{1000 * standard.gauge_m:g} mm",
            f"{1000 * standard.head_width_m:g} mm",
            standard.sources,
        )


if __name__ == "__main__":
    application = start_qgis()
    PAGE.write_text(page(application.plugin.provider), encoding="utf-8")
