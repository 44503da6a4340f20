"""What is shown instead of what the trackers say: a frozen body, or one that sits."""

from dataclasses import replace

import numpy as np

from lobstr_hw.blend import blend
from lobstr_hw.ik.vectors import smoothstep
from lobstr_hw.seated import Seat, sit
from lobstr_hw.skeleton import Body
from lobstr_hw.skeleton_pose import SkeletonPose, Source

__all__ = ["Presentation"]

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

    def forget_places(self) -> None:
        """The world moved: feet on the floor and poses on the way are not where they were."""
        self._seat = self._from = None

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
