"""What people type as numbers and lists is read in one way, or refused with both."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dearig.window.kit.fields import shown_value
from dearig.window.kit.number_text import NumberTextError, read_number, read_numbers


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("3,5; 6,5", [3.5, 6.5]),
        ("3,5;6,5", [3.5, 6.5]),
        ("4,5 7,5 0", [4.5, 7.5, 0.0]),
        ("4,5, 7,5, 0", [4.5, 7.5, 0.0]),
        ("6.5, 7", [6.5, 7.0]),
        ("6 , 7", [6.0, 7.0]),
        ("3 4 5", [3.0, 4.0, 5.0]),
        ("3; 5;", [3.0, 5.0]),  # the next value is being typed
        ("3,5;", [3.5]),
        ("100, 200", [100.0, 200.0]),
        ("0,500; 1,2", [0.5, 1.2]),
        ("-1; \N{MINUS SIGN}2,5", [-1.0, -2.5]),
        ("1e3", [1000.0]),
        ("", []),
    ],
)
def test_a_list_is_read(text: str, values: list[float]) -> None:
    assert read_numbers(text) == values


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("3,5", r'"3,5" may be 3\.5 or 3; 5'),
        ("1,2,3", r"may be 1; 2; 3 or, with decimal commas, 1\.2; 3"),
        ("1,2,3 4", "may be 1; 2; 3 or"),
        ("3 ,5", "may be a decimal comma or separate two values"),
        ("3,5 6.5", 'decimal point and "3,5" a decimal comma'),
        ("6.5,7 8", '"6.5,7" is not a number'),
        ("100 200", r"may be 2 values or one \(100200\)"),
        ("10 000; 20 000", "thousands separator: write 10000"),
        ("1,500; 2", "may be 1.5 or 1500"),
        ("3, 7; 5 8", "separate all values by semicolons"),
        ("3;;5", "a value is missing"),
        ("3,, 5", "a value is missing"),
        ("; 3", "a value is missing"),
        ("3; x", '"x" is not a number'),
    ],
)
def test_a_list_that_may_mean_two_things_is_refused(text: str, words: str) -> None:
    with pytest.raises(NumberTextError, match=words):
        read_numbers(text)


@pytest.mark.parametrize(
    ("text", "value"),
    [("3,5", 3.5), (",5", 0.5), ("3,", 3.0), ("1.500", 1.5), ("0,500", 0.5), ("12,3456", 12.3456)],
)
def test_a_number_is_read(text: str, value: float) -> None:
    assert read_number(text) == value


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1,500", r"may be 1\.5 or 1500"),
        ("1.234,5", r"write 1234\.5"),
        ("1,234,567.5", r"write 1234567\.5"),
        ("1 500", "write 1500"),
        ("1'500", "write 1500"),
        ("1_500", "write 1500"),
        ("nan", "is not a number"),
        ("inf", "is not a number"),
        ("1e999", "too large"),
        ("\N{ARABIC-INDIC DIGIT ONE}", "is not a number"),
        ("6.5 kV", "is not a number"),
        ("3,5,6", "is not a number"),
    ],
)
def test_what_is_no_number_is_refused(text: str, words: str) -> None:
    with pytest.raises(NumberTextError, match=words):
        read_number(text)


def test_a_point_in_a_whole_number_may_separate_thousands() -> None:
    with pytest.raises(NumberTextError, match="may be 10 or 10000"):
        read_number("10.000", whole=True)


numbers = st.decimals(min_value=-1000, max_value=1000, places=2).map(lambda d: f"{d.normalize():f}")


@given(
    st.lists(numbers, min_size=1, max_size=6), st.sampled_from(["; ", ";", " ; "]), st.booleans()
)
def test_between_semicolons_point_and_comma_mean_the_same(
    texts: list[str], separator: str, comma: bool
) -> None:
    typed = separator.join(texts) + ("" if len(texts) > 1 else ";")
    typed = typed.replace(".", ",") if comma else typed
    assert read_numbers(typed) == [float(text) for text in texts]


@given(st.lists(st.floats(-1e6, 1e6).map(lambda x: float(f"{x:.10g}")), max_size=6))
def test_what_is_shown_is_read_back(values: list[float]) -> None:
    assert read_numbers(shown_value(values)) == values


@given(st.text("0123456789,.; -+e'_\u00a0", max_size=12))
def test_a_comma_between_digits_never_separates(text: str) -> None:
    """Whatever is read, each number has the digits of one piece of the text, in their order."""
    try:
        values = read_numbers(text)
    except NumberTextError:
        return
    pieces = [piece for piece in text.replace(", ", " ").replace(";", " ").split() if piece != ","]
    assert values == [float(piece.rstrip(",").replace(",", ".")) for piece in pieces]


@given(st.text(max_size=20))
def test_any_text_is_read_or_refused_with_a_sentence(text: str) -> None:
    for read in (read_number, read_numbers):
        said = "a number"
        try:
            read(text)
        except NumberTextError as error:
            said = str(error)
        assert said
