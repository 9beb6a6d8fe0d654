"""The algorithms of the toolbox, one module each."""

from .extract_rails import ExtractRails

ALGORITHMS = (ExtractRails,)
"""In the order of the walk from points to tracks."""
