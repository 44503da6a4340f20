"""Warnings: once, in time, and not for what mends itself."""

from collections.abc import Callable

import pytest

from lobstr_hw.drivers.driver import DeviceInfo
from lobstr_hw.runtime.alarms import BATTERY_LOW, LOST_S, Alarms
from lobstr_hw.runtime.announcer import Sound, Spoken
from lobstr_hw.skeleton_pose import RoleReport
from lobstr_hw.trackers import TrackerRole

HEAD, PELVIS = TrackerRole.HEAD, TrackerRole.PELVIS


def watched(state_of: Callable[[float], str], until_s: float = 10.0) -> list[tuple[float, Spoken]]:
    """What is said when the pelvis fares so; the head is always well."""
    alarms, heard = Alarms(), []
    for k in range(int(45 * until_s)):
        now_s = k / 45.0
        reports = {HEAD: RoleReport("ok", 0.0), PELVIS: RoleReport(state_of(now_s), 0.0)}
        heard += [(now_s, spoken) for spoken in alarms.trackers(now_s, reports)]
    return heard


@pytest.mark.parametrize("how", ["guessed", "missing"])
def test_a_lost_tracker_is_told_once_and_so_is_its_return(how: str) -> None:
    lost, back = watched(lambda t: how if 2.0 <= t < 6.0 else "ok")
    assert lost[0] == pytest.approx(2.0 + LOST_S, abs=0.1)
    assert (lost[1].sound, back[1].sound) == (Sound.TROUBLE, Sound.DONE)
    assert "pelvis" in lost[1].text.lower()
    assert 6.0 < back[0] < 7.0


def test_short_losses_are_not_worth_a_word() -> None:
    assert not watched(lambda t: "guessed" if t % 2.0 < 0.9 * LOST_S else "ok")


def test_a_flickering_return_does_not_chatter() -> None:
    heard = watched(lambda t: "missing" if t > 2.0 and t % 0.5 < 0.25 else "ok", 30.0)
    assert len(heard) <= 2


def test_what_was_never_there_is_not_lost() -> None:
    assert not watched(lambda t: "missing")


def charges(*values: float | None) -> list[Spoken]:
    alarms, heard = Alarms(), []
    for value in values:
        device = DeviceInfo("A", "controller", battery=value)
        heard += alarms.batteries([device], {"A": TrackerRole.LEFT_HAND})
    return heard


def test_each_low_mark_is_told_once_on_the_way_down() -> None:
    heard = charges(*[1.0 - 0.01 * k for k in range(100)])
    assert len(heard) == len(BATTERY_LOW)
    assert all("left hand" in spoken.text for spoken in heard)


def test_a_charge_that_wavers_at_the_mark_is_told_once_until_charged() -> None:
    assert len(charges(*[0.15, 0.16] * 20)) == 1
    assert len(charges(0.15, 0.9, 0.15)) == 2


def test_devices_that_do_not_know_their_charge_are_left_alone() -> None:
    assert not charges(None, None)


def test_a_device_that_says_it_is_something_else_is_told_once_and_not_obeyed() -> None:
    alarms = Alarms()
    roles = {"A": PELVIS, "B": HEAD}

    def said(claimed: TrackerRole | None) -> list[Spoken]:
        devices = [DeviceInfo("A", "tracker", role_hint=claimed), DeviceInfo("C", "tracker")]
        return alarms.roles(devices, roles)

    assert said(None) == said(PELVIS) == []
    (spoken,) = said(TrackerRole.LEFT_FOOT)
    assert "left foot" in spoken.text
    assert "pelvis" in spoken.text
    assert spoken.sound is Sound.TROUBLE
    assert said(TrackerRole.LEFT_FOOT) == []
    assert said(PELVIS) == []
    assert said(TrackerRole.LEFT_FOOT) != [], "again, after it was right"
