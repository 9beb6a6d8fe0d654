"""FRPDF, the network that cleans rail rasters: its architecture, weights, engines and passes.

The constants here are those of Gribov and Chang, section 5 (docs/method.md section 3).
"""

from ..parameters import Parameters

AUTO = "AUTO"
ENGINES = (AUTO, "TORCH", "OPENCV")
DEVICES = (AUTO, "CPU", "CUDA")

START = 0.5
"""State before the first pass: undecided."""
FEEDBACK_THRESHOLD = 0.75
"""Probability from which a cell is rail in the state of the next pass."""
OUTPUT_THRESHOLD = 0.5
"""Probability from which a cell is rail in the result."""

DEFAULT_PASSES, MAX_PASSES = Parameters.passes, 5
"""Default number of passes, and the number after which a run that continues until the result is stable ends."""
STATISTICS = 2
"""Sets of batch statistics: one for the first pass, whose state is constant, and one for all later passes."""
