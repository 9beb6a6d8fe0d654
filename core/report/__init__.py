"""The report: a page that shows at a glance whether a result is good, and where it is not."""

from .alignment import build_alignment_page
from .page import Origin, build_page

__all__ = ["Origin", "build_alignment_page", "build_page"]
