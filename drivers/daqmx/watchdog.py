"""Description of the card's hardware watchdog: whether it is wired, and what that means."""

from __future__ import annotations

from dearig.drivers.instruments.findings import Finding, Verdict
from dearig.drivers.settings import CardSettings

__all__ = ["WATCHDOG", "watchdog_finding", "watchdog_text"]

#: Item of the finding.
WATCHDOG = "hardware watchdog"

_NOTHING = "not wired: nothing takes the voltage down if run and guardian die together"


def watchdog_text(card: CardSettings, simulated: bool | None) -> str:
    """Return whether the watchdog is wired and what that means.

    ``simulated`` is what the card reports of itself, None if it was not asked.
    """
    if card.watchdog_s:
        return (
            f"wired to {card.do_hv_enable}: if this computer and its guardian both fail, the card "
            f"switches the amplifier off after {card.watchdog_s:g} s"
        )
    if simulated and not card.i_have_no_watchdog:
        return "not wired; the card reports itself as simulated, so a run needs none"
    return _NOTHING


def watchdog_finding(
    instrument: str, card: CardSettings, simulated: bool | None, server: str | None
) -> Finding:
    """Return the finding on the watchdog; ``wrong`` where a run is refused without it.

    A real card needs a watchdog or the declaration that there is none. One behind a ``server``
    that was not reached may be simulated.
    """
    text = watchdog_text(card, simulated)
    verdict: Verdict
    if card.watchdog_s:
        return Finding(instrument, WATCHDOG, text)
    if card.i_have_no_watchdog:
        advice = "wire card.do_hv_enable to the amplifier's enable input to have one"
        return Finding(instrument, WATCHDOG, text, verdict="warning", advice=advice)
    if simulated:
        return Finding(instrument, WATCHDOG, text, verdict="not wired")
    verdict = "warning" if simulated is None and server is not None else "wrong"
    return Finding(
        instrument, WATCHDOG, text, verdict=verdict,
        advice="wire a digital line to the amplifier's enable input and write card.do_hv_enable, "
        "or write i_have_no_watchdog = true in [card] of the rig file to run without",
    )  # fmt: skip
