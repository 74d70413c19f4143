"""One case of the campaign: a run as an operator starts it, what is done to it, what is seen.

The run is ``dearig record`` in a process of its own, with its guardian, on a simulated card behind
a server in this process; whether the film is at 0 V is read off the simulated wire.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import psutil

from dearig.config.rigfile import load_rig_file
from dearig.drivers.settings import LaserSettings
from dearig.errors import DearigError
from dearig.recording import open_recording
from dearig.sim_backend.clock import PacedClock
from dearig.sim_backend.daqmx.opening import open_device
from dearig.sim_backend.daqmx.protocol.server import DaqmxServer
from dearig.sim_backend.daqmx.simulated_card import SimulatedCard
from dearig.sim_backend.faults import FaultKind, FaultPlan
from dearig.sim_backend.keyence import SimulatedController
from dearig.sim_backend.serial_port import serve_on_socket
from tests.campaign.link import Link
from tests.campaign.trouble import ACTS, Load, Run, hostile_files, planted_code_ran, stalling_disk
from tests.tools.command import thesis_model

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
{watchdog}
[limits]
ramp_down_s = 0.3
[laser]
port = "{port}"
"""
ENABLE = "port0/line0"
WATCHDOG = f'do_hv_enable = "{ENABLE}"\nhv_enable_watchdog_s = 1.0'
NO_WATCHDOG = "i_have_no_watchdog = true"

ZERO = 50.0  # V at the film that count as 0
LEAD_IN = 0.3  # s
#: A kind with this before its name happens to a hold, while the voltage answers the readings.
HOLD = "hold-"
HOLD_LEAD_IN, HOLD_RISE = 2.0, 0.5  # s
HOLD_FOR = 12  # s
SAMPLE_RATE = 1000.0  # Hz, as a rig file has it by default
EARLIEST, LATEST = 0.7, 2.7  # s after the start: when trouble sets in
STARTS_WITHIN = 120.0  # s, on a machine that is busy
ENDS_WITHIN = 60.0  # s
FLUSH = 0.25 + 0.2  # s of a run that a kill may take: since the last flush, and two blocks
RAMP = 0.3 + 0.1  # s, and a block
# s that a response may take after the detection: after one fault, or under a load of 20 processes
RESPONSE, RESPONSE_LOADED = 0.5, 1.0
RESPONSE_HARDWARE = 0.1  # s; after two faults the card itself responds
STALL = 10.0  # s
LOST = 0.4  # s; blocks that the machine had not delivered yet
ARMING = "client-frozen-arming"
ARMING_LATEST = 0.05  # s after the enable line went high; longer than a run takes to start
_FREEZES = "client-frozen"  # kinds after which the run is let go on


@dataclass(frozen=True)
class Expected:
    """How a run has to end.

    ``codes`` are its exit codes. The trouble is detected within ``detection`` s; infinity stands
    for a trouble that does not end the run. ``ramp`` says whether the voltage is then ramped down,
    ``faults`` how many parts fail at once. ``event`` is part of an event in the recording, ``said``
    part of what the terminal says. ``recorded`` is False where nothing may be recorded.
    """

    codes: tuple[int, ...]
    detection: float = 0.0
    ramp: bool = False
    faults: int = 1
    load: int = 0
    watchdog: bool = True
    event: str = ""
    said: str = ""
    recorded: bool = True

    @property
    def bound(self) -> float:
        """Time in s until 0 V."""
        response = RESPONSE_LOADED if self.load else RESPONSE
        if self.faults > 1:
            response = RESPONSE_HARDWARE
        return self.detection + RAMP * self.ramp + response


_KILLED = (-signal.SIGKILL,)
_ENABLE_LOW = 1.0  # s; hv_enable_watchdog_s above
_FROZEN = 1.0  # s; guardian.timeout_s, by default
_UNANSWERED = 0.5  # s; an acknowledgement of the guardian
_LOOK = 1.0  # s between two looks at the file
_NOT_SAFE = "NOT CONFIRMED"
_DEAF = Expected((4,), _ENABLE_LOW, said=_NOT_SAFE)  # no one can reach the card but its watchdog

#: Trouble -> how it has to end.
KINDS: dict[str, Expected] = {
    "arc": Expected((3,), event="interlock"),
    "film-rupture": Expected((3,), event="interlock"),
    "amplifier-trip": Expected((3,), event="interlock"),
    "monitor-wire-off": Expected((3,), event="interlock"),
    "electrode-open": Expected((3,), 2.0, ramp=True, event="interlock"),
    "sensor-stuck": Expected((3,), 0.5, ramp=True, event="interlock"),
    "sensor-out-of-range": Expected((3,), ramp=True, event="interlock"),
    "sensor-noise-burst": Expected((3,), ramp=True, event="interlock"),
    "ai-overflow": Expected((4,), event="instrument fault"),
    # seen when samples stop coming, and the output is asked why
    "ao-underflow": Expected((4,), 0.5, event="instrument fault"),
    "short-read": Expected((0,), np.inf),
    # longer than the guardian's patience
    "late-reply": Expected((3, 4), _FROZEN, event="fault"),
    "server-frozen": _DEAF,
    "server-gone": Expected((4,), 0.5, said=_NOT_SAFE),
    "link-cut": _DEAF,
    "link-silent": _DEAF,
    "link-delayed": _DEAF,
    # a new connection may get through
    "link-corrupted": Expected((4,), _ENABLE_LOW),
    "link-trickling": _DEAF,
    "serial-garbage": Expected((4,), recorded=False),
    "client-killed": Expected(_KILLED),
    "client-killed-loaded": Expected(_KILLED, load=20),
    "client-killed-hostile-folder": Expected(_KILLED),
    "client-frozen": Expected((4,), _FROZEN, event="fault"),
    # before or just after the clock starts: nothing may be enabled when it goes on
    ARMING: Expected((4,), _FROZEN, said="the guardian acted"),
    "client-frozen-loaded": Expected((4,), _FROZEN, event="fault", load=20),
    "guardian-killed": Expected((4,), ramp=True, event="guardian"),
    "guardian-killed-loaded": Expected((4,), ramp=True, event="guardian", load=20),
    "guardian-frozen": Expected((4,), _UNANSWERED, ramp=True, event="guardian"),
    "guardian-frozen-client-killed": Expected(_KILLED, _ENABLE_LOW, faults=2),
    "both-killed": Expected(_KILLED, _ENABLE_LOW, faults=2),
    # nothing can be done then, so the run has to say so beforehand
    "both-killed-no-watchdog": Expected(
        _KILLED, np.inf, faults=2, watchdog=False, said="nothing takes the voltage down if run and"
    ),
    # seen when the file next grows: it is extended by a second, and written every quarter of one
    "disk-full": Expected((4,), 1.25, ramp=True),
    "disk-stalled": Expected((0,), np.inf),
    "file-deleted": Expected((4,), _LOOK, ramp=True),
    "file-replaced": Expected((4,), _LOOK, ramp=True),
    "folder-renamed": Expected((4,), _LOOK, ramp=True),
    "operator-stops": Expected((130,), ramp=True, event="interrupted by the signal SIGTERM"),
    "hold-client-killed": Expected(_KILLED),
    "hold-client-frozen": Expected((4,), _FROZEN, event="fault"),
    "hold-guardian-frozen": Expected((4,), _UNANSWERED, ramp=True, event="guardian"),
    "hold-both-killed": Expected(_KILLED, _ENABLE_LOW, faults=2),
    "hold-operator-stops": Expected((130,), ramp=True, event="interrupted by the signal SIGTERM"),
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
    expected = KINDS[kind]
    folder = folder / f"{kind}-{seed}"
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "recordings").mkdir(parents=True)
    out, stalled = folder / "recordings" / "run.h5", folder / "stalled"
    garbled = kind == FaultKind.SERIAL_GARBAGE
    moment = _begins(kind) + float(
        np.random.default_rng((seed, *kind.encode())).uniform(EARLIEST, LATEST)
    )
    rig_file, sequence = folder / "rig.toml", folder / "sequence.toml"
    with ExitStack() as stack:
        port = stack.enter_context(_laser_port(garbled))
        watchdog = WATCHDOG if expected.watchdog else NO_WATCHDOG
        rig_file.write_text(RIG.format(port=port, watchdog=watchdog), encoding="utf-8")
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
        server = stack.enter_context(DaqmxServer(device, client_timeout=tracking))
        link = stack.enter_context(Link(server.port, seed))
        load = stack.enter_context(Load(expected.load))
        environment = dict(os.environ)
        if kind == "disk-stalled":
            environment = stack.enter_context(stalling_disk(stalled))
        if kind == "client-killed-hostile-folder":
            hostile_files(folder)
        process = subprocess.Popen(
            [
                # -P: the console script that an operator starts has no working folder on its path
                sys.executable, "-P", "-m", "dearig", *_asked(kind, folder, sequence),
                "--rig", f"daqmx:Dev1@127.0.0.1:{link.port}",
                "--rig-file", str(rig_file), "--out", str(out),
            ],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=folder,
            env=environment,
        )  # fmt: skip
        try:
            run = Run(process, out, link, stalled, STALL, load)
            return _observe(kind, seed, moment, run, device, clock, patience)
        except (RuntimeError, TimeoutError) as error:
            return Outcome(kind, seed, moment, None, process.poll(), "", [str(error)])
        finally:
            _end(process)


def _asked(kind: str, folder: Path, sequence: Path) -> list[str]:
    """Return the command with its own arguments: a hold, or the run of ``sequence``."""
    if not kind.startswith(HOLD):
        return ["record", str(sequence)]
    model = str(thesis_model(folder / "model.toml"))
    return ["hold", "0.6", "--model", model, "--for", f"{HOLD_FOR}s", "--rise-s", f"{HOLD_RISE}"]


def _begins(kind: str) -> float:
    """Return the time in s of the run at which the first trouble may set in, less ``EARLIEST``."""
    return HOLD_LEAD_IN + HOLD_RISE if kind.startswith(HOLD) else 0.0


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
    run: Run,
    device: SimulatedCard,
    clock: PacedClock,
    patience: float,
) -> Outcome:
    expected = KINDS[kind]
    bound = expected.bound + patience
    struck = None
    before = 0.0
    if kind == ARMING:
        _wait(lambda: device.line(ENABLE), STARTS_WITHIN)
        freeze = clock.now() + np.random.default_rng(seed).uniform(0.0, ARMING_LATEST)
        _wait(lambda: clock.now() >= freeze, STARTS_WITHIN)
        run.children = psutil.Process(run.process.pid).children(recursive=True)
        os.kill(run.process.pid, signal.SIGSTOP)
    elif expected.recorded:
        start = _started(run.process, device) - (HOLD_LEAD_IN if kind.startswith(HOLD) else LEAD_IN)
        run.children = psutil.Process(run.process.pid).children(recursive=True)
        struck = start + moment
        act = ACTS.get(kind.removeprefix(HOLD))
        if act is not None:
            _wait(lambda: clock.now() >= struck, _begins(kind) + LATEST + 1.0)
            struck = clock.now()
            act(run)
        if _FREEZES in kind:
            end = struck + bound
            _wait(lambda: device.wire_voltage() == 0.0 or clock.now() > end, bound + 5.0)
            before = device.wire_voltage()
            os.kill(run.process.pid, signal.SIGCONT)
    enabled = kind == ARMING and _goes_on_and_enables(run.process, device, clock, bound)
    try:
        run.process.wait(ENDS_WITHIN)
        _kill_stopped(run.children, lambda: device.wire_voltage() == 0.0, bound)
        printed, said = run.process.communicate(timeout=ENDS_WITHIN)
    except subprocess.TimeoutExpired:
        return Outcome(kind, seed, moment, None, None, "", ["it did not end"])
    # whoever comes late is given time to spoil it: for as long as a guardian takes
    _wait(lambda: not any(child.is_running() for child in run.children), 10.0)
    wrong = ["the amplifier was enabled again"] if enabled else []
    history = device.history()
    # the wire is noted when it leaves 0 V and when it is back
    standing = [change.time for change in history if change.wire != 0.0]
    to_zero = None
    if struck is not None:
        after = [c.time for c in history if standing and c.time > standing[-1]]
        to_zero = max(0.0, after[0] - struck) if after else np.inf
        if bound < np.inf and to_zero > bound:
            wrong.append(f"0 V after {to_zero:.3f} s, {bound:.3f} s are allowed")
    elif standing and kind != ARMING:
        wrong.append("there was a voltage")
    if abs(before) > ZERO:
        wrong.append(f"{before:.0f} V at the end of the freeze")
    stays = kind == "both-killed-no-watchdog"
    if not stays and (abs(device.wire_voltage()) > ZERO or device.line(ENABLE)):
        wrong.append(
            f"at the end: {device.wire_voltage():.0f} V, enable line {device.line(ENABLE)}"
        )
    wrong += _terminal_faults(expected, run.process.returncode, printed, said)
    if planted_code_ran(run.out.parents[1]):
        wrong.append("a module of the working folder was imported")
    wrong += _recording_faults(kind, expected, moment, run)
    said = " ".join(said.split())
    return Outcome(kind, seed, moment, to_zero, run.process.returncode, said[-400:], wrong)


def _goes_on_and_enables(
    process: subprocess.Popen[str], device: SimulatedCard, clock: PacedClock, bound: float
) -> bool:
    """Let a run that has just been frozen go on after ``bound`` s, when its guardian has acted.

    Returns True if a voltage can come back: the enable line goes high, or the output leaves 0 V.
    """
    end = clock.now() + bound
    _wait(lambda: clock.now() > end, bound + 5.0)
    os.kill(process.pid, signal.SIGCONT)
    high = False  # polled: the deterministic interleavings are in tests/drivers/daqmx

    def ended() -> bool:
        nonlocal high
        high = high or device.line(ENABLE) or device.output_voltage() != 0.0
        return process.poll() is not None

    _wait(ended, ENDS_WITHIN)
    return high


def _kill_stopped(children: list[psutil.Process], down: Callable[[], bool], bound: float) -> None:
    """End a frozen guardian, which outlives a run that is killed, when ``bound`` s have passed."""
    for child in children:
        if child.is_running() and child.status() == psutil.STATUS_STOPPED:
            end = time.monotonic() + bound
            _wait(lambda: down() or time.monotonic() > end, bound + 5.0)  # noqa: B023
            child.kill()


def _terminal_faults(expected: Expected, code: int, printed: str, said: str) -> Iterator[str]:
    last = said.splitlines()[-1] if said else ""
    said = " ".join(f"{printed} {said}".split())
    if code not in expected.codes:
        yield f"exit code {code}, not {expected.codes}"
    if "Traceback" in said:
        yield "a traceback"
    if code not in (0, -signal.SIGKILL) and not last.startswith(("dearig: ", "the guardian ")):
        yield f"the terminal ends with {last!r}"
    if expected.said not in said:
        yield f"the terminal does not say {expected.said!r}"


def _recording_faults(kind: str, expected: Expected, moment: float, run: Run) -> list[str]:
    found = sorted(run.out.parents[1].rglob("*.h5"))
    if not expected.recorded:
        return ["there is a recording"] if found else []
    if run.process.returncode == 0 and found != [run.out]:
        return [f"the run ended well, and left {found}"]
    if kind in ("file-deleted", "file-replaced"):
        # its data were saved in a copy, or are gone and the run says so
        found = [path for path in found if path != run.out or kind == "file-deleted"]
        if not found:
            return []
    if kind == ARMING and not found:
        return []  # there was no sample
    if len(found) != 1:
        return [f"{len(found)} recordings"]
    try:
        recording = open_recording(found[0])
    except DearigError as error:
        return [f"the recording cannot be read: {error}"]
    wrong = []
    seconds = recording.samples / SAMPLE_RATE
    if kind != ARMING and seconds < moment - FLUSH - LOST:
        wrong.append(f"{seconds:.2f} s were recorded of {moment:.2f} s")
    if expected.event and not any(expected.event in event.message for event in recording.events):
        wrong.append(f"no event {expected.event!r} in the recording")
    if -signal.SIGKILL not in expected.codes and kind != "disk-full" and not recording.complete:
        wrong.append("the recording was not closed")
    return wrong


def _started(run: subprocess.Popen[str], device: SimulatedCard) -> float:
    """When the voltage rose first, on the card's clock."""

    def up() -> bool:
        if run.poll() is not None:
            said = run.stderr.read() if run.stderr else ""
            raise RuntimeError(f"the run ended before it began (exit {run.returncode}): {said}")
        return abs(device.wire_voltage()) > ZERO

    _wait(up, STARTS_WITHIN)
    # the wire leaves 0 V with the first sample of the ramp
    return next(c.time for c in device.history() if c.wire != 0.0)


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
    for stream in (run.stdout, run.stderr):
        if stream is not None:
            stream.close()
