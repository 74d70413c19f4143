"""The tutorial shows what its commands print."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.docs import tutorial
from tests.docs.markdown import blocks
from tests.docs.tutorial import PAGE, Stale, numbers, renewed

PRINTED = """\
Step by step
                Training  Untouched
Model                 µm         µm
thesis's model     12.63       1.49
+ load inertia      1.06       1.05
"""


def test_lines_are_renewed_with_the_numbers_that_are_printed() -> None:
    shown = "Model    µm    µm\nthesis's model   1.60    1.4\n"
    assert renewed(shown, PRINTED) == (
        "Model                 µm         µm\nthesis's model     12.63       1.49\n"
    )


@pytest.mark.parametrize(
    "shown", ["+ moving mass   1.06   1.05\n", "+ load inertia  1.06  1.05\nStep by step\n"]
)
def test_a_line_that_is_not_printed_there_is_stale(shown: str) -> None:
    with pytest.raises(Stale, match="is not printed any more"):
        renewed(shown, PRINTED)


@pytest.mark.deep
def test_the_tutorial_shows_what_its_commands_print(tmp_path: Path) -> None:
    page = list(blocks(PAGE))
    shown = [block for block in page if block.language == "text"]
    played = list(tutorial.played(page, tmp_path))
    assert [block for block, _ in played] == shown
    for block, printed in played:
        for old, new in zip(
            block.text.splitlines(), renewed(block.text, printed).splitlines(), strict=True
        ):
            # another processor may fit to other last digits, and to other values of what the data
            # do not determine, which is in brackets
            if "(" in old:
                continue
            assert numbers(old) == pytest.approx(numbers(new), rel=0.05, abs=0.02), old
