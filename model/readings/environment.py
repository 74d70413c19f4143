"""The air of the room during a record, and which effects of it several records can show.

Temperatures in K and relative humidities (0 to 1) are those of the start of each record, less the
reference, as a ``Drive`` has them; None where they are not known.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

__all__ = [
    "CELSIUS",
    "HUMIDITY",
    "HUMIDITY_SPAN",
    "TEMPERATURE_SPAN",
    "air_texts",
    "recorded_of",
]

#: Standard atmosphere 23/50 of ISO 291: a film's numbers are those in this air, where an effect
#: makes them depend on it. Degrees Celsius, and relative humidity from 0 to 1.
CELSIUS, HUMIDITY = 23.0, 0.5

#: Least differences between recordings, in K and as relative humidity: a change of 0.3 % per K, or
#: of 10 % from a dry to a saturated room, then moves a film by 0.3 and 0.5 %, which a laser sees.
TEMPERATURE_SPAN, HUMIDITY_SPAN = 1.0, 0.05


def _span(values: Sequence[float | None]) -> float | None:
    """Return by how much several values differ; None where one is not known or there is one."""
    known = [value for value in values if value is not None]
    if len(known) < len(values) or len(known) < 2:
        return None
    return max(known) - min(known)


def recorded_of(
    temperatures: Sequence[float | None], humidities: Sequence[float | None]
) -> frozenset[str]:
    """Return which needs of effects (``Effect.needs``) recordings in this air meet.

    An effect of the air from one recording to the next needs it in all of them.
    """
    found = set()
    warmer, moister = _span(temperatures), _span(humidities)
    if warmer is not None and warmer >= TEMPERATURE_SPAN:
        found.add("temperatures")
    if moister is not None and moister >= HUMIDITY_SPAN:
        found.add("humidity")
    return frozenset(found)


def air_texts(
    temperatures: Sequence[float | None], humidities: Sequence[float | None]
) -> Iterator[str]:
    """Yield why effects of a recorded humidity or temperature cannot be looked for."""
    for what, values, least, scale, reference, unit in (
        ("humidity", humidities, HUMIDITY_SPAN, 100.0, HUMIDITY, "%"),
        ("temperature", temperatures, TEMPERATURE_SPAN, 1.0, CELSIUS, "°C"),
    ):
        known = [value for value in values if value is not None]
        if not known:
            continue
        low, high = (scale * (value + reference) for value in (min(known), max(known)))
        if len(values) < 2:
            yield (
                f"the room's {what} was recorded ({low:.1f} {unit}), but one recording cannot show "
                f"what the film owes to it: give several at different values"
            )
        elif len(known) < len(values):
            yield (
                f"the room's {what} was recorded in {len(known)} of {len(values)} recordings: what "
                f"the film owes to it is looked for only where all have it"
            )
        elif max(known) - min(known) < least:
            yield (
                f"the room's {what} differs too little between the recordings ({low:.1f} to "
                f"{high:.1f} {unit}): they cannot show what the film owes to it"
            )
