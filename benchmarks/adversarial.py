"""Print what comes out of scenes that mislead: wrong lines, their errors, and what the report says about them.

Run `python benchmarks/adversarial.py [SCENE ...]`.
"""

from __future__ import annotations

import argparse
import sys

from rail_extract.core.checks.findings import examine, verdict
from rail_extract.core.frpdf.models import NAMES
from rail_extract.core.parameters import Parameters
from rail_extract.core.pipeline import extract_rails
from rail_extract.core.rails import RailNetwork
from rail_extract.laboratory.ruler.golden import Variant, build_scene, line_figures, parameters_of
from rail_extract.laboratory.scenes.adversarial import ADVERSARIAL
from rail_extract.laboratory.scenes.scene import Scene

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
        scene = build_scene(name)
        network = extract_rails([scene.rail_points()], parameters_of(scene, Variant("", model=arguments.model)))
        print(row(scene, network), flush=True)
        print(name, file=sys.stderr, flush=True)


def row(scene: Scene, network: RailNetwork) -> str:
    """Write the row of a scene, from what was extracted of it with the geometry of its tracks."""
    figures = line_figures(scene, network)
    gauge = " ".join(f"{line.gauge_mm:.0f}" for line in network.centerlines)
    _, words = verdict(examine(network, (scene.standard.gauge_m,))) if network.centerlines else ("", "no track")
    said = f"{figures['bridged m']:.1f} : {scene.gaps_m:.1f}"
    rails, tracks = f"{len(network.rails)}:{len(scene.rails)}", f"{len(network.centerlines)}:{len(scene.centerlines)}"
    return (
        f"{scene.name:<14}{figures['found %']:>7.2f}{figures['right %']:>7.2f}"
        f"{figures['wrong m']:>9.1f}{figures['track wrong m']:>9.1f}"
        f"{figures['across mm']:>8.1f}{figures['height mm']:>8.1f}{rails:>7}{tracks:>7}"
        f"{gauge:>8}{figures['in 1 s %']:>8.0f}{figures['in 2 s %']:>8.0f}{said:>14}  {words[:24]}"
    )


if __name__ == "__main__":
    main()
