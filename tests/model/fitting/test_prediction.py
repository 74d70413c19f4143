"""What the parameters' own error makes of a prediction, against fits to many noises."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dearig.model.fitting import identify
from dearig.model.fitting.parameters import NORMAL_95
from dearig.model.fitting.prediction import prediction_error
from dearig.model.readings.records import ActuatorRecord
from tests.tools.engine import PLAIN, record_of, thesis_drive


def _elsewhere() -> ActuatorRecord:
    """The plain film at half the voltage, without noise."""
    drive = replace(thesis_drive(), voltage=0.5 * thesis_drive().voltage)
    return record_of(PLAIN, drive, noise=1e-15)


def test_it_is_the_spread_of_predictions_by_fits_to_many_noises() -> None:
    record, off = _elsewhere(), []
    for seed in range(8):
        noisy = record_of(PLAIN, thesis_drive(rate=50.0), seed=seed)
        fitted = identify([noisy], PLAIN, intervals=False, workers=1)
        off.append(fitted.model.simulate(record.drive).displacement - record.displacement)
    one = identify([record_of(PLAIN, thesis_drive(rate=50.0), seed=20)], PLAIN, workers=1)
    record = replace(record, noise=1e-6)
    bound = prediction_error(record, one.model, one.covariance_names, one.covariance)
    spread = NORMAL_95 * float(np.sqrt(np.mean(np.square(off))))
    # eight fits of three parameters know a standard deviation to some 1/sqrt(2 * 24)
    assert bound == pytest.approx(spread, rel=0.4)


def test_a_direction_that_the_fit_does_not_determine_stays_finite() -> None:
    record = replace(_elsewhere(), noise=1e-6)
    names = ("mu_0", "mu_1", "T_1")
    told = [prediction_error(record, PLAIN, names, size * np.eye(3)) for size in (1e20, 1e30)]
    assert told[0] == pytest.approx(told[1])
    assert np.isfinite(told[0])
    assert prediction_error(record, PLAIN, names, np.zeros((3, 3))) == 0.0
