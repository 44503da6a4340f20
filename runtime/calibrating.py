"""Waiting for a T-pose in the running stream."""

from collections.abc import Sequence

from lobstr_hw.calibration import Calibration, TPoseDetector, calibrate_t_pose
from lobstr_hw.errors import CalibrationError
from lobstr_hw.runtime.roles import RoleTable
from lobstr_hw.trackers import TrackerSample

__all__ = ["TPoseWatcher"]


class TPoseWatcher:
    """Shown the samples of every tick; returns a calibration once someone stands in a T-pose."""

    def __init__(self, table: RoleTable, floor_m: float = 0.0) -> None:
        """Begin with nothing seen.

        Args:
            table: what is known of roles; trackers without one are told apart by where they are.
            floor_m: height of the floor in the tracking space.
        """
        self._table = table
        self._floor_m = floor_m
        self._detector = TPoseDetector(floor_m=floor_m)

    def __call__(self, samples: Sequence[TrackerSample]) -> Calibration | None:
        """Look at new samples, oldest first."""
        for sample in samples:
            if sample.serial not in self._detector.hints:
                role = self._table.of(sample.serial)
                if role is not None:
                    self._detector.hints[sample.serial] = role
        pose = self._detector.add(samples)
        return None if pose is None else calibrate_t_pose(pose, floor_m=self._floor_m)

    def failure(self) -> CalibrationError:
        """Why there is no calibration at the end of a log, and what to do."""
        error = self._detector.failure()
        return type(error)(
            f"the log ended without a calibration: {error} Or give the profile of this person and "
            "these trackers: --profile FILE"
        )
