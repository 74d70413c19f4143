"""Open the simulated card of a rig by the rig's address."""

from __future__ import annotations

from collections.abc import Mapping

from dearig.drivers.settings import RigSettings
from dearig.model.film.material import Film, Load
from dearig.sim_backend.clock import Clock, ManualClock, PacedClock
from dearig.sim_backend.daqmx.simulated_card import SimulatedCard
from dearig.sim_backend.factory import plant_of
from dearig.sim_backend.faults import FaultPlan

__all__ = ["open_device"]


def open_device(
    address: str,
    settings: RigSettings,
    film: Film,
    load: Load,
    *,
    seed: int = 0,
    paced: bool = True,
    clock: Clock | None = None,
    faults: FaultPlan | None = None,
    sine: bool = False,
    signals: Mapping[str, str] | None = None,
) -> SimulatedCard:
    """Return the card of the rig at ``address``; see ``factory.open_simulated_rig``.

    With ``sine`` the inputs read a sine instead of the rig, see ``SimulatedCard``. ``signals`` are
    at the card's digital terminals, see ``terminals``.
    """
    plant, hidden = plant_of(address, film, load)
    return SimulatedCard(
        settings,
        plant,
        clock or (PacedClock() if paced else ManualClock()),
        noise_seed=(seed,) if hidden is None else (seed, hidden),
        faults=faults,
        sine=sine,
        signals=signals,
    )
