"""Inputs of a rig at rest: read, with nothing at its output."""

from __future__ import annotations

from dearig.acquisition.rigs import kind_of, options_of
from dearig.config.rigfile import RigFile
from dearig.drivers.errors import AddressError, LinkRefused, RigError
from dearig.drivers.inputs import Inputs, ReadsInputs
from dearig.errors import InputError, InstrumentFault

__all__ = ["open_inputs"]


def open_inputs(rig: str, rig_file: RigFile) -> Inputs:
    """Return the inputs of the rig at address ``rig``; nothing is output.

    Raises ``InputError`` for an address that names no rig, or a kind of rig whose inputs cannot be
    read at rest; ``InstrumentFault`` where the card is missing or in use.
    """
    kind = kind_of(rig)
    if not isinstance(kind, ReadsInputs):
        raise InputError(f"rig {rig!r}: the inputs of this kind of rig are read in a run only")
    try:
        return kind.open_inputs(rig, rig_file, options_of(rig_file))
    except (AddressError, LinkRefused) as error:
        raise InputError(str(error)) from error
    except RigError as error:
        raise InstrumentFault(str(error)) from error
    except ValueError as error:  # a film without a rest state
        raise InputError(f"rig {rig!r} with this rig file: {error}") from error
