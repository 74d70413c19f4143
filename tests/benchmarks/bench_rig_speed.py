"""How many times faster than real time the simulated rig is at 1 kHz, and where its time goes.

Run as ``python -m tests.benchmarks.bench_rig_speed``. Everything is on: thermometer, noise, film.
"""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from dearig.drivers.gate import FilmForecast, GatedWaveform, admit
from dearig.drivers.settings import RigSettings, ThermometerSettings
from dearig.model.film.material import THESIS_FILM, THESIS_LOAD
from dearig.sim_backend.amplifier import Amplifier
from dearig.sim_backend.card import Converters
from dearig.sim_backend.factory import open_simulated_rig
from dearig.sim_backend.laser import Laser
from dearig.sim_backend.model_plant import ModelPlant
from dearig.sim_backend.rig import SimulatedRig
from dearig.sim_backend.streams import Streams
from dearig.sim_backend.truth.plant import TruthPlant

RATE = 1000.0
REPEATS = 15
PARTS: tuple[tuple[str, type, str], ...] = (
    ("film (model)", ModelPlant, "advance"),
    ("film (truth)", TruthPlant, "advance"),
    ("amplifier", Amplifier, "advance"),
    ("amplifier", Amplifier, "outputs"),
    ("laser", Laser, "read"),
    ("converters", Converters, "convert"),
    ("noise generators", Streams, "of_chunk"),
)


def thesis_record(settings: RigSettings) -> GatedWaveform:
    """Two periods of the identification set, framed by 2 s and 1 s of quiet."""
    lobes = []
    for amplitude, frequency in zip(
        (6.0, 6.5, 7.0, 7.5, 8.0), (0.2, 0.4, 0.6, 0.8, 1.0), strict=True
    ):
        elapsed = np.arange(round(RATE / frequency)) / RATE
        lobes.append(amplitude * 1e3 * np.sin(np.pi * frequency * elapsed))
    voltage = np.concatenate((np.zeros(2000), *lobes, *lobes, np.zeros(1000)))
    field_per_volt = np.full(voltage.size, 1.25 / THESIS_FILM.thickness)
    foreseen = FilmForecast(field_per_volt, THESIS_FILM.electric_volume)
    return admit(voltage, RATE, settings.limits.gate_limits(), foreseen)


def play(rig: SimulatedRig, waveform: GatedWaveform) -> None:
    rig.load(waveform)
    rig.arm()
    rig.start()
    while rig.read() is not None:
        pass


class Stopwatch:
    """Adds up the time spent inside methods that it stands in for."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._inside = 0.0

    def around(self, name: str, method: Callable[..., Any]) -> Callable[..., Any]:
        def timed(*args: Any, **kwargs: Any) -> Any:
            outer, self._inside = self._inside, 0.0
            before = time.perf_counter()
            try:
                return method(*args, **kwargs)
            finally:
                spent = time.perf_counter() - before
                # what was spent in a part inside this one is that part's
                self.seconds[name] = self.seconds.get(name, 0.0) + spent - self._inside
                self._inside = outer + spent

        return timed


def shares(rig: SimulatedRig, waveform: GatedWaveform) -> tuple[dict[str, float], float]:
    """Seconds of one record by part, and in all (a little slower for being watched)."""
    watch = Stopwatch()
    originals = [(owner, name, getattr(owner, name)) for _, owner, name in PARTS]
    try:
        for part, owner, name in PARTS:
            setattr(owner, name, watch.around(part, getattr(owner, name)))
        before = time.perf_counter()
        for _ in range(REPEATS):
            play(rig, waveform)
        total = time.perf_counter() - before
    finally:
        for owner, name, method in originals:
            setattr(owner, name, method)
    return {part: s / REPEATS for part, s in watch.seconds.items()}, total / REPEATS


def main() -> None:
    settings = RigSettings(thermometer=ThermometerSettings())
    waveform = thesis_record(settings)
    seconds = waveform.samples / RATE
    for address in ("sim", "sim:1"):
        rig = open_simulated_rig(address, settings, THESIS_FILM, THESIS_LOAD)
        play(rig, waveform)  # compiles
        best = np.inf
        for _ in range(REPEATS):
            before = time.perf_counter()
            play(rig, waveform)
            best = min(best, time.perf_counter() - before)
        print(
            f"{address}: {seconds:.1f} s in {best * 1e3:.1f} ms, {seconds / best:.0f} x real time"
        )
        parts, total = shares(rig, waveform)
        parts["the rest"] = total - sum(parts.values())
        for part, spent in sorted(parts.items(), key=lambda item: -item[1]):
            print(f"    {part:<18}{spent * 1e3:7.2f} ms  {100.0 * spent / total:4.0f} %")


if __name__ == "__main__":
    main()
