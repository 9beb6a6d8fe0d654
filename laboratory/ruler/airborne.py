"""How far tracks fitted in airborne clouds lie from the true ones."""

from __future__ import annotations

import tempfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from ...core.airborne.files import Run, survey_files
from ...core.airborne.fitting import REASONS
from ...core.airborne.guide_line import STATION_M
from ...core.airborne.survey import SWITCH, AirborneSurvey, AirborneTrack, GuideLine
from ...core.clouds.points import ask
from ...core.parameters import AirborneParameters
from ...core.polyline import Polyline
from ...core.run.tasks import Runner
from ..airborne.catalogue import FlownScene
from ..airborne.designs import SPACING_M, Design
from ..airborne.write import ORIGIN, write_airborne

GAUGE_M, CLASSES = 1.435, (1, 2)
"""Gauge of all tracks, metres, and the classes that are read."""

UNSEEN = ("", "empty", "hidden", "misled", "unsure", "twin", "aside", "sparse")
"""Short names of `REASONS`, by which stations that are not seen are counted."""

RIGHT_M, CERTAIN = 0.10, 1.96
"""A station within this distance is right, and one within as many standard errors is inside its 95 % interval."""

END_SAMPLES = 4
"""Stations beside the first and last samples of the truth are beyond its ends."""


@dataclass(frozen=True)
class Stationwise:
    """Figures of stations, one row each.

    Attributes
    ----------
    seen : (n,) bool array
    across_m, height_m : (n,) arrays
        Distance to the left of the true track and above it; NaN where it is not seen.
    within : (n,) bool array
        Whether the truth lies in the 95 % interval.
    beside_m : (n,) array
        Distance of the true track from the next one.
    flagged : (n,) bool array
        Whether the station is said to be at a switch.
    along_m : (n,) array
        Chainage along the true track.
    """

    seen: np.ndarray
    across_m: np.ndarray
    height_m: np.ndarray
    within: np.ndarray
    beside_m: np.ndarray
    flagged: np.ndarray
    along_m: np.ndarray

    def __getitem__(self, which: np.ndarray) -> Stationwise:
        return Stationwise(*(values[which] for values in vars(self).values()))

    @classmethod
    def joined(cls, parts: Sequence[Stationwise]) -> Stationwise:
        """Return all rows of several."""
        return cls(*(np.concatenate(columns) for columns in zip(*(vars(part).values() for part in parts))))

    @property
    def right(self) -> np.ndarray:
        """Which stations are seen and right, (n,) bool."""
        return self.seen & (np.abs(np.nan_to_num(self.across_m, nan=np.inf)) < RIGHT_M)

    def shares(self) -> tuple[float, float, float, float, float]:
        """Return the share seen, of these right, rms across in mm, sd of the height in mm, and share within."""
        seen, right = self.seen, self.right
        if not right.any():
            return float(seen.mean()) if len(seen) else np.nan, 0.0, np.nan, np.nan, 0.0
        rms = np.sqrt(np.mean(self.across_m[right] ** 2))
        share = right.sum() / seen.sum()
        return (
            float(seen.mean()),
            float(share),
            1000 * float(rms),
            1000 * float(self.height_m[right].std()),
            float(self.within[seen].mean()),
        )


def compare_stations(
    xyz: np.ndarray,
    seen: np.ndarray,
    sigma_m: np.ndarray,
    flagged: np.ndarray,
    truth: np.ndarray,
    others: Sequence[np.ndarray] = (),
) -> Stationwise:
    """Compare stations, (n, 3), with the true track, (m, 3) dense samples, beside other true tracks."""
    nearest = cKDTree(truth[:, :2]).query(xyz[:, :2])[1]
    inside = (nearest >= END_SAMPLES) & (nearest < len(truth) - END_SAMPLES)
    xyz, seen, sigma_m, flagged, nearest = xyz[inside], seen[inside], sigma_m[inside], flagged[inside], nearest[inside]
    ahead = truth[nearest + 1, :2] - truth[nearest - 1, :2]
    ahead /= np.hypot(*ahead.T)[:, None]
    step = xyz - truth[nearest]
    across = ahead[:, 0] * step[:, 1] - ahead[:, 1] * step[:, 0]
    along = (ahead * step[:, :2]).sum(axis=1)
    gradient = (truth[nearest + 1, 2] - truth[nearest - 1, 2]) / np.hypot(
        *(truth[nearest + 1, :2] - truth[nearest - 1, :2]).T
    )
    height = step[:, 2] - along * gradient
    beside = np.min(
        [cKDTree(other[:, :2]).query(truth[nearest, :2])[0] for other in others] or [np.full(len(nearest), np.inf)],
        axis=0,
    )
    across, height = np.where(seen, across, np.nan), np.where(seen, height, np.nan)
    within = seen & (np.abs(across) < CERTAIN * sigma_m)
    return Stationwise(seen, across, height, within, beside, flagged, Polyline(truth).t[nearest])


def surveyed(scene: FlownScene) -> AirborneSurvey:
    """Survey a scene along its guides, from files and back."""
    guides = [GuideLine(1 + number, one + ORIGIN[:2]) for number, one in enumerate(scene.guides)]
    parameters = AirborneParameters(GAUGE_M, SPACING_M - GAUGE_M, footprint_m=scene.flight.footprint_m)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_airborne(scene.cloud, folder / "cloud.las")
        return survey_files(Run(ask(folder / "cloud.las", CLASSES), parameters, folder / "points", Runner()), guides)


def survey_figures(scene: FlownScene) -> dict[str, float]:
    """Survey a scene along its guides, and measure the tracks that are found.

    Shares of stations are in per cent; errors in millimetres, rms across, and sd of the height; `wrong m` is the length
    that is seen where no track is, `others` counts tracks without a guide, `said` warnings, and the names of `UNSEEN`
    stations that are not seen.
    """
    survey = surveyed(scene)
    pairs = list(zip(survey.tracks, scene.meant))
    rows = [compared(survey, track, scene.design, number) for track, number in pairs if number is not None]
    shares = Stationwise.joined(rows).shares() if rows else (np.nan,) * 5
    reasons = Counter(REASONS.index(one) for track in survey.tracks for one in track.reason if one in REASONS[1:])
    seen, right, rms, sd, within = shares
    return {
        "seen %": 100 * seen,
        "right %": 100 * right,
        "across mm": rms,
        "height mm": sd,
        "within %": 100 * within,
        "wrong m": STATION_M * float(sum(track.seen.sum() for track, number in pairs if number is None)),
        "lines": len(survey.lines),
        "flagged": sum(one == SWITCH for track in survey.tracks for one in track.reason),
        "others": sum(len(track.others) for track in survey.tracks),
        "said": len(survey.warnings),
        **{UNSEEN[code]: count for code, count in sorted(reasons.items())},
    }


def compared(survey: AirborneSurvey, track: AirborneTrack, design: Design, number: int) -> Stationwise:
    """Compare the stations of a track with a true one, except where a train hides it."""
    xyz = survey.frame.to_crs(track.xyz) - ORIGIN
    at_switch = np.array([one == SWITCH for one in track.reason])
    others = [design.truth(other) for other in range(len(design.tracks)) if other != number]
    found = compare_stations(
        xyz, track.seen.astype(bool), track.sigma_mm / 1000, at_switch, design.truth(number), others
    )
    return found[~design.is_hidden(number, found.along_m)]
