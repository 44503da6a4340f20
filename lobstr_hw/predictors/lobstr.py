"""LoBSTR: the lower body from four points, by a GRU stepped once per grid time."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from lobstr_hw.features import Form, Points, features, reference_frame
from lobstr_hw.lost_points import seen_points
from lobstr_hw.lower_body import pose_from_6d
from lobstr_hw.predictors import bridge
from lobstr_hw.predictors.predictor import Frame, ModelCard, Prediction, State
from lobstr_hw.predictors.weights import Network
from lobstr_hw.rotations import Array, heading
from lobstr_hw.skeleton import Body, Joint

__all__ = ["GIVES", "Lobstr", "prediction_from_6d", "softmax_contact"]

GIVES = (
    Joint.LEFT_UPPER_LEG,
    Joint.LEFT_LOWER_LEG,
    Joint.LEFT_FOOT,
    Joint.RIGHT_UPPER_LEG,
    Joint.RIGHT_LOWER_LEG,
    Joint.RIGHT_FOOT,
)
"""Upper legs in the reference frame, the others in their parents."""

GAP_STEPS = 1.5
"""Frames further apart than this many grid steps are not linked by a velocity."""


@dataclass(frozen=True, slots=True, eq=False)
class Lobstr:
    """The paper's network as a pure step (see ``predictor.Predictor``).

    State: hidden (n, H) float32; the points of the step before (p, R, valid_p, valid_R, R_ref);
    started (n,) whether there was one; time_s (n,) of it; scale (n,) of the user; and what is kept
    for points that are lost (:mod:`lobstr_hw.predictors.bridge`), which are guessed here: what a
    frame holds in their place counts only until they are seen for the first time.
    """

    network: Network

    @property
    def card(self) -> ModelCard:
        """What it needs and gives."""
        return self.network.card.model

    def start(self, body: Body) -> State:
        """Before the first frame: a zero hidden state, nothing to difference with."""
        n = len(body.scale)
        return {
            "hidden": np.zeros((n, self.network.card.hidden_size), dtype=np.float32),
            "p": np.zeros((n, 4, 3)),
            "R": np.broadcast_to(np.eye(3), (n, 4, 3, 3)).copy(),
            "valid_p": np.zeros((n, 4), dtype=bool),
            "valid_R": np.zeros((n, 4), dtype=bool),
            "R_ref": np.broadcast_to(np.eye(3), (n, 3, 3)).copy(),
            "started": np.zeros(n, dtype=bool),
            "time_s": np.zeros(n),
            "scale": np.array(body.scale, dtype=np.float64),
            **bridge.begun(n, self.network.card.hidden_size),
        }

    def step(self, state: State, frame: Frame) -> tuple[State, Prediction]:
        """One grid step (section 3.1 to 3.3 of the paper)."""
        card = self.network.card
        elapsed = frame.time_s - state["time_s"]
        linked = state["started"] & (elapsed * card.model.rate_hz < GAP_STEPS)
        now = seen_points(frame)
        calm = bridge.all_seen(state, now)
        if not calm:
            state = bridge.bridged(state, now, linked, self.network)
            now = bridge.guessed(state, now)
        now = _with_reference(now, state, card.feature_form)
        before = bridge.last_points(state)
        x = features(before, now, linked, card.feature_form, state["scale"])  # (n, 37)
        z = (x.astype(np.float32) - card.input_mean) / card.input_scale
        hidden, pose, logits = self.network.step(z, state["hidden"])
        new = _state_after(state, now, hidden, frame.time_s)
        if not calm:
            new |= bridge.remembered(state, now, linked)
        return new, prediction_from_6d(pose, logits)

    def shift_world(self, state: State, T: Array) -> State:
        """The play space moved by T (n, 4, 4): the remembered points and heading move along."""
        R_T = T[:, :3, :3]
        p = (R_T[:, None] @ state["p"][..., None])[..., 0] + T[:, None, :3, 3]
        return {
            **state,
            "p": p,
            "R": R_T[:, None] @ state["R"],
            "R_ref": heading(R_T) @ state["R_ref"],
            **bridge.shifted(state, T),
        }


def _with_reference(now: Points, state: State, form: Form) -> Points:
    R_ref = reference_frame(now.R[:, 0], state["R_ref"], state["started"], form)
    return Points(now.p, now.R, now.valid_p, now.valid_R, R_ref)


def _state_after(
    state: State, now: Points, hidden: npt.NDArray[np.float32], time_s: float
) -> State:
    n = len(hidden)
    return {
        **state,
        "hidden": hidden,
        "p": now.p,
        "R": now.R,
        "valid_p": now.valid_p,
        "valid_R": now.valid_R,
        "R_ref": now.R_ref,
        "started": np.ones(n, dtype=bool),
        "time_s": np.full(n, time_s),
        "steps": state["steps"] + 1,
    }


def prediction_from_6d(pose: npt.NDArray[Any], logits: npt.NDArray[Any]) -> Prediction:
    """The network's numbers (n, 48) and (n, 4) as rotations and probabilities."""
    joints = pose_from_6d(pose.astype(np.float64))  # (n, 2, 4, 3, 3): C, U, L, F
    C = joints[:, :, 0]
    legs = joints[:, :, 1:]
    legs[:, :, 0] = C @ legs[:, :, 0]
    return Prediction(
        R=legs.reshape(len(legs), len(GIVES), 3, 3), contact=softmax_contact(logits), C=C
    )


def softmax_contact(logits: npt.NDArray[Any]) -> Array:
    """Logits (n, 4): (off, on) of the left foot, then of the right -> probability of on (n, 2)."""
    off_on = logits.astype(np.float64).reshape(-1, 2, 2)
    # a softmax of two is a logistic of their difference; tanh does not overflow
    return np.asarray(0.5 + 0.5 * np.tanh(0.5 * (off_on[..., 1] - off_on[..., 0])))
