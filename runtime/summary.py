"""``--summary``: what a session was like, as one JSON document."""

import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from lobstr_hw.errors import OutputError
from lobstr_hw.rotations import Array
from lobstr_hw.runtime.ticks import Ticks
from lobstr_hw.skeleton import PARENTS, Body, Joint
from lobstr_hw.skeleton_pose import SkeletonPose
from lobstr_hw.trackers import TrackerRole

__all__ = ["Summary", "Tally", "check_summary_path", "write_summary"]

TOES = [Joint.LEFT_TOES, Joint.RIGHT_TOES]


@dataclass(frozen=True, slots=True)
class Summary:
    """One session; the field names are the JSON keys.

    Attributes:
        frames: poses sent.
        rate_hz: of the loop.
        duration_s: from the first tick to the last.
        overruns: ticks whose work was not done by the next one's deadline.
        tick_ms: p50, p99 and max of a tick's work; the only numbers that differ between runs of
            ``--sim --fast``.
        leg_delay_ms: how far the legs lie behind the trackers.
        predictor: its name.
        nonfinite_frames: poses that were not finite, each replaced by the last good one.
        gate_events: how often the gate refused a tracker, by reason.
        tracker_loss: seconds without a believable pose, by role.
        foot_skate_cm_s: mean horizontal speed of each toe base while in contact; None without one.
        calibrated_at_s: time of the calibration after the first tick; None without one.
        bone_length_error_m: the largest difference of a bone from its length after calibration.
    """

    frames: int
    rate_hz: float
    duration_s: float
    overruns: int
    tick_ms: dict[str, float | None]
    leg_delay_ms: float
    predictor: str
    nonfinite_frames: int
    gate_events: dict[str, int]
    tracker_loss: dict[str, float]
    foot_skate_cm_s: dict[str, float | None]
    calibrated_at_s: float | None
    bone_length_error_m: float


class Tally:
    """Adds up what the summary tells, a few microseconds a tick."""

    def __init__(self, rate_hz: float) -> None:
        """Nothing yet."""
        self.frames = 0
        self.first_s = 0.0
        self.last_s = 0.0
        self.calibrated_at_s: float | None = None
        self.bone_length_error_m = 0.0
        self.loss_s: dict[TrackerRole, float] = {}
        self._period_s = 1.0 / rate_hz
        self._skate_m, self._contact_s = np.zeros(2), np.zeros(2)
        self._before: SkeletonPose | None = None

    def add(self, pose: SkeletonPose, body: Body | None) -> None:
        """One tick.

        Args:
            pose: as sent.
            body: the user's, once calibrated.
        """
        if not self.frames:
            self.first_s = pose.time_s
            self.loss_s = dict.fromkeys(pose.roles, 0.0)
        self.frames += 1
        self.last_s = pose.time_s
        for role, report in pose.roles.items():
            if report.state != "ok":
                self.loss_s[role] += self._period_s
        if body is not None:
            if self.calibrated_at_s is None:
                self.calibrated_at_s = pose.time_s - self.first_s
            self._measure(pose, body)

    def _measure(self, pose: SkeletonPose, body: Body) -> None:
        bones = pose.p_world[:, 1:] - pose.p_world[:, PARENTS[1:]]
        error = np.abs(_norm(bones) - _norm(body.offsets[:, 1:]))
        self.bone_length_error_m = max(self.bone_length_error_m, float(error.max()))
        if self._before is not None:
            self._add_skate(self._before, pose)
        self._before = pose

    def _add_skate(self, a: SkeletonPose, b: SkeletonPose) -> None:
        moved = (b.p_world[0, TOES] - a.p_world[0, TOES])[:, ::2]
        both = a.contact[0] & b.contact[0]
        self._skate_m += _norm(moved) * both
        self._contact_s += (b.time_s - a.time_s) * both

    def foot_skate_cm_s(self) -> dict[str, float | None]:
        """Mean speed of each toe base while in contact."""
        return {
            side: round(100.0 * float(m / s), 6) if s else None
            for side, m, s in zip(("left", "right"), self._skate_m, self._contact_s, strict=True)
        }

    def summary(
        self,
        ticks: Ticks,
        predictor: str,
        leg_delay_ms: float,
        nonfinite_frames: int,
        gate_events: dict[str, int],
    ) -> Summary:
        """All of it."""
        return Summary(
            frames=self.frames,
            rate_hz=ticks.rate_hz,
            duration_s=round(self.last_s - self.first_s, 6),
            overruns=ticks.overruns,
            tick_ms=ticks.work.summary_ms(),
            leg_delay_ms=leg_delay_ms,
            predictor=predictor,
            nonfinite_frames=nonfinite_frames,
            gate_events=dict(sorted(gate_events.items())),
            tracker_loss={role.value: round(s, 6) for role, s in self.loss_s.items()},
            foot_skate_cm_s=self.foot_skate_cm_s(),
            calibrated_at_s=_rounded(self.calibrated_at_s),
            bone_length_error_m=self.bone_length_error_m,
        )


def _norm(v: Array) -> Array:
    return np.asarray(np.sqrt(np.einsum("...i,...i", v, v)))


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 6)


def check_summary_path(path: Path) -> None:
    """See that a summary could be written there, before an hour's session ends without one.

    Raises:
        OutputError: the folder is missing, or the path is one.
    """
    if path.is_dir() or not path.parent.is_dir():
        what = "is a folder" if path.is_dir() else f"needs the folder {path.parent}; make it first"
        raise OutputError(f"cannot write the summary: {path} {what}.")


def write_summary(path: Path, summary: Summary) -> None:
    """Write the JSON; the file appears whole or not at all.

    Raises:
        OutputError: it cannot be written.
    """
    part = path.with_name(path.name + ".part")
    try:
        with open(part, "w", encoding="utf-8", newline="\n") as file:
            json.dump(asdict(summary), file, indent=2)
            file.write("\n")
        os.replace(part, path)
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror or error}.") from error
