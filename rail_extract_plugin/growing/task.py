"""What grows from a click, computed in the background."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from qgis.core import QgsPointXY, QgsTask

from ...core.errors import Cancelled, OffCloudError, OffRailError, RailExtractError
from ...core.jobs.clouds import CloudSource
from ...core.parameters import GrowParameters
from ...core.standards import RAIL_CLASS, SEARCHED_CLASSES, RailStandard
from ..feedback import TaskProgress
from ..reading.clouds import points_folder

if TYPE_CHECKING:
    import numpy as np


CLASSIFIED = (
    f"This cloud has points of class {RAIL_CLASS}, which are those on rails: Extract Rails uses them as they are. Grow "
    "Rails is for clouds whose rail points nobody has classified."
)


@dataclass(frozen=True)
class Shown:
    """What grew from a seed, in the coordinate system of the cloud: rails, (k, 2) each, and both ends of its own rail.

    The text says how far it goes and why it ends; or why there is none.
    """

    rails: tuple[np.ndarray, ...] = ()
    ends: tuple[np.ndarray, ...] = ()
    text: str = ""


class GrowTask(QgsTask):
    """Follows the rail at a place, in the coordinate system of the cloud, in a thread of QGIS.

    `done` is called in the main thread with what grew; not if the task was cancelled.
    """

    def __init__(
        self, cloud: CloudSource, standard: RailStandard, seed: QgsPointXY, done: Callable[[Shown], None]
    ) -> None:
        super().__init__("Rail Extract: growing rails", QgsTask.Flag.CanCancel)
        self._cloud, self._standard, self._seed, self._done = cloud, standard, seed, done
        self._shown = Shown()

    def run(self) -> bool:
        """Follow the rail; no exception may leave this method."""
        try:
            self._shown = self._grown()
        except Cancelled:
            return False
        except OffCloudError:
            self._shown = Shown(text="The cloud has no point here: click on a rail of the cloud.")
        except OffRailError:
            self._shown = Shown(text=CLASSIFIED if has_rail_points(self._cloud) else _missed())
        except RailExtractError as error:
            self._shown = Shown(text=str(error))
        except Exception as error:
            self._shown = Shown(text=f"The rail can't be followed ({type(error).__name__}: {error}).")
        return True

    def _grown(self) -> Shown:
        import numpy as np

        from ...core.clouds.points import ask
        from ...core.grow.heads import GrowSettings
        from ...core.kernels import blas, one_thread
        from ...core.labelling.growing import described, grow_all

        request = ask(self._cloud.paths, SEARCHED_CLASSES, self._cloud.crs_wkt)
        request = replace(request, leave_out=self._cloud.leave_out)
        settings = GrowSettings(self._standard.gauge_m, self._standard.head_width_m)
        seed = np.array([[self._seed.x(), self._seed.y()]])
        with points_folder() as folder, one_thread(*blas()):
            _, growths = grow_all(request, [seed], settings, folder, TaskProgress(self))
        (growth,) = growths.grown
        to_crs = request.zero.to_crs
        return Shown(
            tuple(to_crs(rail.xyz)[:, :2] for rail in growth.rails),
            tuple(to_crs(stop.xyz)[:2] for stop in growth.stops),
            described(growth),
        )

    def finished(self, result: bool) -> None:
        """Pass on what grew, in the main thread."""
        if result:
            self._done(self._shown)


def has_rail_points(cloud: CloudSource) -> bool:
    """Return whether some of the first points of a cloud have the class of rail points; takes less than a second.

    Raises CloudError if the file is damaged.
    """
    from ...core.clouds.readers import first_header, read_points
    from ...core.progress import SILENT

    _, codes, _, _ = next(read_points(first_header(cloud.paths).path, SILENT, cloud.leave_out))
    return bool((codes == RAIL_CLASS).any())


def _missed() -> str:
    """Say to someone who clicked that there is no rail."""
    return (
        f"No railhead within {100 * GrowParameters.search_m:.0f} cm of the click: zoom in and click on one, or choose "
        "another rail standard."
    )
