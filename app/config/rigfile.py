"""The rig file (TOML): film, load, instruments and limits."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Literal, get_args

from pydantic import BaseModel, Field, ValidationError, model_validator
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from dearig.config.toml_input import allowed, meant, parse_toml, read_text, shown
from dearig.drivers.gate import Limits
from dearig.drivers.settings import RigSettings, Section
from dearig.errors import InputError
from dearig.model.film.material import Film, Load
from dearig.recording.files import check_output, replaced_when_done

__all__ = [
    "REPEATED",
    "FilmSection",
    "LoadSection",
    "RecordingSection",
    "RigFile",
    "fault_text",
    "load_rig_file",
    "write_default",
]

#: Tables that a rig file may hold any number of times: ``[[channel]]``.
REPEATED = ("channel",)


class FilmSection(Section):
    """The film before it is loaded."""

    name: str = Field(
        default="",
        max_length=200,
        description="name of the film that the limits are for; a run on real instruments needs it, "
        "and a run that names another film is refused",
    )
    length_mm: float = Field(
        default=75.0, gt=0.0, le=1e4, description="free length L1 of the film, along the motion"
    )
    length_mm_uncertainty: float = Field(
        default=0.0,
        ge=0.0,
        le=1e4,
        description="standard uncertainty of length_mm; 0 if not known",
    )
    width_mm: float = Field(
        default=72.0, gt=0.0, le=1e4, description="width L2 of the film, across the motion"
    )
    width_mm_uncertainty: float = Field(
        default=0.0,
        ge=0.0,
        le=1e4,
        description="standard uncertainty of width_mm; 0 if not known",
    )
    thickness_mm: float = Field(
        default=1.0, ge=1e-4, le=100.0, description="thickness Z of the film"
    )
    thickness_mm_uncertainty: float = Field(
        default=0.0,
        ge=0.0,
        le=100.0,
        description="standard uncertainty of thickness_mm; 0 if not known",
    )
    relative_permittivity: float = Field(
        default=4.7, ge=1.0, le=1000.0, description="relative permittivity of the film"
    )
    relative_permittivity_uncertainty: float = Field(
        default=0.0,
        ge=0.0,
        le=1000.0,
        description="standard uncertainty of relative_permittivity; 0 if not known",
    )
    density_kg_m3: float = Field(default=1000.0, ge=1.0, le=3e4, description="density of the film")
    kinematics: Literal["constrained-width", "uniaxial", "equibiaxial"] = Field(
        default="constrained-width", description="boundary condition of the film across the motion"
    )


class LoadSection(Section):
    """The load that hangs from the film."""

    mass_g: float = Field(
        default=200.0, ge=0.0, le=1e5, description="mass that hangs from the film"
    )
    mass_g_uncertainty: float = Field(
        default=0.0,
        ge=0.0,
        le=1e5,
        description="standard uncertainty of mass_g; 0 if not known",
    )
    rest_length_mm: float | None = Field(
        default=None,
        gt=0.0,
        le=1e4,
        description="measured length of the film under the load; left out, the model gives it",
    )


class RecordingSection(Section):
    """The recording of a run."""

    lost_file: Literal["ramp", "new_file"] = Field(
        default="ramp",
        description="what a run does when another program deletes, moves, replaces or overwrites "
        "its file: ramp to 0 V, or continue in a new file next to it",
    )


class RigFile(RigSettings):
    """Contents of a rig file; the defaults are the rig of the thesis."""

    film: FilmSection = FilmSection()
    load: LoadSection = LoadSection()
    recording: RecordingSection = RecordingSection()

    def as_film(self) -> Film:
        """Return the film in SI units, for the model."""
        film = self.film
        # divided, not multiplied by 1e-3: 72 mm is then 0.072 m to the last bit
        return Film(
            length=film.length_mm / 1e3,
            width=film.width_mm / 1e3,
            thickness=film.thickness_mm / 1e3,
            permittivity=film.relative_permittivity,
            density=film.density_kg_m3,
            kinematics=film.kinematics,
        )

    def as_load(self) -> Load:
        """Return the load in SI units, for the model."""
        rest = self.load.rest_length_mm
        return Load(mass=self.load.mass_g / 1e3, rest_length=None if rest is None else rest / 1e3)

    def gate_limits(self) -> Limits:
        """Return the limits in SI units, for the gate."""
        return self.limits.gate_limits(self.film.name)

    @model_validator(mode="after")
    def _load_stretches_film(self) -> RigFile:
        rest = self.load.rest_length_mm
        if rest is not None and rest <= self.film.length_mm:
            raise ValueError(
                f"load.rest_length_mm = {rest:g} is not above film.length_mm = "
                f"{self.film.length_mm:g}: under its load the film is longer than before"
            )
        if rest is not None and self.load.mass_g == 0.0:
            raise ValueError(
                f"load.rest_length_mm = {rest:g} needs a load.mass_g above 0 to have stretched it"
            )
        return self


def load_rig_file(path: Path | str | None) -> RigFile:
    """Read a rig file; None gives the defaults, the rig of the thesis.

    Raises ``InputError`` with one sentence that names the file, the key, its value, and what is
    allowed.
    """
    if path is None:
        return RigFile()
    path = Path(path)
    data = parse_toml(read_text(path, "rig file"), f"rig file {path}")
    try:
        # the files that it names are relative to its folder
        return RigFile.model_validate(data, context={"folder": path.resolve().parent})
    except ValidationError as error:
        raise InputError(f"rig file {path}: {_sentence(error)}") from error


def write_default(path: Path | str, overwrite: bool = False) -> None:
    """Write a rig file that holds every key with its default, what it means and what it may be.

    Raises ``InputError`` where the file cannot be written, or exists and is not to be overwritten.
    """
    path = Path(path)
    lines = [
        "# Rig file of dearig. A key that is left out has the value shown here.",
        "",
    ]
    sections = RigFile.model_fields
    # the operator's own things first: film and load come last in the class, where they are added
    for name in ("film", "load", *(n for n in sections if n not in ("film", "load"))):
        lines.extend(_section_lines(name, sections[name]))
    out = check_output(path, overwrite)
    with replaced_when_done(out, overwrite) as partial:
        partial.write_text("\n".join(lines), encoding="utf-8", newline="\n")


def _section_lines(name: str, info: FieldInfo) -> Iterator[str]:
    section = _section_class(info)
    # a section that is absent by default stands there as a comment, to be switched on
    off = "# " if info.default is None or name in REPEATED else ""
    doc = (section.__doc__ or "").splitlines()[0]
    yield f"# {doc}" if not off else f"# {doc} {(info.description or '').capitalize()}."
    yield f"{off}[[{name}]]" if name in REPEATED else f"{off}[{name}]"
    for key, field in section.model_fields.items():
        about = f"# {field.description} ({allowed(field)})"
        value = field.get_default(call_default_factory=True)
        if field.is_required() and field.examples:
            value = field.examples[0]
        if value is None:
            yield about
            yield f"# {key} ="
        else:
            yield about
            yield f"{off}{key} = {json.dumps(value)}"
    yield ""


def _section_class(info: FieldInfo) -> type[BaseModel]:
    """Model class of a section's field, of ``X`` as well as ``X | None``."""
    for part in (info.annotation, *get_args(info.annotation)):
        if isinstance(part, type) and issubclass(part, BaseModel):
            return part
    raise TypeError(f"{info!r} is not a section")


def _sentence(error: ValidationError) -> str:
    """Return a sentence on the first fault; unknown keys come before the faults they may cause."""
    faults = error.errors(include_url=False)
    first = min(faults, key=lambda fault: fault["type"] != "extra_forbidden")
    more = len(faults) - 1
    tail = f" ({more} more fault{'s' if more > 1 else ''} after that)" if more else ""
    return fault_text(first) + tail


def fault_text(fault: ErrorDetails) -> str:
    """Return one sentence for a fault that pydantic found: the key, its value, what is allowed."""
    # which of several tables it is, counted from 1, is part of the key that is shown
    place = [str(part) for part in fault["loc"] if isinstance(part, str)]
    value = fault["input"]
    if fault["type"] == "extra_forbidden":
        return _unknown(place)
    if not place:
        return str(fault["ctx"]["error"])
    key = ".".join(str(p) if isinstance(p, str) else f"[{p + 1}]" for p in fault["loc"])
    key = key.replace(".[", "[")
    info = RigFile.model_fields[place[0]]
    if fault["type"] == "tuple_type":
        return (
            f"{key} = {shown(value)} is not a list of tables: write [[{key}]] and its keys below, "
            f"once for each"
        )
    if fault["type"] in ("model_type", "model_attributes_type"):
        return f"{key} = {shown(value)} is not a table: write [{key}] and its keys below"
    if len(place) == 1:
        # the section's own check
        return str(fault["ctx"]["error"])
    info = _section_class(info).model_fields[place[1]]
    may = allowed(info)
    if fault["type"] == "missing":
        return f"{key} is missing: it is {may} ({info.description})"
    if fault["type"] == "value_error":
        return f"{key} = {shown(value)} is not allowed: {fault['ctx']['error']}"
    return f"{key} = {shown(value)} is not allowed, but {may} ({info.description})"


def _unknown(place: list[str]) -> str:
    """Sentence for a key that is not known, with the one that was probably meant."""
    *parents, key = place
    sections = RigFile.model_fields
    known = _section_class(sections[parents[0]]).model_fields if parents else sections
    dotted = ".".join(place)
    what = "key" if parents else "table"
    hint = meant(key, known, "".join(f"{p}." for p in parents))
    if hint and not hint.startswith("did"):
        return f"{dotted} is not a {what}: {hint}"
    for section, info in sections.items():
        if section not in parents and key in _section_class(info).model_fields:
            return f"{dotted} is not a key here: it belongs in [{section}]"
    if hint:
        return f"{dotted} is not a {what}; {hint}"
    where = f"[{parents[0]}]" if parents else "a rig file"
    return f"{dotted} is not a {what}; {where} takes {', '.join(known)}"
