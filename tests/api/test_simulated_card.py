"""The simulated card for others: what the how-to page shows."""

import nidaqmx
import pytest
from nidaqmx.constants import AcquisitionType

from dearig.api.simulated_card import simulated_daqmx_card
from dearig.api.simulated_card_fixture import daqmx_card  # noqa: F401  (a fixture)
from tests.docs.markdown import blocks

PAGE = "app/docs/how-to/simulated-card.md"


def test_a_program_measures_what_the_test_has_wired():
    signals = {"PFI8": "2 kHz", "PFI3": "PFI12"}
    with (
        simulated_daqmx_card(name="Mine", signals=signals) as card,
        nidaqmx.Task(grpc_options=card.session) as task,
    ):
        chan = task.ci_channels.add_ci_freq_chan("Mine/ctr0", min_val=2.0, max_val=1e5)
        chan.ci_freq_term = "/Mine/PFI8"
        task.timing.cfg_implicit_timing(sample_mode=AcquisitionType.CONTINUOUS)
        assert task.read(5) == pytest.approx([2000.0] * 5)


def test_a_wrong_signal_is_refused_in_a_sentence():
    with (
        pytest.raises(ValueError, match="not a square wave"),
        simulated_daqmx_card(signals={"PFI8": "often"}),
    ):
        pass


def test_the_fixture_is_a_card(daqmx_card):  # noqa: F811  (the fixture)
    with nidaqmx.Task(grpc_options=daqmx_card.session) as task:
        task.ao_channels.add_ao_voltage_chan("Dev1/ao1")
        task.write(1.5)
    assert daqmx_card.device.name == "Dev1"


def test_the_examples_of_the_page_run(daqmx_card, monkeypatch):  # noqa: F811  (the fixture)
    """Every Python block of the page runs, and its test functions pass."""
    for block in blocks(PAGE):
        if block.language == "python":
            names: dict = {}
            exec(compile(block.text, PAGE, "exec"), names)  # noqa: S102  (the page's own text)
            for name, value in names.items():
                if name.startswith("test_"):
                    value(daqmx_card)
