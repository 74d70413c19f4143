"""Runs one after the other in one process: nothing of a run is left when it is over."""

from __future__ import annotations

import threading
from pathlib import Path

import psutil

from dearig.acquisition.run import record
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import parse_sequence
from tests.tools.command import LOBE
from tests.tools.daqmx import served

RIG = RigFile.model_validate(
    {
        "film": {"name": "A7"},
        "card": {"sample_rate_Hz": 200.0, "do_hv_enable": "port0/line0"},
    }
)


def test_runs_on_a_card_leave_no_task_process_thread_or_file(tmp_path: Path) -> None:
    me = psutil.Process()
    others = set(me.children(recursive=True))  # of earlier tests, such as a tracker of resources
    with served(RIG, client_timeout=60.0) as card:
        address = f"daqmx:Dev1@127.0.0.1:{card.server.port}"

        def run(number: int) -> tuple[set[str], int]:
            out = tmp_path / f"run-{number}.h5"
            record(parse_sequence(LOBE, "the lobe", tmp_path), address, RIG, out)
            assert card.device.state.tasks == {}
            assert set(me.children(recursive=True)) <= others
            # what belongs to the server grows up to its pool
            own = {t.name for t in threading.enumerate() if not t.name.startswith("daqmx")}
            return own, len(me.open_files())

        first = run(0)  # loads and compiles what is needed
        for number in range(1, 3):
            assert run(number) == first
