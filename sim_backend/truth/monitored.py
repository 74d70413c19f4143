"""Which faults of the amplifier its voltage monitor shows.

The monitor shows a fault of the output stage or of its supply; it does not show one of its own
divider or of the stage behind it. The seed of a rig decides. A fault that would end the thesis's
runs by the interlocks of the default rig file is never shown: no one could record that rig.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dearig.drivers.settings import InterlockSettings
from dearig.sim_backend.truth.effect import SupplyStage, TruthEffect
from dearig.sim_backend.truth.supply import Supply

__all__ = ["with_monitor"]

_STREAM = 1  # of the seed: apart from the one that draws the film and its effects
_PEAK, _HERTZ = 8000.0, 1.0  # V, Hz: the thesis's steepest lobe
_RATE = 1000.0  # Hz


def with_monitor(effect: TruthEffect, seed: int) -> TruthEffect:
    """Return ``effect`` of the rig of ``seed``, shown by the voltage monitor or not.

    Only an effect of the amplifier is changed; its description says which.
    """
    stage = effect.on_voltage
    if effect.acts_on != "amplifier" or stage is None:
        return effect
    generator = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_STREAM,)))
    seen = bool(generator.random() < 0.5) and not _ends_runs(stage)
    text = "shown by the voltage monitor" if seen else "not shown by the voltage monitor"
    return replace(effect, seen=seen, description=f"{effect.description} ({text})")


def _ends_runs(stage: SupplyStage) -> bool:
    """Return True where a monitor that shows ``stage`` would trip an interlock on two lobes."""
    locks = InterlockSettings()
    time = np.arange(round(2.0 * _RATE / _HERTZ)) / _RATE
    asked = _PEAK * np.abs(np.sin(np.pi * _HERTZ * time))
    shown = stage(time, Supply(asked, asked, asked), None)[0].last
    apart = np.abs(asked - shown) > 1e3 * locks.monitor_tolerance_kV
    low = (asked > 1e3 * locks.breakdown_above_kV) & (shown < locks.breakdown_fraction * asked)
    return _lasts(apart, locks.monitor_debounce_ms) or _lasts(low, locks.breakdown_debounce_ms)


def _lasts(flags: np.ndarray, milliseconds: float) -> bool:
    """Return True where ``flags`` (N,) are set for so long without a break."""
    edges = np.flatnonzero(np.diff(flags, prepend=False, append=False))
    return bool((np.diff(edges)[::2] > 1e-3 * milliseconds * _RATE).any())
