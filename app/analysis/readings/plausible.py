"""Refusal of recordings whose units cannot be right."""

from __future__ import annotations

import numpy as np

from dearig.analysis.readings.faults import place
from dearig.errors import InputError
from dearig.model.film.material import THESIS_FILM, VACUUM_PERMITTIVITY, Film
from dearig.recording.content.bounds import MODULUS, SPAN_TO_EXPECTED, STRETCH, VOLTAGE
from dearig.recording.reading.recording import Recording

__all__ = ["check_units"]

#: Pa; a modulus in the middle of the usual range of elastomers.
_TYPICAL_MODULUS = 1e5
#: m; a travel that should be smaller may drown in the noise of a laser whatever its unit.
_SEEN = 100e-6


def check_units(recording: Recording, moved: np.ndarray) -> None:
    """Refuse ``recording`` for a unit that cannot be right; ``moved`` (N,) is its drive."""
    if recording.kind == "film":
        _check_film_units(recording, moved)
        return
    peak = float(np.max(np.abs(moved)))
    if peak == 0.0:
        return
    at = f"at {place(recording, int(np.argmax(np.abs(moved))))}"
    if peak > VOLTAGE.possible.high:
        raise InputError(
            f"{recording.path}: the voltage reaches {peak * 1e-3:.4g} kV {at}, which no film "
            f"survives; is it in V, and was it imported as kV, or in mV, and was it imported as V?"
        )
    if peak < VOLTAGE.possible.low:
        raise InputError(
            f"{recording.path}: the voltage reaches only {peak:.4g} V {at}, which moves no film; "
            f"is it in kV, and was it imported as V?"
        )
    film = recording.film or THESIS_FILM
    # the 99.9 % range: a single outlier is not taken for a wrong unit
    travel = float(np.subtract(*np.percentile(recording.signal, (99.95, 0.05))))
    expected = _expected_travel(film, peak)
    if travel > SPAN_TO_EXPECTED.high * expected and travel > 1e-3 * film.length:
        raise InputError(
            f"{recording.path}: the displacement spans {travel * 1e3:.4g} mm under "
            f"{peak * 1e-3:.4g} kV, where a film of {film.length * 1e3:.4g} mm moves about "
            f"{expected * 1e3:.2g} mm; is its unit wrong by a thousand, or the voltage's?"
        )
    if expected > _SEEN and 0.0 < travel < SPAN_TO_EXPECTED.low * expected:
        raise InputError(
            f"{recording.path}: the displacement spans only {travel * 1e6:.4g} um under "
            f"{peak * 1e-3:.4g} kV, where a film of {film.length * 1e3:.4g} mm moves about "
            f"{expected * 1e3:.2g} mm; is its unit wrong by a thousand, or the voltage's?"
        )


def _expected_travel(film: Film, voltage: float) -> float:
    """Return the displacement in m: the Maxwell stress over a modulus in the usual range."""
    stress = VACUUM_PERMITTIVITY * film.permittivity * (voltage / film.thickness) ** 2
    return min(stress / _TYPICAL_MODULUS, 3.0) * film.length


def _check_film_units(recording: Recording, stretch: np.ndarray) -> None:
    low, high = float(stretch.min()), float(stretch.max())
    at = f"at {place(recording, int(np.argmax(stretch)))}"
    if high > STRETCH.possible.high:
        raise InputError(
            f"{recording.path}: the stretch reaches {high:.4g} {at}; it is length over length at "
            f"rest, so 150 % is 1.5: is it in per cent?"
        )
    if low < STRETCH.possible.low:
        raise InputError(
            f"{recording.path}: the stretch is {low:.4g} "
            f"at {place(recording, int(np.argmin(stretch)))}; it is length over length at rest, "
            f"1 at the start: is it a strain?"
        )
    # compared with the stiffest and softest films, and a factor of safety
    pull = np.abs(stretch - stretch**-2.0)
    wide = pull > 0.5 * float(pull.max())
    if not (wide.any() and float(pull.max()) > 0.02):
        return
    modulus = float(np.median(np.abs(recording.signal[wide]) / pull[wide]))
    peak = float(np.max(np.abs(recording.signal)))
    if modulus > 0.0 and modulus not in MODULUS:
        too_low = modulus < MODULUS.low
        side = "kPa or MPa imported as Pa" if too_low else "Pa imported as kPa"
        raise InputError(
            f"{recording.path}: a nominal stress of {peak * 1e-3:.4g} kPa at stretch {high:.4g} is "
            f"that of a modulus of {modulus:.2g} Pa, and films have 1e4 to 1e7 Pa; is it {side}, "
            f"or the area wrong?"
        )
