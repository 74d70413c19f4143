"""``import dearig`` costs nothing, and its names are there when they are used."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

import dearig

HEAVY = {"numpy", "scipy", "numba", "h5py", "matplotlib", "PySide6", "pydantic", "pandas", "typer"}


def modules_after(code: str) -> set[str]:
    """Names of the packages that a fresh interpreter has imported after ``code``."""
    program = f"import sys, json\n{code}\nprint(json.dumps(sorted(sys.modules)))"
    ran = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    return set(json.loads(ran.stdout))


def test_importing_the_package_imports_none_of_its_parts() -> None:
    modules = modules_after("import dearig")
    assert not {name.partition(".")[0] for name in modules} & HEAVY
    assert {name for name in modules if name.startswith("dearig.")} == set()


def test_opening_a_recording_needs_no_plotting_and_no_window() -> None:
    modules = modules_after("import dearig; dearig.open")
    assert not {name.partition(".")[0] for name in modules} & {"matplotlib", "PySide6", "pandas"}


def test_a_fit_waits_for_no_library_that_it_may_not_need() -> None:
    modules = modules_after("from dearig.model.diagnosis import diagnose")
    # each takes half a second or more
    assert not modules & {"scipy.stats", "scipy.signal", "matplotlib", "pandas"}


@pytest.mark.parametrize("name", dearig.__all__)
def test_every_name_of_the_interface_is_there_and_documented(name: str) -> None:
    assert name in dir(dearig)
    value = getattr(dearig, name)
    assert isinstance(value, str) or value.__doc__


def test_a_name_that_is_not_there_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="'dearig' has no attribute 'opne'"):
        dearig.opne  # noqa: B018


def test_errors_of_the_interface_are_those_of_the_program() -> None:
    from dearig.errors import InputError

    assert dearig.InputError is InputError
    assert issubclass(dearig.InputError, dearig.DearigError)
