"""Compatibility of recordings, and the model to fit to them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields

from dearig.analysis.readings.enough import overlap
from dearig.config.rigfile import FilmSection, LoadSection, RigFile
from dearig.errors import InputError
from dearig.model.errors import ModelError
from dearig.model.film.material import Branch, Film, Load, Network, Spring
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip
from dearig.model.springs import SPRING_LAWS, SPRINGS
from dearig.recording.content.assumed import assumed_of
from dearig.recording.reading.recording import Recording

__all__ = [
    "BRANCHES_MAX",
    "assumed_by",
    "base_model",
    "check_apart",
    "check_branches",
    "of_rig",
]

#: Maxwell branches of a model, at most: no data of this kind determine more.
BRANCHES_MAX = 8

_WIDE_LIMIT = 1e4  # of a spring that does not stiffen
_SIMPLE = ("neo-hookean", "gent", "arruda-boyce")  # of which the branches are made too


def check_branches(count: int, least: int = 1) -> None:
    """Refuse a number of branches that cannot be fitted; ``least`` is 0 for an elastic film."""
    if not least <= count <= BRANCHES_MAX:
        raise InputError(
            f"{count} branches cannot be fitted; give a number from {least} to {BRANCHES_MAX} "
            f"branches"
        )


def _network(branches: int, spring: str, branch_spring: str) -> Network:
    """Return a network of that structure, practically neo-Hookean."""
    for kind in (spring, branch_spring or spring):
        if kind not in SPRINGS:
            raise InputError(f"spring {kind!r} is not one of {', '.join(SPRINGS)}")

    def one(kind: str) -> Spring:
        law = SPRING_LAWS[kind]
        wide = (_WIDE_LIMIT, *law.neutral[1:]) if law.has_limit else law.neutral
        return Spring.of(kind, 1e5, wide)

    other = branch_spring or (spring if spring in _SIMPLE else "gent")
    return Network(one(spring), tuple(Branch(one(other), 1.0) for _ in range(branches)))


def base_model(
    recordings: Sequence[Recording],
    branches: int,
    spring: str,
    rest_length_mm: float | None,
    rig_file: RigFile | None,
    branch_spring: str = "",
) -> Actuator | Strip:
    """Return the model to fit; its structure matters, its parameter values do not.

    ``spring`` is the strain energy of the equilibrium spring, ``branch_spring`` that of the
    branches: by default the same where it is one of the thesis's three, else Gent's.
    """
    network = _network(branches, spring, branch_spring)
    if recordings[0].kind == "film":
        held = {r.kinematics for r in recordings}
        if len(held) > 1:
            raise InputError(
                f"these films were held in different ways ({', '.join(sorted(held))}): fit each "
                f"way alone"
            )
        if rest_length_mm is not None:
            raise InputError(
                "a rest length applies to an actuator, and these recordings are of films: leave "
                "it out"
            )
        return Strip(network, recordings[0].kinematics)
    films = {r.film for r in recordings if r.film is not None}
    loads = {r.load for r in recordings if r.load is not None}
    if len(films) > 1 or len(loads) > 1:
        raise InputError(_differing(recordings), option="rig_file")
    default = rig_file or RigFile()
    film = films.pop() if films and rig_file is None else default.as_film()
    load = loads.pop() if loads and rig_file is None else default.as_load()
    if rest_length_mm is not None:
        # not (>), so that NaN is refused too
        if not film.length * 1e3 < rest_length_mm < 1e4:
            raise InputError(
                f"a rest length of {rest_length_mm:g} mm is not above the film's own "
                f"{film.length * 1e3:g} mm, or beyond 10 m: under its load the film is longer than "
                f"before"
            )
        try:
            load = Load(load.mass, rest_length_mm / 1e3)
        except ModelError as error:
            raise InputError(f"a rest length of {rest_length_mm:g} mm: {error}") from error
    return Actuator(film, load, network)


def assumed_by(recordings: Sequence[Recording], rig_file: RigFile | None) -> str:
    """Return a sentence on values of the film and the load that no recording says; "" if none."""
    if recordings[0].kind == "film" or rig_file is not None:
        return ""
    declared = next((r for r in recordings if r.film is not None), recordings[0])
    load = next((r.load for r in recordings if r.load is not None), None)
    assumed = assumed_of(declared.film, load, declared.provenance)
    if not assumed:
        return ""
    return (
        f"Assumed, because the recordings do not say it: {' and '.join(assumed)} of the thesis; "
        f"give yours in a rig file, or when the data are imported"
    )


def check_apart(train: Sequence[Recording], validation: Sequence[Recording]) -> None:
    """Refuse data that would be both fitted and validated, and recordings of different kinds."""
    fitted = {r.sha256: r.path for r in train}
    for recording in validation:
        if recording.sha256 in fitted:
            raise InputError(
                f"{recording.path}, to validate, is a copy of {fitted[recording.sha256]}, to fit: "
                f"an error on fitted data proves nothing; leave it out of one of them"
            )
        if recording.kind != train[0].kind:
            raise InputError(
                f"{recording.path}, to validate, is of kind {recording.kind}, and "
                f"{train[0].path}, to fit, of kind {train[0].kind}: give data of one kind"
            )
        for other in train:
            same = overlap(other, recording)
            if same is not None:
                raise InputError(
                    f"{recording.path}, to validate, holds from {same[1]:.4g} s on the samples of "
                    f"{other.path}, to fit, from {same[0]:.4g} s on: an error on fitted data "
                    f"proves nothing; give recordings that do not overlap"
                )


def _differing(recordings: Sequence[Recording]) -> str:
    """Return a sentence on two recordings that are not of one film and load."""
    first = next(r for r in recordings if r.film is not None or r.load is not None)
    for other in recordings:
        for what, one, two in (
            ("films", first.film, other.film),
            ("loads", first.load, other.load),
        ):
            if one is not None and two is not None and one != two:
                return (
                    f"{first.path} and {other.path} are of different {what} "
                    f"({_apart(one, two)}, in SI units); fit them one by "
                    f"one, or say in a rig file what holds for all"
                )
    return "these recordings are of different films or loads; fit them one by one"


def _apart(one: Film | Load, two: Film | Load) -> str:
    """Return the properties in which two films or two loads differ."""
    pairs = ((f.name, getattr(one, f.name), getattr(two, f.name)) for f in fields(one))
    return ", ".join(f"{name.replace('_', ' ')} {a} and {b}" for name, a, b in pairs if a != b)


def of_rig(rig_file: RigFile, film: Film, load: Load) -> RigFile:
    """Return ``rig_file`` with ``film`` and ``load`` in it, so that its limits hold for them."""
    film_section = FilmSection(
        length_mm=film.length * 1e3,
        width_mm=film.width * 1e3,
        thickness_mm=film.thickness * 1e3,
        relative_permittivity=film.permittivity,
        density_kg_m3=film.density,
        kinematics=film.kinematics,  # type: ignore[arg-type]
    )
    rest = load.rest_length
    load_section = LoadSection(
        mass_g=load.mass * 1e3, rest_length_mm=None if rest is None else rest * 1e3
    )
    return rig_file.model_copy(update={"film": film_section, "load": load_section})
