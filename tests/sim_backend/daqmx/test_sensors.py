"""Input channels with a sensor: what they measure, and which properties they have."""

import numpy as np
import pytest
from nidaqmx.constants import (
    BridgeConfiguration,
    CurrentShuntResistorLocation,
    CurrentUnits,
    ExcitationSource,
    ResistanceConfiguration,
    RTDType,
    TemperatureUnits,
    UsageTypeAI,
)
from nidaqmx.errors import DaqError

from tests.tools.daqmx import add_output, task

MONITOR = "Dev1/_ao0_vs_aognd"
OUTSIDE = {"current_excit_source": ExcitationSource.EXTERNAL}


def measured(session, volts, add):
    """What a channel that ``add`` makes reads with ``volts`` at its terminal, and the channel."""
    with task(session) as ao, task(session) as ai:
        add_output(ao)
        ao.write(volts)
        add(ai.ai_channels)
        value = ai.read()
        ao.write(0.0)
    return value


def test_a_current_flows_through_its_shunt(session):
    def add(channels):
        channel = channels.add_ai_current_chan(
            MONITOR, min_val=0.0, max_val=0.02, ext_shunt_resistor_val=250.0
        )
        assert channel.ai_meas_type is UsageTypeAI.CURRENT
        assert channel.ai_current_shunt_loc is CurrentShuntResistorLocation.EXTERNAL
        assert channel.ai_current_units is CurrentUnits.AMPS

    assert measured(session, 2.5, add) == pytest.approx(0.01, abs=1e-6)


def test_a_resistance_is_that_at_its_current(session):
    def add(channels):
        channels.add_ai_resistance_chan(MONITOR, current_excit_val=1e-3, **OUTSIDE)

    assert measured(session, 0.5, add) == pytest.approx(500.0, abs=0.5)


@pytest.mark.parametrize(
    ("ohms", "celsius"),
    # IEC 60751, Pt100
    [(100.0, 0.0), (138.5055, 100.0), (60.2558, -100.0), (212.052, 300.0)],
)
def test_a_resistance_thermometer_follows_its_standard(session, ohms, celsius):
    def add(channels):
        channels.add_ai_rtd_chan(
            MONITOR,
            min_val=-200.0,
            max_val=600.0,
            rtd_type=RTDType.PT_3851,
            current_excit_val=1e-2,
            **OUTSIDE,
        )

    assert measured(session, ohms * 1e-2, add) == pytest.approx(celsius, abs=0.1)


def test_the_coefficients_of_a_thermometer_can_be_set(session):
    with task(session) as ai:
        channel = ai.ai_channels.add_ai_rtd_chan("Dev1/ai3", rtd_type=RTDType.PT_3750)
        assert channel.ai_rtd_a == 0.00381
        channel.ai_rtd_a = 0.004
        assert channel.ai_rtd_a == 0.004
        del channel.ai_rtd_a
        assert channel.ai_rtd_a == 0.00381
        assert channel.ai_rtd_r0 == 100.0
        channel.ai_rtd_type = RTDType.PT_3851
        assert channel.ai_rtd_a == 3.9083e-3


@pytest.mark.parametrize(
    ("units", "value"), [(TemperatureUnits.DEG_C, 25.0), (TemperatureUnits.K, 298.15)]
)
def test_a_thermistor_divides_the_voltage_of_its_excitation(session, units, value):
    # 10 kOhm at 25 degrees Celsius, in series with as much: half of the excitation
    log = np.log(10e3)
    a, b = 1.0 / 298.15 - 2.4e-4 * log - 9e-8 * log**3, 2.4e-4

    def add(channels):
        channel = channels.add_ai_thrmstr_chan_vex(
            MONITOR,
            min_val=0.0,
            max_val=400.0,
            units=units,
            voltage_excit_source=ExcitationSource.EXTERNAL,
            voltage_excit_val=5.0,
            a=a,
            b=b,
            c=9e-8,
            r_1=10e3,
        )
        assert channel.ai_meas_type is UsageTypeAI.TEMPERATURE_THERMISTOR
        assert channel.ai_temp_units is units

    assert measured(session, 2.5, add) == pytest.approx(value, abs=0.1)


@pytest.mark.parametrize(("scaling", "value"), [(True, 0.3), (False, 1.5)])
def test_an_excitation_divides_where_it_is_used_for_scaling(session, scaling, value):
    def add(channels):
        channel = channels.add_ai_voltage_chan_with_excit(
            MONITOR,
            min_val=-2.0,
            max_val=2.0,
            bridge_config=BridgeConfiguration.HALF_BRIDGE,
            voltage_excit_source=ExcitationSource.EXTERNAL,
            voltage_excit_val=5.0,
            use_excit_for_scaling=scaling,
        )
        assert channel.ai_excit_use_for_scaling is scaling

    assert measured(session, 1.5, add) == pytest.approx(value, abs=1e-3)


def test_the_card_has_no_excitation_of_its_own(session):
    with task(session) as ai:
        ai.ai_channels.add_ai_rtd_chan(
            "Dev1/ai3",
            resistance_config=ResistanceConfiguration.THREE_WIRE,
            current_excit_source=ExcitationSource.INTERNAL,
        )
        with pytest.raises(DaqError, match="AI_EXCIT_SRC") as caught:
            ai.read()
        assert caught.value.error_code == -200077


def test_a_sensor_has_only_its_own_properties(session):
    with task(session) as ai:
        channel = ai.ai_channels.add_ai_current_chan("Dev1/ai3")
        with pytest.raises(DaqError) as caught:
            _ = channel.ai_rtd_a
        assert caught.value.error_code == -200452
