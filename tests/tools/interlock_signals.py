"""Made-up samples of a run for the interlocks' tests, and ways to spoil them."""

import itertools

import numpy as np

from dearig.drivers.interlocks import Interlocks, Trip
from dearig.drivers.rig import Block
from dearig.drivers.settings import AmplifierSettings, InterlockSettings, LaserSettings, RigSettings

RATE = 1000.0
QUIET = 100  # samples of lead-in
REST = 6.4e-3  # m, reading of the loaded rest state
NAMES = ("voltage_command", "voltage_monitor", "current_monitor", "displacement")
#: Calibrations of the inputs as a card has them.
COEFFICIENTS = {
    "voltage_command": (0.0, 10.0 / 32768),
    "voltage_monitor": (1e-3, 10.0 / 32768 * 1.0002, 1e-12, -1e-17),
    "current_monitor": (-1e-3, 10.0 / 32768 * 0.9998, 1e-12, 1e-17),
    "displacement": (5e-4, 10.0 / 32768 * 1.0001, -1e-12, 1e-17),
}


class Signals:
    """A healthy run: half-sine lobes of 6 kV and 0.5 s, the film following."""

    def __init__(
        self,
        samples=2000,
        rate=RATE,
        laser: LaserSettings | None = None,
        amplifier: AmplifierSettings | None = None,
        **locks,
    ):
        self.settings = RigSettings(
            interlocks=InterlockSettings(**locks),
            laser=laser or LaserSettings(),
            amplifier=amplifier or AmplifierSettings(),
        )
        self.rate = rate
        self.channels = self.settings.channels(COEFFICIENTS)
        time = np.maximum(0.0, np.arange(samples) / rate - QUIET / RATE)
        self.planned = 6000.0 * np.abs(np.sin(np.pi * time / 0.5))
        self.predicted = 3e-11 * self.planned**2
        self.voltage_command = self.planned.copy()
        self.voltage_monitor = self.planned.copy()
        self.current_monitor = np.zeros(samples)
        noise = np.random.default_rng(0).standard_normal(samples)
        self.displacement = REST + self.predicted + 1e-6 * noise

    def counts(self):
        rows = (c.scaling.counts(getattr(self, c.name)) for c in self.channels)
        return np.stack(list(rows))

    def interlocks(self, plan=True):
        planned = self.planned if plan else None
        return Interlocks(self.settings, self.channels, self.rate, self.predicted, planned)

    def trips(self, cuts=(), plan=True):
        return watch(self.interlocks(plan), self.counts(), cuts)

    def tripped(self, **more):
        return {trip.interlock: trip.sample for trip in self.trips(**more)}


def watch(interlocks: Interlocks, counts: np.ndarray, cuts=()) -> list[Trip]:
    edges = [0, *sorted(cuts), counts.shape[1]]
    trips: list[Trip] = []
    for begin, end in itertools.pairwise(edges):
        trips += interlocks.watch(Block(begin, counts[:, begin:end]))
    return trips


PEAK = QUIET + 250  # 6 kV, and 1.08 mm


def monitor(s, at):
    s.voltage_monitor[at] += 1600.0


def breakdown(s, at):
    s.voltage_monitor[at] *= 0.39


def current(s, at):
    s.current_monitor[at] = -0.0201


def laser(s, at):
    s.displacement[at] = 0.040


def displacement(s, at):
    s.displacement[at] = REST + 25.1e-3


def following(s, at):
    s.displacement[at] = REST + 0.19 * s.predicted[at]
