"""Stillness, found in a stream of samples."""

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from lobstr_hw.rotations import Array, geodesic_angle, rotation_mean
from lobstr_hw.trackers import TrackerSample

__all__ = ["Rest", "Window"]

_GAP = 0.4  # the share of a window that may pass without sight: the pose before and after is one
_MINIMUM_SAMPLES = 8
_OUTLIERS = 0.9  # the share of the samples that must be still; jumps and glitches are not


@dataclass(frozen=True, slots=True, eq=False)
class Rest:
    """How one tracker stood during a window.

    Attributes:
        p: (3,) its median position.
        R: (3, 3) its mean rotation.
        spread_m, spread_rad: within which nine tenths of the samples are.
    """

    p: Array
    R: Array
    spread_m: float
    spread_rad: float


class Window:
    """The last seconds of each tracker."""

    def __init__(self, length_s: float) -> None:
        """Begin empty.

        Args:
            length_s: of the window.
        """
        self.length_s = length_s
        self.now_s = -np.inf
        self._samples: dict[str, deque[tuple[float, Array, Array]]] = {}
        self._first_s: dict[str, float] = {}

    @property
    def serials(self) -> list[str]:
        """Every tracker that ever had a pose."""
        return list(self._samples)

    def add(self, samples: Iterable[TrackerSample]) -> None:
        """Take in samples; those without sight, position or finite numbers tell nothing."""
        for sample in samples:
            pose = sample.T_world_tracker
            if not sample.tracked or pose.p is None:
                continue
            if not (np.isfinite(pose.p).all() and np.isfinite(pose.R).all()):
                continue
            kept = self._samples.setdefault(sample.serial, deque())
            self._first_s.setdefault(sample.serial, sample.time_s)
            kept.append((sample.time_s, pose.p, pose.R))
            self.now_s = max(self.now_s, sample.time_s)
            while kept[0][0] < self.now_s - self.length_s:
                kept.popleft()

    def rest(self, serial: str) -> Rest | None:
        """How a tracker stood; None while the window is not filled."""
        since = self.now_s - self.length_s
        kept = [item for item in self._samples[serial] if item[0] >= since]
        if len(kept) < _MINIMUM_SAMPLES or self._first_s[serial] > since:
            return None
        times, p, R = (np.array(part) for part in zip(*kept, strict=True))
        edges = np.concatenate([[since], times, [self.now_s]])
        if np.max(np.diff(edges)) > _GAP * self.length_s:
            return None
        return _rest(p, R)


def _rest(p: Array, R: Array) -> Rest:
    middle = np.median(p, axis=0)
    away = np.linalg.norm(p - middle, axis=-1)
    near = away <= np.quantile(away, _OUTLIERS)
    mean = rotation_mean(R[near])
    turned = np.quantile(geodesic_angle(R, mean), _OUTLIERS)
    return Rest(middle, mean, float(np.max(away[near])), float(turned))
