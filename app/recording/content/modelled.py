"""The displacement of an overlay model, written next to the counts of a run as it is computed.

Single precision is enough for values that are plotted: it resolves 0.1 nm in a millimetre.
"""

from __future__ import annotations

import h5py
import numpy as np

from dearig.recording.content.layout import describe_field
from dearig.recording.content.text import fixed

__all__ = ["NAME", "ModelledWriter", "keep_modelled"]

#: Under /entry while the run goes on: under /entry/data readers look for finished values only.
NAME = "modelled"
FIELD = "displacement_model"


class ModelledWriter:
    """The dataset ``entry/modelled`` (n,) float32 m of a run; ``chunk`` samples are a chunk."""

    def __init__(self, entry: h5py.Group, chunk: int) -> None:
        # a kill can leave it some samples behind the counts
        self._dataset = entry.create_dataset(
            NAME, shape=(0,), maxshape=(None,), chunks=(chunk,), dtype="<f4", fillvalue=np.nan
        )
        describe_field(self._dataset, FIELD)

    def move_to(self, entry: h5py.Group) -> None:
        """Write to the same dataset of another file from now on."""
        self._dataset = entry[NAME]

    def append(self, displacement: np.ndarray) -> None:
        """Append the next ``displacement`` (n,) m, NaN where the model has failed."""
        first = self._dataset.shape[0]
        self._dataset.resize((first + displacement.size,))
        self._dataset[first:] = displacement


def keep_modelled(entry: h5py.Group, samples: int) -> None:
    """Move the overlay of a run of ``samples`` samples to where readers look for it, if any.

    The values stay where they are in the file; only their name changes.
    """
    if NAME not in entry:
        return
    if entry[NAME].shape != (samples,):
        entry[NAME].resize((samples,))
    entry.move(NAME, f"data/{FIELD}")
    entry["data"].attrs["auxiliary_signals"] = fixed([FIELD])
