import pytest

from lobstr_hw.drivers.driver import BASE_STATION, DeviceInfo
from lobstr_hw.errors import MissingRole
from lobstr_hw.runtime.roles import RoleTable
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole

HEAD, LEFT, RIGHT, PELVIS = FOUR_POINTS


def devices(**hints: TrackerRole | None) -> list[DeviceInfo]:
    return [DeviceInfo(serial, "tracker", role_hint=hint) for serial, hint in hints.items()]


def test_a_profile_is_binding_whatever_devices_say() -> None:
    table = RoleTable({"A": HEAD}, lambda: devices(A=PELVIS, B=LEFT))
    assert table.of("A") is HEAD
    assert table.of("B") is None


def test_devices_that_come_later_are_asked_for() -> None:
    seen = devices(A=HEAD)
    table = RoleTable(None, lambda: seen)
    assert table.of("B") is None
    seen += devices(B=PELVIS)
    assert table.of("B") is PELVIS


def test_the_first_device_of_a_role_keeps_it() -> None:
    table = RoleTable(None, lambda: devices(A=HEAD, B=HEAD))
    assert table.of("B") is None
    assert table.of("A") is HEAD


def test_a_missing_role_is_named_with_what_was_seen() -> None:
    table = RoleTable(None, lambda: devices(A=HEAD, B=LEFT, C=RIGHT))
    with pytest.raises(MissingRole, match=r"pelvis; seen: head \(A\), left_hand \(B\)"):
        table.require(FOUR_POINTS)
    table.require((HEAD, LEFT))


def test_before_a_calibration_a_device_without_a_name_may_be_what_is_missing() -> None:
    seen = devices(A=HEAD, B=LEFT, C=RIGHT, D=None)
    RoleTable(None, lambda: seen).require(FOUR_POINTS)
    with pytest.raises(MissingRole, match="pelvis"):
        RoleTable({"A": HEAD, "B": LEFT, "C": RIGHT}, lambda: seen).require(FOUR_POINTS)


def test_a_base_station_stands_for_nobody() -> None:
    seen = [*devices(A=HEAD, B=LEFT, C=RIGHT), DeviceInfo("LHB-1", BASE_STATION)]
    with pytest.raises(MissingRole, match="pelvis"):
        RoleTable(None, lambda: seen).require(FOUR_POINTS)
