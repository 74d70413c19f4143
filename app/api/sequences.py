"""Sequences of voltage: from a file, a preset or TOML, or built segment by segment."""

from __future__ import annotations

import inspect
import tomllib
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tomli_w

from dearig.api.display import card, drawing, facts, write_page
from dearig.api.written import HasPage
from dearig.config.presets import PRESETS
from dearig.config.rigfile import RigFile
from dearig.config.segments import SEGMENT_KINDS
from dearig.config.sequencefile import LoadedSequence, load_sequence, parse_sequence
from dearig.errors import InputError
from dearig.recording.files import check_output, replaced_when_done
from dearig.report.figures.signals import voltage_figure
from dearig.report.text.numbers import seconds, significant

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Sequence", "SequenceSource", "as_loaded"]

_TO_ZERO = {"kind": "ramp", "to_kV": 0.0, "duration_s": 1.0}


class Sequence(HasPage):
    """A sequence of voltage segments, at 0 V before and after.

    Every kind of segment is a method that returns a new sequence with such a segment at its end::

        lobes = (
            dearig.Sequence("lobes", lead_in_s=1.0)
            .half_sine(amplitude_kV=6.0, frequency_Hz=1.0, repeats=3)
            .hold(duration_s=2.0)
        )

    The keys are those of a sequence file; ``dearig.Sequence.kinds()`` lists the kinds. A wrong key
    or value raises ``InputError`` immediately, a sequence that does not end at 0 V when it is used.

    Parameters
    ----------
    name : str
        What recordings of it are called.
    lead_in_s, tail_s : float, optional
        Time at 0 V before and after; a sequence file's defaults where they are left out.
    segments : iterable of mappings, optional
        Tables of segments with their ``kind``, as in a sequence file.
    folder : path, optional
        Where the files of ``csv`` segments are; the working folder where it is left out.
    """

    def __init__(
        self,
        name: str,
        *,
        lead_in_s: float | None = None,
        tail_s: float | None = None,
        segments: Iterable[Mapping[str, object]] = (),
        folder: str | Path = "",
    ) -> None:
        data: dict[str, Any] = {"name": name}
        data |= {
            key: value
            for key, value in (("lead_in_s", lead_in_s), ("tail_s", tail_s))
            if value is not None
        }
        data["segment"] = [dict(segment) for segment in segments]
        self._set(data, Path(folder), f"sequence {name!r}")

    def _set(self, data: dict[str, Any], folder: Path, label: str, toml: str = "") -> None:
        self._data, self._folder, self._label, self._text = data, folder, label, toml
        self._loaded: LoadedSequence | None = None
        if data.get("segment") and not toml:
            # more segments may follow, which bring the voltage back to 0
            self._parse(tomli_w.dumps({**data, "segment": [*data["segment"], _TO_ZERO]}))

    def _parse(self, text: str) -> LoadedSequence:
        return parse_sequence(text, self._label, self._folder)

    @classmethod
    def _of(cls, data: dict[str, Any], folder: Path, label: str, toml: str = "") -> Sequence:
        made = cls.__new__(cls)
        made._set(data, folder, label, toml)
        return made

    @classmethod
    def open(cls, source: str | Path) -> Sequence:
        """Return the sequence of a file or of a preset.

        Parameters
        ----------
        source : str or Path
            A sequence file, or the name of a preset.

        Returns
        -------
        Sequence
            The sequence.

        Raises
        ------
        InputError
            If the file is not a sequence that can be played.
        """
        loaded = load_sequence(source)
        if str(source) in PRESETS:
            folder, label, text = Path(), f"preset {source}", PRESETS[str(source)]
        else:
            folder, label, text = Path(source).parent, f"sequence {source}", loaded.toml
        return cls._of(tomllib.loads(text), folder, label, text)

    @classmethod
    def from_toml(cls, text: str, *, folder: str | Path = "") -> Sequence:
        """Return the sequence in a TOML text.

        Parameters
        ----------
        text : str
            Content of a sequence file.
        folder : str or Path
            Folder of the files of ``csv`` segments.

        Returns
        -------
        Sequence
            The sequence.

        Raises
        ------
        InputError
            If the text is not a sequence that can be played.
        """
        loaded = parse_sequence(text, "the sequence", Path(folder))
        label = f"sequence {loaded.sequence.name!r}"
        return cls._of(tomllib.loads(text), Path(folder), label, text)

    @staticmethod
    def kinds() -> tuple[str, ...]:
        """Return the kinds of segments.

        Returns
        -------
        tuple of str
            Names for ``add``, and of the methods that add a segment.
        """
        return tuple(SEGMENT_KINDS)

    @staticmethod
    def presets() -> tuple[str, ...]:
        """Return the presets.

        Returns
        -------
        tuple of str
            Names for ``open`` and ``dearig.record``.
        """
        return tuple(PRESETS)

    def add(self, kind: str, **keys: object) -> Sequence:
        """Return a sequence with one more segment at the end.

        Parameters
        ----------
        kind : str
            Kind of the segment, one of ``kinds()``.
        **keys
            Keys of a sequence file, with units in their names: ``amplitude_kV``, ``duration_s``.

        Returns
        -------
        Sequence
            A new sequence.

        Raises
        ------
        InputError
            If the kind, a key or a value is wrong.
        """
        segments = [*self._data.get("segment", []), {"kind": kind, **_plain(keys)}]
        return self._of({**self._data, "segment": segments}, self._folder, self._label)

    def __getattr__(self, kind: str) -> Callable[..., Sequence]:
        """Return the method that adds a segment of ``kind``."""
        table = SEGMENT_KINDS.get(kind)
        if table is None:
            raise AttributeError(
                f"Sequence has no attribute {kind!r}; the kinds of segments are "
                f"{', '.join(SEGMENT_KINDS)}"
            )

        def segment(**keys: object) -> Sequence:
            return self.add(kind, **keys)

        taken = {n: f for n, f in table.model_fields.items() if n != "kind"}
        keys = "\n".join(f"{name} : {field.description}" for name, field in taken.items())
        segment.__name__ = kind
        segment.__doc__ = (
            f"Return a sequence with a {kind} segment at the end.\n\nParameters\n----------\n{keys}"
        )
        signature = [
            inspect.Parameter(
                name,
                inspect.Parameter.KEYWORD_ONLY,
                default=inspect.Parameter.empty if field.is_required() else field.default,
            )
            for name, field in taken.items()
        ]
        segment.__signature__ = inspect.Signature(signature)  # type: ignore[attr-defined]
        return segment

    def __dir__(self) -> list[str]:
        """Return the names, with the kinds of segments."""
        return [*super().__dir__(), *SEGMENT_KINDS]

    @property
    def loaded(self) -> LoadedSequence:
        """The sequence as a run takes it.

        Raises ``InputError`` for one without segments, or that cannot be played as a whole.
        """
        if not self._data.get("segment"):
            raise InputError(
                f"{self._label} has no segments: add one, such as "
                f".half_sine(amplitude_kV=6.0, frequency_Hz=1.0)"
            )
        if self._loaded is None:
            self._loaded = self._parse(self._text or tomli_w.dumps(self._data))
        return self._loaded

    @property
    def name(self) -> str:
        """What recordings of it are called."""
        return str(self._data["name"])

    @property
    def toml(self) -> str:
        """The text of a sequence file."""
        return self.loaded.toml

    @property
    def duration_s(self) -> float:
        """Duration in s, with lead-in and tail."""
        return self.loaded.sequence.duration

    def sample(self, rate_Hz: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the voltage at a sample rate.

        Parameters
        ----------
        rate_Hz : float
            Samples per second in Hz.

        Returns
        -------
        tuple of numpy.ndarray
            Time (N,) in s and voltage (N,) in V.

        Raises
        ------
        InputError
            If the sequence cannot be played as a whole.
        """
        return self.loaded.sample(rate_Hz)

    def plot(self) -> Figure:
        """Plot the voltage over time, at the default sample rate of a rig.

        Returns
        -------
        matplotlib.figure.Figure
            The figure, with axes in the units that its labels name.
        """
        return voltage_figure(*self.sample(float(RigFile().card.sample_rate_Hz)))

    def save(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write a sequence file.

        Parameters
        ----------
        path : str or Path
            The file (``.toml``).
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
        out = check_output(path, overwrite)
        with replaced_when_done(out, overwrite) as partial:
            partial.write_text(self.toml, encoding="utf-8")
        return out

    def _write_page(self, path: Path) -> Path:
        return write_page(path, self.name, "Sequence", self._repr_html_())

    def __repr__(self) -> str:
        """Return name and segments in a line."""
        kinds = ", ".join(str(segment.get("kind")) for segment in self._data.get("segment", []))
        return f"<Sequence {self.name!r}: {kinds or 'no segments'}>"

    def _repr_html_(self) -> str:
        if not self._data.get("segment"):
            return card(self.name, facts([("segments", "none")]))
        voltage = self.sample(float(RigFile().card.sample_rate_Hz))[1]
        kinds = ", ".join(str(segment["kind"]) for segment in self._data["segment"])
        rows = [
            ("duration", seconds(self.duration_s)),
            ("voltage", f"{significant(voltage.min() / 1e3)} to "
                        f"{significant(voltage.max() / 1e3)} kV"),
            ("segments", kinds),
        ]  # fmt: skip
        label = f"Voltage of the sequence {self.name} over time"
        return card(self.name, facts(rows), drawing(self.plot(), label))


def _plain(keys: Mapping[str, object]) -> dict[str, object]:
    """``keys`` with lists in place of arrays and tuples, and numbers in place of NumPy's."""
    found: dict[str, object] = {}
    for name, value in keys.items():
        if isinstance(value, np.ndarray | np.generic):
            value = value.tolist()
        found[name] = list(value) if isinstance(value, tuple | range) else value
    return found


#: A sequence, the path of a sequence file, or the name of a preset.
SequenceSource = str | Path | Sequence | LoadedSequence


def as_loaded(source: SequenceSource) -> LoadedSequence:
    """Return a sequence as a run takes it.

    Parameters
    ----------
    source : Sequence, LoadedSequence, path or name of a preset
        The sequence.

    Returns
    -------
    LoadedSequence
        The checked sequence with its TOML text.

    Raises
    ------
    InputError
        If it cannot be played as a whole.
    """
    if isinstance(source, Sequence):
        return source.loaded
    return source if isinstance(source, LoadedSequence) else load_sequence(source)
