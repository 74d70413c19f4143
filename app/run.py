"""One run: sequence -> gate -> rig -> recording, and 0 V at the end whatever happens."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from pathlib import Path

from app.errors import InputError, InstrumentFault
from app.progress import Progress, quiet
from app.recording.writer import RecordingWriter
from app.rigfile import RigFile
from app.sequencefile import LoadedSequence
from drivers.errors import AddressError, RefusedWaveform, RigError
from drivers.gate import GatedWaveform, admit
from drivers.rig import Rig
from model.actuator import Actuator, Drive
from model.errors import ModelError
from model.kernel import PULL_IN
from model.kinematics import thinning
from model.material import TABLE_3
from sim_backend.factory import is_simulated, open_simulated_rig

__all__ = ["RunResult", "gate_sequence", "open_rig", "record"]

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class RunResult:
    """A run that was recorded: where, how much, how it ended, and what happened on the way."""

    path: Path
    samples: int
    rate_Hz: float
    outcome: str
    events: tuple[str, ...]


def open_rig(address: str, rig_file: RigFile, *, seed: int, paced: bool) -> Rig:
    """The rig at ``address``. Raises ``InputError`` for an address that names none."""
    try:
        if is_simulated(address):
            return open_simulated_rig(
                address, rig_file, rig_file.as_film(), rig_file.as_load(), seed=seed, paced=paced
            )
    except (AddressError, ModelError) as error:
        raise InputError(str(error)) from error
    if address.startswith("daqmx:"):
        raise InputError(
            f"rig {address!r}: this version drives simulated rigs only; write sim or sim:SEED"
        )
    raise InputError(f"rig {address!r} is not known: write sim, or sim:SEED such as sim:7")


def gate_sequence(loaded: LoadedSequence, rig_file: RigFile) -> GatedWaveform:
    """The sequence sampled on the rig's clock and passed through the gate.

    The true field is predicted with the model of the rig file's film (Table 3's network): a
    stretched film is thinner. Raises ``InputError`` with a sentence for every limit it breaks.
    """
    rate = float(rig_file.card.sample_rate_Hz)
    name = loaded.sequence.name
    try:
        time, voltage = loaded.sequence.sample(rate)
        actuator = Actuator(rig_file.as_film(), rig_file.as_load(), TABLE_3)
        response = actuator.simulate(Drive(time, voltage, hold=True))
    except ModelError as error:
        raise InputError(f"sequence {name!r}: {error}") from error
    if response.status == PULL_IN:
        raise InputError(f"sequence {name!r} is refused: the model predicts {response.in_words}")
    if not response.ok:
        raise InputError(
            f"sequence {name!r} is refused: the film's thickness could not be predicted "
            f"({response.in_words})"
        )
    thin = thinning(actuator.film.held, response.stretch) / actuator.film.thickness
    try:
        return admit(voltage, rate, rig_file.gate_limits(), thin)
    except RefusedWaveform as error:
        raise InputError(
            f"sequence {name!r} is refused: {'; '.join(error.reasons)} (limits of the rig file)"
        ) from error


def record(
    loaded: LoadedSequence,
    address: str,
    rig_file: RigFile,
    configuration: str,
    out: str | Path,
    *,
    seed: int = 0,
    paced: bool = False,
    operator: str = "",
    film_id: str = "",
    notes: str = "",
    overwrite: bool = False,
    progress: Progress = quiet,
) -> RunResult:
    """Play ``loaded`` on the rig at ``address`` and record it to ``out``.

    ``configuration`` is the text of the rig file, kept with the recording. Raises ``InputError``
    before anything is touched, ``InstrumentFault`` for what fails during the run, after the
    rig was made safe and the recording was closed; a ``KeyboardInterrupt`` passes through in the
    same way.
    """
    waveform = gate_sequence(loaded, rig_file)
    rig = open_rig(address, rig_file, seed=seed, paced=paced)
    try:
        return _record_on(
            rig, waveform, loaded, rig_file, configuration, out, seed, operator, film_id, notes,
            overwrite, progress,
        )  # fmt: skip
    finally:
        rig.close()


def _record_on(
    rig: Rig,
    waveform: GatedWaveform,
    loaded: LoadedSequence,
    rig_file: RigFile,
    configuration: str,
    out: str | Path,
    seed: int,
    operator: str,
    film_id: str,
    notes: str,
    overwrite: bool,
    progress: Progress,
) -> RunResult:
    try:
        rate = rig.load(waveform)
    except RefusedWaveform as error:
        raise InputError(f"the rig refuses the sequence: {error}") from error
    except RigError as error:
        raise InstrumentFault(str(error)) from error
    samples = waveform.voltage.size
    writer = RecordingWriter(
        out, rig.identify(), rate, samples, loaded.toml, rig_file.as_film(), rig_file.as_load(),
        configuration, operator=operator, film_id=film_id, notes=notes, seed=seed,
        overwrite=overwrite,
    )  # fmt: skip
    events: list[str] = []
    outcome = "interrupted; the rig was made safe"
    try:
        rig.arm()
        rig.start()
        while (block := rig.read()) is not None:
            writer.append(block)
            for event in block.events:
                events.append(f"{event.level}: {event.message}")
                log.log(_LEVELS.get(event.level, logging.INFO), "%s", event.message)
            progress("recording", writer.samples / samples)
        outcome = "finished"
    except KeyboardInterrupt:
        _ramp_down(rig, writer)
        raise
    except RigError as error:
        outcome = f"instrument fault: {error}"
        raise InstrumentFault(
            f"{error}; the rig was made safe, and what was recorded is in {out}"
        ) from error
    finally:
        # 0 V first: a disk that is slow or full must not keep the voltage up
        rig.make_safe()
        writer.close(outcome)
    return RunResult(Path(out), writer.samples, rate, outcome, tuple(events))


_LEVELS = {"info": logging.INFO, "warning": logging.WARNING, "fault": logging.ERROR}


def _ramp_down(rig: Rig, writer: RecordingWriter) -> None:
    """Take the voltage down in the set time, recording it; a second ctrl-C ends that at once."""
    writer.event(writer.samples, "warning", "interrupted by the operator: ramping down to 0 V")
    rig.stop()
    while (block := rig.read()) is not None:
        writer.append(block)
