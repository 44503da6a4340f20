"""The contact lock: a foot that is on the floor stays where it is (Yang et al. 2021, 3.4.1).

What the paper leaves open (hysteresis, the floor, early release) is decided in docs/decisions.md,
"The contact lock lets go by a spring, ...". Lengths are metres on the standard skeleton, times are
seconds: the lock behaves the same at every rate of the loop.
"""

from dataclasses import dataclass, replace

import numpy as np

from lobstr_hw.ik.vectors import length, rotate
from lobstr_hw.predictors.predictor import Bools
from lobstr_hw.rotations import Array

__all__ = ["ContactLock", "LockSettings", "follow", "release", "smoothed", "toe_target"]


@dataclass(frozen=True, slots=True)
class LockSettings:
    """When a foot is held and let go.

    Attributes:
        on_probability: above it a foot is locked.
        off_probability: under this the lock opens.
        reach: share of the stretched leg (hip to toe base) beyond which it opens.
        distance_m: from the network's toe beyond which it opens: how far a stance may be wrong
            for the sake of standing still.
        close_within_m: from the network's toe within which it may close. Without it a foot let go
            early is locked again on its way, still far off, and never comes home.
        floor_within_m: a locked toe stands on the floor while the network's is no further above it
            than this (or under it); where it is, it goes as high as the network's: on a rung.
        floor_s: how long that way takes.
        release_s: half-life of what is left of the way home after a release.
        smooth_s: memory of the filter that takes the trembling off the network's toe.
    """

    on_probability: float = 0.6
    off_probability: float = 0.4
    reach: float = 0.99
    distance_m: float = 0.1
    close_within_m: float = 0.05
    floor_within_m: float = 0.03
    floor_s: float = 0.1
    release_s: float = 0.06
    smooth_s: float = 0.035


@dataclass(frozen=True, slots=True, eq=False)
class ContactLock:
    """State of the lock, both feet of n people.

    Attributes:
        known: (n,) whether there has been a tick at all.
        on: (n, 2) held.
        p_lock: (n, 2, 3) where a locked toe base is held, or was when it was let go; world.
        toe: (n, 2, 3) the network's toe bases, smoothed; world.
        leg: (n, 2, 3) the same from the hip joints, along the world's axes.
        leg_v: (n, 2, 3) how that changes, metres per second.
        offset: (n, 2, 3) of the toe shown from the network's, since the lock opened.
        offset_v: (n, 2, 3) how that changes.
    """

    known: Bools
    on: Bools
    p_lock: Array
    toe: Array
    leg: Array
    leg_v: Array
    offset: Array
    offset_v: Array

    @staticmethod
    def start(n: int) -> "ContactLock":
        """Nothing locked, nothing on its way."""
        points = np.zeros((n, 2, 3))
        return ContactLock(
            known=np.zeros(n, dtype=np.bool_),
            on=np.zeros((n, 2), dtype=np.bool_),
            p_lock=points,
            toe=points,
            leg=points,
            leg_v=points,
            offset=points,
            offset_v=points,
        )

    def shifted(self, T: Array) -> "ContactLock":
        """The same lock after the play space moved by T (n, 4, 4), a turn about Y and a shift."""
        R, shift = T[:, None, :3, :3], T[:, None, :3, 3]
        return replace(
            self,
            p_lock=rotate(R, self.p_lock) + shift,
            toe=rotate(R, self.toe) + shift,
            leg=rotate(R, self.leg),
            leg_v=rotate(R, self.leg_v),
            offset=rotate(R, self.offset),
            offset_v=rotate(R, self.offset_v),
        )


def smoothed(
    lock: ContactLock, toe: Array, p_hip: Array, dt_s: Array, settings: LockSettings
) -> tuple[ContactLock, Array]:
    """The network's toe bases (n, 2, 3) without their trembling, and the state that says so.

    A filter of fading memory that expects the leg to go on as it goes: what moves steadily is
    not delayed. It is the leg, not the foot in the world, that is smoothed: how the hips move is
    measured.

    Args:
        lock: the state at the last tick.
        toe: as the network has them at this tick (n, 2, 3).
        p_hip: upper-leg joints (n, 2, 3).
        dt_s: time since the last tick (n, 1).
        settings: of the lock.
    """
    keep = np.exp(-dt_s / settings.smooth_s)[..., None]
    expected = lock.leg + dt_s[..., None] * lock.leg_v
    missed = toe - p_hip - expected
    leg = expected + (1.0 - keep**2) * missed
    leg_v = lock.leg_v + (1.0 - keep) ** 2 * missed / np.maximum(dt_s, 1e-6)[..., None]
    known = lock.known[:, None, None]
    leg, leg_v = np.where(known, leg, toe - p_hip), np.where(known, leg_v, 0.0)
    return replace(lock, leg=leg, leg_v=leg_v), p_hip + leg


def toe_target(
    lock: ContactLock, toe: Array, dt_s: Array, floor_y: Array, settings: LockSettings
) -> tuple[ContactLock, Array]:
    """Where the toe bases are to be shown at this tick (n, 2, 3), before new locks are told.

    What a foot was off when it was let go is taken away as a critically damped spring does it
    (its rate is 2 ln 2 / half-life); the foot goes with the network's at once, so that a swing is
    not shown late.

    Args:
        lock: the state at the last tick.
        toe: of :func:`smoothed` (n, 2, 3).
        dt_s: time since the last tick (n, 1).
        floor_y: height of a toe base that stands on the floor (n, 1).
        settings: of the lock.

    Returns:
        The state with what is left of the way home, and the toe bases.
    """
    step = settings.floor_within_m / settings.floor_s * dt_s
    y, toe_y = lock.p_lock[..., 1], toe[..., 1]
    goal_y = np.where(toe_y - floor_y < settings.floor_within_m, floor_y, toe_y)
    y = y + np.clip(goal_y - y, -step, step)
    held = np.stack([lock.p_lock[..., 0], y, lock.p_lock[..., 2]], axis=-1)
    rate, dt = 2.0 * np.log(2.0) / settings.release_s, dt_s[..., None]
    pull, decay = lock.offset_v + rate * lock.offset, np.exp(-rate * dt)
    offset = decay * (lock.offset + dt * pull)
    offset_v = decay * (lock.offset_v - dt * rate * pull)
    lock = replace(lock, offset=offset, offset_v=offset_v)
    return lock, np.where(lock.on[..., None], held, toe + offset)


def release(
    lock: ContactLock,
    target: Array,
    toe: Array,
    p_hip: Array,
    probability: Array,
    reach_m: Array,
    tracked: Bools,
    settings: LockSettings,
) -> Bools:
    """Which locks (n, 2) open at this tick.

    Args:
        lock: the state at the last tick.
        target: of :func:`toe_target` (n, 2, 3).
        toe: of :func:`smoothed` (n, 2, 3).
        p_hip: upper-leg joints (n, 2, 3).
        probability: of contact at the newest grid step (n, 2).
        reach_m: length of the stretched leg with its foot (n, 2).
        tracked: feet that have a valid tracker of their own (n, 2).
        settings: of the lock.
    """
    stretched = length(target - p_hip)[..., 0] > settings.reach * reach_m
    strayed = length(target - toe)[..., 0] > settings.distance_m
    lifted = probability < settings.off_probability
    return np.asarray(lock.on & (stretched | strayed | lifted | tracked))


def follow(
    lock: ContactLock,
    target: Array,
    toe: Array,
    opens: Bools,
    probability: Array,
    allowed: Bools,
    dt_s: Array,
    settings: LockSettings,
) -> ContactLock:
    """The state after this tick: open the locks told, close those that are due.

    A new lock holds the toe base as shown at this moment; one that opens leaves from there, at
    rest.

    Args:
        lock: of :func:`smoothed` and :func:`toe_target`.
        target: toe bases as shown at this tick (n, 2, 3).
        toe: of :func:`smoothed` (n, 2, 3).
        opens: of :func:`release`.
        probability: of contact at the newest grid step (n, 2).
        allowed: (n, 2) where a lock may close; elsewhere a tracker says where the foot is.
        dt_s: time since the last tick (n, 1).
        settings: of the lock.
    """
    off = target - toe
    at_home = length(off)[..., 0] < settings.close_within_m
    closes = ~lock.on & (probability > settings.on_probability) & allowed & at_home
    leaves = (opens | ~allowed)[..., None]
    toe_v = (toe - lock.toe) / np.maximum(dt_s, 1e-3)[..., None]
    return replace(
        lock,
        known=np.ones_like(lock.known),
        on=(lock.on & ~opens) | closes,
        p_lock=np.where((lock.on | closes)[..., None], target, lock.p_lock),
        toe=toe,
        offset=np.where(leaves, off, lock.offset),
        offset_v=np.where(leaves, np.where(allowed[..., None], -toe_v, 0.0), lock.offset_v),
    )
