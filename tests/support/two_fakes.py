"""A fake person tracked by two systems: head and hands by one, the pelvis by another."""

from lobstr_hw.drivers.fake import FakeDriver
from lobstr_hw.runtime.many_drivers import ManyDrivers
from lobstr_hw.runtime.part_driver import PartDriver
from lobstr_hw.trackers import TrackerRole


def two_fakes(script: str = "join") -> ManyDrivers:
    """The second's space is ``OTHER_SPACE``; the script says what the person does."""
    hands = FakeDriver(script=script, rate_hz=45.0, has="head+left_hand+right_hand")
    belt = FakeDriver(script=script, rate_hz=45.0, has="pelvis", apart=1)
    return ManyDrivers([PartDriver(hands, "vr"), PartDriver(belt, "belt", TrackerRole.PELVIS)])
