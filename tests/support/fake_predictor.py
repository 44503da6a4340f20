"""A predictor without a network: an analytic walk driven by how far the hips have moved."""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.predictors.predictor import Frame, ModelCard, Prediction, State
from lobstr_hw.rotations import Array, rotation_x
from lobstr_hw.skeleton import SKELETON_VERSION, Body, Joint
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole

STRIDE_M = 1.2
"""Two steps."""

STANCE = 0.6
"""Share of the stride that a foot is on the floor."""


@dataclass(frozen=True, slots=True, eq=False)
class FakePredictor:
    """Legs swing with the distance the hips have gone; a standing person stands.

    ``roles`` may be more than the four points: the card accepts them. ``contacts`` False: no foot
    is ever said to be on the floor.
    """

    roles: tuple[TrackerRole, ...] = FOUR_POINTS
    delay_frames: int = 0
    contacts: bool = True

    @property
    def card(self) -> ModelCard:
        return ModelCard(
            name="fake",
            version="1",
            rate_hz=45.0,
            delay_frames=self.delay_frames,
            needs=FOUR_POINTS,
            accepts=self.roles,
            gives=tuple(
                Joint[f"{side}_{bone}"]
                for side in ("LEFT", "RIGHT")
                for bone in ("UPPER_LEG", "LOWER_LEG", "FOOT")
            ),
            contacts=self.contacts,
            feature_version=1,
            skeleton_version=SKELETON_VERSION,
        )

    def start(self, body: Body) -> State:
        n = len(body.scale)
        return {"p": np.zeros((n, 3)), "gone_m": np.zeros(n), "begun": np.zeros(n, dtype=bool)}

    def step(self, state: State, frame: Frame) -> tuple[State, Prediction]:
        p = frame.p[:, frame.index(TrackerRole.PELVIS)]
        step = np.hypot(*(p - state["p"])[:, [0, 2]].T)
        gone_m = state["gone_m"] + np.where(state["begun"], step, 0.0)
        speed = np.where(state["begun"], step * 45.0, 0.0)
        phase = gone_m[:, None] / STRIDE_M + np.array([0.0, 0.5])  # (n, 2)
        new = {"p": p, "gone_m": gone_m, "begun": np.ones_like(state["begun"])}
        return new, Prediction(_legs(phase, speed), self.contacts * _contact(phase, speed))

    def shift_world(self, state: State, T: Array) -> State:
        p = (T[:, :3, :3] @ state["p"][..., None])[..., 0] + T[:, :3, 3]
        return {**state, "p": p}


def _legs(phase: Array, speed: Array) -> Array:
    """Upper leg, lower leg and foot of both sides (n, 6, 3, 3)."""
    how = np.minimum(speed, 1.0)[:, None]
    turn = 2.0 * np.pi * phase
    thigh = how * (-0.10 - 0.40 * np.cos(turn))  # forward is a negative turn about X
    knee = 0.05 + how * (0.25 + 0.45 * np.maximum(np.sin(turn - np.pi), 0.0))
    foot = how * 0.15 * np.sin(turn) - 0.05
    R = [rotation_x(angle) for angle in (thigh, knee, foot)]
    return np.stack(R, axis=2).reshape(len(phase), 6, 3, 3)


def _contact(phase: Array, speed: Array) -> Array:
    swings = (phase % 1.0 > STANCE) & (speed[:, None] > 0.05)
    return np.where(swings, 0.05, 0.95)
