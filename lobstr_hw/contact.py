"""The contact lock: a foot that is on the floor stays where it is (Yang et al. 2021, 3.4.1).

What the paper leaves open (hysteresis, the floor, early release) is decided in design's "Contact
and floor". Lengths are metres on the standard skeleton, times are seconds: the lock behaves the
same at every rate of the loop.
"""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from lobstr_hw.ik.vectors import length
from lobstr_hw.predictors.predictor import Bools
from lobstr_hw.rotations import Array

__all__ = ["ContactLock", "LockSettings", "count_contact_steps", "follow", "release", "toe_target"]


@dataclass(frozen=True, slots=True)
class LockSettings:
    """When a foot is held and let go.

    Attributes:
        on_probability: at or under this a foot is not locked.
        on_steps: grid steps in a row above it before the lock closes.
        off_probability: under this the lock opens.
        reach: share of the stretched leg (hip to toe base) beyond which it opens.
        distance_m: from the network's toe beyond which it opens.
        close_within_m: from the network's toe within which it may close. Without it a foot let go
            early is locked again in mid-blend, still far off, and never comes home.
        floor_within_m: a toe locked nearer than this to its height on the floor is brought there.
        floor_s: how long that takes at most.
        release_s: of the blend back to the network's toe (the paper's ten frames at 45 Hz).
    """

    on_probability: float = 0.6
    on_steps: int = 2
    off_probability: float = 0.4
    reach: float = 0.99
    distance_m: float = 0.15
    close_within_m: float = 0.05
    floor_within_m: float = 0.03
    floor_s: float = 0.1
    release_s: float = 10.0 / 45.0


@dataclass(frozen=True, slots=True, eq=False)
class ContactLock:
    """State of the lock, both feet of n people.

    Attributes:
        on: (n, 2) held.
        steps: (n, 2) grid steps in a row with a contact above the threshold.
        p_lock: (n, 2, 3) where a locked toe base is held, or was when it was let go; world.
        goal_y: (n, 2) height to which a locked toe base is being brought.
        speed_y: (n, 2) how fast, metres per second.
        since_release_s: (n, 2) time since the lock opened; the blend is over after release_s.
    """

    on: Bools
    steps: npt.NDArray[np.int64]
    p_lock: Array
    goal_y: Array
    speed_y: Array
    since_release_s: Array

    @staticmethod
    def start(n: int) -> "ContactLock":
        """Nothing locked, nothing blending."""
        return ContactLock(
            on=np.zeros((n, 2), dtype=np.bool_),
            steps=np.zeros((n, 2), dtype=np.int64),
            p_lock=np.zeros((n, 2, 3)),
            goal_y=np.zeros((n, 2)),
            speed_y=np.zeros((n, 2)),
            since_release_s=np.full((n, 2), 1e6),
        )

    def shifted(self, T: Array) -> "ContactLock":
        """The same lock after the play space moved by T (n, 4, 4), a turn about Y and a shift."""
        p = (T[:, None, :3, :3] @ self.p_lock[..., None])[..., 0] + T[:, None, :3, 3]
        return replace(self, p_lock=p, goal_y=self.goal_y + T[:, None, 1, 3])


def count_contact_steps(
    lock: ContactLock, probability: Array, settings: LockSettings
) -> ContactLock:
    """After a grid step: how many in a row were a contact, from its probability (n, 2)."""
    steps = np.where(probability > settings.on_probability, lock.steps + 1, 0)
    return replace(lock, steps=steps)


def toe_target(lock: ContactLock, toe: Array, dt_s: Array, settings: LockSettings) -> Array:
    """Where the toe bases are to be shown at this tick (n, 2, 3), before new locks are told.

    Args:
        lock: the state at the last tick.
        toe: the network's toe bases at this tick (n, 2, 3).
        dt_s: time since the last tick (n, 1).
        settings: of the lock.
    """
    step = lock.speed_y * dt_s
    y = lock.p_lock[..., 1]
    y = y + np.clip(lock.goal_y - y, -step, step)
    held = np.stack([lock.p_lock[..., 0], y, lock.p_lock[..., 2]], axis=-1)
    # shifted sine: slow in, slow out
    done = np.minimum((lock.since_release_s + dt_s) / settings.release_s, 1.0)
    weight = (0.5 - 0.5 * np.cos(np.pi * done))[..., None]
    blended = lock.p_lock + weight * (toe - lock.p_lock)
    free = np.where(done[..., None] < 1.0, blended, toe)
    return np.where(lock.on[..., None], held, free)


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
        toe: the network's toe bases (n, 2, 3).
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
    allowed: Bools,
    dt_s: Array,
    floor_y: Array,
    settings: LockSettings,
) -> ContactLock:
    """The state after this tick: open the locks told, close those that are due.

    A new lock holds the toe base as shown at this moment.

    Args:
        lock: the state at the last tick.
        target: toe bases as shown at this tick (n, 2, 3).
        toe: the network's toe bases (n, 2, 3).
        opens: of :func:`release`.
        allowed: (n, 2) where a lock may close.
        dt_s: time since the last tick (n, 1).
        floor_y: height of a toe base that stands on the floor (n, 1).
        settings: of the lock.
    """
    stays = lock.on & ~opens
    at_home = length(target - toe)[..., 0] < settings.close_within_m
    closes = ~lock.on & (lock.steps >= settings.on_steps) & allowed & at_home
    gap = np.abs(floor_y - target[..., 1])
    near = gap < settings.floor_within_m
    return ContactLock(
        on=stays | closes,
        steps=np.where(opens, 0, lock.steps),
        p_lock=np.where((lock.on | closes)[..., None], target, lock.p_lock),
        goal_y=np.where(closes, np.where(near, floor_y, target[..., 1]), lock.goal_y),
        speed_y=np.where(closes, np.where(near, gap / settings.floor_s, 0.0), lock.speed_y),
        since_release_s=np.where(opens, 0.0, lock.since_release_s + dt_s),
    )
