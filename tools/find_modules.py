"""Exit with 0 if there is a qgis_process and Python finds every module named on the command line, otherwise with 1."""

import shutil
import sys
from importlib.util import find_spec


def is_found(module: str) -> bool:
    """Return whether `module` can be imported; its parent packages are imported."""
    try:
        return find_spec(module) is not None
    except ImportError:
        return False


if __name__ == "__main__":
    sys.exit(not (shutil.which("qgis_process") and all(map(is_found, sys.argv[1:]))))
