"""From the address of a simulated rig to the card that it hangs on."""

from __future__ import annotations

import re

from drivers.errors import AddressError
from drivers.settings import RigSettings
from model.actuator import Actuator
from model.material import TABLE_3, Film, Load
from sim_backend.clock import Clock, ManualClock, PacedClock
from sim_backend.daqmx.device import Device
from sim_backend.faults import FaultPlan
from sim_backend.model_plant import ModelPlant
from sim_backend.plant import Plant
from sim_backend.truth import cases

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
) -> Device:
    """The card of the rig at ``address``; see ``sim_backend.factory.open_simulated_rig``."""
    found = re.fullmatch(r"sim(?::(\d{1,18}))?", address)
    if not found:
        raise AddressError(
            f"rig {address!r} is not a simulated rig: write sim, or sim:SEED with a whole number "
            f"such as sim:7"
        )
    hidden = None if found[1] is None else int(found[1])
    plant: Plant
    if hidden is None:
        plant = ModelPlant.at_rest(Actuator(film, load, TABLE_3))
    else:
        plant = cases.draw(hidden, film, load).plant()
    return Device(
        settings,
        plant,
        clock or (PacedClock() if paced else ManualClock()),
        noise_seed=(seed,) if hidden is None else (seed, hidden),
        faults=faults,
    )
