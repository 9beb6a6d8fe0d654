"""Every widget and dialog of ours is made, painted and used with PyQt6."""

from configparser import ConfigParser
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("PyQt6.QtWidgets", exc_type=ImportError)

import qgis_stub as stub
from PyQt6.QtCore import QEvent, QPoint, QPointF, QSize, Qt, QUrl
from PyQt6.QtGui import QKeyEvent, QMouseEvent, QPixmap, QWheelEvent
from PyQt6.QtTest import QTest
from PyQt6.QtWidgets import QApplication, QComboBox, QMainWindow, QPushButton, QTextBrowser, QTextEdit

stub.install()

NO_KEYS, LEFT = Qt.KeyboardModifier.NoModifier, Qt.MouseButton.LeftButton


def turn(widget):
    """Turn the wheel over a widget by one notch."""
    place = QPointF(widget.rect().center())
    no_button, phase = Qt.MouseButton.NoButton, Qt.ScrollPhase.NoScrollPhase
    event = QWheelEvent(place, place, QPoint(0, 0), QPoint(0, -120), no_button, NO_KEYS, phase, False)
    QApplication.sendEvent(widget, event)
    return event


def seen(widget, width=400, height=300):
    """Return the colours that a widget paints."""
    widget.resize(width, height)
    image = widget.grab().toImage()
    return {image.pixelColor(x, y).name() for x in range(0, image.width()) for y in range(0, image.height())}


def test_the_section_is_painted(application):
    from rail_extract.rail_extract_plugin.review.section_view import PAPER, POINT, RAIL, SectionView
    from rail_extract.rail_extract_plugin.review.sections import Picture

    view = SectionView()
    rails = np.array([[-0.75, 0.0], [0.75, 0.0]])
    view.show_picture(Picture(rails + [0.01, 0.005], rails, np.array([False, True]), 0.072))
    assert {one.name() for one in (PAPER, POINT, RAIL)} <= seen(view)
    assert view.sizeHint() == QSize(340, 260)


def test_the_wheel_passes_over_a_list(application):
    from rail_extract.rail_extract_plugin.dialog.wheel import ignore_wheel

    combo = QComboBox()
    combo.addItems(["one", "two"])
    ignore_wheel(combo)
    combo.show()
    assert not turn(combo).isAccepted()
    assert combo.currentIndex() == 0


def test_a_link_in_a_log_is_followed_by_a_click(application):
    from rail_extract.rail_extract_plugin.links import LinkFollower, links

    followed, log = [], QTextEdit()
    log.setHtml(links.to("here", lambda: followed.append(1)))
    follower = LinkFollower(log)
    log.resize(300, 100)
    log.show()
    place = log.cursorRect().center() + QPoint(12, 0)
    for kind in (QEvent.Type.MouseMove, QEvent.Type.MouseButtonRelease):
        event = QMouseEvent(kind, QPointF(place), QPointF(place), LEFT, LEFT, NO_KEYS)
        follower.eventFilter(log.viewport(), event)
    assert log.viewport().cursor().shape() == Qt.CursorShape.PointingHandCursor
    QTest.qWait(20)
    assert followed == [1]
    links.register()
    links.open(QUrl("railextract:nothing"))
    links.deregister()


@pytest.fixture
def dialog(application, monkeypatch, tmp_path):
    from rail_extract.rail_extract_plugin.runs.run_dialog import RunDialog

    picture = QPixmap(240, 60)
    picture.fill(Qt.GlobalColor.red)
    picture.save(str(tmp_path / "picture.png"))
    monkeypatch.setattr(stub, "PICTURE", (tmp_path / "picture.png").as_uri())
    made = RunDialog(stub.Nothing())
    yield made
    made.close()


def test_the_dialog_offers_steps_and_fits_its_help(application, dialog):
    from rail_extract.core.errors import UnclassifiedError

    ran = []
    dialog.mainWidget().wrappers["CLASSIFY"] = stub.Nothing()
    dialog.run_again = ran.append
    dialog._failure = UnclassifiedError
    dialog.after_run(False, {}, None)
    (item,) = dialog.messageBar().items
    assert "Find the rail points" in dialog.findChild(QTextEdit, "txtLog").toPlainText()
    item.findChild(QPushButton).click()
    assert ran == [{"CLASSIFY": True}]
    assert not turn(dialog.mainWidget().combo).isAccepted()
    assert not turn(dialog.mainWidget().number).isAccepted()
    dialog.resize(180, 700)
    dialog.show()
    application.processEvents()
    browser = dialog.findChild(QTextBrowser, "textShortHelp")
    assert browser.width() < 240
    assert browser.horizontalScrollBar().maximum() == 0


def test_a_message_about_missing_packages_has_a_link(application):
    from rail_extract.rail_extract_plugin.runs.missing import with_link
    from rail_extract.rail_extract_plugin.setup.dependencies import PACKAGES

    assert 'href="railextract:' in with_link("It needs torch.", PACKAGES[-1:])


def test_the_welcome_leads_on(application, monkeypatch):
    from rail_extract.rail_extract_plugin import welcome

    opened, bar = [], stub.MessageBar()
    monkeypatch.setattr(welcome, "open_installation", lambda: opened.append("packages"))
    monkeypatch.setattr(welcome, "missing_packages", lambda needs: [SimpleNamespace(module="laspy")])
    shown = welcome.Welcome(bar, lambda: opened.append("sample"))
    bar.items[0].findChild(QPushButton).click()
    monkeypatch.setattr(welcome, "missing_packages", lambda needs: [])
    welcome.notices.packages_installed.emit()
    bar.items[0].findChild(QPushButton).click()
    assert opened == ["packages", "sample"]
    shown.show()
    assert bar.items == []
    shown.remove()


def definition(**values):
    """A parameter as the wrappers see it."""
    return SimpleNamespace(**{name: (lambda value=value: value) for name, value in values.items()})


def test_lists_of_choices_and_of_standards(application):
    from rail_extract.rail_extract_plugin.dialog.choice_widget import ChoiceWidgetWrapper
    from rail_extract.rail_extract_plugin.dialog.standard_widget import StandardWidgetWrapper

    facts = {"allowMultiple": False, "flags": 0}
    one = ChoiceWidgetWrapper(definition(name="MODEL", options=["AUTO", "fast", "base"], **facts))
    one.setValue("base")
    assert (one.value(), one.widget.count()) == ("base", 3)
    standard = StandardWidgetWrapper(definition(name="STANDARD", options=["EN_60E1_1435", "IN_75R_1000"], **facts))
    standard.setValue("IN_75R_1000")
    standard.remember()
    later = StandardWidgetWrapper(definition(name="STANDARD", options=["EN_60E1_1435", "IN_75R_1000"], **facts))
    later.postInitialize([])
    assert later.value() == "IN_75R_1000"


def test_the_widget_for_clouds(application):
    from rail_extract.rail_extract_plugin.dialog.cloud_widget import CloudWidget

    widget = CloudWidget(lambda: [("my cloud", "id")])
    changes = []
    widget.changed.connect(lambda: changes.append(widget.value()))
    widget.set_value("my cloud")
    assert widget.value() == "id"
    widget.combo.setEditText("/data/typed.laz")
    assert (widget.value(), changes[-1]) == ("/data/typed.laz", "/data/typed.laz")
    assert len(seen(widget)) > 1


class Window:
    """The part of QGIS's interface that the dock uses."""

    def __init__(self):
        self.window = QMainWindow()

    def mainWindow(self):
        return self.window

    def mapCanvas(self):
        return stub.Nothing()


def test_the_dock_is_painted_and_has_keys(application):
    from rail_extract.rail_extract_plugin.review.dock import ReviewDock

    window = Window()
    dock = ReviewDock(window)
    window.window.addDockWidget(Qt.DockWidgetArea.RightDockWidgetArea, dock)
    window.window.show()
    window.window.activateWindow()
    pressed = []
    for name, button in dock.buttons.items():
        button.setEnabled(True)
        button.clicked.disconnect()
        button.clicked.connect(lambda _, name=name: pressed.append(name))
    dock.widget().setFocus()
    application.processEvents()
    for key in (Qt.Key.Key_N, Qt.Key.Key_P, Qt.Key.Key_A, Qt.Key.Key_R):
        QTest.keyClick(dock.widget(), key)
    assert pressed == ["next", "previous", "accepted", "rejected"]
    assert len(seen(dock)) > 3
    dock.close_for_good()


def test_rails_are_clicked_on_the_map(application, monkeypatch):
    from rail_extract.rail_extract_plugin.growing.tool import ClickTool, GrowRails

    done = []
    tool = ClickTool(stub.Nothing(), done.append, lambda: done.append("undo"), lambda: done.append("accept"))
    mouse = SimpleNamespace(button=lambda: LEFT, mapPoint=lambda: "place")
    tool.canvasReleaseEvent(mouse)
    for key in (Qt.Key.Key_Backspace, Qt.Key.Key_Return):
        tool.keyPressEvent(QKeyEvent(QEvent.Type.KeyPress, key, NO_KEYS))
    assert done == ["place", "undo", "accept"]
    window = QMainWindow()
    grown = GrowRails(stub.Nothing(), stub.Nothing(), window)
    bar = window.addToolBar("Rail Extract")
    bar.addActions(grown.actions)
    bar.addWidget(grown.standards)
    grown.undo_action.trigger()
    assert (grown.standards.count() > 10, grown.undo_action.isEnabled()) == (True, False)
    assert len(seen(bar)) > 2


def test_the_windows_come_and_go(application):
    from rail_extract.rail_extract_plugin.windows import Windows

    window, entries = QMainWindow(), []
    iface = SimpleNamespace(
        mainWindow=lambda: window,
        mapCanvas=stub.Nothing,
        messageBar=stub.MessageBar,
        activeLayer=lambda: None,
        addDockWidget=window.addDockWidget,
        removeDockWidget=window.removeDockWidget,
        addToolBar=window.addToolBar,
        addPluginToMenu=lambda menu, entry: entries.append(entry.text()),
        removePluginMenu=lambda menu, entry: entries.remove(entry.text()),
        initializationCompleted=stub.Nothing(),
    )
    windows = Windows(iface)
    assert {"Extract Rails…", "Grow Rails", "Review Findings", "Install Packages…", "Help"} <= set(entries)
    assert not windows.dock.isVisible()
    windows.remove()
    assert entries == []


def test_the_metadata_admit_qgis_4():
    metadata = ConfigParser(interpolation=None)
    metadata.read(Path(__file__).resolve().parents[2] / "metadata.txt", encoding="utf-8")
    facts = metadata["general"]
    assert (facts["qgisMinimumVersion"], facts["qgisMaximumVersion"], facts["supportsQt6"]) == ("3.22", "4.99", "True")


def test_every_module_with_widgets_loads():
    root = Path(__file__).resolve().parents[2] / "rail_extract_plugin"
    modules = [path for path in root.rglob("*.py") if "QtWidgets import" in path.read_text(encoding="utf-8")]
    assert len(modules) > 10
    for path in modules:
        import_module(".".join(("rail_extract.rail_extract_plugin", *path.relative_to(root).with_suffix("").parts)))
