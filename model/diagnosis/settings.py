"""Settings of a diagnosis: every number of the search, each with its derivation."""

from __future__ import annotations

from dataclasses import dataclass

from dearig.model.readings.noise import NOISE_MARGIN

__all__ = ["DiagnosisSettings", "Rung"]


@dataclass(frozen=True)
class Rung:
    """One rung of the race: how many effects run in it, and for how many iterations each."""

    effects: int
    iterations: int


@dataclass(frozen=True)
class DiagnosisSettings:
    """Numbers of the search, in groups: work, regression, race, evidence, noise.

    Parameters
    ----------
    effort
        Integration steps that the search may take: some 45 s of two cores.
    intervals
        Part of the effort that the intervals may take after the search: those of most diagnoses
        take less than the search, and a profile that does not end is not worth more.
    branch_time_min_s
        A branch that relaxes faster than the excitation varies acts as a drag, and is sought as
        one: half of the shortest lobe's quarter.
    branch_time_max
        In durations of the longest record. A slower branch cannot be told from the equilibrium
        spring: over a third of its relaxation time it relaxes by 28 %.
    grid_ratio
        Ratio of neighbouring relaxation times of the regression. A branch between two nodes is met
        to (ln ratio)^2/32 of its stress, here 1.5e-3: below the noise of a motion of 500 noises.
    bandwidth_hz
        Rate of the means that the regression fits: the film rings at 70 Hz, and means over whole
        periods of the mains, 50 or 60 Hz, would hide interference.
    smoothing_s
        Standard deviation of the filter for lam' and lam'': it passes what the means resolve.
    shapes
        Points of a Sobol sequence over the bounds of the shape parameters, besides an effect's own
        starts. 8 points leave no gap above a third of the range of each of two parameters; a
        pattern search goes on from the best.
    amplitudes
        Amplitudes, in typical ones, of effects whose response is not linear. Steps by a factor of
        10 and coefficients from 0.3 to 3.3 of each secant cover the range without gaps.
    moments
        Instants at which an event is tried in each record; the regression's own resolution then
        refines the best.
    starts
        Starts of one effect that are simulated, each with new springs and with the parent's.
    rungs
        The race: each rung takes about as much work as the one before (successive halving).
    effects_max
        Effects in one model. One recording of half a minute does not determine more.
    odds
        Least gain of the criterion for an effect: twice the logarithm of some forty candidates
        (7.4), and e^2 in its favour.
    form_error
        Relative RMS to which a law is true. Differences below this part of what is explained
        decide nothing.
    form_share
        Part of what is explained (mean square) that the wrong form of a law may leave: no further
        effect is sought in it once the rest is within the noise.
    share
        The better part. Of what is above the noise a further effect must explain it: the wrong form
        of the first one leaves structure that any other effect explains to some part. What explains
        less of it in all names nothing, and drift is believed before laws where it leaves less than
        this part of what they leave.
    trusted_share
        Part of what is above the noise that a model must explain to predict other recordings: what
        explains less may be a disguise.
    alike
        Gain of the criterion, odds of e^5, below which two explanations are not told apart.
    unseen_share
        Prior odds of a fault that a voltage monitor does not show, behind its tap or of its own
        divider, against one of another family.
    noise_margin
        RMS over noise up to which a residual counts as noise.
    white_correlation
        Correlation time up to which a residual counts as white, in samples, or in the correlation
        time of the reading at rest where that is not white.
    drift_modes
        Cosines of the drift of one record; slower than the drive's lobes are the first half.
    tempering
        Divisor of the criterion in probabilities: residuals of laws that are not quite true are
        no samples of their noise. The mean logarithm of the probability given to what is true is
        largest with it, over 98 simulated rigs of two hands (-1.13; -1.15 with 2, -1.16 with 4).
    """

    effort: float = 2.8e8
    intervals: float = 0.5
    branch_time_min_s: float = 0.1
    branch_time_max: float = 3.0
    grid_ratio: float = 1.25
    bandwidth_hz: float = 80.0
    smoothing_s: float = 0.010
    shapes: int = 8
    amplitudes: tuple[float, ...] = (0.1, 1.0, 10.0, 100.0)
    moments: int = 60
    starts: int = 3
    rungs: tuple[Rung, ...] = (Rung(20, 3), Rung(8, 6), Rung(4, 12), Rung(3, 30))
    effects_max: int = 3
    odds: float = 12.0
    form_error: float = 0.01
    form_share: float = 0.02
    share: float = 0.5
    trusted_share: float = 0.8
    alike: float = 10.0
    unseen_share: float = 0.25
    noise_margin: float = NOISE_MARGIN
    white_correlation: float = 1.3
    drift_modes: int = 24
    tempering: float = 3.0
