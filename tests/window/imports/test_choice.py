"""Texts of the import with the labels of the window."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from PySide6.QtWidgets import QCheckBox, QLabel

from dearig.errors import InputError, Note
from dearig.window.imports.choice import LABELS, with_labels
from dearig.window.imports.dialog import ImportDialog
from tests.cli.test_hints import hinted
from tests.test_errors import ROOT
from tests.window.imports.test_dialog import Here

PATH = Path("in.csv")


@pytest.mark.parametrize(
    ("text", "path", "shown"),
    [
        ("plain", None, "plain"),
        (Note("no rate", "rate_Hz"), None, "no rate (“Rate”)"),
        (Note("no film", ("rig_file", "load_g")), None, "no film (“Film and load”)"),
        (InputError("run.h5 is there", option="force"), None, "run.h5 is there"),
        (
            InputError("in.csv, line 2: bad", option="skip_bad_rows"),
            PATH,
            "Line 2: bad (“Leave out bad rows”)",
        ),
    ],
)
def test_texts_name_fields_of_the_window(text, path, shown):
    assert with_labels(text, path) == shown


def test_every_option_of_an_import_has_a_label():
    folder = ROOT / "app/recording/importers"
    found = hinted("option", folder) | hinted("answers", folder)
    assert {"rate_Hz", "rig_file", "skip_bad_rows", "table"} <= found
    assert found <= LABELS.keys()


def test_every_label_is_one_of_the_dialog(session, qtbot):
    dialog = ImportDialog(session, Here(), PATH)
    qtbot.addWidget(dialog)
    texts = [w.text() for kind in (QLabel, QCheckBox) for w in dialog.findChildren(kind)]
    known = {re.sub(r" \(.*", "", text.replace("&", "")) for text in texts}
    known |= {"Quantity", "Scale"}  # heads of the table of columns
    assert {name for text in LABELS.values() for name in re.findall("“(.*?)”", text)} <= known
