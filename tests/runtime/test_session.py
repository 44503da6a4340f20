from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest

from lobstr_hw.calibration import Calibration, TPoseDetector, calibrate_t_pose
from lobstr_hw.predictors import Frame, Prediction, Predictor, State
from lobstr_hw.predictors.trivial import ConstantPose, standing
from lobstr_hw.rotations import Array
from lobstr_hw.runtime.feed import Feed
from lobstr_hw.runtime.roles import RoleTable
from lobstr_hw.runtime.session import Session
from lobstr_hw.runtime.ticks import Grid, Tick
from lobstr_hw.simulation import SimulatedTake, take_samples
from lobstr_hw.skeleton import Body, Joint
from lobstr_hw.skeleton_pose import SkeletonPose, Source
from lobstr_hw.trackers import FOUR_POINTS, TrackerRole, TrackerSample

RATE_HZ = 45.0


@dataclass(frozen=True)
class Stumbling:
    """Stands, but says NaN at some of its steps."""

    inner: ConstantPose
    bad_steps: tuple[int, ...]

    @property
    def card(self) -> object:
        return self.inner.card

    def start(self, body: Body) -> State:
        return {**self.inner.start(body), "count": np.zeros(1, dtype=np.int64)}

    def step(self, state: State, frame: Frame) -> tuple[State, Prediction]:
        count = int(state["count"][0])
        _, said = self.inner.step(state, frame)
        if count in self.bad_steps:
            said = replace(said, R=np.full_like(said.R, np.nan))
        return {**state, "count": state["count"] + 1}, said

    def shift_world(self, state: State, T: Array) -> State:
        return state


@pytest.fixture(scope="module")
def calibration(take: SimulatedTake) -> Calibration:
    hints = {serial: role for role, serial in take.serials.items()}
    pose = TPoseDetector(hints).add(take_samples(take))
    assert pose is not None
    return calibrate_t_pose(pose)


def never(samples: Sequence[TrackerSample]) -> None:
    return None


def bodies(
    take: SimulatedTake, predictor: Predictor, calibration: Calibration, seconds: float = 1.0
) -> Iterator[tuple[Session, SkeletonPose]]:
    """A calibrated session, tick by tick."""
    session = Session(predictor, never, calibration, rate_hz=RATE_HZ, input_delay_s=0.01)
    feed = Feed(FOUR_POINTS, RoleTable(calibration.roles, lambda: ()))
    grid = Grid(RATE_HZ, RATE_HZ, 0.0)
    samples = list(take_samples(take))
    for k in range(round(seconds * RATE_HZ)):
        tick = Tick(k, k / RATE_HZ, grid.due(k))
        feed.add([s for s in samples if (k - 1) / RATE_HZ < s.time_s <= tick.time_s])
        yield session, session.step(tick, feed)


def test_a_pose_that_is_not_finite_never_leaves_and_good_ones_come_again(
    take: SimulatedTake, calibration: Calibration
) -> None:
    bad = Stumbling(standing(), (5,))
    shown = [(s.nonfinite_frames, pose) for s, pose in bodies(take, bad, calibration)]  # type: ignore[arg-type]
    assert all(np.isfinite(pose.p_world).all() for _, pose in shown)
    assert all(np.isfinite(pose.R_local).all() for _, pose in shown)
    assert [pose.time_s for _, pose in shown] == [k / RATE_HZ for k in range(len(shown))]
    counts = [count for count, _ in shown]
    first = next(k for k, count in enumerate(counts) if count)
    np.testing.assert_array_equal(shown[first][1].p_world, shown[first - 1][1].p_world)
    # the state before the bad step is kept, so the same step is bad again until it is given up
    given_up = round(0.2 * RATE_HZ)
    assert counts[first + given_up] == counts[first + given_up + 3] == given_up


def test_a_calibrated_user_whose_trackers_are_away_stands_in_the_own_size(
    take: SimulatedTake, calibration: Calibration
) -> None:
    session = Session(standing(), never, calibration, rate_hz=RATE_HZ, input_delay_s=0.01)
    feed = Feed(FOUR_POINTS, RoleTable(calibration.roles, lambda: ()))
    pose = session.step(Tick(0, 0.0, (-0.01,)), feed)
    assert (pose.source == Source.HELD).all()
    assert pose.p_world[0, Joint.HIPS, 1] == pytest.approx(1.0 / calibration.scale)
    assert {report.state for report in pose.roles.values()} == {"missing"}


def test_every_role_reports_its_age(take: SimulatedTake, calibration: Calibration) -> None:
    *_, (_, pose) = bodies(take, standing(), calibration)
    for role in FOUR_POINTS:
        assert pose.roles[role].state == "ok"
        assert 0.0 <= pose.roles[role].age_s < 1.0 / 90.0


def test_the_body_is_fixed_by_the_first_calibration(
    take: SimulatedTake, calibration: Calibration
) -> None:
    session = Session(standing(), lambda samples: calibration, rate_hz=RATE_HZ, input_delay_s=0.01)
    assert not session.calibrated
    np.testing.assert_array_equal(session.body.offsets, Body.standard().offsets)
    assert session.calibrate(())
    assert session.body is calibration.body
    assert not session.calibrate(())
    assert session.roles[take.serials[TrackerRole.PELVIS]] is TrackerRole.PELVIS
