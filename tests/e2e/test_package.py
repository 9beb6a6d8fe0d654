import re
import zipfile

import package
import pytest
from rail_extract.core import VERSION


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    path = tmp_path_factory.mktemp("package") / "rail_extract.zip"
    package.build(path)
    return path


@pytest.fixture(scope="module")
def names(archive):
    with zipfile.ZipFile(archive) as file:
        return file.namelist()


def test_same_files_give_the_same_bytes(archive, tmp_path):
    package.build(tmp_path / "again.zip")
    assert (tmp_path / "again.zip").read_bytes() == archive.read_bytes()


def test_zip_is_a_single_folder_that_qgis_recognizes(names):
    assert {name.split("/")[0] for name in names} == {"rail_extract"}
    assert {f"rail_extract/{name}" for name in ("__init__.py", "metadata.txt", "LICENSE")} <= set(names)


def test_zip_contains_only_the_product(names):
    assert any(re.fullmatch(r"rail_extract/models/.*\.npz", name) for name in names)
    assert {"rail_extract/core/pipeline/__init__.py", "rail_extract/resources/styles/rails.qml"} <= set(names)
    assert not [name for name in names if re.search(r"/(tests|tools|benchmarks|\.ci)/|\.pyc$", name)]


def test_help_buttons_open_pages_of_the_zip(archive, names):
    pages = [name for name in names if name.endswith(".html")]
    assert {f"rail_extract/resources/guide/{page}.html" for page in ("README", "parameters", "troubleshooting")} <= set(
        pages
    )
    with zipfile.ZipFile(archive) as file:
        for page in pages:
            links = re.findall(r'(?:href|src)="(?!\w+:|#)([^"#]+)', file.read(page).decode())
            assert links and not {f"rail_extract/resources/guide/{link}" for link in links} - set(names), page


def test_versions_agree(request):
    root = request.config.rootpath
    stated = {
        re.search(r'^version ?= ?"?([\d.]+)', (root / name).read_text(encoding="utf-8"), re.MULTILINE).group(1)
        for name in ("metadata.txt", "pyproject.toml")
    }
    assert stated == {VERSION}
