"""Errors in Python name the arguments that they are about, in a note."""

from __future__ import annotations

import pytest

from dearig.api.arguments import named_arguments
from dearig.errors import InputError


@named_arguments
def given(drive: str = "", *, overwrite: bool = False) -> str:
    """Take both."""
    if drive == "same":
        return drive
    raise InputError("wrong", option=("drive", "force", "rate_Hz"))


def test_an_error_names_the_arguments_that_the_function_has():
    with pytest.raises(InputError, match="wrong") as error:
        given("monitor", overwrite=True)
    assert error.value.__notes__ == ["see the arguments drive, overwrite"]


def test_what_is_right_is_returned():
    assert given("same") == "same"
    assert given.__name__ == "given"
