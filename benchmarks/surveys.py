"""Print how well two surveys by images agree on the rails of one place, and whether stated errors explain the rest.

Run `python benchmarks/surveys.py [--seed N] [--heads] [PLACE ...]`. The second survey of a place has other errors and
is registered some centimetres aside; mean differences are this shift. `--heads` draws lines from the points that are on
heads, so that the figures do not depend on the classification.
"""

from __future__ import annotations

import argparse

import numpy as np
from rail_extract.core.rails import RailNetwork
from rail_extract.laboratory.ruler.agreement import HEADER, agreement
from rail_extract.laboratory.ruler.classification import draw, settings_of
from rail_extract.laboratory.ruler.lines import match
from rail_extract.laboratory.ruler.whole_clouds import classify_cloud
from rail_extract.laboratory.scenes.raw import RawScene
from rail_extract.laboratory.scenes.raw_catalogue import BLUNT, DRONE, SURVEYED, another_day

SEED = 2026

CAMERAS = {"sharp": DRONE, "blunt": BLUNT}


def main() -> None:
    """Print a row for each place and camera."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("places", nargs="*", metavar="PLACE", help=f"of {', '.join(SURVEYED)}")
    parser.add_argument("--seed", type=int, default=SEED, help=f"of the scenes (default {SEED})")
    parser.add_argument("--heads", action="store_true", help="take the points that are on heads as labelled")
    arguments = parser.parse_args()
    print(f"{'':<20}{'found % of each':>16}{'mm off truth':>14}{'gauge mm of each':>18}{HEADER}")
    for name in arguments.places or SURVEYED:
        for kind, camera in CAMERAS.items():
            scenes = [SURVEYED[name](arguments.seed, scanner=one) for one in (camera, another_day(camera))]
            networks = [drawn(scene, arguments.heads) for scene in scenes]
            print(f"{name + ', ' + kind:<20}{row(scenes, networks)}", flush=True)


def drawn(scene: RawScene, heads: bool) -> RailNetwork | None:
    """Draw the rails of a scene."""
    return draw(scene, scene.head if heads else classify_cloud(scene.xyz, settings_of(scene)).rail)


def row(scenes: list[RawScene], networks: list[RailNetwork | None]) -> str:
    """Format what two surveys found, how far the first is off the truth across, and how they agree."""
    shares, off_mm, gauges = [], [], []
    for scene, network in zip(scenes, networks):
        rails = () if network is None else network.rails
        compared = match([rail.xyz for rail in rails], scene.shown).within(0.05)
        shares.append(f"{100 * compared.completeness:.1f}")
        off_mm.append(f"{1000 * compared.lateral_rmse_m:.1f}")
        found = [track.gauge_mm for track in network.geometry] if network is not None else []
        gauges.append(f"{np.nanmedian(np.concatenate(found)):.1f}" if found else "-")
    both = None if None in networks else agreement(*(network.rails for network in networks if network is not None))
    return f"{' '.join(shares):>16}{off_mm[0]:>14}{' '.join(gauges):>18}" + ("" if both is None else both.text())


if __name__ == "__main__":
    main()
