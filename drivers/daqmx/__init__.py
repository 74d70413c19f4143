"""The card through NI-DAQmx, in this computer or behind NI's gRPC device server."""

from drivers.daqmx.inspection import inspect
from drivers.daqmx.rig import DaqmxRig, open_daqmx_rig

__all__ = ["DaqmxRig", "inspect", "open_daqmx_rig"]
