"""Joining two tracking spaces: two trackers, one of each, are held together and moved about."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from lobstr_hw.calibration.alike import common_s, turning_likeness
from lobstr_hw.calibration.calibration import TrackingSpace
from lobstr_hw.calibration.hand_eye import fit_positions, fit_rotations, wobble
from lobstr_hw.calibration.track import Track
from lobstr_hw.calibration.verdict import Grade
from lobstr_hw.errors import SpacesNotJoined
from lobstr_hw.poses import Pose
from lobstr_hw.rotations import Array, geodesic_angle
from lobstr_hw.trackers import TrackerSample

__all__ = ["LEAST_S", "LEAST_WOBBLE_RAD", "SpaceAlignment", "align_spaces", "turned_so_far"]

LEAST_S = 3.0
"""Of both trackers being seen."""
LEAST_WOBBLE_RAD = float(np.deg2rad(15.0))
"""Below this errors of the trackers are multiplied by more than three."""
NEAR_S = 0.015
PAIRS = 300
"""Moments that the delay is found with; all of them give the rest."""
LEVER_M = 0.5
"""An error of rotation weighs as the shift that it makes half a metre away."""
OUTLIER = 3.0
KEPT = 0.8
TOGETHER = ((0.005, np.deg2rad(1.0)), (0.03, np.deg2rad(5.0)))
"""Residuals of good and of usable alignments; beyond, the trackers moved against each other."""


@dataclass(frozen=True, slots=True, eq=False)
class SpaceAlignment:
    """How two tracking spaces lie to each other.

    Attributes:
        T_a_b: from space b to space a.
        T_trackera_trackerb: how the two trackers were held together.
        delay_s: by how much later driver b stamps the same moment.
        residual_m, residual_rad: what is left, root of the mean square.
        wobble_rad: how much the two were turned out of one axis; more is better.
        seconds: of both being seen.
    """

    T_a_b: Pose
    T_trackera_trackerb: Pose
    delay_s: float
    residual_m: float
    residual_rad: float
    wobble_rad: float
    seconds: float

    @property
    def grade(self) -> Grade:
        """By the residuals; poor ones are never handed out."""
        good_m, good_rad = TOGETHER[0]
        good = self.residual_m <= good_m and self.residual_rad <= good_rad
        return Grade.GOOD if good else Grade.FAIR

    def space(self, T_world_a: Pose | None = None) -> TrackingSpace:
        """Space b for a profile; space a is the world unless told otherwise."""
        T_world_b = self.T_a_b if T_world_a is None else T_world_a @ self.T_a_b
        return TrackingSpace(T_world_b, self.delay_s, self.residual_m, self.residual_rad)


def turned_so_far(samples: Iterable[TrackerSample]) -> float:
    """How much one tracker was turned out of one axis, radians; for a bar that fills up.

    It is enough at ``LEAST_WOBBLE_RAD``.
    """
    track = Track.of(samples)
    return wobble(track.R) if len(track) else 0.0


def align_spaces(
    samples_a: Iterable[TrackerSample], samples_b: Iterable[TrackerSample]
) -> SpaceAlignment:
    """The rigid transform between two tracking spaces from two trackers that moved as one.

    How they are held together is not known, nor by how much the stamps of the two drivers differ.

    Args:
        samples_a: of one tracker of the one space, oldest first.
        samples_b: of one tracker of the other space, of the same time.

    Raises:
        SpacesNotJoined: too short, too little turned, or not held together; says which.
    """
    a, b = Track.of(samples_a), Track.of(samples_b)
    if min(len(a), len(b)) < 2:
        raise SpacesNotJoined(f"{len(a)} and {len(b)} samples: switch on and show both trackers.")
    step = max(1, len(a) // PAIRS)
    few = Track(a.times_s[::step], a.p[::step], a.R[::step])
    _check_turning(few)
    _check_turning(b)
    coarse_s = _coarse_delay(a, b)
    delay_s = _minimum(lambda d: _misfit(few, b, d), coarse_s - NEAR_S, coarse_s + NEAR_S)
    fit = _fit(a, b, delay_s)
    _check_together(fit)
    return fit


def _check_turning(a: Track) -> None:
    turned = wobble(a.R)
    if turned < LEAST_WOBBLE_RAD:
        raise SpacesNotJoined(
            f"turned by {np.rad2deg(turned):.0f} degrees out of one axis, "
            f"{np.rad2deg(LEAST_WOBBLE_RAD):.0f} are needed: hold the two trackers together and "
            "turn them about all axes, like a steering wheel, a key and a nod."
        )


def _check_together(fit: SpaceAlignment) -> None:
    most_m, most_rad = TOGETHER[1]
    if fit.residual_m > most_m or fit.residual_rad > most_rad:
        raise SpacesNotJoined(
            f"the two trackers do not move as one: {1e3 * fit.residual_m:.0f} mm and "
            f"{np.rad2deg(fit.residual_rad):.1f} degrees are left. Hold them firmly together, in "
            "sight of both systems, away from metal, and move them again."
        )


def _coarse_delay(a: Track, b: Track) -> float:
    seconds = common_s(a, b)
    if seconds < LEAST_S:
        raise SpacesNotJoined(
            f"both were seen for {max(0.0, seconds):.1f} s, {LEAST_S:g} are needed: go on "
            "moving them in sight of both systems."
        )
    return turning_likeness(a, b)[0]


def _misfit(a: Track, b: Track, delay_s: float) -> float:
    """Of the best fit with this delay, outliers left out; square metres."""
    _, off_m, off_rad = _pair(a, b, delay_s)
    squares = np.sort(off_m**2 + (LEVER_M * off_rad) ** 2)
    return float(np.mean(squares[: int(KEPT * len(squares))]))


def _fit(a: Track, b: Track, delay_s: float) -> SpaceAlignment:
    (T_a_b, T_held), off_m, off_rad = _pair(a, b, delay_s, rounds=4)
    kept = _believed(off_m, off_rad)
    return SpaceAlignment(
        T_a_b,
        T_held,
        delay_s,
        float(np.sqrt(np.mean(off_m[kept] ** 2))),
        float(np.sqrt(np.mean(off_rad[kept] ** 2))),
        wobble(a.R),
        float(len(off_m) * np.median(np.diff(a.times_s))),
    )


def _pair(
    a: Track, b: Track, delay_s: float, rounds: int = 2
) -> tuple[tuple[Pose, Pose], Array, Array]:
    """X and Y with this delay, and how far off each moment (m,) is, in metres and radians."""
    p_b, R_b, seen = b.at(a.times_s + delay_s)
    if np.sum(seen) < len(a) // 4:
        raise SpacesNotJoined("the two trackers were seldom seen at once: keep both in sight.")
    p_a, R_a, p_b, R_b = a.p[seen], a.R[seen], p_b[seen], R_b[seen]
    kept = np.ones(len(p_a), dtype=bool)
    for _ in range(rounds):
        R_X, R_Y = fit_rotations(R_a[kept], R_b[kept])
        p_X, p_Y = fit_positions(R_a[kept], p_a[kept], p_b[kept] @ R_X.T)
        off_m = np.linalg.norm(p_a + R_a @ p_Y - p_b @ R_X.T - p_X, axis=-1)
        off_rad = geodesic_angle(R_a @ R_Y, R_X @ R_b)
        kept = _believed(off_m, off_rad)
    return (Pose(R_X, p_X), Pose(R_Y, p_Y)), off_m, off_rad


def _believed(off_m: Array, off_rad: Array) -> "np.ndarray[tuple[int], np.dtype[np.bool_]]":
    """Trackers jump: moments far off the others do not count."""
    off = np.hypot(off_m, LEVER_M * off_rad)
    return np.asarray(off <= OUTLIER * np.median(off) + 1e-12)


def _minimum(f: Callable[[float], float], low: float, high: float) -> float:
    """Of a function with one valley, by the golden section."""
    golden = (np.sqrt(5.0) - 1.0) / 2.0
    c, d = high - golden * (high - low), low + golden * (high - low)
    f_c, f_d = f(c), f(d)
    while high - low > 1e-8:
        if f_c < f_d:
            high, d, f_d = d, c, f_c
            c = high - golden * (high - low)
            f_c = f(c)
        else:
            low, c, f_c = c, d, f_d
            d = low + golden * (high - low)
            f_d = f(d)
    return 0.5 * (low + high)
