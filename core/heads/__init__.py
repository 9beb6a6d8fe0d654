"""Railheads: refinement of lines across, heights of the top, and the standard error of both."""
