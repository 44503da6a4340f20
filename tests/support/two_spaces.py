"""Two trackers held together and moved about, each in a tracking space of its own."""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.poses import PartialPose, Pose
from lobstr_hw.rotations import Array, from_rotation_vector
from lobstr_hw.simulation import TrackingErrors
from lobstr_hw.simulation.noise import random_rotations, smooth_noise
from lobstr_hw.simulation.tracking_errors import disturbed
from lobstr_hw.trackers import TrackerSample

__all__ = ["Scene", "held_together"]

PLACE = np.array([0.3, 1.1, -0.4])


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """The truth, and what was measured.

    Attributes:
        T_a_b: between the spaces.
        T_held: tracker b in tracker a.
        samples_a, samples_b: oldest first.
        p_mean: (3,) where it was, in space a.
    """

    T_a_b: Pose
    T_held: Pose
    samples_a: list[TrackerSample]
    samples_b: list[TrackerSample]
    p_mean: Array


def held_together(
    seed: int,
    *,
    seconds: float = 8.0,
    delay_s: float = 0.0,
    rate_b_hz: float = 90.0,
    turn_rad: float = 0.5,
    axes: Array | None = None,
    slip_m: float = 0.0,
    errors: TrackingErrors | None = None,
) -> Scene:
    """Somebody moves two trackers.

    Args:
        seed: of everything.
        seconds: for so long.
        delay_s: how much later b's samples are stamped.
        rate_b_hz: of tracker b; tracker a has 90 Hz.
        turn_rad: deviation of the angle about each axis.
        axes: (3,) which axes they are turned about, 1 or 0; all unless given.
        slip_m: by how much the one moves against the other, deviation.
        errors: of the trackers; none unless given.
    """
    rng = np.random.default_rng(seed)
    T_a_b = Pose(random_rotations(rng, 1)[0], rng.uniform(-2.0, 2.0, 3))
    T_held = Pose(random_rotations(rng, 1)[0], rng.uniform(-0.1, 0.1, 3))
    rest = random_rotations(rng, 1)[0]
    scale = turn_rad * (np.ones(3) if axes is None else axes)
    way = int(rng.integers(1 << 30))

    def hands(times_s: Array) -> tuple[Pose, Pose]:
        """Where the hands are, and how far the one tracker has slipped in them."""
        waves = smooth_noise(np.random.default_rng(way), times_s, 9, 1.0)
        R = rest @ from_rotation_vector(scale * waves[:, :3])
        slip = Pose(np.broadcast_to(np.eye(3), R.shape), slip_m * waves[:, 6:])
        return Pose(R, PLACE + 0.15 * waves[:, 3:6]), slip

    times_a, times_b = (np.arange(0.0, seconds, 1.0 / hz) for hz in (90.0, rate_b_hz))
    a, _ = hands(times_a)
    b, slip = hands(times_b)
    b = T_a_b.inverse() @ b @ slip @ T_held
    errors = errors or TrackingErrors.none()
    return Scene(
        T_a_b,
        T_held,
        _samples("A", times_a, a, errors, rng),
        _samples("B", times_b, b, errors, rng, delay_s),
        np.mean(a.p, axis=0),
    )


def _samples(
    serial: str,
    times_s: Array,
    pose: Pose,
    errors: TrackingErrors,
    rng: np.random.Generator,
    late_s: float = 0.0,
) -> list[TrackerSample]:
    p, R, tracked = disturbed(errors, rng, times_s, pose.p[:, None], pose.R[:, None])
    return [
        TrackerSample(serial, PartialPose(R[i, 0], p[i, 0]), time_s + late_s, bool(tracked[i, 0]))
        for i, time_s in enumerate(times_s.tolist())
    ]
