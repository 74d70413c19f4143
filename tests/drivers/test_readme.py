"""The instrument that drivers/README.md shows passes the contract that it names."""

from __future__ import annotations

import re
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from dearig.drivers.contract.laser import LaserContract
from dearig.drivers.instruments.laser import LaserDriver
from dearig.drivers.settings import LaserSettings

README = Path(__file__).parents[2] / "drivers" / "README.md"
BLOCKS = re.findall(r"^```python\n(.*?)^```", README.read_text(encoding="utf-8"), re.M | re.S)


def acme_laser() -> LaserDriver:
    found: dict[str, Any] = {}
    exec(next(block for block in BLOCKS if "class AcmeLaser" in block), found)  # noqa: S102
    driver: LaserDriver = found["AcmeLaser"]()
    return driver


@contextmanager
def simulated_acme(reading: float | None, answers: bool, agrees: bool) -> Iterator[str]:
    """The address of a port at which the controller of the document answers, or is silent."""
    shown = "-" if reading is None else f"{reading * 1e3:.3f}"
    answer = f"{shown},{4.0 if agrees else 5.0:.3f}\r".encode()

    def serve() -> None:
        while not over.is_set():
            caller, _ = listener.accept()
            with caller:
                while (asked := caller.recv(64)) and answers:
                    caller.sendall(answer * asked.count(b"?"))

    over = threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=serve)
        thread.start()
        try:
            yield f"socket://127.0.0.1:{listener.getsockname()[1]}"
        finally:
            over.set()
            socket.create_connection(listener.getsockname()).close()
            thread.join()


class TestAcme(LaserContract):
    @contextmanager
    def connected(
        self, *, reading: float | None = LaserContract.PLACE, answers: bool = True,
        agrees: bool = True,
    ) -> Iterator[tuple[LaserDriver, LaserSettings]]:  # fmt: skip
        with simulated_acme(reading, answers, agrees) as port:
            yield acme_laser(), LaserSettings(driver="acme", port=port)
