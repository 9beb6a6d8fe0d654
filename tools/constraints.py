"""Print constraints for pip: the versions of the system's numpy and scipy, and those on the command line."""

import sys

import numpy
import scipy

if __name__ == "__main__":
    print("# Python {}.{}".format(*sys.version_info))
    print(f"numpy=={numpy.__version__}", f"scipy=={scipy.__version__}", *sys.argv[1:], sep="\n")
