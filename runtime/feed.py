"""What the trackers say, sorted: serial -> role, believed or not, the last 0.3 s of each role."""

import math
from collections.abc import Iterable, Sequence

from lobstr_hw.poses import Pose
from lobstr_hw.rotations import Array
from lobstr_hw.runtime.gate import Gate
from lobstr_hw.runtime.resampling import VALID_S, History, Resampled
from lobstr_hw.runtime.roles import RoleTable
from lobstr_hw.skeleton_pose import RoleReport
from lobstr_hw.trackers import TrackerRole, TrackerSample

__all__ = ["Feed"]


class Feed:
    """Takes samples as the drivers give them, and gives poses by role at any recent time."""

    def __init__(self, roles: Sequence[TrackerRole], table: RoleTable) -> None:
        """Begin with nothing heard.

        Args:
            roles: to listen to, in the order of all arrays.
            table: serial -> role.
        """
        self.roles = tuple(roles)
        self.table = table
        self.gate = Gate()
        self._history = History(len(self.roles))
        self._heard_s = dict.fromkeys(self.roles, -math.inf)

    def add(self, samples: Iterable[TrackerSample]) -> None:
        """Take in samples, oldest first."""
        for sample in samples:
            role = self.table.of(sample.serial)
            if role is not None and role in self._heard_s:
                self._take(role, sample)

    def _take(self, role: TrackerRole, sample: TrackerSample) -> None:
        self._heard_s[role] = max(self._heard_s[role], sample.time_s)
        if self.gate.judge(role, sample).believed:
            pose = sample.T_world_tracker
            self._history.add(self.roles.index(role), sample.time_s, pose.p, pose.R)

    def shift(self, T_new_old: Pose, before_s: float) -> None:
        """The space was set up anew: what came before a time is taken along into it."""
        self.gate.shift(T_new_old, before_s)
        self._history.shift(T_new_old, before_s)

    def at(self, times_s: Sequence[float]) -> Resampled:
        """Tracker poses of all roles; where one was never heard, the pelvis' pose, not valid."""
        out = self._history.at(times_s)
        unseen = [i for i in range(len(self.roles)) if not self._history.seen(i)]
        if unseen and TrackerRole.PELVIS in self.roles:
            pelvis = self.roles.index(TrackerRole.PELVIS)
            out.p[:, unseen], out.R[:, unseen] = out.p[:, [pelvis]], out.R[:, [pelvis]]
        return out

    def seen(self, roles: Iterable[TrackerRole]) -> bool:
        """Whether each of these roles had a believable pose at some time."""
        return all(self._history.seen(self.roles.index(role)) for role in roles)

    def head(self, time_s: float) -> Array | None:
        """Position (3,) of the headset in the world; None before it was seen."""
        if TrackerRole.HEAD not in self.roles or not self.seen((TrackerRole.HEAD,)):
            return None
        p: Array = self._history.at((time_s,)).p[0, self.roles.index(TrackerRole.HEAD)]
        return p

    def report(self, time_s: float) -> dict[TrackerRole, RoleReport]:
        """How each role fares: ok, guessed (heard, not believed) or missing."""
        return {role: self._report(i, role, time_s) for i, role in enumerate(self.roles)}

    def _report(self, index: int, role: TrackerRole, time_s: float) -> RoleReport:
        age_s = time_s - self._history.newest_s(index)
        if age_s <= VALID_S:
            return RoleReport("ok", age_s)
        return RoleReport(
            "guessed" if time_s - self._heard_s[role] <= VALID_S else "missing", age_s
        )
