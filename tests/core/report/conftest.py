"""Pages in a browser: QtWebKit, where it is installed."""

import json
import os
import subprocess
import sys

import pytest

BROWSER = """
import json, os, sys
try:
    from PyQt5.QtCore import QSize
    from PyQt5.QtWebKitWidgets import QWebPage
    from PyQt5.QtWidgets import QApplication
except ImportError:
    os._exit(77)
application, page = QApplication([]), QWebPage()
page.setViewportSize(QSize(int(sys.argv[2]), 1000))
page.mainFrame().setHtml(open(sys.argv[1], encoding="utf-8").read())
for script in json.loads(sys.argv[3]):
    print(json.dumps(page.mainFrame().evaluateJavaScript(script)))
sys.stdout.flush()
os._exit(0)  # WebKit crashes where Python removes it
"""


@pytest.fixture
def in_browser(tmp_path):
    """Run scripts in a page of a width in pixels, and return their values."""

    def run(html, scripts, width=1000):
        file = tmp_path / "page.html"
        file.write_text(html, encoding="utf-8")
        command = [sys.executable, "-c", BROWSER, str(file), str(width), json.dumps(scripts)]
        environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen"}
        ended = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60)
        if ended.returncode == 77:
            pytest.skip("QtWebKit is not installed.")
        assert ended.returncode == 0, ended.stderr
        return [json.loads(line) for line in ended.stdout.splitlines()]

    return run
