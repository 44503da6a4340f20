"""What a calibration is: who is who, how each tracker sits, how big the person is."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from lobstr_hw.poses import Pose, frozen
from lobstr_hw.predictors.predictor import Bools, Frame
from lobstr_hw.rotations import Array
from lobstr_hw.skeleton import Body, Joint
from lobstr_hw.trackers import TrackerRole

__all__ = ["Calibration", "Residuals", "TrackingSpace"]


@dataclass(frozen=True, slots=True)
class Residuals:
    """How well the T-pose fits what is known about people and devices.

    Attributes:
        spread_m, spread_rad: how far the stillest window wandered.
        heading_disagreement_rad: of the headset against the line between the hands.
        misfit: of the measures, in deviations; the self-check refuses more than 1.8.
        hips_height_deviation_m, arm_deviation_m: how far off these may be.
    """

    spread_m: float = 0.0
    spread_rad: float = 0.0
    heading_disagreement_rad: float = 0.0
    misfit: float = 0.0
    hips_height_deviation_m: float = 0.0
    arm_deviation_m: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class TrackingSpace:
    """Where one driver's tracking space lies in the world, and how its clock does.

    Attributes:
        T_world_space: from that space to the world.
        delay_s: by how much later than the world's this driver stamps the same moment.
        residual_m, residual_rad: of the fit.
    """

    T_world_space: Pose = field(default_factory=Pose.identity)
    delay_s: float = 0.0
    residual_m: float = 0.0
    residual_rad: float = 0.0

    @property
    def is_world(self) -> bool:
        """Nothing is to be moved."""
        T = self.T_world_space
        same = np.array_equal(T.R, np.eye(3)) and not T.p.any()
        return bool(same and self.delay_s == 0.0)


def _no_spaces() -> Mapping[str, TrackingSpace]:
    return MappingProxyType({})


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """From tracker poses to joint poses of one person.

    Attributes:
        roles: serial -> role, in the order of the offsets.
        R_tracker_joint: (k, 3, 3) per tracker.
        p_tracker_joint: (k, 3) per tracker, the user's metres.
        body: the user's sizes, n = 1.
        stature_m: of the user.
        floor_m: height of the floor in the tracking space.
        heading_rad: where the user faced in the T-pose.
        residuals: how well it all fits.
        tracking_spaces: by driver, for parts of the body tracked by different systems.
        created: when it was made, in the caller's words.
    """

    roles: Mapping[str, TrackerRole]
    R_tracker_joint: Array
    p_tracker_joint: Array
    body: Body
    stature_m: float
    floor_m: float = 0.0
    heading_rad: float = 0.0
    residuals: Residuals = Residuals()
    tracking_spaces: Mapping[str, TrackingSpace] = field(default_factory=_no_spaces)
    created: str = ""

    def __post_init__(self) -> None:
        """Check the shapes once."""
        object.__setattr__(self, "roles", MappingProxyType(dict(self.roles)))
        object.__setattr__(self, "R_tracker_joint", frozen(self.R_tracker_joint, (3, 3)))
        object.__setattr__(self, "p_tracker_joint", frozen(self.p_tracker_joint, (3,)))
        if not len(self.roles) == len(self.R_tracker_joint) == len(self.p_tracker_joint):
            raise ValueError(f"{len(self.roles)} roles, {len(self.R_tracker_joint)} offsets")

    @property
    def scale(self) -> float:
        """S = 1.0 / the user's hips height."""
        return float(self.body.scale[0])

    @property
    def arm_m(self) -> float:
        """From shoulder joint to wrist."""
        bones = self.body.offsets[0, [Joint.LEFT_LOWER_ARM, Joint.LEFT_HAND]]
        return float(np.sum(np.linalg.norm(bones, axis=-1)))

    def serial_of(self, role: TrackerRole) -> str | None:
        """The tracker that stands for a role."""
        return next((serial for serial, its in self.roles.items() if its == role), None)

    def T_tracker_joint(self, serial: str) -> Pose:
        """The joint in the frame of its tracker."""
        i = list(self.roles).index(serial)
        return Pose(self.R_tracker_joint[i], self.p_tracker_joint[i])

    def frame(
        self,
        time_s: float,
        roles: tuple[TrackerRole, ...],
        p_trackers: Array,
        R_trackers: Array,
        valid_p: Bools,
        valid_R: Bools,
    ) -> Frame:
        """Tracker poses -> joint poses above the floor, scaled to the standard skeleton.

        Args:
            time_s: of the frame.
            roles: of the arrays' second axis; a role that was not calibrated is not valid.
            p_trackers: (n, roles, 3) in the tracking space, metres.
            R_trackers: (n, roles, 3, 3).
            valid_p: (n, roles) which positions were measured.
            valid_R: (n, roles) which rotations were measured.
        """
        R_offset, p_offset, known = self._offsets(roles)
        p = p_trackers + (R_trackers @ p_offset[..., None])[..., 0]
        p[..., 1] -= self.floor_m
        return Frame(
            time_s, roles, p * self.scale, R_trackers @ R_offset, valid_p & known, valid_R & known
        )

    def _offsets(self, roles: tuple[TrackerRole, ...]) -> tuple[Array, Array, Bools]:
        """Rotations (roles, 3, 3) and positions (roles, 3) in the order asked for."""
        own = tuple(self.roles.values())
        if roles == own:  # the usual case, at every tick
            return self.R_tracker_joint, self.p_tracker_joint, np.ones(len(own), dtype=bool)
        at = [own.index(role) if role in own else -1 for role in roles]
        known = np.array(at) >= 0
        R = np.where(known[:, None, None], self.R_tracker_joint[at], np.eye(3))
        return R, np.where(known[:, None], self.p_tracker_joint[at], 0.0), known
