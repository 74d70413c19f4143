"""One case of the campaign: a run as an operator starts it, what is done to it, what is seen.

The run is ``dearig record`` in a process of its own, with its guardian, on a simulated card behind
a server in this process; whether the film is at 0 V is read off the simulated wire.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import psutil

from dearig.config.rigfile import load_rig_file
from dearig.drivers.settings import LaserSettings
from dearig.errors import DearigError
from dearig.recording import open_recording
from dearig.sim_backend.clock import PacedClock
from dearig.sim_backend.daqmx.device import Device
from dearig.sim_backend.daqmx.opening import open_device
from dearig.sim_backend.daqmx.server import DaqmxServer
from dearig.sim_backend.faults import FaultKind, FaultPlan
from dearig.sim_backend.keyence import SimulatedController
from dearig.sim_backend.serial_port import serve_on_socket

__all__ = ["KINDS", "Outcome", "run_case"]

#: 3.5 to 6.5 kV most of the time, so that whatever happens happens at voltage.
SEQUENCE = """\
name = "campaign"
lead_in_s = 0.3
tail_s = 0.2
[[segment]]
kind = "ramp"
to_kV = 5.0
duration_s = 0.3
[[segment]]
kind = "sine"
amplitude_kV = 1.5
offset_kV = 5.0
frequency_Hz = 0.75
cycles = 3.0
[[segment]]
kind = "ramp"
to_kV = 0.0
duration_s = 0.3
"""

RIG = """\
[film]
name = "campaign"
[card]
do_hv_enable = "port0/line0"
hv_enable_watchdog_s = 1.0
[limits]
ramp_down_s = 0.3
[laser]
port = "{port}"
"""

ZERO = 50.0  # V at the film that count as 0
LEAD_IN = 0.3  # s
SAMPLE_RATE = 1000.0  # Hz, as a rig file has it by default
EARLIEST, LATEST = 0.7, 2.7  # s after the start: when trouble sets in
STARTS_WITHIN = 120.0  # s, on a machine that is busy
ENDS_WITHIN = 60.0  # s
FLUSH = 0.25 + 0.2  # s of a run that a kill may take: since the last flush, and two blocks
RAMP = 0.3 + 0.1  # s, and a block
LATE = 0.4  # s for whatever the machine does meanwhile


@dataclass(frozen=True)
class Expected:
    """How a run ends: its exit ``codes``, 0 V within ``bound`` s, ``event`` in the recording."""

    codes: tuple[int, ...]
    bound: float
    event: str = ""
    recorded: bool = True


#: Trouble -> how it has to end.
KINDS: dict[str, Expected] = {
    "arc": Expected((3,), LATE + 0.1, "interlock"),
    "film-rupture": Expected((3,), LATE + 0.1, "interlock"),
    "amplifier-trip": Expected((3,), LATE + 0.1, "interlock"),
    "monitor-wire-off": Expected((3,), LATE + 0.1, "interlock"),
    "electrode-open": Expected((3,), 2.0 + RAMP + LATE, "interlock"),
    "sensor-stuck": Expected((3,), 0.5 + RAMP + LATE, "interlock"),
    "sensor-out-of-range": Expected((3,), RAMP + LATE, "interlock"),
    "sensor-noise-burst": Expected((3,), RAMP + LATE, "interlock"),
    "ai-overflow": Expected((4,), LATE + 0.1, "instrument fault"),
    # seen when samples stop coming, and the output is asked why
    "ao-underflow": Expected((4,), 0.5 + LATE, "instrument fault"),
    "short-read": Expected((0,), np.inf),
    # longer than the guardian's patience
    "late-reply": Expected((3, 4), 1.0 + 0.5, "fault"),
    # nobody can reach the card: its watchdog takes the enable line low
    "server-frozen": Expected((4,), 1.0 + 0.5, "THE RIG COULD NOT BE MADE SAFE"),
    "server-gone": Expected((4,), 0.5 + LATE, "THE RIG COULD NOT BE MADE SAFE"),
    "serial-garbage": Expected((4,), 0.0, recorded=False),
    "client-killed": Expected((-signal.SIGKILL,), 0.5),
    "client-frozen": Expected((4,), 1.0 + 0.5, "fault"),
    "guardian-killed": Expected((4,), RAMP + LATE, "guardian"),
    # seen when the file next grows: it is extended by a second, and written every quarter of one
    "disk-full": Expected((4,), 1.25 + RAMP + LATE),
    "operator-stops": Expected((130,), RAMP + LATE, "interrupted by the operator"),
}


@dataclass(frozen=True)
class Outcome:
    """What was seen of a case, times in s; ``wrong`` is empty where all was well."""

    kind: str
    seed: int
    moment: float
    to_zero: float | None
    exit_code: int | None
    said: str
    wrong: list[str] = field(default_factory=list)


def run_case(kind: str, seed: int, folder: Path, patience: float = 0.0) -> Outcome:
    """Let ``kind`` of trouble, drawn by ``seed``, happen to a run recorded in ``folder``.

    ``patience`` in s is added to the time that is allowed until 0 V.
    """
    folder.mkdir(parents=True, exist_ok=True)
    out = folder / f"{kind}-{seed}.h5"
    out.unlink(missing_ok=True)
    garbled = kind == FaultKind.SERIAL_GARBAGE
    moment = float(np.random.default_rng((seed, *kind.encode())).uniform(EARLIEST, LATEST))
    rig_file, sequence = folder / f"{kind}-{seed}.toml", folder / f"{kind}-{seed}-sequence.toml"
    with _laser_port(garbled) as port:
        rig_file.write_text(RIG.format(port=port), encoding="utf-8")
        sequence.write_text(SEQUENCE, encoding="utf-8")
        settings = load_rig_file(rig_file)
        faults = FaultPlan.parse([f"{kind}@{moment:.6f}"] if kind in set(FaultKind) else [])
        clock = PacedClock()
        device = open_device(
            "sim", settings, settings.as_film(), settings.as_load(), seed=seed, clock=clock,
            faults=FaultPlan() if garbled else faults,
        )  # fmt: skip
        # NI's own server does not watch its clients: only a link that is cut asks for that
        tracking = 1.0 if kind == FaultKind.SERVER_GONE else None
        with DaqmxServer(device, client_timeout=tracking) as server:
            run = subprocess.Popen(
                [
                    sys.executable, "-m", "dearig", "record", str(sequence),
                    "--rig", f"daqmx:Dev1@127.0.0.1:{server.port}",
                    "--rig-file", str(rig_file), "--out", str(out),
                ],
                stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                cwd=Path(__file__).parents[2],
            )  # fmt: skip
            try:
                return _observe(kind, seed, moment, run, device, clock, out, patience)
            except (RuntimeError, TimeoutError) as error:
                return Outcome(kind, seed, moment, None, run.poll(), "", [str(error)])
            finally:
                _end(run)


@contextmanager
def _laser_port(garbled: bool) -> Iterator[str]:
    """Address of a laser controller whose line is full of noise; else none is looked at."""
    if not garbled:
        yield ""
        return
    faults = FaultPlan.parse([f"{FaultKind.SERIAL_GARBAGE}@0"])
    controller = SimulatedController(LaserSettings(), lambda _: 0.0, faults=faults)
    with serve_on_socket(controller) as port:
        yield port


def _observe(
    kind: str,
    seed: int,
    moment: float,
    run: subprocess.Popen[str],
    device: Device,
    clock: PacedClock,
    out: Path,
    patience: float,
) -> Outcome:
    expected = KINDS[kind]
    bound = expected.bound + patience
    children: list[psutil.Process] = []
    struck = None
    if expected.recorded:
        start = _started(run, device)
        children = psutil.Process(run.pid).children(recursive=True)
        struck = start + moment
        if kind in _DO:
            _wait(lambda: clock.now() >= struck, LATEST + 1.0)
            struck = clock.now()
            _DO[kind](run, children, out)
        if kind == "client-frozen":
            end = struck + bound
            _wait(lambda: device.wire_voltage() == 0.0 or clock.now() > end, bound + 5.0)
            before = device.wire_voltage()
            os.kill(run.pid, signal.SIGCONT)
    try:
        _, said = run.communicate(timeout=ENDS_WITHIN)
    except subprocess.TimeoutExpired:
        return Outcome(kind, seed, moment, None, None, "", ["it did not end"])
    # whoever comes late is given time to spoil it: for as long as a guardian takes
    _wait(lambda: not any(child.is_running() for child in children), 10.0)
    wrong = []
    history = device.history()
    # the wire is noted when it leaves 0 V and when it is back
    standing = [change.time for change in history if change.wire != 0.0]
    to_zero = None
    if struck is not None:
        after = [c.time for c in history if standing and c.time > standing[-1]]
        to_zero = max(0.0, after[0] - struck) if after else np.inf
        if bound < np.inf and to_zero > bound:
            wrong.append(f"0 V after {to_zero:.3f} s, {bound:.3f} s are allowed")
    elif standing:
        wrong.append("there was a voltage")
    if kind == "client-frozen" and abs(before) > ZERO:
        wrong.append(f"{before:.0f} V at the end of the freeze")
    if abs(device.wire_voltage()) > ZERO or device.line("port0/line0"):
        wrong.append(
            f"at the end: {device.wire_voltage():.0f} V, enable line {device.line('port0/line0')}"
        )
    if run.returncode not in expected.codes:
        wrong.append(f"exit code {run.returncode}, not {expected.codes}")
    said = " ".join(said.split())
    if "Traceback" in said:
        wrong.append("a traceback")
    if run.returncode not in (0, -signal.SIGKILL) and "dearig: " not in said:
        wrong.append("no sentence on the terminal")
    wrong += _recording_faults(kind, expected, moment, out)
    return Outcome(kind, seed, moment, to_zero, run.returncode, said[-400:], wrong)


def _recording_faults(kind: str, expected: Expected, moment: float, out: Path) -> list[str]:
    if not expected.recorded:
        return ["there is a recording"] if out.exists() else []
    try:
        recording = open_recording(out)
    except DearigError as error:
        return [f"the recording cannot be read: {error}"]
    wrong = []
    seconds = recording.samples / SAMPLE_RATE
    if seconds < moment - FLUSH - LATE:
        wrong.append(f"{seconds:.2f} s were recorded of {moment:.2f} s")
    if expected.event and not any(expected.event in event.message for event in recording.events):
        wrong.append(f"no event {expected.event!r} in the recording")
    if kind != "client-killed" and kind != "disk-full" and not recording.complete:
        wrong.append("the recording was not closed")
    return wrong


def _started(run: subprocess.Popen[str], device: Device) -> float:
    """When the sample clock started, on the card's clock."""

    def up() -> bool:
        if run.poll() is not None:
            said = run.stderr.read() if run.stderr else ""
            raise RuntimeError(f"the run ended before it began (exit {run.returncode}): {said}")
        return abs(device.wire_voltage()) > ZERO

    _wait(up, STARTS_WITHIN)
    # the wire leaves 0 V with the first sample of the ramp
    return next(c.time for c in device.history() if c.wire != 0.0) - LEAD_IN


def _wait(until: Callable[[], bool], seconds: float) -> None:
    end = time.monotonic() + seconds
    while not until():
        if time.monotonic() > end:
            raise TimeoutError("what was waited for did not happen")
        time.sleep(0.005)


def _end(run: subprocess.Popen[str]) -> None:
    """Leave nothing behind, whatever went wrong."""
    if run.poll() is None:
        for child in psutil.Process(run.pid).children(recursive=True):
            child.kill()
        run.kill()
        run.wait()
    if run.stderr is not None:
        run.stderr.close()


def _fill_disk(run: subprocess.Popen[str], _: list[psutil.Process], out: Path) -> None:
    """From now on the file cannot grow, as on a full disk."""
    import resource

    size = out.stat().st_size
    resource.prlimit(run.pid, resource.RLIMIT_FSIZE, (size, size))


def _kill_guardian(_: subprocess.Popen[str], children: list[psutil.Process], __: Path) -> None:
    guardians = [c for c in children if any("guardian_process" in a for a in c.cmdline())]
    if len(guardians) != 1:
        raise RuntimeError(f"{len(guardians)} guardians are running")
    guardians[0].kill()


_Act = Callable[[subprocess.Popen[str], list[psutil.Process], Path], None]
_DO: dict[str, _Act] = {
    "client-killed": lambda run, *_: os.kill(run.pid, signal.SIGKILL),
    "client-frozen": lambda run, *_: os.kill(run.pid, signal.SIGSTOP),
    # as ctrl-C, which a program started in the background may have been told to ignore
    "operator-stops": lambda run, *_: os.kill(run.pid, signal.SIGTERM),
    "guardian-killed": _kill_guardian,
    "disk-full": _fill_disk,
}
