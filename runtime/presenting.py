"""What is shown instead of what the trackers say: a frozen body, or one that sits."""

from dataclasses import replace

import numpy as np

from lobstr_hw.blend import blend
from lobstr_hw.ik.vectors import smoothstep
from lobstr_hw.poses import Pose
from lobstr_hw.seated import Seat, sit
from lobstr_hw.skeleton import Body
from lobstr_hw.skeleton_pose import SkeletonPose, Source

__all__ = ["Presentation", "in_new_world"]

BLEND_S = 0.5
"""Into a seat, out of it, and out of a frozen pose."""


class Presentation:
    """Poses go in as computed and come out as shown.

    Attributes:
        frozen: the body stands still whatever the person does.
        seated: the legs sit.
    """

    def __init__(self) -> None:
        """Nothing out of the ordinary."""
        self.frozen = False
        self.seated = False
        self._seat: Seat | None = None
        self._shown: SkeletonPose | None = None
        self._from: SkeletonPose | None = None
        self._since_s = 0.0

    def freeze(self) -> bool:
        """Stand still, or go on; True when frozen now."""
        self.frozen = not self.frozen
        if not self.frozen:
            self._leave()
        return self.frozen

    def sit(self) -> bool:
        """Sit, or stand up; True when seated now."""
        self.seated = not self.seated
        self._seat = None
        self._leave()
        return self.seated

    def shift_world(self, T_new_old: Pose) -> None:
        """The play space was set up anew: what is shown stays where it is in the room.

        Args:
            T_new_old: of the user's world, heights over the floor left alone.
        """
        if self._seat is not None:
            ankle, R_foot = T_new_old.apply(self._seat.ankle), T_new_old.R @ self._seat.R_foot
            self._seat = replace(self._seat, ankle=ankle, R_foot=R_foot)
        self._shown = None if self._shown is None else in_new_world(self._shown, T_new_old)
        self._from = None if self._from is None else in_new_world(self._from, T_new_old)

    def _leave(self) -> None:
        """From the pose shown last into whatever comes."""
        self._from = self._shown
        self._since_s = 0.0 if self._shown is None else self._shown.time_s

    def show(self, pose: SkeletonPose, body: Body) -> SkeletonPose:
        """The pose to be sent."""
        if self.frozen and self._shown is not None:
            held = np.full_like(pose.source, Source.HELD)
            self._shown = replace(self._shown, time_s=pose.time_s, source=held, roles=pose.roles)
            return self._shown
        if self.seated:
            dt_s = 0.0 if self._shown is None else pose.time_s - self._shown.time_s
            self._seat, pose = sit(pose, body, self._seat, dt_s)
        if self._from is not None:
            share = float(smoothstep(np.array(pose.time_s - self._since_s), 0.0, BLEND_S))
            pose = blend(self._from, pose, share, body)
            self._from = None if share >= 1.0 else self._from
        self._shown = pose
        return pose


def in_new_world(pose: SkeletonPose, T_new_old: Pose) -> SkeletonPose:
    """A body at the same place in the room, told in a world that lies elsewhere."""
    R_local = pose.R_local.copy()
    R_local[:, 0] = T_new_old.R @ R_local[:, 0]
    return replace(pose, p_world=T_new_old.apply(pose.p_world), R_local=R_local)
