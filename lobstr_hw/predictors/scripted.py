"""A predictor that says what was worked out before, frame by frame."""

from dataclasses import dataclass

import numpy as np

from lobstr_hw.predictors.predictor import Frame, ModelCard, Prediction, State
from lobstr_hw.rotations import Array
from lobstr_hw.skeleton import Body

__all__ = ["Scripted"]


@dataclass(frozen=True, slots=True, eq=False)
class Scripted:
    """What one person's legs are to do, by the time of the frame.

    Attributes:
        card: of the predictor it was made by.
        times_s: (frames,) rising.
        said: R (frames, joints, 3, 3), contact (frames, 2).
    """

    card: ModelCard
    times_s: Array
    said: Prediction

    def start(self, body: Body) -> State:
        """Nothing to remember but how many there are."""
        return {"people": np.arange(len(body.scale))}

    def step(self, state: State, frame: Frame) -> tuple[State, Prediction]:
        """What was said of the newest of the frames up to this one's time."""
        i = max(int(np.searchsorted(self.times_s, frame.time_s, side="right")) - 1, 0)
        C = None if self.said.C is None else self.said.C[i][None]
        return state, Prediction(self.said.R[i][None], self.said.contact[i][None], C)

    def shift_world(self, state: State, T: Array) -> State:
        """Nothing of the world is remembered."""
        return state
