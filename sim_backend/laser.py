"""Laser displacement sensor: a moving average on its own clock, output as a voltage.

Between two nodes of the film's motion the position is the cubic Hermite interpolant of position and
velocity. The sum of a cubic over evenly spaced instants has a closed form, so a moving average over
thousands of internal samples costs no more than one over a few.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dearig.drivers.settings import LaserSettings
from dearig.model.compiled.jit import allocating, jit
from dearig.sim_backend.laser_noise import WHITE, LaserNoise
from dearig.sim_backend.streams import Streams

__all__ = ["Laser", "LaserRows", "LaserState"]


@jit
def _instants_before(time: float, phase: float, period: float) -> int:
    """Return the number j of the first instant ``phase + j period`` at or after ``time``."""
    return math.ceil((time - phase) / period)


@jit
def _partial_sum(
    position: np.ndarray,
    velocity: np.ndarray,
    node: int,
    spacing: float,
    first: float,
    step: float,
    count: int,
) -> float:
    """Return the sum of ``count`` positions in one interval, at ``first + k step`` s into it."""
    p0, v0 = position[node], velocity[node] * spacing
    rise, v1 = position[node + 1] - p0, velocity[node + 1] * spacing
    c2 = 3.0 * rise - 2.0 * v0 - v1
    c3 = v0 + v1 - 2.0 * rise
    # the cubic as a function of the sample number i: theta = a + b i
    a, b = first / spacing, step / spacing
    k0 = p0 + a * (v0 + a * (c2 + a * c3))
    k1 = b * (v0 + a * (2.0 * c2 + 3.0 * a * c3))
    k2 = b * b * (c2 + 3.0 * a * c3)
    k3 = b * b * b * c3
    n = float(count)
    s1 = 0.5 * n * (n - 1.0)
    s2 = s1 * (2.0 * n - 1.0) / 3.0
    return float(k0 * n + k1 * s1 + k2 * s2 + k3 * s1 * s1)


@jit
def _sum_up_to(
    instant: int,
    position: np.ndarray,
    velocity: np.ndarray,
    first_node: int,
    spacing: float,
    phase: float,
    period: float,
    numbers: np.ndarray,
    sums: np.ndarray,
) -> float:
    """Return the sum of all positions from the first node up to and including ``instant``.

    Before the first node the film rests at its position there; the sum is then negative.
    """
    if instant < numbers[0]:
        return float(-position[0] * (numbers[0] - 1 - instant))
    node = int((phase + instant * period) / spacing) - first_node
    node = min(max(node, 0), numbers.shape[0] - 2)
    while numbers[node] > instant:
        node -= 1
    while numbers[node + 1] <= instant:
        node += 1
    number = numbers[node]
    into = phase + number * period - (first_node + node) * spacing
    count = instant - number + 1
    return float(sums[node] + _partial_sum(position, velocity, node, spacing, into, period, count))


@allocating
def _averages(
    position: np.ndarray,
    velocity: np.ndarray,
    first_node: int,
    spacing: float,
    phase: float,
    period: float,
    averaging: int,
    times: np.ndarray,
    out: np.ndarray,
) -> None:
    """Return the moving averages on the output at ``times`` (N,) s, all within the nodes' span."""
    nodes = position.shape[0]
    numbers = np.empty(nodes, dtype=np.int64)
    sums = np.zeros(nodes)
    for i in range(nodes):
        numbers[i] = _instants_before((first_node + i) * spacing, phase, period)
    for i in range(nodes - 1):
        count = numbers[i + 1] - numbers[i]
        into = phase + numbers[i] * period - (first_node + i) * spacing
        inside = _partial_sum(position, velocity, i, spacing, into, period, count)
        sums[i + 1] = sums[i] + inside
    for k in range(times.shape[0]):
        last = math.floor((times[k] - phase) / period)
        last = min(last, numbers[nodes - 1] - 1)
        upper = _sum_up_to(
            last, position, velocity, first_node, spacing, phase, period, numbers, sums
        )
        lower = _sum_up_to(
            last - averaging, position, velocity, first_node, spacing, phase, period, numbers, sums
        )
        out[k] = (upper - lower) / averaging


@dataclass(frozen=True)
class LaserState:
    """Past samples that the moving average still needs.

    ``position`` and ``velocity`` (K,) are the nodes since ``first_node``; there are none before the
    first read. ``draws`` (Q, 2) is the noise of the last sample intervals, ``kind`` the state of
    the noise's kind. ``alarm`` is True while the film is out of range.
    """

    first_node: int
    position: np.ndarray
    velocity: np.ndarray
    draws: np.ndarray
    kind: np.ndarray
    alarm: bool = False


@dataclass(frozen=True)
class LaserRows:
    """Analog output ``volts`` (N,), and ``alarm`` (N,), True where the film is out of range."""

    volts: np.ndarray
    alarm: np.ndarray


class Laser:
    """Sensor in one run, read once every ``interval`` s; the state is passed in and out."""

    def __init__(
        self,
        settings: LaserSettings,
        streams: Streams,
        run: int,
        interval: float,
        spacing: float,
        noise: str = WHITE,
    ) -> None:
        self._settings = settings
        self._streams = streams
        self._run = run
        self._interval = interval
        self._spacing = spacing  # of the nodes of the film's motion, s
        self._period = settings.sampling_us * 1e-6 * (1.0 + settings.clock_error_ppm * 1e-6)
        generator = streams.before_run("laser", run)
        self._phase = generator.uniform(0.0, self._period)
        self._whole, self._part = divmod(settings.averaging * self._period, interval)
        self._before = generator.standard_normal((int(self._whole) + 1, 2))
        self._kind = LaserNoise(noise, interval, settings.window)
        self._kind_before = self._kind.start(streams.before_run("laser_noise", run))

    def start(self) -> LaserState:
        """Return the state before the first read."""
        return LaserState(0, np.zeros(0), np.zeros(0), self._before, self._kind_before)

    def read(
        self,
        position: np.ndarray,
        velocity: np.ndarray,
        times: np.ndarray,
        chunk: int,
        chunk_samples: int,
        state: LaserState,
    ) -> tuple[LaserRows, LaserState]:
        """Read at ``times`` (N,) s a film with ``position`` m and ``velocity`` m/s at nodes (K,).

        The first node is the last one of the previous read (kept in the state), if there was one.
        The times lie within the nodes.
        """
        settings = self._settings
        if state.position.size:
            position = np.concatenate((state.position, position[1:]))
            velocity = np.concatenate((state.velocity, velocity[1:]))
        mean = np.empty(times.size)
        _averages(
            position,
            velocity,
            state.first_node,
            self._spacing,
            self._phase,
            self._period,
            settings.averaging,
            times,
            mean,
        )
        noise, draws = self._noise(times.size, chunk, chunk_samples, state.draws)
        noise, kind = self._kind.shape(
            noise,
            chunk_samples,
            self._streams.of_chunk("laser_noise", self._run, chunk),
            state.kind,
        )
        reading = settings.rest_position_mm * 1e-3 + mean + settings.noise_um * 1e-6 * noise
        step = max(settings.resolution_um * 1e-6, self._kind.step)
        if step > 0.0:
            reading = np.rint(reading / step) * step
        limit = settings.range_mm * 1e-3
        alarm = np.abs(reading) > limit
        reading = np.clip(reading, -limit, limit)
        volts = settings.direction * reading * 1e3 / settings.mm_per_V
        # the first time of the next read needs the oldest instant of the window
        keep = math.ceil((settings.averaging + 1) * self._period / self._spacing) + 1
        cut = max(0, position.size - 1 - keep)
        after = LaserState(
            state.first_node + cut, position[cut:], velocity[cut:], draws, kind, bool(alarm[-1])
        )
        return LaserRows(volts, alarm), after

    def _noise(
        self, samples: int, chunk: int, chunk_samples: int, before: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return (N,) noise of unit variance, correlated where the readings' windows overlap.

        White noise averaged over a window is the increment of a random walk over it. The window
        spans ``whole`` sample intervals and a ``part`` of one. Each interval's increment is
        therefore drawn in two pieces, before and after the window's far edge. Readings that share
        pieces then have the correlation of overlapping windows.
        """
        generator = self._streams.of_chunk("laser", self._run, chunk)
        fresh = generator.standard_normal((chunk_samples, 2))[:samples]
        draws = np.concatenate((before, fresh))
        window = self._whole * self._interval + self._part
        late = math.sqrt(self._part / window) * draws[:, 1]
        whole = int(self._whole)
        # rows before + k - whole .. before + k - 1 are whole intervals, the one before them a part
        noise = late[:samples].copy()
        if whole:
            early = math.sqrt((self._interval - self._part) / window) * draws[:, 0]
            walk = np.concatenate(([0.0], np.cumsum(early + late)))
            noise += walk[1 + whole : 1 + whole + samples] - walk[1 : 1 + samples]
        return noise, draws[-(whole + 1) :]
