#!/usr/bin/env bash
# Qt Widgets: a number field with arrows of a German locale shows 0.5 as it was typed, and returns 5.
#
# Expected: a text with the sign of another language is not acceptable, or is read as it is shown.
# Seen: the text stays 0.5 and is called acceptable; value() is 5.0, for the point is left out when the text is read.
#     In a field of the C locale the comma is: 0,5 is 5.0.
# Version: PySide6-Essentials 6.11.3 (Qt 6.11.3), platform plugin offscreen.
# Who is hurt: who types set points of an instrument (mm, kV) on a computer of another language: what is set is ten times what the field shows.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check \
  "PySide6-Essentials==6.11.3"
cat >finding.py <<'EOF'
from PySide6.QtCore import QLocale, qVersion
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QDoubleSpinBox

print("Qt", qVersion())
application = QApplication([])


def typed(language, keys):
    field = QDoubleSpinBox(minimum=0.001, maximum=1000.0, decimals=3, value=2.0)
    field.setLocale(QLocale(language))
    field.show()
    field.lineEdit().clear()
    QTest.keyClicks(field, keys)
    print(f"{language}, keys {keys}: shows {field.lineEdit().text()}, "
          f"acceptable {field.hasAcceptableInput()}, value {field.value()}")
    return field.value()


seen = [typed(language, keys) for language in ("C", "de_DE") for keys in ("0.5", "0,5")]
assert seen == [0.5, 5.0, 5.0, 0.5], "changed"
EOF
QT_QPA_PLATFORM=offscreen venv/bin/python finding.py
