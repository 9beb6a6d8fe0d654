"""Some damaged files of every kind that needs no QGIS; `make fuzz` reads as many as time allows."""

import fuzz
import pytest
from fuzzing.kinds import CORE


@pytest.mark.parametrize("kind", CORE, ids=lambda kind: kind.name)
def test_damaged_files_are_read_or_refused(kind):
    pytest.importorskip(kind.needs)
    counts, failures = fuzz.fuzz(kind, range(150))
    assert failures == {}
    assert counts[fuzz.READ] + counts[fuzz.REFUSED] == 150
