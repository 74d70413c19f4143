"""Settings of the instruments in a rig file, each with its unit in its name.

Defaults are the rig of the thesis (section 4.1) with the makers' figures, which are from memory:
check them against the manuals of the actual instruments. Values marked "simulated rig only"
describe an instrument's imperfections; they have no effect on a real one.
"""

from dearig.drivers.settings.amplifier import AmplifierSettings
from dearig.drivers.settings.card import CardSettings
from dearig.drivers.settings.channel import ChannelSettings, ThermometerSettings
from dearig.drivers.settings.laser import LaserSettings
from dearig.drivers.settings.limits import GuardianSettings, InterlockSettings, LimitsSettings
from dearig.drivers.settings.rig import RigSettings
from dearig.drivers.settings.room import RoomSettings, ThermohygrometerSettings
from dearig.drivers.settings.section import Action, Section

__all__ = [
    "Action",
    "AmplifierSettings",
    "CardSettings",
    "ChannelSettings",
    "GuardianSettings",
    "InterlockSettings",
    "LaserSettings",
    "LimitsSettings",
    "RigSettings",
    "RoomSettings",
    "Section",
    "ThermohygrometerSettings",
    "ThermometerSettings",
]
