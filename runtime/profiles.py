"""Which calibration profile a session begins with, if any."""

from collections.abc import Callable
from pathlib import Path

from lobstr_hw.calibration import Calibration, check_devices, load_profile
from lobstr_hw.calibration.profile import profile_from_json
from lobstr_hw.drivers.driver import TrackerDriver
from lobstr_hw.drivers.replay import ReplayDriver
from lobstr_hw.runtime.profile_path import default_profile_path

__all__ = ["chosen_profile"]


def chosen_profile(
    path: Path | None, driver: TrackerDriver, tell: Callable[[str], None]
) -> Calibration | None:
    """The profile that was asked for; or the one in the log; or the user's own.

    The user's own is for devices only, and only when all of its trackers are there: a replay must
    not depend on who runs it, and offsets of other trackers would be worse than none.

    Args:
        path: as the user gave it.
        driver: open.
        tell: is told of a profile that nobody asked for.

    Returns:
        None when the session has to wait for a T-pose.

    Raises:
        ProfileError: it is missing or cannot be used.
    """
    if path is not None:
        return _checked(load_profile(path), driver)
    if isinstance(driver, ReplayDriver):
        data = driver.log.profile
        return None if data is None else profile_from_json(data.decode(), f"{driver.path}: profile")
    return _own_profile(default_profile_path(), driver, tell)


def _checked(profile: Calibration, driver: TrackerDriver) -> Calibration:
    """The profile, unless these are other devices, or the same in other places.

    A driver that learns of its devices only while it listens has none yet, and nothing is checked.
    """
    seen = {device.serial: device.role_hint for device in driver.devices()}
    if seen:
        check_devices(profile, seen)
    return profile


def _own_profile(
    path: Path, driver: TrackerDriver, tell: Callable[[str], None]
) -> Calibration | None:
    if not path.exists():
        return None
    profile = load_profile(path)
    if not set(profile.roles) <= {device.serial for device in driver.devices()}:
        tell(f"{path} is for other trackers than these; stand in a T-pose to calibrate.")
        return None
    tell(f"calibrated by {path}")
    return profile
