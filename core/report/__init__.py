"""The report: a page that shows at a glance whether a result is good, and where it is not."""

from .origin import Origin
from .page import build_page

__all__ = ["Origin", "build_page"]
