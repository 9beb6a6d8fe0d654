"""FRPDF, the network that cleans rail rasters: its layers, its weights, its engines and its passes.

The constants here are those of Gribov and Chang, section 5; they stand apart from `network`, which needs PyTorch.
"""

from ..parameters import Parameters

AUTO = "AUTO"
ENGINES = (AUTO, "TORCH", "OPENCV")
DEVICES = (AUTO, "CPU", "CUDA")

START = 0.5
"""State before the first pass: undecided."""
FEEDBACK_THRESHOLD = 0.75
"""Probability from which a pass hands a cell on as rail to the next."""
OUTPUT_THRESHOLD = 0.5
"""Probability from which the last pass calls a cell rail."""

DEFAULT_PASSES, MAX_PASSES = Parameters.passes, 5
"""Repairs have settled by the latter; so often it runs where the user leaves the number of passes to it."""
STATISTICS = 2
"""Sets of batch statistics: the first pass sees a constant state, all later passes see a decided one."""
