"""Run the tests of plugin and qgis_process in another version of Debian, with its QGIS and Python.

The other system is in .chroots/NAME; mmdebstrap builds it once, and `make clean-chroots` removes it. It needs root.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
CHROOTS = ROOT / ".chroots"
TREE = "rail_extract"
"""Folder in the other system with a copy of the working tree, a .venv and a build folder."""

MIRROR = "http://deb.debian.org/debian"
BASE_PACKAGES = ("ca-certificates", "git", "make")

SHARED = (
    "/etc/resolv.conf",
    "/etc/ssl/certs",
    "/etc/pip.conf",
    "~/.config/pip",
    "/opt",
)
"""What pip may need of this system: names, certificates, its configuration, and packages in local folders."""

VIRTUAL = ("/proc", "/sys", "/dev")

RELEASES = {"latest": ("forky",), "3.40": ("bookworm", "bookworm-backports")}
"""Suites of Debian, the last one preferred: testing has QGIS 3.44, the backports for Debian 12 have QGIS 3.40."""


def make_system(name: str, packages: list[str]) -> Path:
    """Build the system `name` with `packages`, unless it exists, and return its folder."""
    folder = CHROOTS / name
    if folder.exists():
        return folder
    suites = RELEASES[name]
    unfinished = CHROOTS / f"{name}.unfinished"
    shutil.rmtree(unfinished, ignore_errors=True)
    CHROOTS.mkdir(exist_ok=True)
    options = (
        'Acquire::Check-Valid-Until "false"',
        'APT::Install-Recommends "false"',
        f'APT::Default-Release "{suites[-1]}"',
    )
    print(f"Building Debian {suites[-1]} with its QGIS in {folder}", flush=True)
    subprocess.run(
        [
            "mmdebstrap",
            "--variant=apt",
            "--dpkgopt=force-unsafe-io",
            *(f"--aptopt={option}" for option in options),
            f"--include={','.join((*BASE_PACKAGES, *packages))}",
            suites[0],
            str(unfinished),
            *(f"deb {MIRROR} {suite} main" for suite in suites),
        ],
        check=True,
    )
    return unfinished.rename(folder)


def copy_tree(tree: Path) -> None:
    """Copy the working tree into `tree`, whose .venv and build folder are kept."""
    listing = ["git", "-c", f"safe.directory={ROOT}", "ls-files", "-z", "-co", "--exclude-standard"]
    names = subprocess.run(listing, cwd=ROOT, check=True, capture_output=True, text=True).stdout.split("\0")
    tree.mkdir(exist_ok=True)
    for old in tree.iterdir():
        if old.name not in (".venv", "build"):
            shutil.rmtree(old) if old.is_dir() else old.unlink()
    for name in filter(None, names):
        if (ROOT / name).is_file():
            (tree / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, tree / name)


def run_inside(system: Path, script: str) -> int:
    """Run a shell script in the copied tree and return its exit code; mounts are in a namespace that ends with it."""
    mounts = [(path, "--rbind") for path in VIRTUAL]
    mounts += [(str(Path(path).expanduser()), "--bind") for path in SHARED if Path(path).expanduser().exists()]
    lines = ["set -e"]
    for path, option in mounts:
        inside = system / path.lstrip("/")
        if Path(path).is_dir():
            inside.mkdir(parents=True, exist_ok=True)
        elif not inside.exists():
            inside.parent.mkdir(parents=True, exist_ok=True)
            inside.unlink(missing_ok=True)
            inside.touch()
        lines.append(f"mount {option} '{path}' '{inside}'")
    lines.append(f"exec chroot '{system}' /bin/sh -ec 'cd /{TREE}; {script}'")
    kept = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "QGIS", "MAKE", "MFLAGS"))}
    environment = {**kept, "PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "LANG": "C.UTF-8", "LC_ALL": "C.UTF-8"}
    return subprocess.run(["unshare", "--mount", "/bin/sh", "-c", "\n".join(lines)], env=environment).returncode


def test_script(torch: str, builds: str) -> str:
    """Return a script that runs the tests, with PyTorch if there is a CPU build for the Python of the system."""
    probe = f"pip install --dry-run --quiet --break-system-packages --no-deps --retries 0 --index-url {builds}"
    return f"""
git init --quiet .; git -c safe.directory=/{TREE} add --all
if {probe} --only-binary=:all: "{torch}" >/dev/null 2>&1; then torch="{torch}"; else torch=""
    echo "There is no CPU build of PyTorch for this Python: the network runs with OpenCV."
fi
make TORCH="$torch" TORCH_BUILDS="{builds}" {os.environ.get("TESTS", "test-qgis")}
"""


def main() -> int:
    """Run the tests; the command line has the system, a version of PyTorch, the address of its builds, and packages."""
    name, torch, builds, *packages = sys.argv[1:]
    if os.geteuid() != 0:
        sys.exit("Only root can build and enter another system: run make as root, or with sudo.")
    system = make_system(name, packages)
    copy_tree(system / TREE)
    return run_inside(system, test_script(torch, builds))


if __name__ == "__main__":
    sys.exit(main())
