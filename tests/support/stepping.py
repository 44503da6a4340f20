"""A predictor led through frames, and frames in a play space that lies elsewhere."""

from collections.abc import Sequence
from dataclasses import replace

from lobstr_hw.predictors import Frame, Prediction, Predictor, State
from lobstr_hw.rotations import Array
from lobstr_hw.skeleton import Body


def run(
    predictor: Predictor, sequence: Sequence[Frame], state: State | None = None
) -> tuple[State, list[Prediction]]:
    """Step by step, from the start where no state is given."""
    state = predictor.start(Body.standard(len(sequence[0].p))) if state is None else state
    said = []
    for frame in sequence:
        state, prediction = predictor.step(state, frame)
        said.append(prediction)
    return state, said


def moved(frame: Frame, T: Array) -> Frame:
    """The same in a play space moved by T (n, 4, 4)."""
    R = T[:, None, :3, :3]
    p = (R @ frame.p[..., None])[..., 0] + T[:, None, :3, 3]
    return replace(frame, p=p, R=R @ frame.R)
