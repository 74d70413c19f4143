"""Model files: a fitted model as TOML, complete enough to be simulated anywhere."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tomli_w
from pydantic import Field, ValidationError, create_model

from dearig.config.toml_input import (
    NAME_MAX,
    TomlTable,
    allowed,
    meant,
    parse_toml,
    read_text,
    shown,
)
from dearig.errors import InputError
from dearig.model.effects import EFFECTS
from dearig.model.errors import ModelError
from dearig.model.film.material import Branch, Film, Load, Network, Spring
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip
from dearig.model.springs import LIMIT, SPRING_LAWS, SPRINGS
from dearig.recording.files import check_output, replaced_when_done

__all__ = [
    "COVARIANCE",
    "FORMAT",
    "HELD_VOLTAGE",
    "PREDICTION",
    "ModelFile",
    "SpringName",
    "load_actuator",
    "load_model",
    "model_toml",
    "save_model",
]

FORMAT = "dearig-model/1"

#: Branches, and effects, of a model at most. Fits have up to 6 branches; three for each decade of
#: time from microseconds to decades of years are 45. The time of a simulation grows with them.
PARTS_MAX = 100

_Positive = Annotated[float, Field(gt=0.0)]
#: Strain energies that a model file may name.
if TYPE_CHECKING:
    SpringName = str
else:
    SpringName = Literal[SPRINGS]

#: Key of a model's history: whether the voltage was assumed to be held between the samples.
HELD_VOLTAGE = "voltage_held"
#: Keys of the covariance of the fitted parameters, and of what else is known of predictions.
COVARIANCE, PREDICTION = "covariance", "prediction"


@dataclass(frozen=True)
class ModelFile:
    """A model by ``name``: an actuator, or a strip of film whose stretch is imposed.

    ``history`` is what the file says about where the model comes from: data with their checksums,
    method, intervals.
    """

    name: str
    model: Actuator | Strip
    history: Mapping[str, Any] = field(default_factory=dict)

    @property
    def kind(self) -> str:
        """``actuator`` or ``film``, as recordings have it."""
        return "actuator" if isinstance(self.model, Actuator) else "film"

    @property
    def fitted(self) -> frozenset[str]:
        """SHA-256 of the recordings it was fitted to, as far as its history names them."""
        train = self.history.get("train")
        tables = train if isinstance(train, list) else []
        return frozenset(str(t["sha256"]) for t in tables if isinstance(t, dict) and "sha256" in t)

    @property
    def assumes_held_voltage(self) -> bool:
        """Whether it was fitted as if the voltage were held from each row of a table to the next.

        Predictions and errors with this model then assume the same.
        """
        return self.history.get(HELD_VOLTAGE) is True


class _Film(TomlTable):
    length_m: _Positive
    width_m: _Positive
    thickness_m: _Positive
    relative_permittivity: _Positive = 4.7
    density_kg_m3: _Positive = 1000.0


class _Load(TomlTable):
    mass_kg: Annotated[float, Field(ge=0.0)]
    rest_length_m: _Positive | None = None


class _SpringBase(TomlTable):
    spring: SpringName = "gent"
    modulus_Pa: Annotated[float, Field(ge=0.0)]
    limit: _Positive | None = None

    def build(self) -> Spring:
        law = SPRING_LAWS[self.spring]
        names = [p.name for p in law.parameters if p.name != LIMIT]
        for name in _SHAPES:
            if name not in names and getattr(self, name) is not None:
                takes = ", ".join(p.name for p in law.parameters) or "nothing"
                raise ModelError(f"spring ({self.spring}): {name} is not its key: it takes {takes}")
            if name in names and getattr(self, name) is None:
                raise ModelError(f"spring ({self.spring}): {name} is missing")
        limit = math.inf if self.limit is None else self.limit
        return Spring(self.modulus_Pa, limit, self.spring, tuple(getattr(self, n) for n in names))


#: Keys of the parameters of all strain energies, besides the limit.
_SHAPES = tuple(
    dict.fromkeys(p.name for law in SPRING_LAWS.values() for p in law.parameters if p.name != LIMIT)
)
if TYPE_CHECKING:
    _Spring = _SpringBase
else:
    _Spring = create_model(
        "_Spring", __base__=_SpringBase, **dict.fromkeys(_SHAPES, (float | None, None))
    )


class _Branch(_Spring):
    relaxation_time_s: Annotated[float, Field(ge=0.0)]


#: Numbers that an effect's law got after the first files, at which it does what it did before: a
#: value, or which of its other numbers.
_SINCE_THEN: dict[str, dict[str, float | str]] = {
    "dry friction": {"damping": 1e-6},
    "elastoplastic friction": {"easing_exponent": 2.0},
    "broad dielectric relaxation": {"half_width": 4.0},
    "dielectric relaxation in stages": {"sooner_ratio": "ratio"},
}


#: Effects of earlier versions, and which one holds their amplitudes.
_REMOVED = {"wandering drift": "fitful drift", "restless drift": "fitful drift"}


class _Effect(TomlTable):
    name: str
    values: dict[str, float]

    def build(self) -> tuple[str, tuple[tuple[str, float], ...]]:
        if self.name in _REMOVED:
            raise ModelError(
                f"effect {self.name!r} is one of an earlier version: write "
                f"{_REMOVED[self.name]!r}, with the same amplitudes and 0 for the others"
            )
        values = dict(self.values)
        for new, then in _SINCE_THEN.get(self.name, {}).items():
            if not isinstance(then, str):
                values.setdefault(new, then)
            elif then in values:
                values.setdefault(new, values[then])
        # in the order of the law; what it does not have is refused with the model
        law = EFFECTS[self.name].parameters if self.name in EFFECTS else ()
        place = {p.name: i for i, p in enumerate(law)}
        return self.name, tuple(sorted(values.items(), key=lambda v: place.get(v[0], len(place))))


class _File(TomlTable):
    format: str
    name: str = Field(min_length=1, max_length=NAME_MAX)
    kinematics: Literal["constrained-width", "uniaxial", "equibiaxial"]
    film: _Film | None = None
    load: _Load | None = None
    equilibrium: _Spring
    branch: list[_Branch] = Field(default=[], max_length=PARTS_MAX)
    effect: list[_Effect] = Field(default=[], max_length=PARTS_MAX)
    history: dict[str, Any] = Field(default={})


def load_model(path: str | Path) -> ModelFile:
    """Read the model file at ``path``.

    Raises ``InputError`` with one sentence: file, key, value, and what is allowed; also for a file
    of a newer version, which may mean something that this one does not know.
    """
    path = Path(path)
    name = f"model file {path}"
    data = parse_toml(read_text(path, "model file"), name)
    found = data.get("format")
    if found != FORMAT:
        if isinstance(found, str) and found.startswith("dearig-model/"):
            raise InputError(
                f"{name} has the format {found}; this version reads {FORMAT}: use a newer dearig, "
                f"or identify the model again with this one"
            )
        raise InputError(
            f'{name} has no line format = "{FORMAT}": it is not a model file, as a fit writes them',
            command=("identify",),
        )
    try:
        file = _File.model_validate(data)
    except ValidationError as error:
        raise InputError(f"{name}: {_sentence(error)}") from error
    try:
        model = _build(file)
        if isinstance(model, Actuator):
            model.rest()  # a load that the springs cannot carry is a fault of this file
        return ModelFile(file.name, model, file.history)
    except ModelError as error:
        raise InputError(f"{name}: {error}") from error
    except ArithmeticError as error:
        raise InputError(
            f"{name}: its numbers are too small or too large to compute with: {error}"
        ) from error


def load_actuator(path: str | Path) -> Actuator:
    """Return the actuator in a model file; ``InputError`` for a bare film."""
    model = load_model(path).model
    if isinstance(model, Actuator):
        return model
    raise InputError(
        f"model file {path} is of a bare film, which a voltage does not move: give one of an "
        f"actuator"
    )


def _build(file: _File) -> Actuator | Strip:
    branches = tuple(Branch(b.build(), b.relaxation_time_s) for b in file.branch)
    network = Network(file.equilibrium.build(), branches)
    effects = tuple(e.build() for e in file.effect)
    if file.film is None and file.load is None:
        return Strip(network, file.kinematics, effects)
    if file.film is None or file.load is None:
        raise ModelError("[film] and [load] go together: an actuator has both, a bare film neither")
    film = Film(
        length=file.film.length_m,
        width=file.film.width_m,
        thickness=file.film.thickness_m,
        permittivity=file.film.relative_permittivity,
        density=file.film.density_kg_m3,
        kinematics=file.kinematics,
    )
    load = Load(file.load.mass_kg, file.load.rest_length_m)
    return Actuator(film, load, network, effects)


def model_toml(name: str, model: Actuator | Strip, history: Mapping[str, Any]) -> str:
    """Return the model as the text of a model file."""
    data: dict[str, Any] = {"format": FORMAT, "name": _plain(name)}
    if isinstance(model, Strip):
        data["kinematics"] = model.kinematics
    else:
        data["kinematics"] = model.film.kinematics
        data["film"] = {
            "length_m": model.film.length,
            "width_m": model.film.width,
            "thickness_m": model.film.thickness,
            "relative_permittivity": model.film.permittivity,
            "density_kg_m3": model.film.density,
        }
        data["load"] = {"mass_kg": model.load.mass}
        if model.load.rest_length is not None:
            data["load"]["rest_length_m"] = model.load.rest_length
    if model.effects:
        data["effect"] = [{"name": n, "values": dict(v)} for n, v in model.effects]
    network = model.network
    data["equilibrium"] = _spring_table(network.equilibrium)
    data["branch"] = [
        {**_spring_table(b.spring), "relaxation_time_s": b.relaxation_time}
        for b in network.branches
    ]
    if history:
        data["history"] = _plain(history)
    return tomli_w.dumps(data)


def save_model(
    path: str | Path,
    name: str,
    model: Actuator | Strip,
    history: Mapping[str, Any],
    overwrite: bool = False,
) -> Path:
    """Write a model file completely or not at all; ``InputError`` where it may not be written."""
    out = check_output(path, overwrite)
    with replaced_when_done(out, overwrite) as partial:
        partial.write_text(model_toml(name, model, history), encoding="utf-8")
    return out


def _spring_table(spring: Spring) -> dict[str, Any]:
    table: dict[str, Any] = {"spring": spring.kind, "modulus_Pa": spring.modulus}
    if math.isfinite(spring.limit):
        table["limit"] = spring.limit
    table |= {p.name: value for p, value in spring.values if p.name != LIMIT}
    return table


def _plain(value: Any) -> Any:
    """``value`` with only what TOML has: no None, no numpy, infinities as text-free omissions."""
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items() if v is not None}
    if isinstance(value, Sequence) and not isinstance(value, str | bytes):
        return [_plain(v) for v in value if v is not None]
    if hasattr(value, "item"):
        return value.item()
    if isinstance(value, str):
        # a file whose name is not text in this system's encoding still has a place in a history
        return value.encode("utf-8", "replace").decode("utf-8")
    return value


#: Keys that hold one table for each of several things.
_LISTS = ("branch", "effect")
_TABLES: Mapping[str, type[TomlTable]] = {
    "film": _Film,
    "load": _Load,
    "equilibrium": _Spring,
    "branch": _Branch,
    "effect": _Effect,
}


def _sentence(error: ValidationError) -> str:
    faults = error.errors(include_url=False)
    fault = min(faults, key=lambda f: f["type"] != "extra_forbidden")
    place = [p for p in fault["loc"] if p != "[key]"]
    table: type[TomlTable] = _File
    dotted = ""
    for part in place[:-1]:
        if isinstance(part, int):
            dotted += f"[{part + 1}]"
            continue
        dotted += f".{part}" if dotted else str(part)
        table = _TABLES.get(str(part), table)
    last = place[-1] if place else "file"
    key = f"{dotted}.{last}" if dotted and isinstance(last, str) else f"{dotted}{last}"
    if fault["type"] == "extra_forbidden":
        hint = meant(str(last), table.model_fields)
        return f"{key} is not a key: {hint or 'it takes ' + ', '.join(table.model_fields)}"
    if fault["type"] == "missing":
        info = table.model_fields.get(str(last))
        return f"{key} is missing" + (f": it takes {allowed(info)}" if info is not None else "")
    info = table.model_fields.get(str(last))
    if fault["type"] == "too_long":
        most = fault["ctx"]["max_length"]
        return f"{key} = {shown(fault['input'])} is too long: {most:,} are read at most"
    if str(last) in _LISTS:
        given = shown(fault["input"])
        return f"{key} = {given} is not a list of tables: write [[{last}]] above each"
    words = "a number" if info is None else allowed(info)
    if words == "a table":
        return f"{key} = {shown(fault['input'])} is not a table: write [{key}] above its keys"
    return f"{key} = {shown(fault['input'])} is not allowed: it takes {words}"
