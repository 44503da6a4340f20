"""Base stations that go out are spoken of, once."""

from lobstr_hw.drivers.driver import BASE_STATION, DeviceEvent, DeviceInfo, EventKind
from lobstr_hw.runtime.announcer import Sound, Spoken
from lobstr_hw.runtime.station_alarms import HIDDEN_S, StationAlarms

STATION = DeviceInfo("LHB-1", BASE_STATION)


def trackers(*in_view: int | None) -> list[DeviceInfo]:
    return [DeviceInfo(f"T{i}", "tracker", stations_in_view=n) for i, n in enumerate(in_view)] + [
        STATION
    ]


def event(kind: EventKind, serial: str = "LHB-1") -> DeviceEvent:
    return DeviceEvent(kind, serial, 1.0)


def words(said: list[Spoken]) -> list[str]:
    return [spoken.text for spoken in said]


def test_a_station_that_its_driver_loses_and_finds_is_told() -> None:
    alarms = StationAlarms()
    alarms.devices(0.0, [STATION])
    (lost,) = alarms.events([event(EventKind.GONE)])
    assert lost.sound is Sound.TROUBLE
    assert "LHB-1" in lost.text
    (back,) = alarms.events([event(EventKind.BACK)])
    assert back.sound is Sound.DONE


def test_a_tracker_that_goes_is_no_station() -> None:
    alarms = StationAlarms()
    alarms.devices(0.0, trackers(2))
    assert alarms.events([event(EventKind.GONE, "T0"), event(EventKind.BUTTON_DOWN)]) == []


def test_a_station_that_nobody_sees_for_long_is_told_once_and_its_return_too() -> None:
    alarms = StationAlarms()
    said = [alarms.devices(float(t), trackers(2, 1)) for t in range(3)]
    said += [alarms.devices(float(t), trackers(1, 1)) for t in range(3, 30)]
    assert [text for one in said for text in words(one)] == [
        "Only 1 of 2 base stations in sight. Is it switched on, and is nothing in front of it?"
    ]
    told_at = next(i for i, one in enumerate(said) if one)
    assert told_at >= 3 + HIDDEN_S
    assert words(alarms.devices(30.0, trackers(1, 2))) == ["All 2 base stations in sight again."]
    assert alarms.devices(31.0, trackers(2, 2)) == []


def test_a_body_that_hides_a_station_for_a_moment_is_none_of_it() -> None:
    alarms = StationAlarms()
    for t in range(60):
        hidden = t % 5 != 0  # once in five seconds somebody sees both
        assert alarms.devices(float(t), trackers(1 if hidden else 2, 1)) == []


def test_where_trackers_do_not_say_what_they_see_nothing_is_said() -> None:
    alarms = StationAlarms()
    for t in range(20):
        assert alarms.devices(float(t), trackers(None, None)) == []
