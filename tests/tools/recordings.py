"""A small rig on paper, and runs of it, for the tests of recordings."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dearig.drivers.channels import Channel, Scaling
from dearig.drivers.rig import Block, Event, Instrument, RigIdentity
from dearig.model.film.material import THESIS_FILM, THESIS_LOAD
from dearig.recording import RecordingWriter, RunMetadata

VOLTS_PER_COUNT = 10.0 / 32768
CHANNELS = (
    Channel("voltage_command", "V", Scaling((0.0, VOLTS_PER_COUNT), 1000.0)),
    Channel("voltage_monitor", "V", Scaling((1e-3, VOLTS_PER_COUNT), 1000.0), skew=2e-6),
    Channel("current_monitor", "A", Scaling((0.0, VOLTS_PER_COUNT), 4e-3), skew=4e-6),
    Channel(
        "displacement",
        "m",
        Scaling((0.0, VOLTS_PER_COUNT), 4e-3, 1e-3),
        skew=6e-6,
        delay=1e-3,
        delay_error=1e-5,
    ),
)
IDENTITY = RigIdentity(
    address="sim:7",
    simulated=True,
    instruments=(
        Instrument("amplifier", "TREK 10/40A-HS", "1234", (("gain", "1000 V/V"),)),
        Instrument("sensor", "LK-H152", "", (("averaging", "256"), ("sampling", "20 µs"))),
    ),
    channels=CHANNELS,
    seed=7,
)
SEQUENCE = 'name = "two lobes"\n[[segment]]\nkind = "hold"\nvoltage_kV = 0.0\nduration_s = 2.0\n'
RATE = 1000.0


class Clock:
    """Unix time that stands until it is moved."""

    def __init__(self, moment: float = 1_800_000_000.0) -> None:
        self.moment = moment

    def __call__(self) -> float:
        return self.moment


def writer(path: Path, **changes: object) -> RecordingWriter:
    metadata = RunMetadata(
        sequence_toml=SEQUENCE,
        film=THESIS_FILM,
        load=THESIS_LOAD,
        configuration="[film]\nlength_mm = 75.0\n",
        operator="Ada",
        film_id="film 3",
        notes="second day",
    )
    told = {name: changes.pop(name) for name in tuple(changes) if hasattr(metadata, name)}
    given: dict = {
        "identity": IDENTITY,
        "rate_Hz": RATE,
        "samples_expected": 3000,
        "metadata": replace(metadata, **told),
        "now": Clock(),
    } | changes
    return RecordingWriter(path, **given)


def run_counts(samples: int = 3000, quiet: int = 1000, seed: int = 0) -> np.ndarray:
    """(4, samples) int16: a lead-in at 0 V, then lobes; the sensor rests at 500 counts."""
    rng = np.random.default_rng(seed)
    t = np.arange(samples) / RATE
    lobes = np.where(np.arange(samples) < quiet, 0.0, np.abs(np.sin(3.0 * (t - quiet / RATE))))
    lobes[quiet : quiet + 1] = 0.01
    command = 20000 * lobes
    counts = np.array(
        [
            command,
            command + rng.normal(0.0, 3.0, samples),
            rng.normal(0.0, 20.0, samples),
            500 + 9000 * lobes**2 + rng.normal(0.0, 5.0, samples),
        ]
    )
    return np.rint(counts).astype(np.int16)


def write_run(path: Path, counts: np.ndarray | None = None, block: int = 500) -> np.ndarray:
    """Record ``counts`` in blocks, with one event in the second; returns them."""
    counts = run_counts() if counts is None else counts
    with writer(path, samples_expected=counts.shape[1]) as recorder:
        for start in range(0, counts.shape[1], block):
            events = (Event(start + 10, "warning", "near the limit"),) if start == block else ()
            recorder.append(Block(start, counts[:, start : start + block], events))
    return counts


def measured_data() -> Path:
    """The folder of measured data, or skip."""
    here = os.environ.get("DEARIG_MEASURED_DATA")
    folder = Path(here) if here else Path(__file__).parents[3] / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(
            f"measured film data are not at {folder}; set DEARIG_MEASURED_DATA to where they are"
        )
    return folder
