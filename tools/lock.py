"""Write the versions and checksums of the packages that Install Packages downloads, for every system and Python.

Run it before a release, after `pip install uv`, look at the difference, and run the tests: the plugin then installs
exactly these files. The list has none of PyTorch's own builds, CPU for Linux and CUDA for Windows, which are on an
index of their own.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

LOCKED = Path(__file__).resolve().parent.parent / "rail_extract_plugin" / "setup" / "locked.txt"

PYTHONS = ("3.9", "3.10", "3.11", "3.12", "3.13", "3.14")
"""From QGIS 3.22 to QGIS 4."""

SYSTEMS = {
    "win32-amd64": "x86_64-pc-windows-msvc",
    "linux-x86_64": "x86_64-manylinux_2_28",
    "linux-aarch64": "aarch64-manylinux_2_28",
    "darwin-x86_64": "x86_64-apple-darwin",
    "darwin-arm64": "aarch64-apple-darwin",
}
"""Systems as in `locked.SYSTEMS`, and as uv names the oldest ones for which packages are taken."""

REQUIREMENTS = ("laspy[lazrs]", "opencv-python-headless==4.11.0.86", "pyproj", "pip<26")
"""This OpenCV is the latest that works with numpy 1, which most versions of QGIS contain, and with numpy 2."""

OPTIONAL = ("torch",)
"""Not every system has a build of it for every Python."""

MACOS = {REQUIREMENTS: "14.0", OPTIONAL: "12.0"}
"""The oldest macOS: pyproj's builds for Intel need the first, older builds of PyTorch the second."""

NOT_LOCKED = ("numpy",)
"""Of QGIS."""

HEAD = """# Versions and checksums of what Install Packages downloads; `python tools/lock.py` writes this file.
"""


def resolve(python: str, system: str, requirements: tuple[str, ...]) -> dict[str, set[str]]:
    """Return the checksums of the files for a system, by name and version; none if there are no such files."""
    call = ["uv", "pip", "compile", "-", "--no-header", "--no-annotate", "--generate-hashes", "--only-binary=:all:"]
    call += ["--python-version", python, "--python-platform", SYSTEMS[system], "--no-python-downloads"]
    environment = {**os.environ, "MACOSX_DEPLOYMENT_TARGET": MACOS[requirements]}
    found = subprocess.run(call, input="\n".join(requirements), capture_output=True, text=True, env=environment)
    if found.returncode and requirements != OPTIONAL:
        raise SystemExit(found.stderr)
    print(f"Python {python}, {system}: {found.stderr.strip().splitlines()[-1]}", file=sys.stderr)
    lines = found.stdout.replace("\\\n", "").splitlines()
    return {line.split()[0]: set(re.findall(r"--hash=(sha256:[0-9a-f]{64})", line)) for line in lines}


def places(found: set[tuple[str, str]]) -> list[str]:
    """Write Pythons and systems, those on all systems without the system.

    >>> places({("3.9", system) for system in SYSTEMS} | {("3.10", "win32-amd64")})
    ['3.9', '3.10:win32-amd64']
    """
    written = []
    for python in PYTHONS:
        systems = [system for system in SYSTEMS if (python, system) in found]
        written += [python] if len(systems) == len(SYSTEMS) else [f"{python}:{system}" for system in systems]
    return written


def main() -> None:
    """Resolve for every system and Python, and write the file."""
    checksums: dict[str, set[str]] = defaultdict(set)
    there: dict[str, set[tuple[str, str]]] = defaultdict(set)
    for python in PYTHONS:
        for system in SYSTEMS:
            for requirements in (REQUIREMENTS, OPTIONAL):
                for package, known in resolve(python, system, requirements).items():
                    if package.split("==")[0] not in NOT_LOCKED:
                        checksums[package] |= known
                        there[package].add((python, system))
    lines = [
        f"{package} {','.join(places(there[package]))} {' '.join(sorted(checksums[package]))}"
        for package in sorted(checksums)
    ]
    LOCKED.write_text(HEAD + "\n".join(lines) + "\n", encoding="ascii")


if __name__ == "__main__":
    main()
