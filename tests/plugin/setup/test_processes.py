import sys

import pytest
from heard import Heard
from rail_extract.core.errors import Cancelled
from rail_extract.rail_extract_plugin.setup.processes import run


def test_output_including_errors_comes_line_by_line():
    code = "import sys; print('one'); print(); print('zwei ü', file=sys.stderr, end='')"
    heard = Heard()
    ended = run(sys.executable, ["-u", "-c", code], {"PYTHONIOENCODING": "utf-8"}, heard)
    assert ended.code == 0
    assert heard.infos == ["one", "zwei ü"]
    assert ended.output == "one\n\nzwei ü\n"


def test_environment_is_changed_as_requested(monkeypatch):
    monkeypatch.setenv("RAIL_KEPT", "kept")
    code = "import os; print(os.environ['RAIL_KEPT'], os.environ['RAIL_CHANGED'])"
    assert run(sys.executable, ["-c", code], {"RAIL_CHANGED": "changed"}).output == "kept changed\n"


def test_exit_code_is_returned():
    assert run(sys.executable, ["-c", "raise SystemExit(3)"]).code == 3


def test_missing_or_crashed_program_has_no_exit_code():
    assert run("/nowhere/python", []).code is None
    assert run(sys.executable, ["-c", "import os; os.abort()"]).code is None


def test_cancel_ends_the_program(tmp_path):
    code = "import sys, time; print('begun', flush=True); time.sleep(60); open(sys.argv[1], 'w')"
    with pytest.raises(Cancelled):
        run(sys.executable, ["-c", code, str(tmp_path / "late")], progress=Heard(cancel_after=0))
    assert not list(tmp_path.iterdir())
