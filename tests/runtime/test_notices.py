"""A driver's words reach whoever listens: a session, a recording, the wizard, lobstr-devices."""

from collections.abc import Sequence
from pathlib import Path

import pytest
from support.fake_clock import FakeClock

from lobstr_hw.drivers.driver import DeviceEvent, EventKind
from lobstr_hw.drivers.fake import FakeDriver
from lobstr_hw.drivers.lighthouse.driver import LighthouseDriver
from lobstr_hw.drivers.tracker_log import TrackerLogWriter
from lobstr_hw.runtime import device_watch
from lobstr_hw.runtime.announcer import Spoken
from lobstr_hw.runtime.device_watch import DeviceWatch
from lobstr_hw.runtime.live import LiveOptions, LiveSession
from lobstr_hw.runtime.notices import notices
from lobstr_hw.runtime.recording import Recorder
from lobstr_hw.runtime.roles import RoleTable
from lobstr_hw.runtime.sources import driver_from_spec
from lobstr_hw.runtime.station_place import default_stations_path, with_station_file
from lobstr_hw.runtime.wizard.find_devices import FindDevices
from lobstr_hw.runtime.wizard.flow import Wizard
from lobstr_hw.runtime.wizard.run import run_with_person
from lobstr_hw.runtime.wizard.stage import Person
from lobstr_hw.runtime.wizard.view import View

WORDS = "A base station was moved."


class Talking(FakeDriver):
    """The fake person, and one thing to say."""

    said = False

    def events(self) -> Sequence[DeviceEvent]:
        if self.said:
            return ()
        self.said = True
        return [DeviceEvent(EventKind.NOTICE, "", 0.0, WORDS)]


def test_only_notices_are_words() -> None:
    kinds = [DeviceEvent(kind, "", 0.0, "x") for kind in EventKind]
    assert notices(kinds) == ["x"]


def test_a_session_says_them(tmp_path: Path) -> None:
    said: list[Spoken] = []
    options = LiveOptions(duration_s=0.1, predictor="standing", quiet=True)
    with LiveSession(Talking(), options, print, FakeClock(), said.append) as live:
        live.run(lambda: False)
    assert [spoken.text for spoken in said].count(WORDS) == 1


def test_a_recording_tells_them(tmp_path: Path) -> None:
    told: list[str] = []
    driver, clock = Talking(), FakeClock(0.0)
    writer = TrackerLogWriter(tmp_path / "a.mcap")
    with driver:
        table = RoleTable(None, driver.devices)
        Recorder(driver, writer, table, clock, 90.0, told.append).run(lambda: False, 0.1)
        writer.close()
    assert told == [WORDS]


class Ears:
    """Stands between the wizard and nobody."""

    def __init__(self) -> None:
        self.heard: list[str] = []

    def keys(self) -> str:
        return "q"

    def show(self, view: View) -> None:
        pass

    def say(self, spoken: Sequence[Spoken]) -> None:
        self.heard += [words.text for words in spoken]


def test_the_wizard_says_them() -> None:
    ears = Ears()
    with Talking() as driver:
        wizard = Wizard(Person(), [FindDevices])
        run_with_person(driver, wizard, ears, FakeClock(), lambda: False)
    assert WORDS in ears.heard


def test_a_list_of_devices_tells_them_once(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[str] = []
    monkeypatch.setattr(device_watch, "load_driver", lambda spec: Talking())
    watch = DeviceWatch("fake", False, FakeClock(), told.append)
    watch.start()
    watch.settled.wait(5.0)
    watch.stop()
    watch.join(5.0)
    assert told == [f"fake: {WORDS}"]


def test_the_file_of_the_base_stations_has_a_place_unless_the_user_gave_one() -> None:
    place = default_stations_path()
    assert with_station_file("lighthouse") == f"lighthouse:stations={place}"
    spec = "lighthouse:pelvis=LHR-1"
    assert with_station_file(spec) == f"{spec},stations={place}"
    named = "lighthouse:stations=room.json"
    assert with_station_file(named) == named
    assert with_station_file("fake") == "fake"
    driver = driver_from_spec("lighthouse")
    assert isinstance(driver, LighthouseDriver)
    assert driver._path == place
