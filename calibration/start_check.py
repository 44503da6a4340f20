"""One second at every start: is it the same person, and do the trackers sit where they did?"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from lobstr_hw.calibration.calibration import Calibration
from lobstr_hw.calibration.recording import RATE_HZ, Movement
from lobstr_hw.calibration.t_pose import Check
from lobstr_hw.errors import ProfileError
from lobstr_hw.predictors.predictor import Bools
from lobstr_hw.rotations import Array, heading_angle, rotation_mean
from lobstr_hw.skeleton import Joint
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole

__all__ = ["StartCheck", "check_devices", "check_start", "needed_serials"]

_LEAST_S = 0.8
_TRUNK = (Joint.SPINE, Joint.CHEST, Joint.UPPER_CHEST, Joint.NECK, Joint.HEAD)
_ARM_ROOT = (Joint.SPINE, Joint.CHEST, Joint.UPPER_CHEST, Joint.LEFT_SHOULDER)
HEAD, LEFT, RIGHT, PELVIS = range(4)


@dataclass(frozen=True, slots=True)
class StartCheck:
    """What one second of standing says about a profile.

    Attributes:
        checks: of stance and sizes.
        standing: the person stood upright and still, so that they mean something.
    """

    checks: tuple[Check, ...]
    standing: bool

    @property
    def ok(self) -> bool:
        """Nothing points to a tracker that has slipped."""
        return not self.failed

    @property
    def failed(self) -> tuple[Check, ...]:
        """What does, the worst first; nothing while the person does not stand still."""
        failed = [check for check in self.checks if self.standing and not check.ok]
        return tuple(sorted(failed, key=lambda check: -check.excess))

    @property
    def warnings(self) -> tuple[str, ...]:
        """In words."""
        return tuple(str(check) for check in self.failed)


def needed_serials(calibration: Calibration) -> tuple[str, ...]:
    """The profile's trackers in the order of FOUR_POINTS.

    Raises:
        ProfileError: it lacks one of these roles.
    """
    serials = {role: calibration.serial_of(role) for role in FOUR_POINTS}
    lacking = [role for role, serial in serials.items() if serial is None]
    if lacking:
        raise ProfileError(
            f"the profile has no tracker for {' and '.join(lacking)}. Run lobstr-calibrate."
        )
    return tuple(serial for serial in serials.values() if serial is not None)


def check_devices(calibration: Calibration, seen: Mapping[str, TrackerRole | None]) -> None:
    """Refuse a profile that was made with other devices, or with these in other places.

    Args:
        calibration: the profile.
        seen: role that each connected device claims, None where it claims none.

    Raises:
        ProfileError: says which device and role, and the way out.
    """
    here = ", ".join(f"{serial} ({role or 'no role'})" for serial, role in seen.items()) or "none"
    for serial, role in calibration.roles.items():
        if serial not in seen:
            raise ProfileError(
                f"the profile's {role} is {serial}, which is not here; seen: {here}. Switch it on, "
                "or, if another device has taken its place, run lobstr-calibrate."
            )
        claimed = seen[serial]
        if claimed is not None and claimed is not role:
            raise ProfileError(
                f"{serial} was the {role} when the profile was made and says now that it is the "
                f"{claimed}. Set its role back (its own setting, or role= of --driver), or run "
                "lobstr-calibrate."
            )


def check_start(calibration: Calibration, second: Movement) -> StartCheck:
    """Compare stance and height with the profile.

    Trunk and arms have lengths that no posture changes, so a tracker that has slipped shows in
    them, in the height of a standing person, and in how upright head and hips are. The limits
    leave room for other shoes and a slouch.

    Args:
        calibration: the profile.
        second: of its trackers, in the order of FOUR_POINTS; a second or more.
    """
    if len(second) < _LEAST_S * RATE_HZ or np.min(np.mean(second.tracked, axis=0)) < 0.5:
        return StartCheck((), standing=False)
    p, R, still = _joints(calibration, second)
    body = calibration.body.offsets[0]
    trunk_m = float(np.sum(body[list(_TRUNK), 1]))
    height_m = 1.0 / calibration.scale
    line = p[HEAD] - p[PELVIS]
    tilts = [float(np.rad2deg(np.arccos(np.clip(R[i, 1, 1], -1.0, 1.0)))) for i in (HEAD, PELVIS)]
    facing = heading_angle(R[HEAD])[0] - heading_angle(R[PELVIS])[0]
    turned = float(np.rad2deg(np.abs(np.angle(np.exp(1j * facing)))))
    slipped = "tracker may have slipped: put it back, or run lobstr-calibrate"
    trunk = float(np.linalg.norm(line))
    checks = (
        Check("height", 100 * float(p[HEAD, 1] - trunk_m - height_m), -6.0, 4.0, "cm",
              "is this the same person, standing up, and the floor where it was? Else run "
              "lobstr-calibrate"),
        Check("hips height", 100 * float(p[PELVIS, 1] - height_m), -4.5, 4.5, "cm",
              f"the pelvis {slipped}"),
        Check("trunk", 100 * (trunk - trunk_m), -4.0, 3.0, "cm", f"the pelvis {slipped}"),
        Check("pelvis tilt", tilts[1], 0.0, 12.0, "degrees", f"the pelvis {slipped}"),
        Check("head tilt", tilts[0], 0.0, 20.0, "degrees", "look straight ahead; the headset may "
              "sit otherwise than it did"),
        Check("facing", turned, 0.0, 25.0, "degrees", f"look straight ahead; the pelvis {slipped}"),
        *(_arm(calibration, p, R, i) for i in (LEFT, RIGHT)),
    )  # fmt: skip
    upright = p[HEAD, 1] > 0.9 * (height_m + trunk_m)
    return StartCheck(checks, standing=bool(still and upright))


def _joints(calibration: Calibration, second: Movement) -> tuple[Array, Array, bool]:
    """Median joint poses (4, 3) and (4, 3, 3) above the floor, and whether they were still."""
    seen: Bools = second.tracked
    frame = calibration.frame(0.0, FOUR_POINTS, np.array(second.p), second.R, seen, seen)
    p = frame.p / calibration.scale
    spread = np.percentile(np.linalg.norm(p - np.median(p, axis=0), axis=-1), 90.0, axis=0)
    still = spread[HEAD] < 0.04 and spread[PELVIS] < 0.04
    return np.median(p, axis=0), rotation_mean(frame.R), bool(still)


def _arm(calibration: Calibration, p: Array, R: Array, i: int) -> Check:
    """A wrist is never farther from its shoulder than the arm is long."""
    body = calibration.body.offsets[0]
    side = 1.0 if i == LEFT else -1.0
    up = float(np.sum(body[list(_ARM_ROOT), 1])) + float(body[Joint.LEFT_UPPER_ARM, 1])
    out = float(body[Joint.LEFT_SHOULDER, 0] + body[Joint.LEFT_UPPER_ARM, 0])
    shoulder = p[PELVIS] + R[PELVIS] @ np.array([side * out, up, 0.0])
    over = float(np.linalg.norm(p[i] - shoulder)) - calibration.arm_m
    role = FOUR_POINTS[i]
    return Check(
        f"{role} reach",
        100.0 * over,
        -100.0,
        9.0,
        "cm",
        f"the {role} is farther away than the arm is long: is it held as it was? Else run "
        "lobstr-calibrate",
    )
