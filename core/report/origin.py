"""The origin of a result, for its report: cloud, rails, parameters, and the command that repeats the run."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from datetime import datetime
from pathlib import Path

from .. import VERSION
from ..clouds.crs import parse_crs
from ..parameters import Parameters
from ..rails import RailNetwork
from ..standards import Gauge, RailStandard
from .page import build_page

STATED_APART = ("gauge_m", "head_width_m", "other_gauges_m", "other_heads_m", "engine", "device", "keep_cleaned")
"""Parameters that the report states elsewhere, or that change no line."""

INTERFACE = {"passes": "iterations", "quality_step": "step"}
"""Names of parameters in QGIS where they differ."""


@dataclass(frozen=True)
class Origin:
    """From what and how a result was computed; `command` repeats the run.

    The parameters are None if the lines come from another run. The time is that of the report, in the time zone of this
    computer.
    """

    paths: tuple[Path, ...]
    standard: RailStandard
    other_gauges: tuple[Gauge, ...]
    command: str
    parameters: Parameters | None = None
    time: datetime = field(default_factory=datetime.now)

    @property
    def gauges_m(self) -> tuple[float, ...]:
        """Gauges that tracks may have."""
        return self.standard.gauge_m, *(gauge_m for gauge_m, _ in self.other_gauges)

    def report(self, network: RailNetwork) -> str:
        """Build the report on a network with its track geometry, an HTML document."""
        first, *more = (path.resolve().name for path in self.paths)
        source = f"{first} and {len(more)} more" if more else first
        facts = {
            **stated(network.frame.crs_wkt, self.time),
            "Rail": self.standard.label,
            "Gauge": ", ".join(f"{1000 * gauge_m:g} mm" for gauge_m in self.gauges_m),
            "Railhead width": ", ".join(self._head_widths()),
            "Parameters": _stated(self.parameters) if self.parameters else "",
            "Command": self.command,
        }
        return build_page(network, self.gauges_m, source, facts)

    def _head_widths(self) -> list[str]:
        """Write the width of the railheads, and those of gauges where it differs."""
        width_m = self.standard.head_width_m
        others = [
            f"{1000 * own_m:g} mm on {1000 * gauge_m:g} mm gauge"
            for gauge_m, own_m in self.other_gauges
            if own_m != width_m
        ]
        return [f"{1000 * width_m:g} mm", *others]


def _stated(parameters: Parameters) -> str:
    """Write parameters under their names in QGIS, with units."""
    stated = []
    for one in fields(Parameters):
        value = getattr(parameters, one.name)
        if one.name in STATED_APART or value is None:
            continue
        name, _, unit = one.name.rpartition("_")
        named, unit = {"m": (name, " m"), "deg": (name, "°")}.get(unit, (one.name, ""))
        text = value if isinstance(value, str) else f"{value:g}{unit}"
        stated.append(f"{INTERFACE.get(named, named).upper()} {text}")
    return ", ".join(stated)


def stated(crs_wkt: str | None, time: datetime | None = None) -> dict[str, str]:
    """Return what a report states in every case: the time, now unless another one is given, version and system."""
    return {
        "Date": f"{time or datetime.now():%Y-%m-%d %H:%M}",
        "Version": f"Rail Extract {VERSION}",
        "Coordinate system": _title(crs_wkt),
    }


def _title(crs_wkt: str | None) -> str:
    """Code and name of a coordinate system, as QGIS shows them."""
    if not crs_wkt:
        return "none stated: metres"
    crs = parse_crs(crs_wkt)
    authority = crs.to_authority()
    return f"{':'.join(authority)} - {crs.name}" if authority else crs.name
