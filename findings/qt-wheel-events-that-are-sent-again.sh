#!/usr/bin/env bash
# Qt Widgets: a wheel event that a program sends does not go on to the parent of a widget that ignores it.
#
# Expected: sendEvent() treats a QWheelEvent as the window system does: a widget that ignores it passes it to its parent.
# Seen: from the window system the parent gets it; sent by sendEvent() to the same child it ends there, not accepted.
#     Mouse presses that are sent do reach the parent.
# Version: PySide6-Essentials 6.11.3 (Qt 6.11.3), platform plugin offscreen.
# Who is hurt: who keeps the wheel from a field of an instrument's window and sends the event on, so that the page scrolls:
#     nothing scrolls. Tests that send wheel events to a child take another way than an operator's wheel.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check \
  "PySide6-Essentials==6.11.3"
cat >finding.py <<'EOF'
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt, qVersion
from PySide6.QtGui import QMouseEvent, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget

print("Qt", qVersion())
application = QApplication([])
reached = []


class Parent(QWidget):
    def wheelEvent(self, event):
        reached.append("wheel")

    def mousePressEvent(self, event):
        reached.append("press")


parent = Parent()
parent.resize(200, 200)
child = QWidget(parent)  # ignores both
child.setGeometry(0, 0, 200, 200)
parent.show()
application.processEvents()
at, notch, none = QPointF(50, 50), QPoint(0, -120), Qt.KeyboardModifier.NoModifier


def reaches(what):
    reached.clear()
    what()
    application.processEvents()
    return bool(reached)


def sent_wheel():
    application.sendEvent(child, QWheelEvent(
        at, at, QPoint(), notch, Qt.MouseButton.NoButton, none, Qt.ScrollPhase.NoScrollPhase, False))


def sent_press():
    left = Qt.MouseButton.LeftButton
    application.sendEvent(child, QMouseEvent(QEvent.Type.MouseButtonPress, at, at, left, left, none))


seen = {
    "wheel of the window system": reaches(lambda: QTest.wheelEvent(parent.windowHandle(), at, notch)),
    "wheel that is sent": reaches(sent_wheel),
    "press that is sent": reaches(sent_press),
}
for what, there in seen.items():
    print(f"{what}: {'reaches' if there else 'does not reach'} the parent")
assert [*seen.values()] == [True, False, True], "changed"
EOF
QT_QPA_PLATFORM=offscreen venv/bin/python finding.py
