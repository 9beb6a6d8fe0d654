"""The size of the code: files, lines, named numbers, and floors."""

import pytest
import size


@pytest.fixture
def house(tmp_path):
    """A package of three rooms: `roof` stands on `walls` and on `ground`, and `walls` on `ground`."""
    (tmp_path / "walls").mkdir()
    files = {
        "__init__.py": "",
        "ground.py": "A, B = 1, 2.5\nNAME = 'a'\n",
        "walls/__init__.py": "",
        "walls/north.py": "from ..ground import A\nfrom .south import C\n",
        "walls/south.py": "C = 3\n\n",
        "roof.py": "from . import ground\nfrom .walls.north import A\n",
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def test_files_lines_and_numbers_are_counted(house):
    assert size.size(house, "*.py") == (6, 8)
    assert size.named_numbers(house) == 3


def test_a_room_stands_on_those_that_it_imports(house):
    imports = size.imported(house)
    assert imports == {"ground": set(), "walls": {"ground"}, "roof": {"ground", "walls"}}
    assert size.floors(imports) == 3
