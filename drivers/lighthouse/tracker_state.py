"""What tracking one device remembers, gives, and is set to."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from lobstr_hw.drivers.lighthouse.angles import TICKS_PER_S, Angles, ImuSamples, Ints
from lobstr_hw.drivers.lighthouse.kalman import FilterSettings, FilterState
from lobstr_hw.rotations import Array

__all__ = ["Fix", "PoseBatch", "Tail", "TrackerSettings", "TrackerState", "begin", "join_poses"]


class Fix(IntEnum):
    """How a pose came about."""

    LIGHT = 0
    """By light within the last 75 ms, and the IMU."""
    INERTIAL = 1
    """By the IMU alone, for up to 100 ms."""
    LOST = 2
    """Only the rotation is still followed; the position is where it was."""


@dataclass(frozen=True, slots=True)
class TrackerSettings:
    """Times and limits of tracking.

    Attributes:
        window: ticks of light that are used together: a sweep or two. The work is per window.
        lag: ticks that light may come later than the IMU: by radio 10 to 25 ms, by cable 3 to 10
            and, of Knuckles, up to 29. Waiting costs little: dead reckoning over 30 ms drifts by a
            tenth of a millimetre.
        inertial_s: without light for so long: dead reckoning, said so. It is not longer dark than
            usual before the lag, a window and the pause between two sweeps are over.
        lost_s: without light for so long: lost. Dead reckoning drifts 5 cm in 0.3 s.
        seed_s: hits of the last so many seconds make a new pose: two turns of the rotors.
        seed_span_s: they must cover so much: velocity is told by time.
        seed_rms_rad: a new pose must fit so well.
        seed_outlier_rad: hits further from a new pose than this are reflections.
        seed_sigma_m: and be known so well; more light has to confirm it.
        search_s: a pose from nothing, some 40 ms of work, is looked for no sooner again.
        rotation_known_s: after so long without light the gyroscope's rotation is forgotten.
        lost_sigma_m: a position less certain than this is none.
        disagree_windows: so many windows in a row whose light does not fit: the pose is wrong.
        doubt_share: less than this share of the latest hits is believed: perhaps the pose is wrong
            and slid off along the few planes of light that still fit. Another is looked for.
        doubt_hits: so many of the latest hits at least, for that.
        doubt_s: after a look in vain for so long no other.
        trial_hits: a new pose must agree with so many more hits before it counts,
        trial_sigma_m: and be so certain.
        rest_s: so long without movement is rest.
        rest_gyro_rad_s, rest_acc_g: spread of the IMU's samples at rest, at most.
        rest_speed_m_s: a device that light sees moving is not at rest, however calm its IMU.
        filter: of the Kalman filter.
    """

    window: int = 12 * TICKS_PER_S // 1000
    lag: int = 30 * TICKS_PER_S // 1000
    inertial_s: float = 0.075
    lost_s: float = 0.1
    seed_s: float = 0.036
    seed_span_s: float = 0.02
    seed_rms_rad: float = 1e-3
    seed_outlier_rad: float = 3e-3
    seed_sigma_m: float = 0.06
    search_s: float = 0.12
    rotation_known_s: float = 5.0
    lost_sigma_m: float = 0.1
    disagree_windows: int = 6
    doubt_share: float = 0.6
    doubt_hits: float = 12.0
    doubt_s: float = 0.1
    trial_hits: float = 6.0
    trial_sigma_m: float = 0.02
    rest_s: float = 0.25
    rest_gyro_rad_s: float = 0.012
    rest_acc_g: float = 0.012
    rest_speed_m_s: float = 0.03
    filter: FilterSettings = field(default_factory=FilterSettings)


@dataclass(frozen=True, slots=True, eq=False)
class PoseBatch:
    """Poses of the IMU frame in the world, one for each IMU sample (k of them).

    Attributes:
        ticks: (k,) device ticks.
        p, v: (k, 3). The velocity is zero while the device lies still.
        R: (k, 3, 3).
        angular_velocity: (k, 3) in the IMU frame, bias taken off.
        covariance: (k, 6, 6) of the position, in the world, and the rotation, in the IMU frame.
        fix: (k,) of Fix.
    """

    ticks: Ints
    p: Array
    v: Array
    R: Array
    angular_velocity: Array
    covariance: Array
    fix: NDArray[np.int8]

    def __len__(self) -> int:
        """Number of poses."""
        return len(self.ticks)


@dataclass(frozen=True, slots=True, eq=False)
class Tail:
    """How far dead reckoning from the filter has come: the last pose given.

    Attributes:
        ticks: of an IMU sample.
        p, v: (3,).
        R: (3, 3).
        covariance: (6, 6) of position and rotation, of all poses until the next window.
    """

    ticks: int
    p: Array
    v: Array
    R: Array
    covariance: Array


@dataclass(frozen=True, slots=True, eq=False)
class TrackerState:
    """All that tracking one device remembers.

    Attributes:
        filter: at the last IMU sample of the last window, or None before the first pose.
        tail: from there on; None where there is no filter.
        imu: samples still needed: the last rest_s, and all after the filter's moment.
        angles: hits still needed, by time.
        window_end: ticks, a multiple of a window's; windows up to here are done.
        given: ticks of the last pose given.
        light: ticks of the last hit that was believed.
        lost: the position is not followed.
        on_trial: lost, and a new pose is followed that light has not confirmed yet.
        place: (3,) where it was before it was lost, or None before the first pose.
        still: at rest.
        disagreed: windows in a row whose light did not fit.
        seen, believed: hits of late, those longer ago counting less.
        looked: ticks of the last look for a pose from nothing, or for another one.
        rms_rad: of the hits believed last.
    """

    filter: FilterState | None
    tail: Tail | None
    imu: ImuSamples
    angles: Angles
    window_end: int
    given: int
    light: int
    lost: bool
    on_trial: bool
    place: Array | None
    still: bool
    disagreed: int
    seen: float
    believed: float
    looked: int
    rms_rad: float


def _no_angles() -> Angles:
    none = np.zeros(0, np.int64)
    return Angles(none, none, none, none, np.zeros(0))


def begin() -> TrackerState:
    """Nothing known yet."""
    never = -(2**62)
    return TrackerState(
        filter=None,
        tail=None,
        imu=ImuSamples.join(()),
        angles=_no_angles(),
        window_end=never,
        given=never,
        light=never,
        lost=True,
        on_trial=False,
        place=None,
        still=False,
        disagreed=0,
        seen=0.0,
        believed=0.0,
        looked=never,
        rms_rad=0.0,
    )


def join_poses(batches: Sequence[PoseBatch]) -> PoseBatch:
    """Poses one after the other."""
    full = [b for b in batches if len(b)]
    if not full:
        return PoseBatch(
            np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3, 3)),
            np.zeros((0, 3)), np.zeros((0, 6, 6)), np.zeros(0, np.int8),
        )  # fmt: skip
    return PoseBatch(
        np.concatenate([b.ticks for b in full]),
        np.concatenate([b.p for b in full]),
        np.concatenate([b.v for b in full]),
        np.concatenate([b.R for b in full]),
        np.concatenate([b.angular_velocity for b in full]),
        np.concatenate([b.covariance for b in full]),
        np.concatenate([b.fix for b in full]),
    )
