"""The end of a recording: physical values beside the counts, and what is known only then."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping
from pathlib import Path

import h5py
import numpy as np

from app.recording.files import replaced_when_done
from app.recording.layout import (
    LIBVER,
    MESSAGE_BYTES,
    ZERO_ORDER,
    counts_name,
    describe_field,
    iso_time,
)
from app.recording.physical import physical_values, read_channels, sample_count
from app.recording.text import clip_text, fixed, put_text

__all__ = ["finish"]


def finish(
    path: Path,
    *,
    complete: bool,
    outcome: str,
    ended: float | None,
    displacement_model: np.ndarray | None = None,
    model_toml: str = "",
    mend: Callable[[Path], None] | None = None,
) -> int:
    """Write physical values and closing metadata to the closed recording ``path``.

    Everything happens in a copy that takes the file's place as a whole: outside SWMR a kill can
    make a file unreadable, and a full disk can strike here, but the counts stay safe. ``mend`` is
    called with the copy before it is opened. ``ended`` is a Unix time in s, None if unknown.
    Returns the number of samples. Raises ``InputError`` if the copy cannot be written.
    """
    with replaced_when_done(path) as partial:
        shutil.copyfile(path, partial)
        if mend is not None:
            mend(partial)
        with h5py.File(partial, "r+", libver=LIBVER) as file:
            entry = file["entry"]
            samples = _write_physical(entry["data"])
            if displacement_model is not None:
                model = displacement_model[:samples]
                _write_field(entry["data"], "displacement_model", model, {})
                entry["data"].attrs["auxiliary_signals"] = fixed(["displacement_model"])
            if model_toml:
                put_text(entry, "model", model_toml)
            if ended is not None:
                put_text(entry, "end_time", iso_time(ended))
            entry.attrs["samples"] = samples
            entry.attrs["outcome"] = fixed(clip_text(outcome, MESSAGE_BYTES).decode())
            entry.attrs["complete"] = complete
    return samples


def _write_physical(data: h5py.Group) -> int:
    channels = read_channels(data)
    samples = sample_count(data, channels)
    physical = physical_values(data, float(data.attrs["rate_Hz"]), samples)
    timing = {c.name: {"skew_s": c.skew, "delay_s": c.delay} for c in channels}
    for channel in channels:
        data[counts_name(channel.name)].resize((samples,))
    for name, values in physical.values.items():
        _write_field(data, name, values, timing.get(name, {}))
    data["voltage_command"].attrs["hold"] = fixed(ZERO_ORDER)
    data["displacement"].attrs["rest_reading"] = physical.rest_reading
    data["displacement"].attrs["rest_samples"] = physical.rest_samples
    return samples


def _write_field(
    data: h5py.Group, name: str, values: np.ndarray, attributes: Mapping[str, float]
) -> None:
    dataset = data.create_dataset(name, data=np.asarray(values, dtype=np.float64))
    describe_field(dataset, name)
    for key, value in attributes.items():
        dataset.attrs[key] = value
