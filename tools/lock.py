"""Write the versions and checksums of the packages that Install Packages downloads, for every system and Python.

Run it before a release, look at the difference, and run the tests: the plugin then installs exactly these files.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

LOCKED = Path(__file__).resolve().parent.parent / "rail_extract_plugin" / "setup" / "locked.txt"

PYTHONS = ("3.9", "3.10", "3.11", "3.12", "3.13", "3.14")
"""From that of QGIS 3.22 to that of QGIS 4."""

SYSTEMS = {
    "Windows": ("win_amd64",),
    "Linux, Intel": ("manylinux_2_28_x86_64", "manylinux_2_17_x86_64", "manylinux2014_x86_64"),
    "Linux, ARM": ("manylinux_2_28_aarch64", "manylinux_2_17_aarch64", "manylinux2014_aarch64"),
    "macOS, Intel": tuple(
        f"macosx_{release}_x86_64" for release in ("14_0", "13_0", "12_0", "11_0", "10_13", "10_12", "10_9")
    ),
    "macOS, Apple": tuple(f"macosx_{release}_arm64" for release in ("14_0", "13_0", "12_0", "11_0")),
}
"""Names of the oldest systems for which packages are taken, as in the names of wheels."""

REQUIREMENTS = ("laspy[lazrs]", "opencv-python-headless==4.11.0.86", "pyproj", "pip<26")
"""This OpenCV is the latest that works with numpy 1, which most versions of QGIS contain, and with numpy 2."""

NOT_LOCKED = ("numpy",)
"""Of QGIS."""

HEAD = """# Versions and checksums of what Install Packages downloads; `python tools/lock.py` writes this file.
"""


def resolve(python: str, tags: tuple[str, ...]) -> dict[tuple[str, str], str]:
    """Return the checksums of the wheels for a system, by name and version."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.json"
        call = [sys.executable, "-m", "pip", "install", "--quiet", "--dry-run", "--ignore-installed"]
        call += ["--report", str(report), "--target", folder, "--python-version", python, "--only-binary=:all:"]
        call += [word for tag in tags for word in ("--platform", tag)]
        subprocess.run([*call, *REQUIREMENTS], check=True)
        found = json.loads(report.read_text(encoding="utf-8"))["install"]
    return {
        (item["metadata"]["name"].lower(), item["metadata"]["version"]): item["download_info"]["archive_info"][
            "hashes"
        ]["sha256"]
        for item in found
    }


def main() -> None:
    """Resolve for every system and Python, and write the file."""
    checksums: dict[tuple[str, str], set[str]] = defaultdict(set)
    pythons: dict[tuple[str, str], set[str]] = defaultdict(set)
    for python in PYTHONS:
        for system, tags in SYSTEMS.items():
            print(f"Python {python}, {system}", file=sys.stderr)
            for package, checksum in resolve(python, tags).items():
                if package[0] not in NOT_LOCKED:
                    checksums[package].add(checksum)
                    pythons[package].add(python)
    lines = [
        f"{name}=={version} {','.join(sorted(pythons[name, version], key=PYTHONS.index))} "
        + " ".join(f"sha256:{checksum}" for checksum in sorted(checksums[name, version]))
        for name, version in sorted(checksums)
    ]
    LOCKED.write_text(HEAD + "\n".join(lines) + "\n", encoding="ascii")


if __name__ == "__main__":
    main()
