from collections.abc import Callable

import pytest
from support.bad_drivers import BrokenProbeDriver, BusyDriver, MissingDriver, QuietDriver

from lobstr_hw.drivers.driver import TrackerDriver
from lobstr_hw.drivers.fake import FakeDriver
from lobstr_hw.errors import TrackerNotFound
from lobstr_hw.runtime import sources
from lobstr_hw.runtime.many_drivers import ManyDrivers
from lobstr_hw.runtime.roles import RoleTable
from lobstr_hw.runtime.sources import drivers_from_specs, joined
from lobstr_hw.trackers import TrackerRole

Machine = Callable[..., None]


@pytest.fixture
def machine(monkeypatch: pytest.MonkeyPatch) -> Machine:
    """Makes the table of drivers; each keyword a driver's name and its class."""

    def make(**drivers: type[TrackerDriver]) -> None:
        table = {name: (found.__module__, found.__name__) for name, found in drivers.items()}
        monkeypatch.setattr("lobstr_hw.drivers.DRIVERS", table)
        monkeypatch.setattr(sources, "DRIVERS", table)

    return make


def test_steamvr_goes_before_hardware_on_usb(machine: Machine) -> None:
    machine(fake=FakeDriver, lighthouse=FakeDriver, openvr=QuietDriver)
    told: list[str] = []
    assert isinstance(drivers_from_specs([], told.append), QuietDriver)
    assert told == ["taking what is there: --driver openvr"]


@pytest.mark.parametrize("openvr", [MissingDriver, BusyDriver, BrokenProbeDriver])
def test_where_steamvr_does_not_run_hardware_on_usb_is_taken(
    machine: Machine, openvr: type[TrackerDriver]
) -> None:
    machine(openvr=openvr, lighthouse=QuietDriver)
    told: list[str] = []
    assert isinstance(drivers_from_specs([], told.append), QuietDriver)
    assert "lighthouse" in told[0]


def test_what_is_there_is_handed_on_closed(machine: Machine) -> None:
    machine(openvr=FakeDriver)
    assert not drivers_from_specs([], print).devices()


def test_where_nothing_is_there_it_is_told_how_to_get_each(machine: Machine) -> None:
    machine(fake=FakeDriver, openvr=BusyDriver, polhemus=MissingDriver, vmc=BrokenProbeDriver)
    with pytest.raises(TrackerNotFound) as raised:
        drivers_from_specs([], print)
    lines = str(raised.value).splitlines()
    assert lines[1] == "  openvr: the dongle is in use. Close the other program."
    assert "as in --driver" in lines[2]
    assert "  fake: ready" in lines
    assert "  polhemus: missing: the Python package snake; pip install snake" in lines
    assert "  vmc: its driver failed (RuntimeError: ouch)" in lines
    assert lines[-1].endswith("lobstr-live --sim")


def test_a_driver_on_its_own_is_taken_as_it_is() -> None:
    assert isinstance(drivers_from_specs(["fake:seed=3"], print), FakeDriver)


def test_a_role_in_a_spec_goes_before_what_devices_say() -> None:
    driver = joined(["fake", "fake:name=belt,role=pelvis"])
    assert isinstance(driver, ManyDrivers)
    with driver:
        fakes, belt = (part.devices() for part in driver.parts)
    assert [device.role_hint for device in fakes][-1] is None
    assert [device.role_hint for device in belt] == [TrackerRole.PELVIS, None, None, None]


def test_a_role_in_a_spec_is_the_role_of_the_session() -> None:
    with joined(["fake:role=chest"]) as driver:
        table = RoleTable(None, driver.devices)
        assert table.of("FAKE-HEAD") is TrackerRole.CHEST
        assert table.of("FAKE-PELVIS") is None


def test_a_serial_belongs_to_the_driver_that_has_it() -> None:
    driver = joined(["fake", "vmc:port=39999"])
    assert isinstance(driver, ManyDrivers)
    assert driver.space_of("FAKE-HEAD") is None
    with driver:
        driver.poll(1.0)
    assert driver.space_of("FAKE-HEAD") == "fake"


@pytest.mark.parametrize(
    ("specs", "reason"),
    [
        (["fake:role=nose"], "role=nose in 'fake:role=nose' is not one of head"),
        (["fake", "fake:seed=1"], "two drivers are called fake; tell them apart"),
        (["fake:role=head", "fake:name=b,role=head"], "two drivers have role=head"),
    ],
)
def test_what_cannot_be_joined_is_told(specs: list[str], reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        joined(specs)
