"""Which calibration profile a session begins with, if any."""

from collections.abc import Callable, Mapping
from pathlib import Path

from lobstr_hw.calibration import Calibration, TrackingSpace, check_devices, load_profile
from lobstr_hw.calibration.profile import profile_from_json
from lobstr_hw.drivers.driver import TrackerDriver
from lobstr_hw.drivers.replay import ReplayDriver
from lobstr_hw.errors import ProfileError
from lobstr_hw.runtime.many_drivers import ManyDrivers
from lobstr_hw.runtime.profile_path import default_profile_path

__all__ = ["chosen_profile", "spaces_as_before"]


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
        return _checked(load_profile(path), driver, tell)
    if isinstance(driver, ReplayDriver):
        data = driver.log.profile
        return None if data is None else _profile_of(data, driver)
    return _own_profile(default_profile_path(), driver, tell)


def _profile_of(data: bytes, driver: ReplayDriver) -> Calibration:
    """The profile in a log.

    Raises:
        ProfileError: it is none.
    """
    where = f"{driver.path}: profile"
    try:
        text = data.decode()
    except UnicodeDecodeError as error:
        raise ProfileError(
            f"{where}: is no text ({error.reason}). Name another with --profile FILE."
        ) from error
    return profile_from_json(text, where)


def _checked(
    profile: Calibration, driver: TrackerDriver, tell: Callable[[str], None]
) -> Calibration:
    """The profile, unless these are other devices, or the same in other places.

    A driver that learns of its devices only while it listens has none yet, and nothing is checked.
    """
    alone = _alone(profile, driver)
    seen = {device.serial: device.role_hint for device in driver.devices()}
    try:
        if seen:
            check_devices(profile, seen)
    except ProfileError as error:
        raise ProfileError(f"{error} {alone}".strip()) from error
    if alone and not seen:
        tell(alone)
    return profile


def _alone(profile: Calibration, driver: TrackerDriver) -> str:
    """What to say of a profile of several systems where only one is here; empty otherwise."""
    if len(profile.tracking_spaces) < 2 or isinstance(driver, ManyDrivers | ReplayDriver):
        return ""
    names = list(profile.tracking_spaces)
    return (
        f"The profile joins the tracking systems {' and '.join(names)}, and one alone is here. "
        "Name all of them with --driver, as at the calibration; or calibrate for this one: "
        "lobstr-calibrate."
    )


def _own_profile(
    path: Path, driver: TrackerDriver, tell: Callable[[str], None]
) -> Calibration | None:
    if not path.exists():
        return None
    profile = load_profile(path)
    if not set(profile.roles) <= {device.serial for device in driver.devices()}:
        words = f"{path} is for other trackers than these; stand in a T-pose to calibrate."
        tell(f"{words} {_alone(profile, driver)}".strip())
        return None
    try:
        _checked(profile, driver, tell)
    except ProfileError as error:
        tell(f"{path} is not used: {error} Until then: stand in a T-pose to calibrate.")
        return None
    tell(f"calibrated by {path}")
    return profile


def spaces_as_before(source: Path | ReplayDriver, world: str) -> Mapping[str, TrackingSpace]:
    """How an old profile joins tracking spaces; nothing where it has another world, or is broken.

    Args:
        source: of the profile: a file, which need not exist, or a log, which need not have one.
        world: name of the space that is the world now.
    """
    try:
        if isinstance(source, ReplayDriver):
            data = source.log.profile
            spaces = {} if data is None else _profile_of(data, source).tracking_spaces
        else:
            spaces = load_profile(source).tracking_spaces
    except ProfileError:
        return {}
    return spaces if world in spaces and spaces[world].is_world else {}
