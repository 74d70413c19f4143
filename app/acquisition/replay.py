"""Repetition of a run from its recording: sequence, rig file, rig and seed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from dearig.acquisition.rig_source import differences
from dearig.acquisition.rigs import is_simulated
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import LoadedSequence, parse_sequence
from dearig.config.toml_input import parse_toml
from dearig.errors import InputError
from dearig.model.film.material import Film, Load
from dearig.recording.reading.reader import open_recording

__all__ = ["Original", "original_of"]


@dataclass(frozen=True)
class Original:
    """Input of ``dearig.acquisition.run.record`` to repeat the run of the recording ``path``.

    ``configuration`` is the text of the rig file. ``rig`` is the address of the run, "" for data
    from elsewhere; ``seed`` is that of its simulated noise.
    """

    path: Path
    sequence: LoadedSequence
    rig_file: RigFile
    configuration: str
    rig: str
    seed: int
    film: Film | None
    load: Load | None

    def on(self, rig: str) -> str:
        """Return the address for ``rig``; ``sim`` is the original's simulated rig, if any."""
        return self.rig if rig == "sim" and is_simulated(self.rig) else rig

    def settings(self, rig_file: Path | None) -> RigFile:
        """Return the settings to repeat the run on a simulated rig.

        Raises ``InputError`` where a ``rig_file`` is given too.
        """
        if rig_file is not None:
            raise InputError(
                f"rig file {rig_file} cannot be used to repeat {self.path} on a simulated rig: the "
                f"recording has its own rig file; leave the other one out",
                option=("rig_file", "like"),
            )
        return self.rig_file

    def differences(self, rig: str, rig_file: Path | None, settings: RigFile) -> tuple[str, ...]:
        """Return what differs between the original's rig file and ``settings``, in sentences.

        On a ``rig`` that is not simulated, scaling and limits are those of its own ``rig_file``:
        raises ``InputError`` where none is given.
        """
        if rig_file is None:
            raise InputError(
                f"rig {rig!r} is not simulated: only the sequence of {self.path} can be repeated "
                f"on it, and a recording of another rig knows neither its scaling nor its limits; "
                f"give the rig's own file",
                option="rig_file",
            )
        # without a rig file a run has the scaling and the limits of the thesis's rig
        mine = "" if self.configuration else ": none, which is the thesis's rig"
        found = differences(self.rig_file, settings)
        if not found:
            return (f"{self.path} was recorded with the same settings of the rig",)
        return (f"{self.path} was recorded with another rig file{mine}; what differs:", *found)

    def check_film(self, rig_file: RigFile, model: Path | None) -> None:
        """Raise ``InputError`` unless film and load of ``rig_file`` are those of the original.

        They differ where the simulated rig was made from a model file, which ``model`` should be.
        """
        if (self.film, self.load) != (rig_file.as_film(), rig_file.as_load()):
            if model is not None:
                raise InputError(
                    f"film or load of the model {model} differ from those that {self.path} was "
                    f"recorded with: give the model of that run, or none",
                    option=("model", "like"),
                )
            raise InputError(
                f"{self.path} was made with the film and load of a model file, which differ from "
                f"those of its rig file: give the model file too",
                option="model",
            )


def original_of(path: str | Path) -> Original:
    """Return the run of the recording at ``path``, to repeat it.

    The CSV file of a waveform is read from the recording's folder. Raises ``InputError`` for a file
    that is not a recording of a run, or whose sequence or rig file this version does not accept.
    """
    path = Path(path)
    recording = open_recording(path)
    if not recording.sequence_toml:
        raise InputError(f"{path} holds no sequence: only a run that was recorded can be repeated")
    noted = recording.provenance
    if "feedback" in noted:
        raise InputError(
            f"{path} was corrected while it was recorded: its voltage followed the readings, and "
            f"its sequence alone does not repeat it; hold the displacement again",
            command=("hold",),
        )
    configuration = str(noted.get("configuration", ""))
    name = f"the rig file in {path}"
    try:
        rig_file = RigFile.model_validate(parse_toml(configuration, name))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(str(part) for part in first["loc"])
        raise InputError(f"{name} is not of this version: {key}: {first['msg']}") from error
    seed = noted.get("seed", 0)
    if not isinstance(seed, int) or seed < 0:
        raise InputError(f"{path}: its seed {seed!r} is not a whole number of 0 or more")
    return Original(
        path=path,
        sequence=parse_sequence(recording.sequence_toml, f"the sequence in {path}", path.parent),
        rig_file=rig_file,
        configuration=configuration,
        rig=str(noted.get("rig", "")),
        seed=seed,
        film=recording.film,
        load=recording.load,
    )
