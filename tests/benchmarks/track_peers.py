"""Ways to follow a path without a model: a PID loop in software, and learning without a model.

Both act on the voltage squared, to which a film's displacement is nearly proportional.

The PID loop reads every 20 ms, and its answer reaches the film 20 ms later: a fast loop for a
program on a desktop computer, which writes single values to the card. It is tuned as a careful
user would: a step, the three numbers of a first-order lag with dead time from it (two points: C. L.
Smith, Digital Computer Process Control, 1972), the SIMC rule with the closed-loop time equal to the
dead time (S. Skogestad, J. Process Control 13, 291 (2003)), and then each gain on its own up and
down, on the path itself, for as long as that makes the error smaller.

Learning without a model inverts the measured frequency response (inversion-based iterative
control: S. Tien, Q. Zou and S. Devasia, IEEE Trans. Control Systems Technology 13, 921 (2005)). A
multisine about the middle of the path is played, its second and third period are averaged, and

    u_0 = Q/H reference,    u_(k+1) = u_k + 0.8 Q/H error.

Q has no phase and passes up to 10 Hz: twice the fastest sine of the paths, and above the resonance
of the loaded film. The gain of 0.8 converges where the response of the film is within a factor 0
to 2.5 of the measured one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from dearig.model.control import VoltageLimits
from dearig.model.control.bands import padded_length, pass_band
from dearig.sim_backend.plant import Plant

__all__ = ["Gains", "Learning", "Loop", "Path", "Response", "Rig", "lowered", "simc", "tuned"]

LEARNED = 0.8  # of the error, in each run
EDGE = 10.0  # Hz: up to where Q passes all; nothing from twice that on
PERIOD = 10.0  # s of the multisine: lines every 0.1 Hz, up to where Q ends
SWING = 0.25  # of its middle: how far the multisine moves the voltage squared either way
STEP = (0.4, 0.6)  # of the largest voltage squared of the path
SETTLING = 2.0  # s after which a step counts as answered: the film creeps on
FACTORS = (2.0, 0.5, 1.3, 1.0 / 1.3)  # by which a gain is turned, coarse before fine
HALVINGS = 6  # of the gains of the rule, which knows no resonance
LOWERED = 0.8  # of the gains, in each step with which they are made gentler in the end
TRIALS = 40  # runs with which a user tunes at most


@dataclass(frozen=True, eq=False)
class Path:
    """A displacement (N,) m to follow at ``rate`` Hz; only where ``counted`` (N,) is it judged.

    The voltage is 0 V where ``inside`` (N,) is False.
    """

    reference: np.ndarray
    counted: np.ndarray
    inside: np.ndarray
    rate: float
    limits: VoltageLimits

    def part(self, of: slice) -> Path:
        """Return a part of the path, for tuning."""
        return replace(
            self,
            reference=self.reference[of],
            counted=self.counted[of],
            inside=self.inside[of],
        )

    def error(self, measured: np.ndarray) -> float:
        """Return the RMS error in m of ``measured`` (N,) m."""
        missed = (self.reference - measured)[self.counted]
        return float(np.sqrt(np.mean(missed**2))) if np.isfinite(missed).all() else math.inf


@dataclass(frozen=True)
class Rig:
    """A film at rest whose readings have normal ``noise`` in m; ``gain`` in m/V^2 is static.

    ``gain`` is what a person knows who measured one displacement at one voltage.
    """

    plant: Plant
    noise: float
    gain: float
    generator: np.random.Generator

    def at_rest(self) -> Plant:
        """Return the film at the begin of another run."""
        return self.plant.renewed(np.random.default_rng(self.generator.integers(2**31)))

    def read(self, moved: np.ndarray) -> np.ndarray:
        """Return the readings of displacements ``moved`` (N,) m."""
        return moved + self.noise * self.generator.standard_normal(moved.size)

    def play(self, voltage: np.ndarray, rate: float) -> np.ndarray:
        """Return the readings (N,) m under ``voltage`` (N,) V; NaN where the film has failed."""
        motion, _ = self.at_rest().advance(np.arange(voltage.size) / rate, voltage, True)
        reading = self.read(motion.displacement)
        if motion.fault is not None:
            reading[motion.fault_at :] = math.nan
        return reading


# ------------------------------------------------------------ PID

#: The voltage in V that answers a sample, from its number, its reading in m, and the last voltage.
Answer = Callable[[int, float, float], float]


@dataclass(frozen=True)
class Response:
    """A first-order lag with dead time: ``gain`` m/V^2, ``lag`` s and ``dead_time`` s."""

    gain: float
    lag: float
    dead_time: float


@dataclass(frozen=True)
class Gains:
    """Gains of a PID loop in V^2/m, V^2/(m s) and V^2 s/m.

    ``ahead`` in V^2/m is that of the reference's own voltage squared, 0 for feedback alone.
    """

    proportional: float
    integral: float
    derivative: float = 0.0
    ahead: float = 0.0


def simc(of: Response) -> Gains:
    """Return the PI gains of the SIMC rule, with a closed-loop time equal to the dead time."""
    slowed = 2.0 * of.dead_time  # closed-loop time plus dead time
    # Kc = lag/(K slowed), and Kc/tau_I with tau_I = min(lag, 4 slowed): pure I without a lag
    proportional = of.lag / (of.gain * slowed)
    return Gains(proportional, max(1.0 / (of.gain * slowed), proportional / (4.0 * slowed)))


@dataclass(frozen=True)
class Loop:
    """A loop in software: a reading every ``period`` s, answered ``latency`` s later."""

    rig: Rig
    limits: VoltageLimits
    rate: float
    period: float = 0.02
    latency: float = 0.02

    def follow(self, path: Path, gains: Gains) -> np.ndarray:
        """Return the readings (N,) m while the loop follows ``path``."""
        late = round(self.latency * self.rate)
        reference, inside = path.reference, path.inside
        summed, before = 0.0, math.nan

        def answer(k: int, reading: float, last: float) -> float:
            nonlocal summed, before
            error = reference[k] - reading
            rising = 0.0 if math.isnan(before) else (reading - before) / self.period
            before = reading
            # the reference is known, so its own voltage needs no delay
            known = gains.ahead * reference[min(k + late, reference.size - 1)]
            asked = known + gains.proportional * error + summed - gains.derivative * rising
            if not inside[min(k + late, inside.size - 1)]:
                summed = 0.0
                return 0.0
            allowed = min(max(asked, 0.0), self.limits.voltage**2)
            # the integral stands still where the voltage is at a limit, and would go beyond it
            if allowed == asked or (asked - allowed) * error < 0.0:
                summed += gains.integral * error * self.period
            most = self.limits.slew * self.period
            return min(max(math.sqrt(allowed), last - most), last + most)

        return self._run(reference.size, answer)

    def step(self, low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
        """Return time (M,) s and readings (M,) m about a step of the voltage squared in V^2.

        Both are those of the loop: time 0 is when the reading was taken that the step answers.
        """
        at = round(SETTLING / self.period) * round(self.period * self.rate)
        reading = self._run(2 * at + 1, lambda k, _, __: math.sqrt(high if k >= at else low))
        every = round(self.period * self.rate)
        return (np.arange(reading.size)[::every] - at) / self.rate, reading[::every]

    def _run(self, samples: int, answer: Answer) -> np.ndarray:
        """Return the readings (N,) m of a run in which ``answer`` gives the voltage."""
        every, late = round(self.period * self.rate), round(self.latency * self.rate)
        voltage, moved = np.zeros(samples + late + every), np.zeros(samples)
        plant, last = self.rig.at_rest(), 0.0
        for k in range(0, samples - 1, every):
            stop = min(k + every, samples - 1)
            last = answer(k, float(self.rig.read(moved[k : k + 1])[0]), last)
            voltage[k + late :] = last
            motion, plant = plant.advance(
                np.arange(k, stop + 1) / self.rate, voltage[k : stop + 1].copy(), True
            )
            moved[k : stop + 1] = motion.displacement
            if motion.fault is not None:
                moved[k:] = math.nan
                return moved
        return self.rig.read(moved)

    def identify(self, path: Path) -> Response:
        """Return what a step in the middle of the path shows, dead time of the loop included."""
        largest = float(path.reference.max()) / self.rig.gain
        low, high = (part * largest for part in STEP)
        time, reading = self.step(low, high)
        settled = slice(-round(0.2 * SETTLING / self.period), None)
        before = float(np.mean(reading[(time > -0.2) & (time <= 0.0)]))
        after = float(np.mean(reading[settled]))
        part = np.maximum.accumulate((reading[time >= 0.0] - before) / (after - before))
        first, second = np.interp((0.283, 0.632), part, time[time >= 0.0])
        lag = 1.5 * float(second - first)
        return Response((after - before) / (high - low), lag, max(float(second) - lag, self.period))


def tuned(loop: Loop, path: Path, start: Gains | None = None) -> tuple[Gains, int]:
    """Return the gains with which ``loop`` follows ``path`` best, and how many runs that took.

    The SIMC rule gives the first ones, in place of ``start``; each gain is then turned by
    ``FACTORS`` while the error falls.
    """
    best = start or _by_rule(loop.identify(path))
    size, runs = path.error(loop.follow(path, best)), 1
    tried = best
    for _ in range(0 if start else HALVINGS):  # of all gains: until the loop does not swing
        tried = _times(tried, 0.5)
        missed, runs = path.error(loop.follow(path, tried)), runs + 1
        if missed < size:
            best, size = tried, missed
    improved = True
    while improved and runs < TRIALS:
        improved = False
        for name in ("integral", "proportional", "derivative"):
            for factor in FACTORS:
                turned = replace(best, **{name: factor * getattr(best, name)})
                missed, runs = path.error(loop.follow(path, turned)), runs + 1
                if missed < 0.99 * size:
                    best, size, improved = turned, missed, True
                    break
    return best, runs


def lowered(loop: Loop, path: Path, gains: Gains) -> Gains:
    """Return ``gains``, tuned on a part of ``path``, as much lower as is better on all of it."""
    size = path.error(loop.follow(path, gains))
    while True:
        less = _times(gains, LOWERED)
        missed = path.error(loop.follow(path, less))
        if missed >= size:
            return gains
        gains, size = less, missed


def _times(gains: Gains, factor: float) -> Gains:
    """Return ``gains`` of the feedback times a ``factor``."""
    return replace(
        gains,
        proportional=factor * gains.proportional,
        integral=factor * gains.integral,
        derivative=factor * gains.derivative,
    )


def _by_rule(found: Response) -> Gains:
    """Return the gains of the SIMC rule; what it leaves at 0 starts small, to be turned."""
    gains = simc(found)
    # small next to the integral action over a dead time
    least = 0.1 * gains.integral * found.dead_time
    return replace(
        gains,
        proportional=max(gains.proportional, least),
        derivative=least * found.dead_time,
    )


# ------------------------------------------------------------ learning without a model


class Learning:
    """Learning of the voltage of ``path`` on ``rig`` from its measured frequency response."""

    def __init__(self, rig: Rig, path: Path) -> None:
        self.rig, self.path = rig, path
        self._length = padded_length(path.reference.size)
        frequency = np.fft.rfftfreq(self._length, 1.0 / path.rate)
        lines, response = self.measure()
        # slower than the first line the film is as good as static; faster than the last Q is 0
        size = np.interp(frequency, lines, np.abs(response))
        phase = np.interp(frequency, lines, np.unwrap(np.angle(response)), left=0.0)
        self._inverse = pass_band(frequency, EDGE) * np.exp(-1j * phase) / size

    def measure(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the lines (M,) in Hz of a multisine, and the response (M,) in m/V^2 there."""
        rate, n = self.path.rate, round(PERIOD * self.path.rate)
        lines = np.arange(1, round(2.0 * EDGE * PERIOD) + 1)
        # phases of M. R. Schroeder, IEEE Trans. Information Theory 16, 85 (1970): a low crest
        spectrum = np.zeros(n // 2 + 1, dtype=complex)
        spectrum[lines] = np.exp(-1j * math.pi * lines * (lines - 1) / lines.size)
        waves = np.fft.irfft(spectrum, n)
        middle = 0.5 * float(self.path.reference.max()) / self.rig.gain
        u = middle * (1.0 + SWING * waves / np.abs(waves).max())
        rise = np.linspace(0.0, u[0], round(rate))
        voltage = np.sqrt(np.concatenate([rise, np.tile(u, 3)]))
        reading = self.rig.play(np.minimum(voltage, self.path.limits.voltage), rate)
        repeated = reading[-2 * n :].reshape(2, n).mean(axis=0)
        response = np.fft.rfft(repeated)[lines] / np.fft.rfft(u)[lines]
        return lines / PERIOD, response

    def runs(self, iterations: int, start: np.ndarray | None = None) -> list[np.ndarray]:
        """Return the readings (N,) m of the first run, and of so many ``iterations``.

        ``start`` (N,) in V^2 replaces the voltage squared of the first one.
        """
        path = self.path
        ceiling = np.where(path.inside, path.limits.voltage, 0.0)
        u = self._through(path.reference) if start is None else start
        readings = []
        for _ in range(iterations + 1):
            voltage = path.limits.nearest(np.sqrt(np.maximum(u, 0.0)), ceiling, path.rate)
            readings.append(self.rig.play(voltage, path.rate))
            error = np.where(path.counted, path.reference - readings[-1], 0.0)
            # what stands at a limit winds nothing up
            u = voltage * voltage + LEARNED * self._through(np.nan_to_num(error))
        return readings

    def _through(self, values: np.ndarray) -> np.ndarray:
        spectrum = np.fft.rfft(values, self._length) * self._inverse
        return np.fft.irfft(spectrum, self._length)[: values.size]
