"""What one step of the network costs, beside the paper's network in the same run.

    python tools/step_cost.py [--predictor lobstr] [--against lobstr-paper] [--seconds 20] [--write]

Both are stepped in turn at their real rate, once per grid time, on one thread; then 256 people at
once as fast as it goes. The ratio means something on a shared machine, the times less.
"""

import argparse
import datetime
import time
from collections.abc import Sequence

import numpy as np
from results_page import write_section

from lobstr_hw.predictors import Frame, Predictor, load_predictor
from lobstr_hw.predictors.predictor import State
from lobstr_hw.rotations import Array, from_rotation_vector
from lobstr_hw.skeleton import Body, forward_kinematics
from lobstr_hw.trackers import FOUR_POINTS, ROLE_JOINT

TITLE = "## Cost of a step"
MANY = 256
_JOINTS = [ROLE_JOINT[role] for role in FOUR_POINTS]


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--predictor", default="lobstr")
    parser.add_argument("--against", default="lobstr-paper")
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--write", action="store_true")
    args = parser.parse_args()
    predictors = [load_predictor(name) for name in (args.predictor, args.against)]
    paced = _paced(predictors, round(args.seconds * 45.0))
    many = _back_to_back(predictors, 60)
    text = "\n".join([_head(args), *_rows(args, predictors, paced, many)])
    print(text)
    if args.write:
        write_section(text)
    return 0


def _paced(predictors: Sequence[Predictor], steps: int) -> list[Array]:
    """Milliseconds (steps,) of each, one person, each step begun at its grid time."""
    states = [predictor.start(Body.standard(1)) for predictor in predictors]
    took: list[list[float]] = [[] for _ in predictors]
    began = time.perf_counter()
    for i in range(steps):
        time.sleep(max(began + i / 45.0 - time.perf_counter(), 0.0))
        # who goes first finds a cold cache: they take turns
        for k in np.roll(np.arange(len(predictors)), i).tolist():
            states[k], ms = _timed(predictors[k], states[k], _frame(i, 1))
            took[k].append(ms)
    return [np.array(ms[steps // 10 :]) for ms in took]


def _back_to_back(predictors: Sequence[Predictor], steps: int) -> list[Array]:
    states = [predictor.start(Body.standard(MANY)) for predictor in predictors]
    took: list[list[float]] = [[] for _ in predictors]
    for i in range(steps):
        for k, predictor in enumerate(predictors):
            states[k], ms = _timed(predictor, states[k], _frame(i, MANY))
            took[k].append(ms)
    return [np.array(ms[steps // 10 :]) for ms in took]


def _timed(predictor: Predictor, state: State, frame: Frame) -> tuple[State, float]:
    began = time.perf_counter()
    state, _ = predictor.step(state, frame)
    return state, 1e3 * (time.perf_counter() - began)


def _frame(i: int, n: int) -> Frame:
    """People who sway and turn, each in their own way."""
    phase = 0.05 * i + np.arange(n)
    turn = np.stack([0.1 * np.sin(phase), 0.3 * np.sin(0.3 * phase), 0.1 * np.cos(phase)], axis=1)
    R_local = from_rotation_vector(np.repeat(turn[:, None], 22, axis=1))
    p, R = forward_kinematics(R_local, np.stack([0 * phase, 0.97 + 0 * phase, 0.1 * phase], 1))
    valid = np.ones((n, len(FOUR_POINTS)), dtype=np.bool_)
    return Frame(i / 45.0, FOUR_POINTS, p[:, _JOINTS], R[:, _JOINTS], valid, valid)


def _rows(
    args: argparse.Namespace,
    predictors: Sequence[Predictor],
    paced: Sequence[Array],
    many: Sequence[Array],
) -> list[str]:
    rows = [
        "| | parameters | one person, ms, p50 / p99 | of the other "
        "| 256 people, us a person, p50 |",
        "|---|---|---|---|---|",
    ]
    names = (args.predictor, args.against)
    for k, name in enumerate(names):
        p50, p99 = np.percentile(paced[k], [50, 99])
        ratio = p50 / np.median(paced[1])
        each = 1e3 * np.median(many[k]) / MANY
        parameters = predictors[k].card.details.get("parameters", 0)
        rows.append(
            f"| {name} | {parameters:,} | {p50:.3f} / {p99:.3f} | {ratio:.2f} | {each:.1f} |"
        )
    return rows


def _head(args: argparse.Namespace) -> str:
    date = datetime.datetime.now(tz=datetime.UTC).date()
    return f"""{TITLE}

`python tools/step_cost.py --seconds {args.seconds:g}`, {date}: a step's features, network and
rotations, paced at 45 Hz, one thread of a shared two-core machine. Features and rotations are the
same for both; of the networks alone see Error against cost.
"""


if __name__ == "__main__":
    raise SystemExit(main())
