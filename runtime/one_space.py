"""Samples of several tracking spaces, brought into the one world of the profile."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from lobstr_hw.calibration.calibration import TrackingSpace
from lobstr_hw.drivers.driver import DeviceEvent, DeviceInfo, TrackerDriver
from lobstr_hw.drivers.replay import ReplayDriver
from lobstr_hw.poses import PartialPose, Pose
from lobstr_hw.rotations import Array
from lobstr_hw.runtime.many_drivers import ManyDrivers
from lobstr_hw.trackers import TrackerSample

__all__ = ["SPACES", "OneSpace", "in_one_space", "moved", "spaces_apart"]

SPACES = "spaces"
"""Metadata of a log that was recorded from several drivers: serial -> name of its space."""


def in_one_space(
    driver: TrackerDriver, spaces: Mapping[str, TrackingSpace], tell: Callable[[str], None]
) -> TrackerDriver:
    """The driver, its samples in the world; the driver itself where there is nothing to do.

    Args:
        driver: open; several drivers as one, or the replay of a log recorded from several.
        spaces: of the profile, by name.
        tell: is told of spaces that nobody joined.
    """
    space_of, names = _spaces_of(driver)
    unknown = sorted(set(names) - spaces.keys())
    if unknown and len(names) > 1:
        tell(
            f"how the tracking space of {' and of '.join(unknown)} lies to the others is not "
            "known, so parts of the body may be elsewhere. Join them: lobstr-calibrate"
        )
    used = {name: spaces[name] for name in names if name in spaces}
    if all(space.is_world for space in used.values()):
        return driver
    return OneSpace(driver, space_of, used)


def spaces_apart(driver: TrackerDriver) -> "OneSpace | None":
    """The driver with its first space as the world, the others to be joined; None if it has one.

    Args:
        driver: open; as for :func:`in_one_space`.
    """
    space_of, names = _spaces_of(driver)
    if len(names) < 2:
        return None
    world, *others = names
    return OneSpace(driver, space_of, {world: TrackingSpace()}, others)


def _spaces_of(driver: TrackerDriver) -> tuple[Callable[[str], str | None], list[str]]:
    """Of a serial, and all of them: as the user named them, or as most trackers are in them."""
    if isinstance(driver, ManyDrivers):
        return driver.space_of, [part.name for part in driver.parts]
    if isinstance(driver, ReplayDriver):
        by_serial = driver.log.metadata.get(SPACES, {})
        return by_serial.get, [name for name, _ in Counter(by_serial.values()).most_common()]
    return lambda serial: None, []


class OneSpace(TrackerDriver):
    """A driver whose samples are moved from their spaces to the world, and their times together.

    Times are only ever moved back, those of the earliest stamps by nothing: a sample must not be
    newer than now.

    Attributes:
        space_of: the name of a serial's space.
        apart: names of the spaces that are not joined to the world yet.
    """

    def __init__(
        self,
        driver: TrackerDriver,
        space_of: Callable[[str], str | None],
        spaces: Mapping[str, TrackingSpace],
        apart: Sequence[str] = (),
    ) -> None:
        """Put the transforms behind a driver.

        Args:
            driver: gives the samples.
            space_of: the name of a serial's space.
            spaces: by name; samples of others are left as they are.
            apart: names of others that may be joined later.
        """
        self._driver, self.space_of, self._spaces = driver, space_of, dict(spaces)
        self.apart = tuple(apart)

    @property
    def spaces(self) -> Mapping[str, TrackingSpace]:
        """All that are joined, by name: what a profile keeps."""
        return MappingProxyType(self._spaces)

    @property
    def name(self) -> str:
        """Of the space that is the world, when this was made by :func:`spaces_apart`."""
        return next(iter(self._spaces))

    @property
    def earliest_s(self) -> float:
        """The delay of the earliest stamps, to which all others are moved back; 0 or less."""
        return min(space.delay_s for space in self._spaces.values())

    def join(self, name: str, space: TrackingSpace) -> None:
        """From now on the samples of this space come in the world, too."""
        self._spaces[name] = space
        self.apart = tuple(other for other in self.apart if other != name)

    def join_as_before(self, spaces: Mapping[str, TrackingSpace]) -> None:
        """Join those of the spaces apart that are known."""
        for name in self.apart:
            if name in spaces:
                self.join(name, spaces[name])

    def open(self) -> None:
        """Open the driver."""
        self._driver.open()

    def poll(self, now_s: float) -> Sequence[TrackerSample]:
        """The driver's samples in the world, oldest first."""
        samples = [self._moved(sample) for sample in self._driver.poll(now_s)]
        return sorted(samples, key=lambda sample: sample.time_s)  # stable

    def _moved(self, sample: TrackerSample) -> TrackerSample:
        space = self._spaces.get(self.space_of(sample.serial) or "")
        if space is None:
            return sample
        return moved(sample, space.T_world_space, self.earliest_s - space.delay_s)

    def devices(self) -> Sequence[DeviceInfo]:
        """The driver's devices."""
        return self._driver.devices()

    def events(self) -> Sequence[DeviceEvent]:
        """The driver's events."""
        return self._driver.events()

    def close(self) -> None:
        """Close the driver."""
        self._driver.close()


def moved(sample: TrackerSample, T_world_space: Pose, later_s: float = 0.0) -> TrackerSample:
    """A sample of a tracking space as one of the world, its time moved by ``later_s``."""
    R, pose = T_world_space.R, sample.T_world_tracker
    p = None if pose.p is None else T_world_space.apply(pose.p)
    return replace(
        sample,
        T_world_tracker=PartialPose(R @ pose.R, p),
        time_s=sample.time_s + later_s,
        velocity=None if sample.velocity is None else R @ sample.velocity,
        covariance=None if sample.covariance is None else _turned(R, sample.covariance),
    )


def _turned(R: Array, covariance: Array) -> Array:
    """Of position and of rotation, (6, 6), both in the world."""
    both = np.kron(np.eye(2), R)
    return np.asarray(both @ covariance @ both.T)
