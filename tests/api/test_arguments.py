"""Errors in Python name the arguments that they are about, in a note."""

from __future__ import annotations

import numpy as np
import pytest

import dearig
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


@named_arguments
def counted(seed: int = 0, rate: float = 1.0, *, overwrite: bool = False) -> tuple[object, ...]:
    """Return them."""
    return seed, rate, overwrite


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"overwrite": "false"}, "overwrite = 'false' is not True or False"),
        ({"overwrite": 1}, "overwrite = 1 is not True or False"),
        ({"seed": 1.5}, "seed = 1.5 is not a whole number"),
        ({"seed": True}, "seed = True is not a whole number"),
        ({"rate": "200"}, "rate = '200' is not a number"),
    ],
)
def test_an_argument_of_another_kind_is_refused(wrong, words):
    with pytest.raises(InputError, match=words):
        counted(**wrong)


def test_numbers_of_numpy_are_numbers():
    given = np.int64(3), np.float32(2.0)
    assert counted(*given, overwrite=np.True_) == (3, 2.0, True)


def test_a_recording_is_named_as_an_hdf5_file(tmp_path):
    with pytest.raises(InputError, match=r"end its name in \.h5") as error:
        dearig.record("thesis", path=tmp_path / "run.csv")
    assert error.value.__notes__ == ["see the argument path"]
