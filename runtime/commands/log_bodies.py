"""The bodies in a log, as the outputs take them."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lobstr_hw.contact_labels import contact_labels
from lobstr_hw.drivers.tracker_log import SkeletonTrack, TrackerLog, TruthTrack
from lobstr_hw.drivers.tracker_log.quality import sample_rate
from lobstr_hw.errors import LogFileError
from lobstr_hw.rotations import Array, transpose
from lobstr_hw.skeleton import (
    PARENTS,
    STANDARD_OFFSETS,
    TOE_BASE_HEIGHT,
    Body,
    Joint,
    forward_kinematics,
    local_rotations,
)
from lobstr_hw.skeleton_pose import RoleReport, SkeletonPose, Source
from lobstr_hw.trackers import TrackerRole

__all__ = ["Bodies", "bodies_of"]

_LEG = [Joint.LEFT_LOWER_LEG, Joint.LEFT_FOOT]
ROUNDING = 1e-4
"""Legs of the same body differ by less, after the rounding of the file."""
_TOES = [Joint.LEFT_TOES, Joint.RIGHT_TOES]


@dataclass(frozen=True, slots=True, eq=False)
class Bodies:
    """One person, frame by frame.

    Attributes:
        body: n = 1, constant over the log.
        rate_hz: by the median distance of frames.
        times_s: (f,).
        p_world: (f, 22, 3).
        R_local: (f, 22, 3, 3).
        contact: (f, 2).
        roles: per frame, how each role fared.
        source: where the joints come from.
    """

    body: Body
    rate_hz: float
    times_s: Array
    p_world: Array
    R_local: Array
    contact: npt.NDArray[np.bool_]
    roles: tuple[dict[str, str], ...]
    source: Source

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.times_s)

    def pose(self, i: int) -> SkeletonPose:
        """One frame."""
        return SkeletonPose(
            float(self.times_s[i]),
            self.p_world[i : i + 1],
            self.R_local[i : i + 1],
            self.contact[i : i + 1],
            np.zeros((1, 2), bool),
            np.full((1, 22), self.source, np.int8),
            {TrackerRole(role): RoleReport(state, 0.0) for role, state in self.roles[i].items()},
        )


def bodies_of(log: TrackerLog) -> Bodies:
    """The recorded skeleton, or else the truth of a made log.

    Raises:
        LogFileError: the log holds neither.
    """
    if log.skeleton is not None:
        return _recorded(log.skeleton)
    if log.truth is not None and log.truth.R_world is not None:
        return _true(log, log.truth, log.truth.R_world)
    raise LogFileError(
        f"{log.path} holds trackers, but no body. Make one of them first: "
        f"lobstr-live --sim {log.path} --fast --output bvh:OUT.bvh"
    )


def _recorded(skeleton: SkeletonTrack) -> Bodies:
    # frames before the calibration have the standard body: give them the user's, on the same floor
    offsets = skeleton.p_local[-1]
    p_hips = np.array(skeleton.p_local[:, 0])
    grown = _size(offsets) / _size(skeleton.p_local)
    p_hips[:, 1] *= np.where(np.abs(grown - 1.0) > ROUNDING, grown, 1.0)
    p, _ = forward_kinematics(skeleton.R_local, p_hips, offsets)
    rate = sample_rate(skeleton.times_s)
    contact = skeleton.contact
    if contact is None:
        contact = contact_labels(p[:, _TOES] / _size(offsets), rate)
    args = (skeleton.times_s, p, skeleton.R_local, contact, skeleton.roles, Source.IK)
    return Bodies(_body(offsets), rate, *args)


def _true(log: TrackerLog, truth: TruthTrack, R_world: Array) -> Bodies:
    parents = list(PARENTS[1:])
    bones = truth.p_world[:, 1:] - truth.p_world[:, parents]
    local = (transpose(R_world[:, parents]) @ bones[..., None])[..., 0]
    # float32 and 16-bit rotations leave 0.05 mm of noise, which the median takes away
    offsets = np.concatenate([np.zeros((1, 3)), np.median(local, axis=0)])
    R_local = local_rotations(R_world)
    p, _ = forward_kinematics(R_local, truth.p_world[:, 0], offsets)
    rate = sample_rate(truth.times_s)
    contact = contact_labels(p[:, _TOES] / _size(offsets), rate)
    args = (truth.times_s, p, R_local, contact, _role_states(log, truth.times_s), Source.TRACKED)
    return Bodies(_body(offsets), rate, *args)


def _role_states(log: TrackerLog, times_s: Array) -> tuple[dict[str, str], ...]:
    """How each role fared at the sample before each time."""
    states: list[dict[str, str]] = [{} for _ in times_s]
    for track in log.trackers:
        if track.role is not None:
            rows = np.maximum(np.searchsorted(track.times_s, times_s, side="right") - 1, 0)
            for frame, tracked in zip(states, track.tracked[rows], strict=True):
                frame[track.role.value] = "ok" if tracked else "guessed"
    return tuple(states)


def _size(offsets: Array) -> Array:
    """Height of the hips (...) of bodies (..., 22, 3), by the legs: these are in proportion."""
    legs, standard = (np.linalg.norm(o[..., _LEG, :], axis=-1) for o in (offsets, STANDARD_OFFSETS))
    return np.asarray(legs.sum(axis=-1) / standard.sum())


def _body(offsets: Array) -> Body:
    size = float(_size(offsets))
    whole = np.array(offsets)
    whole[0] = (0.0, size, 0.0)
    return Body(whole[None], np.array([TOE_BASE_HEIGHT * size]), np.array([1.0 / size]))
