"""Predictors that say the same whatever they see: the yardstick rows of the tables."""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.features import FEATURE_VERSION
from lobstr_hw.lower_body import pose_from_6d
from lobstr_hw.predictors.lobstr import GIVES
from lobstr_hw.predictors.predictor import Frame, ModelCard, Prediction, State
from lobstr_hw.predictors.weights import NetworkCard
from lobstr_hw.rotations import Array
from lobstr_hw.skeleton import SKELETON_VERSION, Body
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole

__all__ = ["ConstantPose", "mean_pose", "standing"]


@dataclass(frozen=True, slots=True, eq=False)
class ConstantPose:
    """One pose of the lower body for ever.

    Attributes:
        card: of this predictor.
        joints: (2, 4, 3, 3) C, U, L, F of both sides.
        contact: (2,) probability.
    """

    card: ModelCard
    joints: Array
    contact: Array

    def start(self, body: Body) -> State:
        """Nothing to remember but how many there are."""
        return {"people": np.arange(len(body.scale))}

    def step(self, state: State, frame: Frame) -> tuple[State, Prediction]:
        """The same pose again."""
        n = len(state["people"])
        C = self.joints[:, 0]
        legs = np.concatenate([(C @ self.joints[:, 1])[:, None], self.joints[:, 2:]], axis=1)
        return state, Prediction(
            R=np.broadcast_to(legs.reshape(1, len(GIVES), 3, 3), (n, len(GIVES), 3, 3)).copy(),
            contact=np.broadcast_to(self.contact, (n, 2)).copy(),
            C=np.broadcast_to(C, (n, 2, 3, 3)).copy(),
        )

    def shift_world(self, state: State, T: Array) -> State:
        """Nothing of the world is remembered."""
        return state


def standing() -> ConstantPose:
    """Straight legs, both feet on the floor: the T-pose."""
    upright = np.broadcast_to(np.eye(3), (2, 4, 3, 3)).copy()
    return ConstantPose(_card("standing"), upright, np.ones(2))


def mean_pose(network: NetworkCard) -> ConstantPose:
    """The mean of a network's training poses, and how often its feet were on the floor."""
    joints = pose_from_6d(network.output_mean.astype(np.float64))
    return ConstantPose(_card("mean_pose"), joints, network.contact_mean.astype(np.float64))


def _card(name: str) -> ModelCard:
    return ModelCard(
        name=name,
        version="1",
        rate_hz=45.0,
        delay_frames=0,
        needs=(TrackerRole.PELVIS,),
        accepts=FOUR_POINTS,
        gives=GIVES,
        contacts=True,
        feature_version=FEATURE_VERSION,
        skeleton_version=SKELETON_VERSION,
    )
