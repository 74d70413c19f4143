"""Open the simulated card of a rig by the rig's address."""

from __future__ import annotations

from dearig.drivers.settings import RigSettings
from dearig.model.material import Film, Load
from dearig.sim_backend.clock import Clock, ManualClock, PacedClock
from dearig.sim_backend.daqmx.device import Device
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
) -> Device:
    """Return the card of the rig at ``address``; see ``factory.open_simulated_rig``.

    With ``sine`` the inputs read a sine instead of the rig, see ``TimingEngine``.
    """
    plant, hidden = plant_of(address, film, load)
    return Device(
        settings,
        plant,
        clock or (PacedClock() if paced else ManualClock()),
        noise_seed=(seed,) if hidden is None else (seed, hidden),
        faults=faults,
        sine=sine,
    )
