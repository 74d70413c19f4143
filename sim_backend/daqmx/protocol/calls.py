"""What the calls of NI's gRPC device protocol share."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
from nidaqmx._stubs import nidaqmx_pb2_grpc as pb_grpc

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.tasks import Task
from dearig.sim_backend.daqmx.simulated_card import SimulatedCard

__all__ = ["BY_CHANNEL", "FINITE", "Calls", "is_finite", "laid_out", "number", "status"]

BY_CHANNEL = 0  #: DAQmx: group by channel
FINITE, CONTINUOUS = 10178, 10123  #: DAQmx: sample modes


class Calls(pb_grpc.NiDAQmxServicer):  # type: ignore[misc]
    """Calls on the card ``device``, until ``closing`` is set."""

    def __init__(self, device: SimulatedCard, closing: threading.Event) -> None:
        self._device = device
        self._closing = closing

    def _task(self, request: Any) -> Task:
        return self._device.task(request.task.name)


def number(request: Any, field: str) -> int:
    """Return an enumeration's number, which a client sends in one of two fields."""
    return int(getattr(request, f"{field}_raw", 0) or getattr(request, field, 0))


def is_finite(request: Any) -> bool:
    """Return True for a finite sample mode; refuses modes that are neither that nor continuous."""
    mode = number(request, "sample_mode")
    if mode not in (FINITE, CONTINUOUS):
        raise DaqmxError(Code.INVALID_VALUE, f"Property: SampQuant.SampMode; Value: {mode}")
    return mode == FINITE


def status(complete: bool) -> int:
    """Return the status of a read; one that timed out is a reply with the samples so far."""
    return 0 if complete else int(Code.SAMPLES_NOT_YET_AVAILABLE)


def laid_out(values: np.ndarray, request: Any) -> np.ndarray:
    """Return ``values`` (channels, n) as (channels * n,), by channel or by scan.

    The client's array is as large as it asked for; only what was read is sent.
    """
    by_channel = number(request, "fill_mode") == BY_CHANNEL
    return values.ravel() if by_channel else values.T.ravel()
