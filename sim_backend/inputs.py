"""Inputs of the simulated rig at rest."""

from __future__ import annotations

import threading

import numpy as np

from dearig.drivers.channels import Channel
from dearig.drivers.errors import RigError
from dearig.drivers.inputs import BLOCK_S
from dearig.drivers.settings import RigSettings
from dearig.sim_backend.card import Converters
from dearig.sim_backend.clock import Clock
from dearig.sim_backend.laser_noise import WHITE
from dearig.sim_backend.plant import Plant
from dearig.sim_backend.room import air_of_run
from dearig.sim_backend.signal_path import CHUNK, SignalPath
from dearig.sim_backend.streams import Streams

__all__ = ["SimulatedInputs"]


class SimulatedInputs:
    """Inputs of the simulated rig with the film ``plant`` at 0 V; see ``drivers.inputs.Inputs``.

    They have no output: the signal path is computed for a command of 0 V. ``noise`` is the laser's
    kind of noise, one of ``laser_noise.NOISES``.
    """

    def __init__(
        self,
        settings: RigSettings,
        plant: Plant,
        clock: Clock,
        *,
        noise_seed: tuple[int, ...] = (0,),
        noise: str = WHITE,
    ) -> None:
        streams = Streams(noise_seed)
        card = Converters(settings, streams)
        self._clock = clock
        self._channels = card.channels[1:]
        self._rate = card.actual_rate(settings.card.sample_rate_Hz)
        self._path = SignalPath(
            settings, card, streams, 0, self._rate, noise=noise,
            air=air_of_run(settings.room, streams.seed[0]),
        )  # fmt: skip
        self._state = self._path.start(plant)
        self._zero = card.channels[0].scaling.counts(np.zeros(CHUNK))
        self._chunks = 0  # computed so far
        self._ready = np.empty((len(self._channels), 0), dtype=np.int16)
        self._started = clock.now()
        self._delivered = 0
        self._closed = threading.Event()

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Return the channels in the order of the rows."""
        return self._channels

    @property
    def rate(self) -> float:
        """Return the actual sample rate in Hz."""
        return self._rate

    def read(self) -> np.ndarray:
        """Return counts (channels, n) int16 of a tenth of a second."""
        samples = max(1, round(BLOCK_S * self._rate))
        self._clock.wait(self._started + (self._delivered + samples) / self._rate, self._closed)
        if self._closed.is_set():
            raise RigError("the inputs of the simulated rig are closed")
        while self._ready.shape[1] < samples:
            counts, _, self._state = self._path.advance(self._chunks, self._zero, self._state)
            self._ready = np.concatenate((self._ready, counts[1:]), axis=1)
            self._chunks += 1
        counts, self._ready = self._ready[:, :samples], self._ready[:, samples:]
        self._delivered += samples
        return counts

    def close(self) -> None:
        """End a read that waits."""
        self._closed.set()
