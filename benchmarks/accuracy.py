"""Print the errors of extracted lines, and of the lines of a plain script, on synthetic scenes.

Run `python benchmarks/accuracy.py [SCENE ...] [--model fast]`.
"""

from __future__ import annotations

import argparse
import sys

from processes import processes
from rail_extract.core.frpdf.models import NAMES
from rail_extract.core.parameters import Parameters
from rail_extract.laboratory.ruler.measuring import Result, measure
from rail_extract.laboratory.ruler.tables import error_table, found_table
from rail_extract.laboratory.scenes.catalogue import SCENES


def main() -> None:
    """Print the tables for the scenes named on the command line, or for all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", choices=[*SCENES, []], metavar="SCENE", help=f"of {', '.join(SCENES)}")
    parser.add_argument("--model", choices=NAMES, default=Parameters.model, help="weights of the network")
    arguments = parser.parse_args()
    results = [_measured(name, arguments.model) for name in arguments.scenes or SCENES]
    print(found_table(results), error_table(results), sep="\n\n")


def _measured(name: str, model: str) -> Result:
    """Measure one scene in a separate process, so that its peak memory belongs to the scene."""
    print(name, file=sys.stderr, flush=True)
    with processes(1) as pool:
        return pool.submit(measure, SCENES[name](), model).result()


if __name__ == "__main__":
    main()
