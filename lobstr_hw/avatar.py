"""The avatar: joint poses of a few points in, a whole body out.

Everything inside works in the standard size (hips at 1.0 m); what comes out is in the user's size.
"""

from collections.abc import Sequence
from dataclasses import fields

import numpy as np
import numpy.typing as npt

from lobstr_hw.contact import ContactLock, LockSettings
from lobstr_hw.errors import ModelError
from lobstr_hw.ik.jacobian import LegPose
from lobstr_hw.ik.vectors import rotate
from lobstr_hw.last_points import LastPoints
from lobstr_hw.legs import FEET, LOWER, TOES, UPPER, LegBody, TrackedFeet, pose_legs
from lobstr_hw.prediction_state import LastTwo
from lobstr_hw.predictors.predictor import Bools, Frame, Predictor, State
from lobstr_hw.rotations import Array, heading
from lobstr_hw.skeleton import Body, Joint, local_rotations
from lobstr_hw.skeleton_pose import RoleReport, SkeletonPose, Source
from lobstr_hw.trackers import ROLE_JOINT, TrackerRole
from lobstr_hw.upper_body import ARM_JOINTS, SPINE_JOINTS, pose_upper_body
from lobstr_hw.world_kinematics import positions

__all__ = ["AHEAD", "Avatar"]

_HANDS = (TrackerRole.LEFT_HAND, TrackerRole.RIGHT_HAND)
_FOOT_ROLES = (TrackerRole.LEFT_FOOT, TrackerRole.RIGHT_FOOT)
_LEGS = (*UPPER, *LOWER, *FEET)
_ARMS = [joint for side in ARM_JOINTS for joint in side]
_LONGEST_TICK_S = 1.0
AHEAD = 0.5
"""Grid steps by which outputs are shown beyond the slerp of the last two: a whole step late costs a
tenth of the position, a whole step ahead trembles (docs/decisions.md)."""


class Avatar:
    """Predictor, contact lock and IK of n people, as one pure step.

    Args:
        predictor: moves the legs.
        body: of n people, in their own sizes.
        loop_rate_hz: of the ticks; the predictor's own if None. When every tick is a grid tick,
            output j is shown; otherwise outputs j - 1 and j, from half way between them to half a
            step beyond.
        input_delay_s: by which the grid's times lag behind the ticks'.
        lock: settings of the contact lock.

    Raises:
        ModelError: the predictor's card asks for what this avatar cannot do.
    """

    def __init__(
        self,
        predictor: Predictor,
        body: Body,
        *,
        loop_rate_hz: float | None = None,
        input_delay_s: float = 0.0,
        lock: LockSettings | None = None,
    ) -> None:
        """Compute what depends on the body only."""
        _check(predictor)
        self.predictor = predictor
        self.body = body
        self._standard = body.scaled_to_standard()
        self._legs = LegBody.of(self._standard)
        self._lock = lock or LockSettings()
        self._delay_s = input_delay_s
        steps_per_tick = predictor.card.rate_hz / (loop_rate_hz or predictor.card.rate_hz)
        self._between = abs(steps_per_tick - round(steps_per_tick)) > 1e-9
        self._where = {joint: i for i, joint in enumerate(predictor.card.gives)}

    def start(self) -> State:
        """The state before the first tick."""
        n = len(self.body.scale)
        return {
            **_prefixed("predictor", self.predictor.start(self.body)),
            **_prefixed("shown", _flat(LastTwo.start(n, len(self._where)))),
            **_prefixed("lock", _flat(ContactLock.start(n))),
            **_prefixed("last", _flat(LastPoints.start(n))),
            "avatar.R_ref": np.broadcast_to(np.eye(3), (n, 3, 3)).copy(),
            "avatar.time_s": np.zeros(n),
        }

    def step(
        self, state: State, frame: Frame, grid: Sequence[Frame] = ()
    ) -> tuple[State, SkeletonPose]:
        """One tick.

        Args:
            state: of the last tick.
            frame: joint poses at the tick's time, in the standard size; a pelvis, head or hand that
                is lost is shown where the body next to it goes (:mod:`lobstr_hw.lost_points`).
            grid: those at the grid times due by this tick, oldest first; the predictor steps once
                for each.

        Returns:
            The new state and the body in the user's size.
        """
        inner, shown = self._predict(state, grid)
        lock = ContactLock(**_part(state, "lock"))
        # what is held in mid-air while the legs walk on would be a statue that treads
        last, frame = LastPoints(**_part(state, "last")).take_along(frame)
        p_hips, R_hips = frame.p[:, frame.index(TrackerRole.PELVIS)], _R(frame, TrackerRole.PELVIS)
        R_ref = heading(R_hips, state["avatar.R_ref"])
        R_given = self._given(shown, frame.time_s)
        R = np.empty((len(p_hips), 22, 3, 3))
        R[:, Joint.HIPS] = R_hips
        dt_s = np.clip(frame.time_s - state["avatar.time_s"], 0.0, _LONGEST_TICK_S)[:, None]
        lock = self._pose_legs(R, p_hips, R_ref, R_given, shown.contact, frame, lock, dt_s)
        self._pose_upper_body(R, p_hips, frame)
        new = {
            **_prefixed("predictor", inner),
            **_prefixed("shown", _flat(shown)),
            **_prefixed("lock", _flat(lock)),
            **_prefixed("last", _flat(last)),
            "avatar.R_ref": R_ref,
            "avatar.time_s": np.full(len(p_hips), frame.time_s),
        }
        return new, self._pose(R, p_hips, frame, shown, lock)

    def shift_world(self, state: State, T: Array) -> State:
        """The state after the play space moved by T (n, 4, 4), a turn about Y and a shift."""
        inner = self.predictor.shift_world(_part(state, "predictor"), T)
        lock = ContactLock(**_part(state, "lock")).shifted(T)
        last = LastPoints(**_part(state, "last")).shifted(T)
        return {
            **state,
            **_prefixed("predictor", inner),
            **_prefixed("lock", _flat(lock)),
            **_prefixed("last", _flat(last)),
            "avatar.R_ref": heading(T[:, :3, :3]) @ state["avatar.R_ref"],
        }

    def _predict(self, state: State, grid: Sequence[Frame]) -> tuple[State, LastTwo]:
        inner, shown = _part(state, "predictor"), LastTwo(**_part(state, "shown"))
        for frame in grid:
            inner, prediction = self.predictor.step(inner, frame)
            shown = shown.add(prediction, frame.time_s)
        return inner, shown

    def _given(self, shown: LastTwo, time_s: float) -> Array:
        """Rotations (n, joints given, 3, 3) for this tick."""
        if not self._between:
            return shown.newest()
        steps = (time_s - shown.time_s - self._delay_s) * self.predictor.card.rate_hz
        return shown.between(np.clip(steps, 0.0, 1.0) + AHEAD)

    def _pose_legs(
        self,
        R: Array,
        p_hips: Array,
        R_ref: Array,
        R_given: Array,
        contact: Array,
        frame: Frame,
        lock: ContactLock,
        dt_s: Array,
    ) -> ContactLock:
        """Fill in the legs' world rotations."""
        upper, lower, foot = (
            R_given[:, [self._where[j] for j in js]] for js in (UPPER, LOWER, FEET)
        )
        # the leg keeps the direction that the network gave it in the upright frame; the hips carry
        # the measured tilt, so the leg's local rotation takes up the difference
        R_upper = R_ref[:, None] @ upper
        R_lower = R_upper @ lower
        network = LegPose(R_upper, R_lower, R_lower @ foot)
        p_hip = p_hips[:, None] + rotate(R[:, :1], self._legs.hip)
        lock, legs, R_toes = pose_legs(
            self._legs, lock, network, p_hip, contact, _tracked_feet(frame), dt_s, self._lock
        )
        R[:, UPPER], R[:, LOWER], R[:, FEET] = legs.upper, legs.lower, legs.foot
        R[:, TOES] = R_toes
        return lock

    def _pose_upper_body(self, R: Array, p_hips: Array, frame: Frame) -> None:
        """Fill in spine, head and arms."""
        head = frame.index(TrackerRole.HEAD)
        hands = [frame.index(role) for role in _HANDS]
        R_head, R_hand = frame.R[:, head], frame.R[:, hands]
        spine, arms = pose_upper_body(
            p_hips, R[:, 0], frame.p[:, head], R_head, frame.p[:, hands], R_hand,
            self._standard.offsets,
        )  # fmt: skip
        R[:, SPINE_JOINTS], R[:, Joint.HEAD] = spine, R_head
        R[:, _ARMS] = arms.reshape(len(R), 6, 3, 3)
        R[:, [ROLE_JOINT[role] for role in _HANDS]] = R_hand

    def _pose(
        self, R: Array, p_hips: Array, frame: Frame, shown: LastTwo, lock: ContactLock
    ) -> SkeletonPose:
        p_hips = p_hips / self.body.scale[:, None]
        return SkeletonPose(
            time_s=frame.time_s,
            p_world=positions(R, p_hips, self.body.offsets),
            R_local=local_rotations(R),
            contact=shown.contact > 0.5,
            locked=lock.on,
            source=_sources(frame, shown.known),
            roles=_reports(frame),
        )


def _check(predictor: Predictor) -> None:
    card = predictor.card
    missing = [joint.name.lower() for joint in _LEGS if joint not in card.gives]
    if missing:
        raise ModelError(
            f"the predictor '{card.name}' does not give {', '.join(missing)}; "
            "the avatar needs upper legs, lower legs and feet from it"
        )
    if card.delay_frames:
        raise ModelError(
            f"the predictor '{card.name}' shows the body of {card.delay_frames} steps ago; "
            "this version shows the present only"
        )


def _R(frame: Frame, role: TrackerRole) -> Array:
    return frame.R[:, frame.index(role)]


def _tracked_feet(frame: Frame) -> TrackedFeet | None:
    """Feet that carry trackers of their own; None when no role of this session is a foot."""
    at = [frame.index(role) if role in frame.roles else 0 for role in _FOOT_ROLES]
    there = np.array([role in frame.roles for role in _FOOT_ROLES])
    if not there.any():
        return None
    valid = frame.valid_p[:, at] & frame.valid_R[:, at] & there
    return TrackedFeet(frame.p[:, at], frame.R[:, at], valid)


def _sources(frame: Frame, known: Bools) -> npt.NDArray[np.int8]:
    source = np.full((len(known), 22), Source.IK, dtype=np.int8)
    source[:, _LEGS] = np.where(known, Source.PREDICTED, Source.HELD)[:, None]
    joints = [ROLE_JOINT[role] for role in frame.roles]
    valid = frame.valid_p & frame.valid_R
    source[:, joints] = np.where(valid, Source.TRACKED, Source.HELD)
    return source


def _reports(frame: Frame) -> dict[TrackerRole, RoleReport]:
    """Neutral ones; the runtime, which knows ages, puts its own in their place."""
    valid = np.all(frame.valid_p & frame.valid_R, axis=0).tolist()
    return {
        role: RoleReport("ok" if ok else "guessed", 0.0)
        for role, ok in zip(frame.roles, valid, strict=True)
    }


def _flat(part: LastTwo | ContactLock | LastPoints) -> State:
    return {field.name: getattr(part, field.name) for field in fields(part)}


def _prefixed(prefix: str, part: State) -> State:
    return {f"{prefix}.{key}": value for key, value in part.items()}


def _part(state: State, prefix: str) -> State:
    start = prefix + "."
    return {key.removeprefix(start): value for key, value in state.items() if key.startswith(start)}
