"""Some damaged files of every kind that needs no QGIS; `make fuzz` reads as many as time allows."""

import fuzz
import pytest
from fuzzing.kinds import CORE, KINDS


@pytest.mark.parametrize("kind", CORE, ids=lambda kind: kind.name)
def test_damaged_files_are_read_or_refused(kind):
    pytest.importorskip(kind.needs)
    counts, failures = fuzz.fuzz(kind, range(150))
    assert failures == {}
    assert counts[fuzz.READ] + counts[fuzz.REFUSED] == 150


@pytest.mark.parametrize("name", ["moving", "stored", "work"])
def test_files_are_read_on_by_the_process_that_replaces_another(name, monkeypatch):
    monkeypatch.setattr(fuzz, "FRESH_AFTER", 2)
    counts, failures = fuzz.fuzz(KINDS[name], range(5))
    assert failures == {}
    assert sum(counts.values()) == 5
