"""Driver of the card through NI-DAQmx, in this computer or behind NI's gRPC device server."""

from dearig.drivers.daqmx.inspection import inspect
from dearig.drivers.daqmx.rig import DaqmxRig, open_daqmx_rig

__all__ = ["DaqmxRig", "inspect", "open_daqmx_rig"]
