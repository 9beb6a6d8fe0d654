"""Rays of a profile scanner cast against cross-sections: what is hidden gives no point, edges give mixed ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

CHUNK = 64
"""Profiles that are cast at once."""

MIXED_STEP_M = 0.02
"""Neighbouring rays whose ranges differ by more than this have an edge between them."""

ECHO_M = 0.25
"""Parts of a footprint this close in range come back as one echo; those behind make a second one."""

MIXED = 15
"""Kind of a point between two surfaces."""

SECOND_ECHO = 0.3
"""Least share of the power that makes a second echo."""

SUBRAYS = tuple(np.arange(-6, 7) / 4)
_POWER = np.exp(-2 * np.square(SUBRAYS))
SUBRAY_WEIGHTS = tuple(_POWER / _POWER.sum())
"""Rays that stand for a wide footprint, in halves of its width, and the share of the power in each: a Gaussian beam,
whose width is given where its power falls to 1/e²."""


@dataclass(frozen=True)
class RawScanner:
    """A profile scanner; the defaults suit a good one on a train.

    Attributes
    ----------
    profile_step_m : float
        Distance between profiles.
    ray_step_rad : float
        Angle between neighbouring rays.
    left_m, height_m : float
        Place to the left of the reference line and above the height of its rails.
    noise_m : float
        Standard deviation of the range; across, points are off by a quarter of it.
    half_range_m : float
        Distance at which half the rays come back.
    footprint_m : float
        Width of the beam where it hits, to 1/e² of its power.
    wide : bool
        Whether the footprint is as wide as a railhead, so that ranges within it are averaged.
    view_rad : tuple of float
        Angles that are scanned, from straight down, positive to the left.
    shift_m : tuple of float
        Error of registration: to the left, and up.
    swing : float
        Share by which the distance of profiles swings with the carrier's speed.
    turned : float
        Tangent of the angle by which the profiles are turned from perpendicular, positive if their left end is ahead.
    stand_m : float or None
        Place along the line of a scanner on a tripod, which turns there: rays are `ray_step_rad` apart in both
        directions, and of the profiles those points are kept that such rays would hit.
    """

    profile_step_m: float = 0.05
    ray_step_rad: float = 0.0022
    left_m: float = 0.4
    height_m: float = 3.8
    noise_m: float = 0.003
    half_range_m: float = 25.0
    footprint_m: float = 0.006
    wide: bool = False
    view_rad: tuple[float, float] = (-np.pi, np.pi)
    shift_m: tuple[float, float] = (0.0, 0.0)
    swing: float = 0.15
    turned: float = 0.0
    stand_m: float | None = None

    def stations(self, length_m: float) -> np.ndarray:
        """Places of the profiles along a reference line."""
        count = int(length_m / self.profile_step_m * (1.05 + self.swing))
        swing = 1 + self.swing * np.sin(np.arange(count) * self.profile_step_m / 10)
        station = np.cumsum(self.profile_step_m * swing)
        return station[station < length_m]

    def share_kept(self, ahead_m: np.ndarray, reach_m: np.ndarray) -> np.ndarray:
        """Share of the points of dense profiles, (n,), that a scanner on a tripod has.

        On any surface along the line, rays of a sphere are `reach_m`² / distance³ · profile_step / ray_step as dense as
        those of the profiles: the solid angle falls with the square of the distance, and the cosine with it. `ahead_m`
        is the distance from the tripod along the line, `reach_m` the one in the profile.
        """
        distance_m = np.hypot(ahead_m, reach_m)
        return np.minimum(reach_m**2 * self.profile_step_m / (distance_m**3 * self.ray_step_rad), 1.0)


@dataclass(frozen=True)
class Segments:
    """Straight pieces of cross-sections, by rising number of their profile.

    Starts and ends, (k, 2), are metres to the left of the reference line, and height.
    """

    profile: np.ndarray
    start: np.ndarray
    end: np.ndarray
    kind: np.ndarray


@dataclass(frozen=True)
class Hits:
    """What the rays hit: places, (n, 2) metres to the left of the reference line and height, with noise."""

    profile: np.ndarray
    place: np.ndarray
    kind: np.ndarray


def cast(segments: Segments, source: np.ndarray, scanner: RawScanner, rng: np.random.RandomState) -> Hits:
    """Scan cross-sections from a place in each, (profiles, 2)."""
    count = len(source)
    borders = np.searchsorted(segments.profile, np.arange(0, count + CHUNK, CHUNK))
    found = []
    for number, (first, last) in enumerate(zip(borders, borders[1:])):
        part = slice(first, last)
        profiles = slice(number * CHUNK, min((number + 1) * CHUNK, count))
        chunk = Segments(
            segments.profile[part] - profiles.start, segments.start[part], segments.end[part], segments.kind[part]
        )
        hits = _cast_chunk(chunk, source[profiles], scanner, rng)
        found.append(Hits(hits.profile + profiles.start, hits.place, hits.kind))
    return Hits(*(np.concatenate([getattr(hits, name) for hits in found]) for name in ("profile", "place", "kind")))


def _cast_chunk(segments: Segments, source: np.ndarray, scanner: RawScanner, rng: np.random.RandomState) -> Hits:
    """Scan some profiles."""
    phase = rng.random_sample(len(source)) * scanner.ray_step_rad
    profile, ray, distance, kind, chance = (_wide if scanner.wide else _sharp)(segments, source, phase, scanner, rng)
    returned = rng.random_sample(len(ray)) < chance / (1 + (distance / scanner.half_range_m) ** 4)
    profile, ray, distance, kind = profile[returned], ray[returned], distance[returned], kind[returned]
    angle = phase[profile] + ray * scanner.ray_step_rad
    distance = distance + scanner.noise_m * rng.standard_normal(len(distance))
    place = source[profile] + distance[:, None] * np.column_stack([np.sin(angle), -np.cos(angle)])
    place += 0.25 * scanner.noise_m * rng.standard_normal(place.shape) + np.asarray(scanner.shift_m)
    return Hits(profile, place, kind)


def _sharp(
    segments: Segments, source: np.ndarray, phase: np.ndarray, scanner: RawScanner, rng: np.random.RandomState
) -> tuple[np.ndarray, ...]:
    """Cast thin rays; where the ranges of neighbours differ, some come back from between them.

    A beam is mixed if the edge lies within half its footprint of its middle, on either side; less than half of it then
    lies on the other surface.
    """
    distance, number, facing = _ranges(segments, source, phase, scanner)
    profile, ray = np.nonzero(np.isfinite(distance))
    own, kind = distance[profile, ray], segments.kind[number[profile, ray]]
    blended = own.copy()
    for side in (-1, 1):
        other = distance[profile, np.clip(ray + side, 0, distance.shape[1] - 1)]
        chance = 0.5 * scanner.footprint_m / (np.minimum(own, other) * scanner.ray_step_rad)
        edge = np.isfinite(other) & (np.abs(other - own) > MIXED_STEP_M) & (rng.random_sample(len(own)) < chance)
        share = 0.5 * rng.random_sample(len(own))
        blended[edge] += share[edge] * (other - own)[edge]
        kind = np.where(edge, MIXED, kind)
    return profile, ray + _first_ray(scanner), blended, kind, _returned(facing[profile, ray])


def _wide(
    segments: Segments, source: np.ndarray, phase: np.ndarray, scanner: RawScanner, rng: np.random.RandomState
) -> tuple[np.ndarray, ...]:
    """Cast several rays for each footprint and average their ranges by echo."""
    reach = np.abs(source[:, 1] - np.median(segments.start[:, 1]))
    half = 0.5 * scanner.footprint_m / np.maximum(reach, 1.0)
    casts = [_ranges(segments, source, phase + share * half, scanner) for share in SUBRAYS]
    distance = np.stack([one for one, _, _ in casts])
    kinds = np.stack([segments.kind[number] for _, number, _ in casts])
    weights = np.broadcast_to(np.reshape(SUBRAY_WEIGHTS, (-1, 1, 1)), distance.shape)
    echoes = []
    first = distance.min(axis=0)
    front = distance < first + ECHO_M
    for inside, least in ((front, 0.0), (~front & np.isfinite(distance), SECOND_ECHO)):
        weight = np.where(inside, weights, 0.0)
        total = weight.sum(axis=0)
        profile, ray = np.nonzero(total > least)
        mean = np.where(inside, weight * np.where(inside, distance, 0.0), 0.0).sum(axis=0)
        main = np.argmax(weight, axis=0)[profile, ray]
        echoes.append((profile, ray, mean[profile, ray] / total[profile, ray], kinds[main, profile, ray]))
    profile, ray, mean, kind = (np.concatenate(parts) for parts in zip(*echoes))
    return profile, ray + _first_ray(scanner), mean, kind, np.full(len(ray), 0.97)


def _returned(facing: np.ndarray) -> np.ndarray:
    """Chance that a ray comes back, by the cosine of its angle to the normal: grazing ones are mirrored away."""
    return np.clip(0.25 + 2.0 * facing, 0.0, 1.0)


def _first_ray(scanner: RawScanner) -> int:
    return int(np.floor(scanner.view_rad[0] / scanner.ray_step_rad))


def _ranges(
    segments: Segments, source: np.ndarray, phase: np.ndarray, scanner: RawScanner
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Distance to what each ray hits first, its segment, and the cosine to its normal, (profiles, rays) each."""
    step = scanner.ray_step_rad
    first_ray = _first_ray(scanner)
    rays = int(np.ceil((scanner.view_rad[1] - scanner.view_rad[0]) / step))
    origin, base = source[segments.profile], phase[segments.profile]
    one, other = segments.start - origin, segments.end - origin
    angle = np.arctan2(one[:, 0], -one[:, 1])
    turn = np.arctan2(other[:, 0], -other[:, 1]) - angle
    turn = (turn + np.pi) % (2 * np.pi) - np.pi
    low, high = np.minimum(angle, angle + turn), np.maximum(angle, angle + turn)
    start = np.ceil((low - base) / step).astype(np.int64)
    count = np.maximum(np.floor((high - base) / step).astype(np.int64) - start + 1, 0)
    number = np.repeat(np.arange(len(count)), count)
    ray = start[number] + np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    at = base[number] + ray * step
    direction = np.column_stack([np.sin(at), -np.cos(at)])
    along = (segments.end - segments.start)[number]
    slope = direction[:, 0] * along[:, 1] - direction[:, 1] * along[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (one[number, 0] * along[:, 1] - one[number, 1] * along[:, 0]) / slope
        facing = np.abs(slope) / np.hypot(*along.T)
    turns = round(2 * np.pi / step)
    ray = np.where(ray - first_ray >= rays, ray - turns, ray)
    ray = np.where(ray < first_ray, ray + turns, ray) - first_ray
    fine = (ray >= 0) & (ray < rays) & (distance > 0)
    key, number, distance, facing = (
        (segments.profile[number] * rays + ray)[fine],
        number[fine],
        distance[fine],
        facing[fine],
    )
    order = np.lexsort((distance, key))
    nearest = order[np.unique(key[order], return_index=True)[1]]
    nearest_distance = np.full(len(source) * rays, np.inf)
    nearest_number, nearest_facing = np.zeros(len(source) * rays, dtype=np.int64), np.zeros(len(source) * rays)
    nearest_distance[key[nearest]] = distance[nearest]
    nearest_number[key[nearest]], nearest_facing[key[nearest]] = number[nearest], facing[nearest]
    shape = len(source), rays
    return nearest_distance.reshape(shape), nearest_number.reshape(shape), nearest_facing.reshape(shape)
