import numpy as np
import pytest

from lobstr_hw.poses import PartialPose
from lobstr_hw.rotations import Array, from_rotation_vector, rotation_y
from lobstr_hw.runtime.gate import Gate
from lobstr_hw.trackers import TrackerRole, TrackerSample

HEAD, HAND, PELVIS = TrackerRole.HEAD, TrackerRole.LEFT_HAND, TrackerRole.PELVIS
RATE_HZ = 90.0


def sample(
    time_s: float, p: object = (0.1, 1.6, 0.2), R: Array | None = None, tracked: bool = True
) -> TrackerSample:
    position = None if p is None else np.array(p, dtype=np.float64)
    rotation = rotation_y(0.3) if R is None else R
    return TrackerSample("LHR-1", PartialPose(rotation, position), time_s, tracked)


def feed(gate: Gate, role: TrackerRole, samples: list[TrackerSample]) -> list[bool]:
    return [gate.judge(role, s).believed for s in samples]


def test_a_quick_but_human_motion_passes_untouched() -> None:
    gate = Gate()
    t = np.arange(0.0, 3.0, 1.0 / RATE_HZ)
    # a hand that swings half a metre five times a second: 15 m/s and 15 rad/s at the most
    swing = 0.5 * np.sin(2 * np.pi * 5.0 * t)
    turns = from_rotation_vector(np.outer(swing, [1.0, 0.2, 0.1]))
    samples = [sample(s, (x, 1.2, 0.3), R) for s, x, R in zip(t, swing, turns, strict=True)]
    assert all(feed(gate, HAND, samples))
    assert not gate.events


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_numbers_that_are_not_finite_never_pass(bad: float) -> None:
    gate = Gate()
    R = rotation_y(0.1)
    R[1, 2] = bad
    assert feed(gate, HEAD, [sample(0.0), sample(0.01, (0.1, bad, 0.2)), sample(0.02)]) == [
        True,
        False,
        True,
    ]
    assert not gate.judge(HEAD, sample(0.03, R=R)).believed
    assert gate.events == {"nonfinite": 2}


def test_the_pose_of_a_lost_device_and_what_is_no_rotation_never_pass() -> None:
    gate = Gate()
    assert gate.judge(HEAD, sample(0.0, (0, 0, 0), np.eye(3))).reason == "zero_pose"
    assert gate.judge(HEAD, sample(0.1, R=np.zeros((3, 3)))).reason == "not_a_rotation"
    assert gate.judge(HEAD, sample(0.2, R=np.diag([1.0, 1.0, -1.0]))).reason == "not_a_rotation"
    assert gate.judge(HEAD, sample(0.3, R=1.01 * rotation_y(0.3))).reason == "not_a_rotation"
    assert gate.judge(HEAD, sample(0.4, (0, 0, 0))).believed  # at the origin, but turned


def test_a_run_of_bad_samples_counts_once() -> None:
    gate = Gate()
    feed(gate, HEAD, [sample(i / RATE_HZ, tracked=False) for i in range(50)])
    feed(gate, HEAD, [sample(1.0 + i / RATE_HZ) for i in range(5)])
    feed(gate, HEAD, [sample(2.0 + i / RATE_HZ, tracked=False) for i in range(50)])
    assert gate.events == {"untracked": 2}


def test_one_jump_is_refused_and_the_old_place_goes_on() -> None:
    gate = Gate()
    samples = [sample(i / RATE_HZ) for i in range(5)]
    samples[3] = sample(3 / RATE_HZ, (1.5, 1.6, 0.2))
    assert feed(gate, HEAD, samples) == [True, True, True, False, True]
    assert gate.events == {"jump": 1}


def test_a_sudden_turn_is_refused() -> None:
    gate = Gate()
    turned = sample(1 / RATE_HZ, R=rotation_y(0.3 + 2.0))
    assert feed(gate, HEAD, [sample(0.0), turned, sample(2 / RATE_HZ)]) == [True, False, True]
    assert gate.events == {"spin": 1}


def test_a_new_place_is_believed_once_it_has_lasted() -> None:
    gate = Gate()
    assert gate.judge(HEAD, sample(0.0)).believed
    t = np.arange(0.01, 0.5, 1.0 / RATE_HZ)
    believed = feed(gate, HEAD, [sample(s, (3.0, 1.6, 0.2)) for s in t])
    first = t[believed.index(True)]
    assert 0.2 <= first - t[0] <= 0.2 + 1.5 / RATE_HZ
    assert all(believed[believed.index(True) :])


def test_a_place_that_keeps_jumping_is_never_believed() -> None:
    gate = Gate()
    gate.judge(HEAD, sample(0.0))
    rng = np.random.default_rng(4)
    wild = [sample(0.01 + i / 1000.0, rng.uniform(10, 20, 3) * (-1) ** i) for i in range(500)]
    assert not any(feed(gate, HEAD, wild))


def test_after_a_long_loss_a_far_place_is_believed_at_once() -> None:
    gate = Gate()
    gate.judge(HEAD, sample(0.0))
    feed(gate, HEAD, [sample(0.1 * i, tracked=False) for i in range(1, 30)])
    assert gate.judge(HEAD, sample(3.0, (2.0, 1.5, 1.0))).believed


def test_a_pelvis_out_of_reach_of_the_head_is_refused_while_the_head_is_fresh() -> None:
    gate = Gate()
    gate.judge(HEAD, sample(0.0))
    assert gate.judge(PELVIS, sample(0.0, (0.1, 0.9, 0.2))).believed
    other = Gate()
    other.judge(HEAD, sample(0.0))
    assert other.judge(PELVIS, sample(0.01, (1.5, 0.9, 0.2))).reason == "out_of_reach"
    assert other.judge(PELVIS, sample(5.0, (1.5, 0.9, 0.2))).believed


def test_a_tracker_without_position_is_judged_by_its_rotation() -> None:
    gate = Gate()
    still = [sample(i / RATE_HZ, None) for i in range(3)]
    assert all(feed(gate, PELVIS, still))
    assert gate.judge(PELVIS, sample(3 / RATE_HZ, None, rotation_y(2.5))).reason == "spin"


def test_roles_are_judged_apart() -> None:
    gate = Gate()
    gate.judge(HEAD, sample(0.0))
    assert gate.judge(HAND, sample(0.001, (3.0, 1.0, 3.0))).believed


def test_a_gap_in_the_position_does_not_forget_where_the_tracker_was() -> None:
    gate = Gate()
    gate.judge(HEAD, sample(0.0))
    assert gate.judge(HEAD, sample(1 / RATE_HZ, None)).believed
    assert gate.judge(HEAD, sample(2 / RATE_HZ, (4.0, 1.6, 0.2))).reason == "jump"
    assert gate.judge(HEAD, sample(3 / RATE_HZ)).believed


def test_a_place_that_nobody_can_be_in_never_passes() -> None:
    gate = Gate()
    far = [sample(i / RATE_HZ, (1e300, 0.0, 0.0)) for i in range(100)]
    assert not any(feed(gate, HEAD, far))
    assert gate.events == {"too_far": 1}
