"""A field of a recording that lists show is one line."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> dict[str, object]:
    """What each list shows of a recording with one more text and one more condition."""
    ran = subprocess.run(
        [sys.executable, "-m", "tests.recording.content.one_more_field",
         str(tmp_path_factory.mktemp("fields"))],
        env={**os.environ, "QT_QPA_PLATFORM": "offscreen"},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    found: dict[str, object] = json.loads(ran.stdout)
    return found


@pytest.mark.parametrize(
    ("of", "expected"),
    {
        "described": ["0one", 100.0],
        "shown": "0one",
        "index": ["0one", 100.0],
        "window": "0one",
        "study": ["0one", 100.0],
        "study_shown": True,
        "trends": ["bias"],
        "names": "007",
        "differ": {"lot": ["0one", "0two"], "bias (V)": ["100.0", "300.0"]},
        "imported": "0one",
    }.items(),
    ids=str,
)
def test_a_field_of_one_line_is_in(shown: dict[str, object], of: str, expected: object) -> None:
    assert shown[of] == expected


def test_a_field_of_one_line_is_in_the_terminal_index(shown: dict[str, object]) -> None:
    assert "0two" in str(shown["lines"]).split()
