"""Apply the rules of the plugin site to the zip: layout, size, metadata, and findings of bandit and detect-secrets."""

from __future__ import annotations

import configparser
import json
import subprocess
import sys
import tempfile
from pathlib import Path

from package import ARCHIVE, PLUGIN, unpack

MAX_BYTES = 25_000_000
"""Largest size that the site accepts."""

KEYS = (
    "name",
    "qgisMinimumVersion",
    "description",
    "about",
    "version",
    "author",
    "email",
    "icon",
    "tags",
)


OF_THE_OWNER = ("repository", "tracker", "homepage")
"""Addresses that the owner of the repository fills in before the first upload; until then no link leads there."""


def layout_findings(plugin: Path) -> list[str]:
    """List what the site refuses apart from code."""
    metadata = _general(plugin)
    findings = [f"metadata.txt lacks {key}" for key in KEYS if not metadata.get(key)]
    findings += [f"{name} is missing" for name in ("__init__.py", "LICENSE") if not (plugin / name).is_file()]
    if not (plugin / metadata.get("icon", "-")).is_file():
        findings.append("the icon that metadata.txt names is missing")
    findings += [f"{path} does not belong in a zip" for path in plugin.rglob("*") if path.suffix in (".pyc", ".so")]
    if ARCHIVE.stat().st_size > MAX_BYTES:
        findings.append(f"the zip has {ARCHIVE.stat().st_size} bytes, more than {MAX_BYTES}")
    return findings


def _general(plugin: Path) -> configparser.SectionProxy:
    """Return the metadata of the plugin."""
    metadata = configparser.ConfigParser(interpolation=None)
    metadata.read(plugin / "metadata.txt", encoding="utf-8")
    return metadata["general"]


def bandit_findings(plugin: Path) -> list[str]:
    """List the findings of bandit in the code."""
    report = _json_of("bandit", "--recursive", "--format", "json", "--quiet", str(plugin))
    return [
        f"{issue['filename']}:{issue['line_number']} {issue['test_id']} {issue['issue_text']}"
        for issue in report["results"]
    ]


def secret_findings(plugin: Path) -> list[str]:
    """List what detect-secrets takes for a password or a key."""
    report = _json_of("detect_secrets", "scan", "--all-files", str(plugin))
    return [
        f"{path}:{item['line_number']} {item['type']}" for path, items in report["results"].items() for item in items
    ]


def _json_of(module: str, *options: str) -> dict:
    """Run a Python tool that prints JSON; bandit exits with 1 if it finds something."""
    run = subprocess.run([sys.executable, "-m", module, *options], capture_output=True, text=True)
    if run.returncode not in (0, 1):
        sys.exit(f"{module} failed: {run.stderr}")
    return json.loads(run.stdout)


def main() -> None:
    """Print the findings and exit with 1 if there are any."""
    with tempfile.TemporaryDirectory() as folder:
        unpack(ARCHIVE, Path(folder))
        plugin = Path(folder) / PLUGIN
        findings = layout_findings(plugin) + bandit_findings(plugin) + secret_findings(plugin)
        unfilled = [key for key in OF_THE_OWNER if not _general(plugin).get(key)]
    if unfilled:
        print(f"Before the upload, fill in {', '.join(unfilled)} in metadata.txt.")
    print(*findings, f"{ARCHIVE.name}: {ARCHIVE.stat().st_size} bytes, {len(findings)} findings", sep="\n")
    sys.exit(bool(findings))


if __name__ == "__main__":
    main()
