"""Iterative learning control: the voltage of the next run from the error of the last.

The method is that of A. Schoellig, F. Mueller and R. D'Andrea, Autonomous Robots 33, 103 (2012):
each run gives an estimate of what the model lacks along the path,

    d_j = measured - reading of the model under the same voltage,                       (1)

and the next voltage is the one with which the model follows ``reference - Q d_j``, computed under
all limits of the voltage (``inversion``). It was chosen because the limits act inside the
computation: a film that stands at 0 V winds nothing up. For a linear film it is u + Q L e
with the learning filter L = 1/(r G), G of the linearised model. The known condition holds (D. A.
Bristow, M. Tharayil and A. G. Alleyne, IEEE Control Systems 26(3), 96 (2006)): the error shrinks
from run to run, at every frequency, where

    |Q (1 - L G_true)| = |Q| W < 1,    W = |G_true/(r G) - 1|.                          (2)

The ratio r of the film's response to the model's is that of the first run, where the path has
power: learning by the measured response, as K.-S. Kim and Q. Zou, IEEE/ASME Trans. Mechatronics 18,
1767 (2013), but nothing is divided by what was not excited. W is taken from the model's uncertainty
(``alternatives``) where no run has shown it, else from the runs: the ratio of the spectra of what r
leaves and of the prediction, over two octaves. After a run that has learned, it is the part of the
error that is left in the band that was learned. Beyond what was seen W grows with the square of the
frequency, as the error of a mass does. The filter Q of no phase passes what keeps |Q| W below
``CONTRACTION``. Where nothing does, nothing is learned.

What a run had alone, noise and a drift of the sensor, is learned as well as what repeats, and makes
the next run worse by its own power. So a step counts only if the mean square error falls by more
than two standard errors, those of white noise. The first one that does not ends the learning, and
the voltage before it is kept. Where the error grows by more than all that was learned, the film
responds otherwise than the model says: that run is stepped back from, and less is learned.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy  # loads its parts when they are first used, which a run may never do

from dearig.model.control.bands import low_pass, pass_band
from dearig.model.control.inversion import Inversion, invert
from dearig.model.control.learning_settings import LearningSettings
from dearig.model.control.linear import level_of, linearise
from dearig.model.control.readings import bridged, has_jump, sorted_out
from dearig.model.control.task import TrackingTask
from dearig.model.errors import ModelError
from dearig.model.simulation.actuator import Actuator

__all__ = ["Learner", "Lesson"]

_IS_NOISE = "the error is noise: nothing more is learned, and its voltage is kept"
_NO_BETTER = (
    "what was learned last has not made the error significantly smaller: nothing more is learned, "
    "and the voltage before it is kept"
)
#: Lines of a spectrum in which an error of the zero shows: that of a constant over most of a path
#: falls as 1/(pi k) at line k, to a hundredth of its power at the third.
_LOWEST = 3


@dataclass(frozen=True, eq=False)
class Lesson:
    """What a run taught: its error, and the voltage of the next run.

    ``rms`` and ``largest`` in m are of reference minus measured, over the ``samples`` that the film
    can reach and that could be used; NaN where there are none. ``voltage`` (N,) in V is the next
    one. ``learned`` is False where it is that of a former run. ``edge`` in Hz is where Q begins to
    fall, ``contraction`` the largest |Q| W, NaN where the error is noise. ``notes`` are sentences
    on what was left out.
    """

    rms: float
    largest: float
    samples: int
    voltage: np.ndarray
    learned: bool
    edge: float
    contraction: float
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Run:
    """A run as far as it is remembered."""

    played: Inversion
    known: np.ndarray  # (N,) m: Q d before it
    lacking: np.ndarray  # (N,) m: d of it
    rms: float
    error: np.ndarray  # (N,) m: reference minus measured
    counted: np.ndarray  # (N,): where that is known and can be reached
    left: np.ndarray  # (M,) m: amplitudes of its error
    edge: float  # Hz: of what its voltage was learned with, 0 for the first

    def mean_square(self, noise: float, where: np.ndarray) -> tuple[float, float]:
        """Return the mean square of the error in m^2 ``where`` (N,), and its standard error.

        With white ``noise`` n (standard deviation in m) on a repeatable error r, the variance of
        the mean of (r + n)^2 over N samples is (4 r^2 noise^2 + 2 noise^4)/N.
        """
        squares = np.square(self.error[where])
        if squares.size == 0:
            return np.inf, 0.0
        mean, power = float(np.mean(squares)), noise * noise
        repeatable = max(mean - power, 0.0)
        return mean, float(np.sqrt((4.0 * repeatable + 2.0 * power) * power / squares.size))

    def is_noise(self, noise: float, readings: int, significant: float) -> bool:
        """Return whether its error is less than so many standard errors above the ``noise`` in m.

        The noise was measured from so many ``readings`` at rest: its power is known to a part
        sqrt(2/readings).
        """
        power = noise * noise
        alone = power * np.sqrt(2.0 / max(int(np.count_nonzero(self.counted)), 1) + 2.0 / readings)
        return bool(self.mean_square(noise, self.counted)[0] - power <= significant * alone)


@dataclass(frozen=True, eq=False)
class _Step:
    """What was learned from a run."""

    before: np.ndarray  # (M,) m: amplitudes of the error of that run
    edge: float  # Hz: of Q
    power: float  # m^2: mean square of the change of what is known


class Learner:
    """Learns the voltage of a target from run to run.

    Parameters
    ----------
    model, task
        As of ``invert``; ``first`` is its result.
    alternatives : sequence of Actuator
        Models that the data allow as well, each as far from ``model`` as they may be 95 % of the
        time in one of their independent directions: what they differ by adds in squares.
    settings : LearningSettings, optional
        Numbers of the learning.
    """

    def __init__(
        self,
        model: Actuator,
        task: TrackingTask,
        *,
        alternatives: Sequence[Actuator] = (),
        settings: LearningSettings | None = None,
    ) -> None:
        self._settings = settings or LearningSettings()
        self._model, self._task, self._rate, self._noise = model, task, task.rate, 0.0
        self.first: Inversion = invert(model, task)
        self._inside = task.inside
        self._edge = task.edge
        self._frequency = np.fft.rfftfreq(task.samples, 1.0 / task.rate)
        # a path has lines of little power between its own, so narrower bands tell of chance
        self._bands = _bands(self._frequency.size, self._settings.octaves)
        self._uncertain = self._spread(alternatives)
        self._now = self.first
        self._known = np.zeros(self.first.time.size)
        self._ratio = np.ones(self._frequency.size, dtype=complex)  # see _film_over_model
        self._stated_up_to = 1  # line
        self._best: _Run | None = None
        self._lacking: list[np.ndarray] = []  # raw, of the last runs
        self._learned: _Step | None = None  # the last step
        self._failed = 0  # steps since the best run
        self.settled = ""  #: why nothing more is learned

    @property
    def voltage(self) -> np.ndarray:
        """The voltage (N,) in V of the next run."""
        return self._now.voltage

    @property
    def expected(self) -> np.ndarray:
        """The displacement (N,) in m that is expected of the next run."""
        return self._now.reading + self._known

    @property
    def is_at_noise(self) -> bool:
        """Whether nothing more is learned because the error is noise."""
        return self.settled == _IS_NOISE

    @property
    def best_rms(self) -> float:
        """The smallest error in m of any run, inf before the first."""
        return np.inf if self._best is None else self._best.rms

    def learn(self, reading: np.ndarray, noise: float, valid: np.ndarray | None = None) -> Lesson:
        """Learn from the ``reading`` (N,) m of a run of ``voltage``; return what follows.

        ``noise`` is the standard deviation in m of a single reading. ``valid`` (N,) is False for
        readings that must not be used. Readings that are not finite, stuck, or spikes are not used
        either. Whatever the reading is, the next voltage is within
        the limits. Raises ``ModelError`` for a noise that is not above 0.
        """
        if not 0.0 < noise < np.inf:
            raise ModelError(f"noise = {noise!r} m must be above 0")
        task, settings = self._task, self._settings
        found = sorted_out(
            reading, valid, self._now.reading, noise, task.rate, task.lead_in, settings
        )
        self._noise = noise = found.noise
        usable, notes = found.usable, found.notes
        # (1), with readings that cannot be used interpolated
        lacking = bridged(found.values - self._now.reading, self._known, usable)
        reading = self._now.reading + lacking  # without what was sorted out
        counted = usable & self.first.reachable & ~self._let_go(reading, notes)
        error = np.where(counted, self.first.reference - reading, 0.0)
        rms, largest, samples = np.nan, np.nan, int(np.count_nonzero(counted))
        if samples:
            rms = float(np.sqrt(np.mean(error[counted] ** 2)))
            largest = float(np.abs(error).max())
        if np.count_nonzero(usable & self._inside) < settings.usable * np.count_nonzero(
            self._inside
        ):
            notes.append("too few readings can be used: nothing is learned from this run")
            return self._lesson(rms, largest, samples, learned=False, notes=notes)
        if self.settled:
            notes.append(self.settled)
            return self._lesson(rms, largest, samples, learned=False, notes=notes)
        best = self._best
        if best is None:
            self._ratio, self._stated_up_to = self._film_over_model(lacking)
        left = np.abs(np.fft.rfft(error))
        edge = 0.0 if self._learned is None else self._learned.edge
        run = _Run(self._now, self._known, lacking, rms, error, counted, left, edge)
        if best is not None:
            # where both were measured: a part that one run lacks says nothing of the other
            both = run.counted & best.counted
            (now, within), (before, before_within) = (
                one.mean_square(noise, both) for one in (run, best)
            )
            scatter = settings.significant * np.hypot(within, before_within)
            # two standard errors; what did not repeat and was learned adds at most its power
            added = 0.0 if self._learned is None else self._learned.power
            if now > before + added + scatter:
                return self._step_back(best, rms, largest, samples, notes)
            if now > before - scatter:
                self._settle(best, _NO_BETTER, notes)
                return self._lesson(rms, largest, samples, learned=False, notes=notes)
        self._failed = 0
        self._best = replace(run, lacking=self._repeated(lacking, notes))
        return self._follow(self._best, rms, largest, samples, notes)

    # ------------------------------------------------------------ next voltage: reference - Q d

    def _follow(
        self, run: _Run, rms: float, largest: float, samples: int, notes: list[str]
    ) -> Lesson:
        """Take the next voltage from what ``run`` has shown."""
        at_rest = self._task.lead_in or self._task.samples
        if run.is_noise(self._noise, at_rest, self._settings.significant):
            self._settle(run, _IS_NOISE, notes)
            return self._lesson(rms, largest, samples, learned=False, notes=notes)
        edge, contraction = self._pass(run)
        if edge <= 0.0:
            notes.append(
                "the measured displacement has too little to do with the prediction: nothing is "
                "learned; check the sign of the laser, the film and the model"
            )
            self._known, self._now = run.known, run.played
            self._best = None  # the next run is as the first
            return self._lesson(rms, largest, samples, learned=False, notes=notes)
        change = np.where(self._inside, run.lacking - run.known, 0.0)
        weight = self._beyond_noise(change)
        # Q (d_j - d_(j-1)) over r, less the part that is noise
        step = self._over_ratio(low_pass(change, self._rate, edge), weight)
        self._known = run.known + step
        self._learned = _Step(run.left, edge, _mean_square(step[run.counted]))
        wanted = replace(self._task, target=self.first.reference - self._known)
        self._now = invert(self._model, wanted, start=run.played.voltage)
        return self._lesson(rms, largest, samples, learned=True, notes=notes, edge=edge,
                            contraction=contraction)  # fmt: skip

    def _settle(self, run: _Run, why: str, notes: list[str]) -> None:
        """Keep the voltage of ``run`` from now on."""
        self._best, self._known, self._now, self.settled = run, run.known, run.played, why
        notes.append(why)

    def _step_back(
        self, best: _Run, rms: float, largest: float, samples: int, notes: list[str]
    ) -> Lesson:
        """Go back to the run of the smallest error, and learn less of it."""
        failed = self._edge if self._learned is None else self._learned.edge
        # the band that made the best run is known to be safe
        self._edge = best.edge if 0.0 < best.edge < failed else failed / self._settings.widening
        self._learned = None
        notes.append(
            f"the error has grown from {best.rms * 1e6:.3g} um: the run is stepped back from, and "
            f"less is learned"
        )
        self._failed += 1
        if self._failed >= self._settings.step_backs:
            self._settle(best, _NO_BETTER, notes)
            return self._lesson(rms, largest, samples, learned=False, notes=notes)
        return self._follow(best, rms, largest, samples, notes)

    def _lesson(
        self,
        rms: float,
        largest: float,
        samples: int,
        *,
        learned: bool,
        notes: Sequence[str],
        edge: float = 0.0,
        contraction: float = np.nan,
    ) -> Lesson:
        return Lesson(rms, largest, samples, self.voltage, learned, edge, contraction, tuple(notes))

    # ------------------------------------------------------------ uncertainty: W and r of (2)

    def _spread(self, alternatives: Sequence[Actuator]) -> np.ndarray:
        """Return |G_other/(k G) - 1| (M,), the root of the squares of all ``alternatives``.

        ``k`` is a gain over the lines of the path, which learning finds on its own.
        """
        spread = np.zeros(self._frequency.size)
        square = np.square(self.first.voltage)
        if not alternatives or not square.any():
            return spread
        n, level = square.size, level_of(square)
        own = linearise(self._model, n, self._rate, level, self._task.lag)
        power = np.abs(np.fft.rfft(self.first.reading, own.length)) ** 2
        for other in alternatives:
            try:
                gain = linearise(other, n, self._rate, level, self._task.lag).gain
            except ModelError:  # it does not stand this voltage: the data rule it out
                continue
            ratio = gain / own.gain
            ratio = np.where(np.isfinite(ratio), ratio, 0.0)
            k = float(np.sum(power * ratio.real) / np.sum(power))
            off = np.abs(ratio / k - 1.0) if k > 0.0 else np.full(ratio.size, np.inf)
            spread = np.hypot(spread, np.interp(self._frequency, own.frequency, off))
        return spread

    def _pass(self, run: _Run) -> tuple[float, float]:
        """Return the edge in Hz of Q, and the largest |Q| W with it; 0 where nothing passes."""
        settings = self._settings
        highest, least = self._edge, self._rate / self.first.time.size
        off, seen = self._off_by_prediction(run.lacking)
        if self._learned is not None and self._learned.before is not run.left:
            before, learned = self._learned.before, self._learned.edge
            left = self._left(before, run.left)
            band = self._frequency <= learned
            if np.isnan(left[band]).all():
                return learned, float("nan")  # the error is noise: nothing more can be detected
            left = np.nan_to_num(left)
            beyond = left[band][-1] * np.maximum(self._frequency / learned, 1.0) ** 2
            off = np.where(band, left, np.minimum(off, beyond))
            highest = min(highest, settings.widening * learned)
            worst = float(np.max(left[band]))
            if worst > settings.contraction:
                # no wider: it still shrinks as a whole, or it does not
                shrinks = np.sum(run.left[band] ** 2) < np.sum(before[band] ** 2)
                return min(highest, learned if shrinks else learned / settings.widening), worst
        off = np.where(seen, off, np.maximum(off, self._uncertain))
        edge = min(highest, _widest(self._frequency, off, settings.contraction))
        if edge <= least:
            return 0.0, np.nan
        worst = float(np.max(pass_band(self._frequency, edge) * off))
        return edge, min(worst, settings.contraction)  # which rounding may exceed

    def _left(self, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """Return the part (M,) of an error that is left, from amplitudes; NaN where it is noise."""
        noise = self._noise_around(int(np.count_nonzero(self.first.reachable)))
        had, left = self._around(before), self._around(after)
        detected = np.maximum(had, left) > self._settings.detected * noise
        part = np.sqrt(np.maximum(left - noise, 0.0) / np.maximum(had, noise))
        return np.where(detected, part, np.nan)

    def _off_by_prediction(self, lacking: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return W (M,) from what the model ``lacking`` (N,) m shows in a run, and where it does.

        Where (M,) the path has too little power, the value is interpolated.
        """
        noise = self._noise_around(int(np.count_nonzero(self._inside)))
        more, moved = (
            np.fft.rfft(np.where(self._inside, row, 0.0)) for row in (lacking, self._now.reading)
        )
        expected = self._ratio * moved
        shown, predicted = self._around(np.abs(more + moved - expected)), self._around(expected)
        detected = np.flatnonzero(predicted > self._settings.detected * noise)
        if detected.size == 0:
            return np.full(shown.size, np.inf), np.zeros(shown.size, dtype=bool)
        ratio = np.sqrt(np.maximum(shown - noise, 0.0)[detected] / predicted[detected])
        lines = np.arange(shown.size)
        off, last = np.interp(lines, detected, ratio), self._stated_up_to
        # what the ratio corrects for at the last line of the path grows beyond it
        corrected = abs(self._ratio[last] / abs(self._ratio[0]) - 1.0)
        grown = max(off[last], corrected) * (lines / last) ** 2
        seen = np.zeros(shown.size, dtype=bool)
        seen[detected] = True
        return np.where(lines > last, np.maximum(off, grown), off), seen

    def _film_over_model(self, lacking: np.ndarray) -> tuple[np.ndarray, int]:
        """Return the film's response over the model's (M,), and the last line that tells of it.

        It is the cross-spectrum of measurement and prediction over the power of the prediction, in
        bands of ``ratio_octaves``, where that power is well above the noise. In between it is
        interpolated, beyond it stays. At the slowest line its size and its phase are kept within
        those of the settings.
        """
        settings = self._settings
        moved, more = (
            np.fft.rfft(np.where(self._inside, row, 0.0)) for row in (self._now.reading, lacking)
        )
        lines = np.arange(moved.size)
        low, high = _bands(moved.size, settings.ratio_octaves)

        def around(values: np.ndarray) -> np.ndarray:
            summed = np.concatenate([[0.0], np.cumsum(values)])
            return summed[high] - summed[low]

        power = around(np.abs(moved) ** 2)
        noise = self._noise**2 * np.count_nonzero(self._inside) * (high - low)
        clear = np.flatnonzero(power > settings.clear * noise)
        if clear.size == 0:
            return np.ones(moved.size, dtype=complex), 1
        ratio = (around((moved + more) * np.conj(moved)) / np.maximum(power, noise))[clear]
        size = np.clip(np.abs(ratio[0]), 1.0 / settings.ratio_max, settings.ratio_max)
        most = np.radians(settings.phase_max_deg)
        ratio[0] = size * np.exp(1j * np.clip(np.angle(ratio[0]), -most, most))
        whole = np.interp(lines, clear, ratio.real) + 1j * np.interp(lines, clear, ratio.imag)
        whole[0] = abs(whole[0])
        return whole, max(int(clear[-1]), 1)

    def _beyond_noise(self, change: np.ndarray) -> np.ndarray:
        """Return the part (M,) of the power of ``change`` (N,) m that is not noise (Wiener)."""
        power = self._around(np.fft.rfft(change))
        noise = self._noise_around(int(np.count_nonzero(self._inside)))
        return np.maximum(power - noise, 0.0) / np.maximum(power, noise)

    def _over_ratio(self, change: np.ndarray, weight: np.ndarray) -> np.ndarray:
        """Return ``change`` (N,) m of the film as one of the model, times ``weight`` (M,)."""
        first = abs(self._ratio[0])
        n, width = change.size, change.size // 2
        padded = np.pad(change, width, mode="edge")  # both ends are at rest
        lines = np.fft.rfftfreq(padded.size, 1.0 / self._rate)
        ratio = np.interp(lines, self._frequency, self._ratio.real) + 1j * np.interp(
            lines, self._frequency, self._ratio.imag
        )
        scaled = first * np.interp(lines, self._frequency, weight) / ratio
        extra = np.fft.irfft(np.fft.rfft(padded) * (scaled - 1.0), padded.size)
        return (change + extra[width : width + n]) / first

    def _around(self, amplitudes: np.ndarray) -> np.ndarray:
        """Return the power (M,) of ``amplitudes`` (M,) in two octaves about each frequency."""
        low, high = self._bands
        power = np.concatenate([[0.0], np.cumsum(np.abs(amplitudes) ** 2)])
        return power[high] - power[low]

    def _noise_around(self, samples: int) -> np.ndarray:
        """Return the power (M,) of the noise of so many ``samples``, as of ``_around``."""
        low, high = self._bands
        power = self._noise**2 * samples * (high - low)
        # the zero is the mean of the lead-in, and its error is that of all samples
        at_rest = max(self._task.lead_in, 1)
        power[:_LOWEST] += (self._noise * samples) ** 2 / at_rest
        return power

    # ------------------------------------------------------------ readings

    def _let_go(self, reading: np.ndarray, notes: list[str]) -> np.ndarray:
        """Return where the film is above the reference though nothing pulls: it returns slower."""
        settings = self._settings
        width = max(round(settings.released_s * self._rate), 1)
        highest = scipy.ndimage.maximum_filter1d(self._now.voltage, width, origin=(width - 1) // 2)
        away = scipy.ndimage.uniform_filter1d(reading - self.first.reference, width, mode="nearest")
        weak = settings.released_part
        least = max(settings.significant * self._noise, weak**2 * float(self.first.reference.max()))
        found = self._inside & (highest <= weak * self._task.limits.voltage) & (away > least)
        if np.count_nonzero(found) < width:
            return np.zeros(found.size, dtype=bool)
        time = self.first.time[found]
        notes.append(
            f"without a voltage the film returns more slowly than the model: from {time[0]:.4g} s "
            f"to {time[-1]:.4g} s it is up to {away[found].max() * 1e6:.3g} um above the target, "
            f"which no voltage changes"
        )
        return found

    def _repeated(self, lacking: np.ndarray, notes: list[str]) -> np.ndarray:
        """Return ``lacking`` (N,) m without what this run or the last one had alone.

        A jump of the difference of two runs is an event of one of them, a slip or a touch. Then the
        median of the last three runs counts, of two their mean.
        """
        self._lacking = [*self._lacking, lacking][-3:]
        if len(self._lacking) < 2:
            return lacking
        change = self._lacking[-1] - self._lacking[-2]
        if not has_jump(change, self._inside, self._noise, self._rate, self._settings):
            return lacking
        notes.append("something happened in one run only: it is not learned")
        return np.median(np.array(self._lacking), axis=0)


def _bands(lines: int, octaves: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the first line (M,), and the one after the last, of a band about each of M lines."""
    at, half = np.arange(lines), 2.0 ** (0.5 * octaves)
    low = np.maximum(np.minimum(np.floor(at / half), at - _LOWEST), 0).astype(int)
    high = np.maximum(np.ceil(half * at), at + _LOWEST).astype(int)
    return low, np.minimum(high, lines - 1) + 1


def _widest(frequency: np.ndarray, off: np.ndarray, contraction: float) -> float:
    """Return the largest edge in Hz of a band with which ``pass_band`` times ``off`` is no more."""
    beyond = off > contraction
    # the gain 1/2 (1 + cos(pi part)) of pass_band is contraction/off at the part
    part = np.arccos(2.0 * contraction / off[beyond] - 1.0) / np.pi
    return float(np.min(frequency[beyond] / (1.0 + part), initial=np.inf))


def _mean_square(values: np.ndarray) -> float:
    return float(np.mean(np.square(values))) if values.size else 0.0
