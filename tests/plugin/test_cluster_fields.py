"""What the command writes has the fields that QGIS gets."""

import numpy as np
from rail_extract.core.cluster import fields
from rail_extract.rail_extract_plugin.compat import INTEGER, REAL, TEXT
from rail_extract.rail_extract_plugin.layers import CENTERLINE_FIELDS, RAIL_FIELDS

KINDS = {INTEGER: np.int32, REAL: float, TEXT: str}


def test_fields_are_the_same():
    assert [(name, KINDS[kind]) for name, kind in RAIL_FIELDS] == list(fields.RAIL_FIELDS.items())
    assert [(name, KINDS[kind]) for name, kind in CENTERLINE_FIELDS] == list(fields.CENTERLINE_FIELDS.items())
