"""One run: sequence -> gate -> rig -> recording, and 0 V at the end whatever happens."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from pathlib import Path

from app.errors import DearigError, InputError, InstrumentFault, Interrupted
from app.interrupts import Interrupts
from app.plan import plan
from app.progress import Progress, quiet
from app.recording.files import check_output
from app.recording.writer import RecordingWriter
from app.rigfile import RigFile
from app.sequencefile import LoadedSequence
from drivers.errors import AddressError, RefusedWaveform, RigError
from drivers.gate import Margin
from drivers.rig import Rig
from model.actuator import Actuator
from sim_backend.factory import is_simulated, open_simulated_rig

__all__ = ["RunResult", "open_rig", "record"]

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class RunResult:
    """A run that was recorded: where, how much, how it ended, and what happened on the way.

    ``margins`` say how near it was planned to come to each limit of the gate.
    """

    path: Path
    samples: int
    rate_Hz: float
    outcome: str
    events: tuple[str, ...]
    margins: tuple[Margin, ...]


class _NotSafe(InstrumentFault):
    """The voltage may still be up."""


def open_rig(
    address: str,
    rig_file: RigFile,
    *,
    seed: int,
    paced: bool,
    actuator: Actuator | None = None,
) -> Rig:
    """The rig at ``address``. Raises ``InputError`` for an address that names none.

    ``actuator`` takes the place of the film that ``sim`` has by default.
    """
    if actuator is not None and address != "sim":
        raise InputError(f"rig {address!r} has a film of its own; only sim takes a model")
    try:
        if is_simulated(address):
            return open_simulated_rig(
                address, rig_file, rig_file.as_film(), rig_file.as_load(), seed=seed, paced=paced,
                actuator=actuator,
            )  # fmt: skip
    except AddressError as error:
        raise InputError(str(error)) from error
    except ValueError as error:  # a film that cannot hang at rest
        raise InputError(f"rig {address!r} with this rig file: {error}") from error
    if address.startswith("daqmx:"):
        raise InputError(
            f"rig {address!r}: this version drives simulated rigs only; write sim or sim:SEED"
        )
    raise InputError(f"rig {address!r} is not known: write sim, or sim:SEED such as sim:7")


def record(
    loaded: LoadedSequence,
    address: str,
    rig_file: RigFile,
    configuration: str,
    out: str | Path,
    *,
    seed: int = 0,
    paced: bool = False,
    actuator: Actuator | None = None,
    operator: str = "",
    film_id: str = "",
    notes: str = "",
    overwrite: bool = False,
    progress: Progress = quiet,
) -> RunResult:
    """Play ``loaded`` on the rig at ``address`` and record it to ``out``.

    ``configuration`` is the text of the rig file, kept with the recording; ``actuator`` is what the
    simulated rig ``sim`` is made of, where it is not Table 3's film. Raises ``InputError``
    before anything is touched; after the rig was made safe and the recording was closed,
    ``InstrumentFault`` or ``DiskFault`` for what failed during the run, and ``Interrupted`` where
    the operator ended it: the first ctrl-C ramps down in the set time, the second is 0 V at once.
    """
    out = check_output(out, overwrite)
    waveform = plan(loaded, rig_file, actuator).admitted()
    rig = open_rig(address, rig_file, seed=seed, paced=paced, actuator=actuator)
    try:
        with Interrupts() as interrupts:
            try:
                rate = rig.load(waveform)
                identity = rig.identify()
            except RefusedWaveform as error:
                raise InputError(f"the rig refuses the sequence: {error}") from error
            except RigError as error:
                raise InstrumentFault(str(error)) from error
            writer = RecordingWriter(
                out, identity, rate, waveform.voltage.size, loaded.toml, rig_file.as_film(),
                rig_file.as_load(), configuration, operator=operator, film_id=film_id,
                notes=notes, seed=seed, overwrite=overwrite,
            )  # fmt: skip
            events = _follow(rig, writer, waveform.voltage.size, interrupts, progress)
        return RunResult(out, writer.samples, rate, "finished", events, waveform.margins)
    finally:
        _close(rig)


def _follow(
    rig: Rig, writer: RecordingWriter, samples: int, interrupts: Interrupts, progress: Progress
) -> tuple[str, ...]:
    """Play what is loaded and record it; whatever happens, 0 V comes first, then the file's end."""
    events: list[str] = []
    try:
        try:
            _play(rig, writer, samples, interrupts, events, progress)
        finally:
            # 0 V first: a disk that is slow or full must not keep the voltage up
            interrupts.close()
            _make_safe(rig)
        if interrupts.asked():
            kept = _end(writer, "interrupted by the operator; ramped down to 0 V")
            raise Interrupted(f"interrupted: the voltage was ramped down to 0 V, and {kept}")
        if writer.samples == 0:
            raise InstrumentFault(f"the rig gave no samples; {_end(writer, 'no samples')}")
        writer.close("finished")
    except KeyboardInterrupt as error:
        kept = _end(
            writer, "interrupted by the operator", "interrupted by the operator: 0 V at once"
        )
        raise Interrupted(
            f"interrupted: the output was taken to 0 V at once, and {kept}"
        ) from error
    except RigError as error:
        kept = _end(writer, f"instrument fault: {error}", f"instrument fault: {error}", "fault")
        raise InstrumentFault(f"{error}; the rig was made safe, and {kept}") from error
    except DearigError as error:
        if writer.closed:
            raise
        kept = _end(writer, f"ended early: {error}", f"ended early: {error}", "fault")
        safe = "" if isinstance(error, _NotSafe) else "the rig was made safe, and "
        raise type(error)(f"{error}; {safe}{kept}") from error
    finally:
        # only what nobody foresaw comes here with an open file
        _end(writer, "ended early by a fault of the program")
    return tuple(events)


def _play(
    rig: Rig,
    writer: RecordingWriter,
    samples: int,
    interrupts: Interrupts,
    events: list[str],
    progress: Progress,
) -> None:
    rig.arm()
    if interrupts.asked():
        return
    rig.start()
    stopping = False
    while (block := rig.read()) is not None:
        writer.append(block)
        for event in block.events:
            events.append(f"{event.level}: {event.message}")
            log.log(_LEVELS.get(event.level, logging.INFO), "%s", event.message)
        progress("recording", writer.samples / samples)
        if interrupts.asked() and not stopping:
            stopping = True
            writer.event(
                writer.samples, "warning", "interrupted by the operator: ramping down to 0 V"
            )
            rig.stop()


def _make_safe(rig: Rig) -> None:
    try:
        rig.make_safe()
    except RigError as error:
        raise _NotSafe(
            f"THE RIG COULD NOT BE MADE SAFE ({error}): switch the amplifier's high voltage off "
            f"by hand"
        ) from error


def _close(rig: Rig) -> None:
    try:
        rig.close()
    except RigError as error:
        raise InstrumentFault(
            f"THE RIG COULD NOT BE CLOSED ({error}): see that the amplifier is at 0 V"
        ) from error


def _end(writer: RecordingWriter, outcome: str, event: str = "", level: str = "warning") -> str:
    """Close the recording of a run that ended early; where it is, in words.

    A disk that fails here too is one more thing to say, and must not hide what ended the run.
    """
    if writer.closed:
        return f"what was recorded is in {writer.path}"
    if writer.samples == 0:
        writer.discard()
        return "nothing was recorded"
    trouble = ""
    try:
        if event:
            writer.event(writer.samples - 1, level, event)
    except DearigError as error:
        trouble = str(error)
    try:
        writer.close(outcome)
    except DearigError as error:
        trouble = str(error)
    where = f"what was recorded is in {writer.path} ({writer.samples} samples)"
    return f"{where}; {trouble}" if trouble else where


_LEVELS = {"info": logging.INFO, "warning": logging.WARNING, "fault": logging.ERROR}
