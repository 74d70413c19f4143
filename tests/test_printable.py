"""Text for terminals: nothing in it acts on them."""

from __future__ import annotations

import io
import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dearig.printable import PrintableStream, printable
from dearig.units import in_digits


def test_what_a_terminal_obeys_is_shown_as_an_escape() -> None:
    assert printable("a\x1b[2Jb\x07\x9b31m\x7f") == r"a\x1b[2Jb\x07\x9b31m\x7f"
    assert printable("abc\u202edef\u2066\u200b\ufeff") == r"abc\u202edef\u2066\u200b\ufeff"
    assert printable("a\nb\r\tc\u2028d") == r"a\nb\r\tc\u2028d"
    assert printable("file-\udcff.h5") == r"file-\udcff.h5"
    assert printable("\U000e0041") == r"\U000e0041"


def test_names_of_people_and_units_stay() -> None:
    for name in ("Müller, 5 µm", "测量 3", "می\u200cشود", "8\u202fkV", "Ωm²", "👩\u200d🔬"):
        assert printable(name) == name


def test_a_long_text_is_cut_in_the_middle() -> None:
    cut = printable("a" * 50_000_000 + "b", most=100)
    assert len(cut) <= 100
    assert cut.startswith("aaa")
    assert cut.endswith("ab")


@given(st.text(alphabet=st.characters()))
def test_no_control_or_format_character_is_left(text: str) -> None:
    shown = printable(text)
    left = {unicodedata.category(c) for c in shown if c not in "\u200c\u200d"}
    assert not left & {"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"}
    shown.encode("utf-8")  # no lone surrogate
    assert printable(shown) == shown


def test_a_stream_passes_lines_and_no_controls() -> None:
    raw = io.StringIO()
    stream = PrintableStream(raw)
    assert stream.write("a\x1b[0m\n") == 6
    stream.writelines(["b\n", "\x07"])
    assert raw.getvalue() == "a\\x1b[0m\nb\n\\x07"
    assert stream.isatty() is False


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("an error of 1.8e+04 um", "an error of 18000 um"),
        ("-2e+03, and no more.", "-2000, and no more."),
        ("1.8e+04.", "18000."),
        ("3e+09 samples, 2e-05 s", "3e+09 samples, 2e-05 s"),
        ("run-1e+04.h5, a/1e+04/b, x1e+04", "run-1e+04.h5, a/1e+04/b, x1e+04"),
    ],
)
def test_thousands_are_written_in_digits(text: str, shown: str) -> None:
    assert in_digits(text) == shown
