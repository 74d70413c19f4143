"""Tests that the inputs of every rig must pass.

Derive a class ``Test...`` from ``InputsContract`` and return opened inputs from ``open_inputs``.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from dearig.drivers.inputs import Inputs
from dearig.drivers.rig import RigIdentity

__all__ = ["InputsContract"]

_READS = 3


class InputsContract:
    """Tests of inputs at rest; a derived class must define the methods that raise below.

    ``outputs_touched`` sees every way of this rig to move an output.
    """

    MONITOR_TOLERANCE = 20.0  # V at the film

    def open_inputs(self) -> Inputs:
        """Return the inputs of a new rig at 0 V with default settings."""
        raise NotImplementedError

    def identity(self) -> RigIdentity:
        """Return the identity of that rig."""
        raise NotImplementedError

    def outputs_touched(self) -> list[str]:
        """Return what was done to an output or the enable line since ``open_inputs``."""
        raise NotImplementedError

    @pytest.fixture
    def inputs(self) -> Iterator[Inputs]:
        """Yield the inputs for one test."""
        inputs = self.open_inputs()
        try:
            yield inputs
        finally:
            inputs.close()

    def read_some(self, inputs: Inputs) -> np.ndarray:
        """Return counts (channels, n) of some reads."""
        return np.concatenate([inputs.read() for _ in range(_READS)], axis=1)

    def test_channels_are_those_of_the_rig_without_its_command(self, inputs: Inputs) -> None:
        channels = self.identity().channels
        assert channels[0].name == "voltage_command"
        assert inputs.channels == channels[1:]
        assert inputs.rate > 0.0

    def test_blocks_are_counts_of_every_channel(self, inputs: Inputs) -> None:
        counts = self.read_some(inputs)
        assert counts.dtype == np.int16
        assert counts.shape[0] == len(inputs.channels)
        assert counts.shape[1] >= _READS

    def test_voltage_monitor_reads_zero_with_noise(self, inputs: Inputs) -> None:
        counts = self.read_some(inputs)
        names = [channel.name for channel in inputs.channels]
        place = names.index("voltage_monitor")
        volts = inputs.channels[place].scaling.physical(counts[place])
        assert abs(volts.mean()) < self.MONITOR_TOLERANCE
        assert 0.0 < volts.std() < self.MONITOR_TOLERANCE

    def test_no_output_is_created_or_written(self, inputs: Inputs) -> None:
        self.read_some(inputs)
        inputs.close()
        inputs.close()
        assert self.outputs_touched() == []
