"""Print what comes out of scenes that mislead: wrong lines, their errors, and what the report says about them.

Run `python benchmarks/adversarial.py [SCENE ...]`.
"""

from __future__ import annotations

import argparse
import sys

import numpy as np
from rail_extract.core.frpdf.models import NAMES
from rail_extract.core.parameters import Parameters
from rail_extract.core.pipeline import extract_rails
from rail_extract.core.rails import RailNetwork
from rail_extract.core.report.findings import examine
from rail_extract.core.report.verdict import verdict
from rail_extract.laboratory.ruler.lines import match
from rail_extract.laboratory.scenes.adversarial import ADVERSARIAL
from rail_extract.laboratory.scenes.scene import Scene

TOLERANCE_M = 0.05
"""Distance from the truth up to which a line is right."""

HEADINGS = (
    f"{'':<14}{'found':>7}{'right':>7}{'false m':>9}{'false m':>9}{'across':>8}{'height':>8}{'rails':>7}{'tracks':>7}"
    f"{'gauge':>8}{'within':>8}{'within':>8}{'bridged m':>14}",
    f"{'scene':<14}{'%':>7}{'%':>7}{'rails':>9}{'tracks':>9}{'mm':>8}{'mm':>8}{': true':>7}{': true':>7}"
    f"{'mm':>8}{'sigma %':>8}{'2 s. %':>8}{'said : true':>14}  verdict",
)


def main() -> None:
    """Print the table for the scenes named on the command line, or all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", choices=[*ADVERSARIAL, []], metavar="SCENE", help=", ".join(ADVERSARIAL))
    parser.add_argument("--model", choices=NAMES, default=Parameters.model, help="weights of the network")
    arguments = parser.parse_args()
    print(*HEADINGS, sep="\n")
    for name in arguments.scenes or ADVERSARIAL:
        scene = ADVERSARIAL[name]()
        standard = scene.standard
        parameters = Parameters(standard.gauge_m, standard.head_width_m, quality_step_m=1.0, model=arguments.model)
        print(row(scene, extract_rails([scene.rail_points()], parameters)), flush=True)
        print(name, file=sys.stderr, flush=True)


def row(scene: Scene, network: RailNetwork) -> str:
    """Write the row of a scene.

    Parameters
    ----------
    scene : Scene
    network : RailNetwork
        What was extracted from it, with the geometry of its tracks.
    """
    rails = match([scene.frame.to_local(network.frame.to_crs(rail.xyz)) for rail in network.rails], scene.rails)
    tracks = match(
        [scene.frame.to_local(network.frame.to_crs(one.xyz)) for one in network.centerlines], scene.centerlines
    )
    compared = rails.within(TOLERANCE_M)
    sigma_m = np.empty(len(rails.line))
    for number, rail in enumerate(network.rails):
        own = rails.line == number
        if rail.support is not None:
            sigma_m[own] = np.interp(rails.t[own], rail.support.t, rail.support.sigma_m)
    near = rails.back.distance <= TOLERANCE_M
    errors_m = np.abs(rails.back.lateral[near])
    within = [100 * np.mean(errors_m <= factor * sigma_m[near]) for factor in (1, 2)]
    gauge = " ".join(f"{line.gauge_mm:.0f}" for line in network.centerlines)
    said_m = sum(rail.bridged_m for rail in network.rails)
    _, words = verdict(examine(network, (scene.standard.gauge_m,))) if network.centerlines else ("", "no track")
    return (
        f"{scene.name:<14}{100 * compared.completeness:>7.2f}{100 * compared.correctness:>7.2f}"
        f"{rails.back.weight[~near].sum():>9.1f}{tracks.back.weight[tracks.back.distance > TOLERANCE_M].sum():>9.1f}"
        f"{1000 * compared.lateral_rmse_m:>8.1f}{1000 * compared.height_rmse_m:>8.1f}"
        f"{f'{len(network.rails)}:{len(scene.rails)}':>7}{f'{len(network.centerlines)}:{len(scene.centerlines)}':>7}"
        f"{gauge:>8}{within[0]:>8.0f}{within[1]:>8.0f}{f'{said_m:.1f} : {scene.gaps_m:.1f}':>14}  {words[:24]}"
    )


if __name__ == "__main__":
    main()
