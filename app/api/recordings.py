"""Recordings: opened from a file, or made by a run."""

from __future__ import annotations

import re
import shutil
import tempfile
import weakref
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tomli_w

from dearig.acquisition.overlay import OverlayModel
from dearig.acquisition.rig_source import SOURCE, source_of
from dearig.acquisition.rigs import check_simulation
from dearig.acquisition.run import RunOptions
from dearig.acquisition.run import record as run
from dearig.analysis.readings.compatibility import of_rig
from dearig.api.arguments import named_arguments
from dearig.api.display import card, drawing, facts, write_page
from dearig.api.models import ModelSource, read_model
from dearig.api.sequences import SequenceSource, as_loaded
from dearig.api.written import HasPage
from dearig.config.modelfile import ModelFile, model_toml
from dearig.config.presets import PRESETS
from dearig.config.rigfile import RigFile, load_rig_file
from dearig.config.rigform import parse_rig_file
from dearig.config.sequencefile import LoadedSequence
from dearig.config.toml_input import read_text
from dearig.drivers.gate import Margin
from dearig.errors import InputError
from dearig.model.simulation.actuator import Actuator
from dearig.progress import Progress, quiet
from dearig.recording.files import check_output, check_recording_name, replaced_when_done
from dearig.recording.reading import recording as stored
from dearig.recording.reading.origin import origin_of
from dearig.recording.reading.reader import open_recording
from dearig.report.figures.signals import signal_figure
from dearig.report.text.numbers import seconds, significant

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Recording", "RigSource", "load_rig", "open", "record", "rig_provenance"]

#: The path of a rig file, or its tables, such as ``{"load": {"mass_g": 50}}``.
RigSource = str | Path | Mapping[str, Mapping[str, object]]


@dataclass(frozen=True, eq=False, repr=False)
class Recording(stored.Recording, HasPage):
    """A recording: arrays (N,) in SI units, read when they are first used, and its metadata.

    Attributes
    ----------
    margins : tuple of Margin
        Distance of the planned run from each limit of the rig; empty for a recording that was
        opened.
    """

    margins: tuple[Margin, ...] = ()

    @classmethod
    def of(cls, recording: stored.Recording, margins: tuple[Margin, ...] = ()) -> Recording:
        """Return a stored recording as one for a notebook.

        Parameters
        ----------
        recording : dearig.recording.reading.recording.Recording
            The stored recording.
        margins : tuple of Margin
            Margins of the planned run.

        Returns
        -------
        Recording
            The same data, with ``plot``, ``save`` and ``to_html``.
        """
        known = {f.name: getattr(recording, f.name) for f in fields(stored.Recording)}
        return cls(**known, margins=margins)

    def plot(self) -> Figure:
        """Plot the drive and the response over time, with the overlay model's.

        Returns
        -------
        matplotlib.figure.Figure
            The figure, with axes in the units that its labels name.
        """
        return signal_figure(
            self.kind,
            self.time,
            self.voltage_command if self.kind == "actuator" else self.stretch,
            self.measured,
            self.displacement_model,
        )

    def save(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Copy the recording's file.

        Parameters
        ----------
        path : str or Path
            The new file (``.h5``).
        overwrite : bool
            Replace a file that exists.

        Returns
        -------
        Path
            The path that was written.

        Raises
        ------
        InputError
            If the file exists, cannot be written.
        """
        out = check_output(path, overwrite, self.path)
        with replaced_when_done(out, overwrite) as partial:
            shutil.copyfile(self.path, partial)
        return out

    def _write_page(self, path: Path) -> Path:
        return write_page(path, self.name, "Recording", self._repr_html_(), (origin_of(self),))

    def __repr__(self) -> str:
        """Return name, kind and size in a line."""
        return (
            f"<Recording {self.name!r}: {self.kind}, {self.samples} samples, {self.duration:.4g} s>"
        )

    def _repr_html_(self) -> str:
        rows = [("title", self.title)] if self.title and self.title != self.name else []
        rate = "" if self.rate is None else f" at {significant(self.rate)} Hz"
        rows.append(("samples", f"{self.samples:,}, {seconds(self.duration)}{rate}"))
        if self.noise_floor is not None:
            rows.append(("noise floor", f"{significant(self.noise_floor * 1e6)} \N{MICRO SIGN}m"))
        film = self.film
        if film is not None:
            size = " x ".join(f"{x * 1e3:.4g}" for x in (film.length, film.width, film.thickness))
            rows.append(("film", f"{self.film_id + ', ' if self.film_id else ''}{size} mm"))
        if self.load is not None:
            rows.append(("load", f"{self.load.mass * 1e3:.4g} g"))
        outcome = self.outcome if self.complete else f"INCOMPLETE: {self.outcome}"
        rows.append(("outcome", outcome))
        rows += [(f"{e.level} at {e.time:.4g} s", e.message) for e in self.events[:_EVENTS_MAX]]
        if len(self.events) > _EVENTS_MAX:
            rows.append(("events", f"{len(self.events) - _EVENTS_MAX} more"))
        label = f"Drive and response of {self.name} over time"
        return card(self.name, facts(rows), drawing(self.plot(), label))


_EVENTS_MAX = 5  # of a card; ``recording.events`` has them all


def open(path: str | Path) -> Recording:  # noqa: A001  (the name of the interface)
    """Open the recording in a file.

    Parameters
    ----------
    path : str or Path
        An HDF5 recording.

    Returns
    -------
    Recording
        Arrays in SI units, read when they are first used, and metadata.

    Raises
    ------
    InputError
        If the file is not a recording that can be read.

    Examples
    --------
    >>> import dearig
    >>> run = dearig.open("run.h5")
    >>> run.displacement.max()  # in m
    """
    return Recording.of(open_recording(path))


@named_arguments
def record(
    sequence: SequenceSource,
    *,
    rig: str = "sim",
    path: str | Path | None = None,
    rig_file: RigSource | None = None,
    model: ModelSource | None = None,
    overlay: ModelSource | None = None,
    operator: str = "",
    film: str = "",
    notes: str = "",
    seed: int = 0,
    paced: bool = False,
    faults: Iterable[str] = (),
    overwrite: bool = False,
    progress: Progress = quiet,
) -> Recording:
    """Play a sequence on a rig, record it, and return the recording.

    An interrupt of the kernel ramps the voltage down to 0 V.

    Parameters
    ----------
    sequence : Sequence, path or name of a preset
        The voltage that is played.
    rig : str
        ``sim``, ``sim:SEED`` for a simulated rig with a hidden effect, ``daqmx:Dev1`` for a card.
    path : path, optional
        The file to write. Without one the recording is in a temporary file, which is deleted
        together with the returned value; ``Recording.save`` keeps it.
    rig_file : path or mapping, optional
        Film, load, instruments and limits: a rig file, or its tables such as
        ``{"load": {"mass_g": 50}}``. The default is the thesis's rig.
    model : model, result or path, optional
        The film and load of the simulated rig ``sim``.
    overlay : model, result or path, optional
        A model that is simulated with the measurement and recorded with it.
    operator, film, notes : str
        Texts that are kept in the recording.
    seed : int
        Seed of the simulated noise.
    paced : bool
        Simulate in real time; otherwise as fast as possible.
    faults : iterable of str
        Faults of a simulated rig, such as ``arc@3.2`` (kind, seconds).
    overwrite : bool
        Replace the file at ``path``.
    progress : callable, optional
        Called with a stage and the fraction of it that is done (0 to 1).

    Returns
    -------
    Recording
        The recording, with the margins to the limits of the rig.

    Raises
    ------
    InputError
        If the rig's limits do not allow the sequence. Nothing was touched then.
    SafetyStop, InstrumentFault, DiskFault, Interrupted
        If the run ended early. The rig is safe, and the file that the message names is kept,
        also a temporary one.

    Examples
    --------
    >>> import dearig
    >>> run = dearig.record("thesis", rig="sim:2003", path="run.h5")
    >>> run.plot()
    """
    check_simulation(rig, seed, paced)
    if path is not None:
        check_recording_name(Path(path))
    settings, text = load_rig(rig_file)
    loaded = as_loaded(sequence)
    actuator = None
    if model is not None:
        actuator = _actuator(model)[1]
        settings = of_rig(settings, actuator.film, actuator.load)
    in_step = None if overlay is None else _overlay_model(overlay)
    options = RunOptions(
        text, operator, film, notes, overwrite=overwrite, seed=seed, paced=paced,
        actuator=actuator, faults=faults, provenance=rig_provenance(rig_file),
    )  # fmt: skip
    folder = None if path is not None else Path(tempfile.mkdtemp(prefix="dearig-"))
    out = Path(path) if path is not None else _unnamed(folder, sequence, loaded)
    try:
        result = run(loaded, rig, settings, out, options, overlay=in_step, progress=progress)
        found = Recording.of(open_recording(result.path), result.margins)
    except BaseException:
        if folder is not None and not any(folder.iterdir()):
            folder.rmdir()  # a run that ended early has left its file there
        raise
    if folder is not None:
        weakref.finalize(found, shutil.rmtree, folder, ignore_errors=True)
    return found


def _overlay_model(source: ModelSource) -> OverlayModel:
    """Return the model of ``source``, to run in step with a measurement."""
    file, actuator = _actuator(source)
    return OverlayModel(file.name, actuator, toml=model_toml(file.name, actuator, file.history))


def _unnamed(folder: Path | None, source: SequenceSource, loaded: LoadedSequence) -> Path:
    """A file in ``folder`` with the name of a preset, of a sequence file, or of the sequence."""
    name = loaded.sequence.name
    if isinstance(source, str | Path):
        name = str(source) if str(source) in PRESETS else Path(source).stem
    stem = re.sub(r"[^\w.]+", "-", name).strip("-.")[:60]
    return (folder or Path()) / f"{stem or 'recording'}.h5"


def _actuator(source: ModelSource) -> tuple[ModelFile, Actuator]:
    """The model of ``source``, which must be of an actuator."""
    file = read_model(source)
    if not isinstance(file.model, Actuator):
        raise InputError(
            f"the model {file.name!r} is of a bare film, which a voltage does not move: give one "
            f"of an actuator"
        )
    return file, file.model


def rig_provenance(source: RigSource | None) -> dict[str, str]:
    """Return what a recording says of where its rig file came from."""
    said = "tables given to the call" if isinstance(source, Mapping) else source_of(source)
    return {SOURCE: said}


def load_rig(source: RigSource | None) -> tuple[RigFile, str]:
    """Return the settings of a rig file, and the text that a recording keeps.

    Parameters
    ----------
    source : path, mapping or None
        A rig file or its tables; None is the thesis's rig.

    Returns
    -------
    tuple of RigFile and str
        The settings and their TOML text.

    Raises
    ------
    InputError
        If the settings cannot be used.
    """
    if isinstance(source, Mapping):
        try:
            text = tomli_w.dumps(_plain(source))
        except TypeError as error:  # None, an array, a key that is not a text
            raise InputError(
                f"the rig file: its tables have a value that a rig file cannot have ({error}); "
                f"leave out the keys that have none"
            ) from error
        return parse_rig_file(text), text
    return load_rig_file(source), "" if source is None else read_text(Path(source), "rig file")


def _plain(value: Any) -> Any:
    """Return ``value`` with the numbers of NumPy in it as those of Python."""
    if isinstance(value, Mapping):
        return {key: _plain(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    return value.item() if isinstance(value, np.generic) else value
