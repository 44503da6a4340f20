"""Is it a T-pose? What a wizard can show, and a detector that finds one in a stream."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from lobstr_hw.calibration.heading import hands_heading, headset_heading, turn_between
from lobstr_hw.calibration.roles import assign_roles, missing_role
from lobstr_hw.calibration.stillness import Rest, Window
from lobstr_hw.errors import CalibrationError, MissingRole, TPoseNotFound
from lobstr_hw.poses import frozen
from lobstr_hw.rotations import Array
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole, TrackerSample

__all__ = ["Check", "TPose", "TPoseDetector", "TPoseQuality", "quality_of"]


@dataclass(frozen=True, slots=True)
class Check:
    """One thing a T-pose must have.

    Attributes:
        name: of it, one word.
        value: as measured.
        low, high: between which it must be.
        unit: of all three.
        advice: what to do when it is not.
    """

    name: str
    value: float
    low: float
    high: float
    unit: str
    advice: str

    @property
    def ok(self) -> bool:
        """Within the limits."""
        return self.low <= self.value <= self.high

    @property
    def excess(self) -> float:
        """How far out of the limits, over their width; 0 inside."""
        out = max(self.low - self.value, self.value - self.high, 0.0)
        return out / (self.high - self.low)

    def __str__(self) -> str:
        """Value and limits in words."""
        limits = f"{self.low:.2f} to {self.high:.2f} {self.unit}".rstrip()
        return f"{self.name} {self.value:.2f} (wanted {limits}): {self.advice}"


@dataclass(frozen=True, slots=True)
class TPoseQuality:
    """All checks of one moment."""

    checks: tuple[Check, ...]

    @property
    def ok(self) -> bool:
        """It is a still T-pose."""
        return all(check.ok for check in self.checks)

    @property
    def failed(self) -> tuple[Check, ...]:
        """What is missing."""
        return tuple(check for check in self.checks if not check.ok)

    @property
    def shortfall(self) -> tuple[int, float]:
        """For choosing the best of many: failed checks, then by how much."""
        return len(self.failed), sum(check.excess for check in self.checks)


@dataclass(frozen=True, slots=True, eq=False)
class TPose:
    """Four trackers in a still T-pose.

    Attributes:
        serials: in the order of FOUR_POINTS, as p and R.
        p: (4, 3) in the tracking space, metres.
        R: (4, 3, 3).
        start_s, end_s: of the window it was taken from.
        spread_m, spread_rad: within which the trackers wandered meanwhile.
        quality: every check.
    """

    serials: tuple[str, ...]
    p: Array
    R: Array
    start_s: float
    end_s: float
    spread_m: float
    spread_rad: float
    quality: TPoseQuality

    def __post_init__(self) -> None:
        """Check the shapes once."""
        object.__setattr__(self, "p", frozen(self.p, (4, 3)))
        object.__setattr__(self, "R", frozen(self.R, (4, 3, 3)))


class TPoseDetector:
    """Finds a still T-pose in a stream of samples.

    Attributes:
        best: quality of the moment that came closest; None while trackers are missing.
        latest: quality at the last look; None while trackers are missing.
    """

    def __init__(
        self,
        hints: Mapping[str, TrackerRole] | None = None,
        *,
        hold_s: float = 1.5,
        every_s: float = 0.1,
        floor_m: float = 0.0,
    ) -> None:
        """Begin with nothing seen.

        Args:
            hints: roles that devices claim, by serial; may be filled later. Devices without one
                are told apart by where they are.
            hold_s: how long the pose must be held; sway averages out over it.
            every_s: how often the stream is looked at.
            floor_m: height of the floor in the tracking space.
        """
        self.hints: dict[str, TrackerRole] = dict(hints or {})
        self.best: TPoseQuality | None = None
        self.latest: TPoseQuality | None = None
        self._window = Window(hold_s)
        self._every_s = every_s
        self._floor_m = floor_m
        self._next_s = -np.inf

    def add(self, samples: Iterable[TrackerSample]) -> TPose | None:
        """Take in samples, oldest first; the T-pose at the moment at which it is complete."""
        for sample in samples:
            self._window.add((sample,))
            if sample.time_s >= self._next_s:
                self._next_s = sample.time_s + self._every_s
                found = self._look()
                if found is not None:
                    return found
        return None

    def failure(self) -> CalibrationError:
        """Why none was found: MissingRole, or TPoseNotFound with how close it came."""
        seen = {serial: self.hints.get(serial) for serial in self._window.serials}
        unclaimed = [role for role in FOUR_POINTS if role not in seen.values()]
        if len(unclaimed) > list(seen.values()).count(None):
            return missing_role(seen)
        wanted = f"Stand in a T-pose for {self._window.length_s + 0.5:.0f} seconds and try again."
        if self.best is None:
            return TPoseNotFound(
                "no T-pose found: the four trackers were never all in sight for "
                f"{self._window.length_s:g} s. {wanted}"
            )
        failed = "; ".join(str(check) for check in self.best.failed)
        return TPoseNotFound(f"no T-pose found; the closest missed {failed}. {wanted}")

    def _look(self) -> TPose | None:
        rests = {serial: self._window.rest(serial) for serial in self._window.serials}
        seen = {serial: rest for serial, rest in rests.items() if rest is not None}
        try:
            chosen = assign_roles(
                list(seen),
                np.array([rest.p for rest in seen.values()]).reshape(-1, 3),
                np.array([rest.R for rest in seen.values()]).reshape(-1, 3, 3),
                self.hints,
            )
        except MissingRole:
            self.latest = None
            return None
        order = [list(seen)[chosen[role]] for role in FOUR_POINTS]
        return self._judge(order, [seen[serial] for serial in order])

    def _judge(self, serials: list[str], rests: list[Rest]) -> TPose | None:
        p = np.array([rest.p for rest in rests]) - [0.0, self._floor_m, 0.0]
        R = np.array([rest.R for rest in rests])
        spread_m = max(rest.spread_m for rest in rests)
        spread_rad = max(rest.spread_rad for rest in rests)
        quality = self.latest = quality_of(p, R, spread_m, spread_rad)
        if self.best is None or quality.shortfall < self.best.shortfall:
            self.best = quality
        if not quality.ok:
            return None
        end_s = self._window.now_s
        p = np.array([rest.p for rest in rests])
        start_s = end_s - self._window.length_s
        return TPose(tuple(serials), p, R, start_s, end_s, spread_m, spread_rad, quality)


def quality_of(p: Array, R: Array, spread_m: float, spread_rad: float) -> TPoseQuality:
    """How good a T-pose four trackers show.

    Args:
        p: (4, 3) above the floor, in the order of FOUR_POINTS.
        R: (4, 3, 3).
        spread_m: within which they wandered.
        spread_rad: within which they turned.
    """
    return TPoseQuality(_checks(p, R, spread_m, spread_rad))


def _checks(p: Array, R: Array, spread_m: float, spread_rad: float) -> tuple[Check, ...]:
    """All checks for trackers (4, 3) above the floor; lengths as shares of the headset's height.

    The limits leave room for every segment 10 degrees off, wands held anyhow and arms 9 % longer
    or shorter than the mean; standing with hanging arms, walking and sitting stay far outside.
    """
    head, left, right, pelvis = p
    tall = max(float(head[1]), 0.3)
    span = (left - right)[[0, 2]] / tall
    width = float(np.linalg.norm(span))
    across = span / max(width, 1e-6)
    middle = (left + right)[[0, 2]] / 2.0
    beside = (head[[0, 2]] - middle) / tall
    facing = hands_heading(left, right)
    turned = np.rad2deg(turn_between(headset_heading(R[0]), facing))
    heights = np.array([left[1], right[1]]) / tall
    lowest, highest = float(heights.min()), float(heights.max())
    under = float(np.linalg.norm((head - pelvis)[[0, 2]])) / tall
    arms = "stretch both arms out to the sides"
    shoulders = "bring both hands to the height of your shoulders"
    upright = "stand upright, the pelvis tracker on your belt"
    return (
        Check("still", 100.0 * spread_m, 0.0, 4.0, "cm", "stand still"),
        Check(
            "steady", float(np.rad2deg(spread_rad)), 0.0, 6.0, "degrees", "hold your hands still"
        ),
        Check("standing", float(head[1]), 1.15, 2.2, "m", "stand up; is the floor at height 0?"),
        Check("wide", width, 0.72, 1.25, "", arms),
        Check("raised", lowest, 0.70, 1.04, "", shoulders),
        Check("lowered", highest, 0.70, 1.04, "", shoulders),
        Check("level", highest - lowest, 0.0, 0.20, "", "hold both hands equally high"),
        Check("centred", abs(float(beside @ across)), 0.0, 0.10, "", arms),
        Check(
            "in line",
            abs(float(beside @ [-across[1], across[0]])),
            0.0,
            0.22,
            "",
            "hold your arms neither forward nor back",
        ),
        Check("hips below", under, 0.0, 0.25, "", upright),
        Check("hips height", float(pelvis[1]) / tall, 0.50, 0.76, "", upright),
        Check(
            "facing",
            abs(float(turned)),
            0.0,
            32.0,
            "degrees",
            "look straight ahead; beyond 90 degrees left and right are exchanged",
        ),
    )
