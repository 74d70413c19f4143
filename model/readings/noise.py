"""The noise of readings, from the readings themselves.

Only NumPy is imported: a recording tells its noise floor without the solvers of SciPy.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from dearig.model.errors import ModelError

__all__ = [
    "DIFFERENCES",
    "FEW_VALUES",
    "LEAD_IN",
    "NOISE_MARGIN",
    "READINGS_MIN",
    "REST_MIN",
    "Tails",
    "about_rest",
    "coarse_noise",
    "noise_at_rest",
    "noise_of",
    "require_readings",
    "rest_of_rounded",
    "rounding",
    "slow_at_rest",
    "tails_of",
]

#: Sources of a noise: readings at rest, or second differences of all of them.
LEAD_IN, DIFFERENCES = "lead-in", "second differences"
#: RMS over noise up to which a residual counts as noise. A lead-in of 2 s at 200 Hz gives the noise
#: to 1/sqrt(2 * 400) = 3.5 %; this is 2.3 of these.
NOISE_MARGIN = 1.08
#: Readings at rest: fewer give the noise to worse than 1/sqrt(200) = 7 %, and do not show its
#: colour.
REST_MIN = 100
#: Fewer readings have no second difference to average.
READINGS_MIN = 4
_FAST = 0.1  # s: what changes more slowly is not noise of single readings
#: Noise at rest over that about means of a tenth of a second: three quarters of its power are slow.
#: With 1/f noise as large as white noise it is 1.2.
_MOVES = 2.0
_READINGS_A_LINE = 4  # samples for each of the three numbers of a periodic line
_SLOW = 15.0  # Hz: a slower line may be drift, 1/f noise, or noise that a sensor has averaged
_SLOWER = 3  # lines of a spectrum at least that are slower than a slow one, and lower
_STANDS_OUT = 30.0  # times the spectrum's median about it: by chance once in a million readings
#: Degrees of freedom of Student's t, of finite variance; above 30 it is normal in 99.9 % of itself.
_FREEDOMS = (2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0, 20.0, 30.0)
_SCALES = 60  # of the middle, tried: in steps of 3 %, as 500 readings tell it
_TAILS_READINGS = 2000  # of the lead-in, the first ones, that tell the tails
_SAME = 1e-6  # of the spread: differences that are rounding of the computer
#: Step over the noise in motion, 1/sqrt(1/9 + 1/12), from which rounding counts: a step is three
#: times the noise before rounding, and the mean of readings at rest off by up to a tenth of that.
_COARSE = 2.27
#: Values that coarse readings take at rest, at most: a step is three times their noise.
FEW_VALUES = 4
_BLOCK = 100  # readings: their second differences tell the noise to some 10 %
_LEVELS = 201  # of a rest between two readings, tried
_SHARPEST = 0.05  # of a step: less noise before rounding changes nothing
_TAILS_MIN = 12.0  # of twice the logarithm of a likelihood
_LINE_FOUND = 1e-5  # of a frequency bin: moves the sine's end by some 1e-5 of a period


def noise_of(values: np.ndarray, valid: np.ndarray | None = None) -> float:
    """Standard deviation of the noise on a slowly changing quantity ``values`` (N,), N >= 4.

    From second differences, which no drift or slope disturbs: their variance is six times that of
    white noise. Readings that are not ``valid`` (N,) take no part; with too few others it is 0.
    """
    require_readings(values)
    bends = np.diff(values, 2)
    if valid is not None:
        bends = bends[valid[:-2] & valid[1:-1] & valid[2:]]
    return float(np.sqrt(np.mean(bends**2) / 6.0)) if bends.size else 0.0


def noise_at_rest(time: np.ndarray, values: np.ndarray) -> float:
    """Standard deviation of the noise on readings (N,) at ``time`` (N,) of what hangs still.

    N >= 4. About a straight line, and without what is periodic: mains on a cable is not noise, but
    something to be found; taken for noise, it would hide everything that is smaller.
    """
    left, given = about_rest(time, values)
    return math.sqrt(float(left @ left) / (values.size - given))


def slow_at_rest(time: np.ndarray, values: np.ndarray, noise: float) -> float:
    """Return the RMS of what moves slowly in readings (N,) at rest; 0 unless it is most of them.

    Their ``noise`` is that of ``noise_at_rest``. Compared is their noise about means over a tenth
    of a second, which nothing slow enters.
    """
    width = max(3, round(_FAST / float(np.median(np.diff(time)))))
    if values.size < 2 * width:
        return 0.0
    means = np.convolve(values, np.full(width, 1.0 / width), "valid")
    first = (width - 1) // 2
    left = values[first : first + means.size] - means
    # a mean contains a share of the reading itself
    fast = float(np.std(left)) / math.sqrt(1.0 - 1.0 / width)
    return math.sqrt(noise**2 - fast**2) if noise > _MOVES * fast > 0.0 else 0.0


def about_rest(time: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, int]:
    """Return readings (N,) at rest less their line and what is periodic, and the numbers fitted."""
    require_readings(values)
    n = values.size
    t = time - time.mean()
    left = _level(t, values)
    given = 2
    steps = np.diff(time)
    even = float(steps.max()) < 1.01 * float(steps.min())
    while even and given + 3 < n / _READINGS_A_LINE:
        line = _strongest_line(t, left)
        if line is None:
            break
        left = _level(t, left - line)  # a line that ends in mid-period looked like a slope
        given += 3
    return left, given


@dataclass(frozen=True)
class Tails:
    """Distribution of noise: Student's t with ``freedom`` degrees, or normal where that is inf.

    ``scale`` is the width of its middle: the standard deviation of a normal distribution. Readings
    are rounded to multiples of ``step``.
    """

    freedom: float
    scale: float
    step: float = 0.0

    @property
    def is_normal(self) -> bool:
        """Whether the tails are those of a normal distribution."""
        return math.isinf(self.freedom)

    def limit(self, share: float) -> float:
        """Return the size beyond which a ``share`` of the noise is, on either side."""
        if self.is_normal:
            return -self.scale * NormalDist().inv_cdf(share / 2.0)
        # takes a while to import, and normal noise does not need it
        from scipy.special import stdtrit

        return -self.scale * float(stdtrit(self.freedom, share / 2.0))

    def pseudo(self, noise: np.ndarray) -> np.ndarray:
        """Return the pseudo-values (N,) of ``noise`` (N,): its mean is the level most probable.

        Minus the derivative of the logarithm of the density over Fisher's information. Their
        variance is the least that any estimate of the level has (Huber, Robust Statistics, 7.4).
        """
        if self.is_normal:
            return noise
        square = (noise / self.scale) ** 2
        return np.asarray(noise * (self.freedom + 3.0) / (self.freedom + square))


def tails_of(noise: np.ndarray, step: float, independent: float = 1.0) -> Tails:
    """Return the more probable distribution of ``noise`` (N,) about 0: normal, or Student's t.

    The likelihood is that of readings that were rounded to a ``step``. Student's t is taken where
    twice the logarithm of the likelihoods' ratio, times the share of the readings that is
    ``independent``, is above 12: what the diagnosis asks of an effect.
    """
    noise = noise[:_TAILS_READINGS]
    spread = float(np.std(noise))
    if spread == 0.0:
        return Tails(math.inf, spread, step)
    # an even rule over what is rounded to one reading
    square = (noise[:, None] + step * np.linspace(-0.4, 0.4, 5)) ** 2
    scales = spread * np.geomspace(0.2, 1.2, _SCALES)

    def fitted(freedom: float) -> tuple[float, float]:
        """Return the largest logarithm of a likelihood, and the scale there."""
        logs = []
        for scale in scales:
            if math.isinf(freedom):
                density = np.exp(-0.5 * square / scale**2) / math.sqrt(2.0 * math.pi)
            else:
                height = math.exp(math.lgamma(0.5 * (freedom + 1.0)) - math.lgamma(0.5 * freedom))
                fall = (1.0 + square / (freedom * scale**2)) ** (-0.5 * (freedom + 1.0))
                density = height / math.sqrt(math.pi * freedom) * fall
            total = np.maximum(density.mean(axis=1) / scale, 1e-300)
            logs.append(float(np.sum(np.log(total))))
        best = int(np.argmax(logs))
        return logs[best], float(scales[best])

    normal, width = fitted(math.inf)
    found = max((*fitted(freedom), freedom) for freedom in _FREEDOMS)
    if 2.0 * independent * (found[0] - normal) > _TAILS_MIN:
        return Tails(found[2], found[1], step)
    return Tails(math.inf, width, step)


def rounding(values: np.ndarray) -> float:
    """Return the step of which readings (N,) are multiples; 0 where they are of no step.

    A converter makes the step of a sensor uneven by one of its own: it is a mean.
    """
    levels = np.unique(values)
    steps = np.diff(levels)
    if not steps.size or float(steps.min()) < _SAME * float(np.ptp(levels)):
        return 0.0
    return float(np.mean(steps[steps < 1.5 * steps.min()]))


def coarse_noise(values: np.ndarray, valid: np.ndarray | None = None) -> tuple[float, float]:
    """Return the noise of coarsely rounded readings (N,) in motion, and their step; else zeros.

    Readings at rest do not tell it: they may all be rounded to one value. In motion the error of
    rounding is spread over the step. The noise is the median over blocks of that of second
    differences where the film moves, so that ringing now and then does not count. Readings are
    coarse from a step of 2.27 times that on.
    """
    count = values.size // _BLOCK
    if not count:
        return 0.0, 0.0
    usable = np.ones(values.size, dtype=bool) if valid is None else valid
    blocks = zip(np.array_split(values, count), np.array_split(usable, count), strict=True)
    moving = [noise_of(block, good) for block, good in blocks if np.unique(block).size > FEW_VALUES]
    if not moving:
        return 0.0, 0.0
    noise, step = float(np.median(moving)), rounding(values[usable])
    return (noise, step) if step > _COARSE * noise > 0.0 else (0.0, 0.0)


def rest_of_rounded(values: np.ndarray, step: float, noise: float) -> float:
    """Return the mean that readings (N,) at rest would have without their rounding to ``step``.

    ``noise`` is that in motion, rounding included. The mean of rounded readings is off by up to
    half a step where they are nearly all rounded to one value. It is the mean of the posterior
    under a flat prior (a likelihood of grouped readings).
    """
    # takes a while to import, and few sensors are so coarse
    from scipy.special import ndtr

    levels, counts = np.unique(values, return_counts=True)
    before = math.sqrt(max(noise**2 - step**2 / 12.0, (_SHARPEST * step) ** 2))
    rests = np.linspace(levels[0] - 0.5 * step, levels[-1] + 0.5 * step, _LEVELS)
    apart = levels - rests[:, None]
    inside = ndtr((apart + 0.5 * step) / before) - ndtr((apart - 0.5 * step) / before)
    logs = np.log(np.maximum(inside, 1e-300)) @ counts
    weights = np.exp(logs - logs.max())
    return float(weights @ rests / weights.sum())


def require_readings(values: np.ndarray) -> None:
    """Raise ``ModelError`` where ``values`` (N,) are too few to read a noise from."""
    if values.size < READINGS_MIN:
        raise ModelError(
            f"{values.size} samples are too few to read a noise from; {READINGS_MIN} are needed"
        )


def _level(t: np.ndarray, values: np.ndarray) -> np.ndarray:
    """``values`` (N,) about their straight line, at times ``t`` (N,) about their mean."""
    level = values - values.mean()
    return np.asarray(level - t * (float(t @ level) / float(t @ t)))


def _strongest_line(t: np.ndarray, values: np.ndarray) -> np.ndarray | None:
    """The sine (N,) that stands out most from the spectrum of ``values`` (N,), or None."""
    n = values.size
    power = np.abs(np.fft.rfft(values)) ** 2
    bin_width = 1.0 / (n * float(t[1] - t[0]))
    half = power.size // 16 + 4
    fast = math.ceil(_SLOW / bin_width)
    # the mean is not a line, and a neighbour of a line is part of it
    for first, end in ((fast, power.size), (_SLOWER + 2, min(fast, power.size))):
        if first >= end:
            continue
        peak = first + int(np.argmax(power[first:end]))
        about = float(np.median(power[max(peak - half, 1) : peak + half + 1]))
        if peak < fast:
            # of noise that is slow, what is slower is larger
            about = max(about, float(np.median(power[1 : peak - 1])))
        if power[peak] > _STANDS_OUT * about:
            return _sine(t, values, peak * bin_width, bin_width)
    return None


def _sine(t: np.ndarray, values: np.ndarray, near: float, bin_width: float) -> np.ndarray:
    """The sine (N,) that leaves least of ``values`` (N,), within a bin of ``near`` Hz."""

    def sine(frequency: float) -> np.ndarray:
        turn = 2.0 * np.pi * frequency * t
        waves = np.array([np.cos(turn), np.sin(turn)])
        return np.asarray(np.linalg.solve(waves @ waves.T, waves @ values) @ waves)

    best = _minimum(
        lambda f: float(np.sum((values - sine(f)) ** 2)),
        near - bin_width,
        near + bin_width,
        _LINE_FOUND * bin_width,
    )
    return sine(best)


def _minimum(function: Callable[[float], float], low: float, high: float, within: float) -> float:
    """Return the place of the minimum of ``function`` from ``low`` to ``high``: golden section."""
    ratio = (math.sqrt(5.0) - 1.0) / 2.0
    left, right = high - ratio * (high - low), low + ratio * (high - low)
    at_left, at_right = function(left), function(right)
    while high - low > within:
        if at_left < at_right:
            high, right, at_right = right, left, at_left
            left = high - ratio * (high - low)
            at_left = function(left)
        else:
            low, left, at_left = left, right, at_right
            right = low + ratio * (high - low)
            at_right = function(right)
    return (low + high) / 2.0
