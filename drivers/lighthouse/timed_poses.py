"""Poses as a device reports them: of the frame that SteamVR reports too, not of its IMU."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lobstr_hw.drivers.lighthouse.angles import TICKS_PER_S, DeviceModel, Ints
from lobstr_hw.drivers.lighthouse.light import Flags
from lobstr_hw.drivers.lighthouse.refine import cross_matrix
from lobstr_hw.drivers.lighthouse.tracker_state import Fix, PoseBatch
from lobstr_hw.rotations import Array, transpose

__all__ = ["TimedPoses", "timed_poses"]


@dataclass(frozen=True, slots=True, eq=False)
class TimedPoses:
    """Poses of the frame that a device reports (docs/conventions.md), one per IMU sample (k).

    Attributes:
        ticks: (k,) of the device's clock, unwrapped.
        p: (k, 3) metres, in the world.
        R: (k, 3, 3).
        velocity: (k, 3) metres per second; zero while the device lies still.
        covariance: (k, 6, 6) of position and rotation, both in the world.
        fix: (k,) of Fix.
    """

    ticks: Ints
    p: Array
    R: Array
    velocity: Array
    covariance: Array
    fix: NDArray[np.int8]

    def __len__(self) -> int:
        """Number of poses."""
        return len(self.ticks)

    @property
    def time_s(self) -> Array:
        """(k,) on the device's clock."""
        return np.asarray(self.ticks / TICKS_PER_S)

    @property
    def tracked(self) -> Flags:
        """(k,) which of them tell where the device is; the others hold its last place."""
        return np.asarray(self.fix != Fix.LOST)


def timed_poses(batch: PoseBatch, model: DeviceModel) -> TimedPoses:
    """From the IMU's frame to the one that the device reports.

    With t its origin in the IMU's frame: p + R t, moving at v + R (w x t). A small turn d of the
    IMU's frame about itself moves that origin by -R [t]x d, and is R d in the world.
    """
    R, t = batch.R, model.T_imu_head.p
    swing = np.cross(batch.angular_velocity, t)
    lies_still = ~np.any(batch.v, axis=1)
    velocity = batch.v + (R @ swing[..., None])[..., 0]
    velocity[lies_still] = 0.0
    J = np.zeros((len(batch), 6, 6))
    J[:, :3, :3] = np.eye(3)
    J[:, :3, 3:] = -R @ cross_matrix(t)
    J[:, 3:, 3:] = R
    return TimedPoses(
        batch.ticks,
        batch.p + R @ t,
        R @ model.T_imu_head.R,
        velocity,
        J @ batch.covariance @ transpose(J),
        batch.fix,
    )
