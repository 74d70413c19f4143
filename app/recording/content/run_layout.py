"""The name, channels and instruments of a run in its file."""

from __future__ import annotations

import re
import tomllib

import h5py

from dearig.drivers.channels import CHANNEL_NAMES, RESERVED_NAMES, Channel
from dearig.drivers.rig import RigIdentity
from dearig.errors import InputError
from dearig.recording.content.layout import UNITS, counts_name
from dearig.recording.content.physical import TEMPERATURE_UNITS
from dearig.recording.content.text import fixed

__all__ = ["check_channels", "sequence_name", "write_instruments"]


def write_instruments(entry: h5py.Group, identity: RigIdentity) -> None:
    """Create ``entry/instrument``: links to the counts, and the instruments with their settings."""
    instruments = entry.create_group("instrument")
    instruments.attrs["NX_class"] = fixed("NXcollection")
    links = instruments.create_group("channels")
    links.attrs["NX_class"] = fixed("NXcollection")
    for channel in identity.channels:
        links[channel.name] = h5py.SoftLink(f"/entry/data/{counts_name(channel.name)}")
    for instrument in identity.instruments:
        group = instruments.create_group(_group_name(instrument.role, instruments))
        group.attrs["NX_class"] = fixed("NXinstrument")
        group.attrs["role"] = fixed(instrument.role)
        group.attrs["model"] = fixed(instrument.model)
        group.attrs["serial"] = fixed(instrument.serial)
        # name, value, name, value; an attribute, since Octave stops reading a file at a dataset
        # with a micro sign or a degree sign
        if instrument.settings:
            group.attrs["settings"] = fixed([text for pair in instrument.settings for text in pair])


def check_channels(channels: tuple[Channel, ...]) -> None:
    """Raise ``ValueError`` for channels that a recording of a run cannot have."""
    names = [c.name for c in channels]
    for needed in ("displacement", "voltage_command"):
        if needed not in names:
            raise ValueError(f"a run is recorded with a channel {needed}; there are {names}")
    if len(set(names)) != len(names):
        raise ValueError(f"two channels have the same name: {names}")
    known = [name for name in names if name in CHANNEL_NAMES]
    if known != [n for n in CHANNEL_NAMES if n in names] or names[: len(known)] != known:
        raise ValueError(f"channels come as {', '.join(CHANNEL_NAMES)}, then others, not {names}")
    for channel in channels:
        if channel.name not in CHANNEL_NAMES:
            if channel.name in RESERVED_NAMES:
                raise ValueError(f"channel {channel.name!r}: recordings use this name themselves")
            continue
        units = TEMPERATURE_UNITS if channel.name == "temperature" else (UNITS[channel.name],)
        if channel.unit not in units:
            raise ValueError(f"channel {channel.name} is in {channel.unit!r}, not in {units[0]}")


def sequence_name(sequence_toml: str) -> str:
    """Return the name of a sequence. Raises ``InputError`` for what is not TOML."""
    try:
        sequence = tomllib.loads(sequence_toml)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"the sequence is not TOML: {error}") from error
    return str(sequence.get("name", "run"))


def _group_name(role: str, taken: h5py.Group) -> str:
    name = re.sub(r"\W+", "_", role).strip("_") or "instrument"
    while name in taken:
        name += "_"
    return name
