"""The origin of a result, for its report: cloud, rails and the command that repeats the run."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..clouds.crs import parse_crs
from ..rails import RailNetwork
from ..standards import RailStandard
from .page import build_page


@dataclass(frozen=True)
class Origin:
    """From what and how a result was computed.

    Attributes
    ----------
    paths : tuple of Path
        Files or folders of the cloud.
    standard : RailStandard
    other_gauges_m : tuple of float
    command : str
        Repeats the run.
    """

    paths: tuple[Path, ...]
    standard: RailStandard
    other_gauges_m: tuple[float, ...]
    command: str

    def report(self, network: RailNetwork) -> str:
        """Build the report on a network with its track geometry, an HTML document."""
        gauges_m = (self.standard.gauge_m, *self.other_gauges_m)
        first, *more = (path.resolve().name for path in self.paths)
        source = f"{first} and {len(more)} more" if more else first
        facts = {
            "Rail": self.standard.label,
            "Gauge": ", ".join(f"{1000 * gauge_m:g} mm" for gauge_m in gauges_m),
            "Railhead width": f"{1000 * self.standard.head_width_m:g} mm",
            "Coordinate system": _title(network.frame.crs_wkt),
            "Command": self.command,
        }
        return build_page(network, gauges_m, source, facts)


def _title(crs_wkt: str | None) -> str:
    """Code and name of a coordinate system, as QGIS shows them."""
    if not crs_wkt:
        return "none stated: metres"
    crs = parse_crs(crs_wkt)
    authority = crs.to_authority()
    return f"{':'.join(authority)} - {crs.name}" if authority else crs.name
