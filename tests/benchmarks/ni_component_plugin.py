"""Plugin of pytest for NI's component tests; it is loaded in NI's source tree, not in this one.

It gives the tests the server at ``$NI_TESTS_PORT`` and its card, leaves out those that need the
driver on this computer, and writes one line of JSON per test to ``$NI_TESTS_OUT``.
"""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import Any

import grpc
import pytest
from nidaqmx import GrpcSessionOptions
from nidaqmx._grpc_interpreter import GrpcStubInterpreter
from nidaqmx.system import System

CARD = os.environ["NI_TESTS_CARD"]
_IN_PLACE_OF = ("PCIe-6363",)  # products in whose place the card is used
_called = ""  # name of the last call to the server


class _Server:
    """Server that runs already, in place of NI's class that starts one."""

    server_port = int(os.environ["NI_TESTS_PORT"])

    def __enter__(self) -> _Server:
        return self

    def __exit__(self, *_: object) -> None:
        pass


def pytest_configure(config: pytest.Config) -> None:
    """Answer what marks ask the driver while the tests are collected, and note each call."""
    channel = grpc.insecure_channel(f"localhost:{_Server.server_port}")
    there = GrpcSessionOptions(channel, "")
    System.local = staticmethod(lambda: System.remote(grpc_options=there))  # type: ignore[method-assign]
    invoke = GrpcStubInterpreter._invoke

    def noted(self: Any, func: Any, request: Any, metadata: Any = None) -> Any:
        global _called
        _called = func._method.decode().rpartition("/")[2]
        return invoke(self, func, request, metadata)

    GrpcStubInterpreter._invoke = noted  # type: ignore[method-assign]
    config.pluginmanager.register(_Choice())


class _Choice:
    """Hooks that need NI's conftest."""

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, config: pytest.Config, items: list[Any]) -> None:
        """Choose the card for every X Series device; deselect tests of the local driver."""
        from tests import conftest  # of NI's source tree

        conftest.GrpcServerProcess = _Server  # type: ignore[attr-defined]
        by_type = conftest._device_by_product_type  # type: ignore[attr-defined]

        def by_product_type(product: str, kind: Any, system: Any) -> Any:
            if product in _IN_PLACE_OF:
                return system.devices[CARD]
            return by_type(product, kind, system)

        conftest._device_by_product_type = by_product_type  # type: ignore[attr-defined]
        conftest._x_series_device = (  # type: ignore[attr-defined]
            lambda _, system, *__, **___: system.devices[CARD]
        )
        local = {i for i in items if "library_init_kwargs" in i.nodeid}
        config.hook.pytest_deselected(items=list(local))
        items[:] = [i for i in items if i not in local]


def _reason(report: Any) -> str:
    """Return the cause of a failure or a skip, without what differs from test to test."""
    if report.skipped:
        text = str(report.longrepr[2] if isinstance(report.longrepr, tuple) else report.longrepr)
        found = re.search(r"Could not detect an? (.+?) (?:device )?(?:that|within|within)", text)
        return f"needs another device: {found[1]}" if found else text.removeprefix("Skipped: ")
    crash = getattr(report.longrepr, "reprcrash", None)
    text = crash.message if crash is not None else str(report.longrepr)
    if "UNIMPLEMENTED" in text:
        return f"not simulated: {_called}"
    code = re.search(r"Status Code: (-?\d+)", text)
    # what is asked for; the names of tasks are numbered
    named = re.findall(
        r"(?:Property|Device Specified|Custom Scale Name|Source Terminal): [^;.\n]+", text
    )
    if code is not None and "AssertionError" not in text:
        return f"DAQmx {code[1]} in {_called}; {'; '.join(named)}".rstrip("; ")
    first = text.splitlines()[0][:120] if text else ""
    place = f"{Path(crash.path).name}: " if crash is not None else ""
    return place + re.sub(r"0x[0-9a-f]+|<\d+>", "", first)


def pytest_runtest_logreport(report: Any) -> None:
    """Write the outcome of a test."""
    if report.passed and report.when != "call":
        return
    if report.when == "teardown" and not report.failed:
        return
    line = {
        "test": report.nodeid,
        "outcome": report.outcome,
        "expected": hasattr(report, "wasxfail"),
        "reason": "" if report.passed else _reason(report),
    }
    with Path(os.environ["NI_TESTS_OUT"]).open("a", encoding="utf-8") as out:
        out.write(json.dumps(line) + "\n")
