"""Open a simulated rig by its address: ``sim`` follows the model, ``sim:SEED`` hides an effect.

``sim:SEED:HAND:NOISE``, each of the last two optional, names another maker's forms of effects and
another kind of noise; see ``dearig.sim_backend.truth.cases``.
"""

from __future__ import annotations

import re

from dearig.drivers.errors import AddressError
from dearig.drivers.settings import RigSettings
from dearig.model.film.material import TABLE_3, Film, Load
from dearig.model.simulation.actuator import Actuator
from dearig.sim_backend.clock import Clock, ManualClock, PacedClock
from dearig.sim_backend.faults import FaultPlan
from dearig.sim_backend.inputs import SimulatedInputs
from dearig.sim_backend.laser_noise import WHITE
from dearig.sim_backend.model_plant import ModelPlant
from dearig.sim_backend.plant import Plant
from dearig.sim_backend.rig import SimulatedRig
from dearig.sim_backend.truth import cases

__all__ = ["open_simulated_inputs", "open_simulated_rig", "plant_of"]


def open_simulated_rig(
    address: str,
    settings: RigSettings,
    film: Film,
    load: Load,
    *,
    seed: int = 0,
    paced: bool = False,
    actuator: Actuator | None = None,
    clock: Clock | None = None,
    block_samples: int | None = None,
    faults: FaultPlan | None = None,
) -> SimulatedRig:
    """Open the rig at ``address``.

    ``sim`` is a film with the model ``actuator``, by default ``film`` under ``load`` with the
    network of the thesis's Table 3. ``sim:SEED`` is a film of the same make; SEED decides which
    effects are hidden in it, if any. ``sim:SEED:second`` hides effects of forms that the model does
    not have, ``sim:SEED:NOISE`` has another kind of noise (``laser_noise.NOISES``). SEED and
    ``seed`` together seed the instruments' noise, so that another ``seed`` records the same rig
    again. ``paced`` runs in real time; otherwise the rig runs as fast as it is read. ``clock``
    replaces either. ``faults`` occur in every run.

    Raises ``AddressError`` for any other address, ``ModelError`` or ``ValueError`` for a film
    without a rest state, ``ValueError`` for faults that this rig cannot have.
    """
    plant, case = _plant_and_case(address, film, load, actuator)
    hidden = None if case is None else case.seed
    return SimulatedRig(
        settings,
        plant,
        clock or (PacedClock() if paced else ManualClock()),
        address=address,
        noise_seed=(seed,) if hidden is None else (seed, hidden),
        identity_seed=hidden,
        block_samples=block_samples,
        faults=faults,
        noise=WHITE if case is None else case.noise,
    )


def open_simulated_inputs(
    address: str,
    settings: RigSettings,
    film: Film,
    load: Load,
    *,
    actuator: Actuator | None = None,
    clock: Clock | None = None,
) -> SimulatedInputs:
    """Open the inputs of the rig at ``address`` at rest, in real time unless ``clock`` is given.

    Raises as ``open_simulated_rig``.
    """
    plant, case = _plant_and_case(address, film, load, actuator)
    return SimulatedInputs(
        settings,
        plant,
        clock or PacedClock(),
        noise_seed=(0,) if case is None else (0, case.seed),
        noise=WHITE if case is None else case.noise,
    )


def plant_of(
    address: str, film: Film, load: Load, actuator: Actuator | None = None
) -> tuple[Plant, int | None]:
    """Return the plant of the rig at ``address``, at rest, and the seed of its hidden effect.

    Raises as ``open_simulated_rig``, and ``AddressError`` for an address with a kind of noise: the
    plant has none.
    """
    plant, case = _plant_and_case(address, film, load, actuator)
    if case is not None and case.noise != WHITE:
        raise AddressError(
            f"rig {address!r} has {case.noise} noise, which only a rig without a server can have: "
            f"write {cases.address_of(case.seed, case.generator)}"
        )
    return plant, None if case is None else case.seed


def _plant_and_case(
    address: str, film: Film, load: Load, actuator: Actuator | None
) -> tuple[Plant, cases.TruthCase | None]:
    found = re.fullmatch(r"sim(?::(\d{1,18})((?::[a-z]+)*))?", address)
    if not found:
        raise AddressError(
            f"rig {address!r} is not a simulated rig: write sim, or sim:SEED with a whole number "
            f"such as sim:7"
        )
    if found[1] is None:
        return ModelPlant.at_rest(actuator or Actuator(film, load, TABLE_3)), None
    if actuator is not None:
        raise AddressError(f"rig {address!r} has its own film; only sim takes an actuator")
    try:
        case = cases.case_of(int(found[1]), found[2].split(":")[1:], film, load)
    except ValueError as error:
        raise AddressError(f"rig {address!r} is not a simulated rig: {error}") from None
    return case.plant(), case
