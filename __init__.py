"""Rail Extract: survey-grade 3D rails and track centerlines from classified lidar points.

>>> from pathlib import Path
>>> import rail_extract as rx
>>> network = rx.extract(Path(rx.__file__).parent / "resources" / "sample" / "sample.laz", standard="IN_75R_1000")
>>> len(network.found.centerlines)
3
"""

from typing import TYPE_CHECKING, Any

from .core import VERSION as __version__  # noqa: N811 - the name that packages give it
from .core.jobs import CALLS

if TYPE_CHECKING:
    from .core.commands.front import Result

__all__ = ["Result", "__version__", *CALLS]  # noqa: PLE0604


def __getattr__(name: str) -> Any:
    """Import a public name when it is asked for: QGIS imports this package before numpy may be installed."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from .core.commands import front

    return getattr(front, name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])


def classFactory(iface):  # noqa: N802 - the name QGIS calls
    """Build the plugin for QGIS.

    Parameters
    ----------
    iface : qgis.gui.QgisInterface or None
        None under ``qgis_process``.
    """
    from .rail_extract_plugin.plugin import RailExtractPlugin

    return RailExtractPlugin(iface)
