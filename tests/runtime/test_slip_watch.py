"""A tracker that slips in the middle of a session."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from support.calibrations import calibrated
from support.made_logs import QUIET

from lobstr_hw.calibration import Calibration
from lobstr_hw.motion import Motion
from lobstr_hw.poses import Pose
from lobstr_hw.rotations import from_rotation_vector
from lobstr_hw.runtime.slip_watch import EVERY_S, LOOKS, SlipWatch
from lobstr_hw.simulation import (
    PoseDeviation,
    SimulatedTake,
    SimulatedUser,
    Sway,
    simulate,
    take_samples,
)
from lobstr_hw.simulation.mishaps import arms_off_level, seated
from lobstr_hw.simulation.t_pose import t_pose_motion
from lobstr_hw.trackers import TrackerRole, TrackerSample

SEED = 3
TURN_S = 1.0 / 45.0


def at_ease(seconds: float, pelvis: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Motion:
    """Somebody who stands with hanging arms."""
    rng = np.random.default_rng(SEED)
    deviation = replace(PoseDeviation.drawn(rng, np.deg2rad(4.0)), pelvis=np.array(pelvis))
    return t_pose_motion(seconds, 45.0, arms_off_level(deviation, (-1.2, -1.2)), Sway(), rng)


def take_of(motion: Motion, user: SimulatedUser | None = None) -> SimulatedTake:
    return simulate(motion, SEED, rate_hz=45.0, user=user, t_pose_s=0.0, errors=QUIET)


def strapped(user: SimulatedUser, shift: Iterable[float], turn: Iterable[float]) -> SimulatedUser:
    """The pelvis tracker elsewhere."""
    T = user.mounts[TrackerRole.PELVIS]
    R = from_rotation_vector(np.array(list(turn)))
    moved = Pose(R @ T.R, T.p + np.array(list(shift)))
    return replace(user, mounts={**user.mounts, TrackerRole.PELVIS: moved})


@pytest.fixture(scope="module")
def whole() -> SimulatedTake:
    return simulate(at_ease(1.0), SEED, errors=QUIET, pose_deviation_deg=3.0)


@pytest.fixture(scope="module")
def profile(whole: SimulatedTake) -> Calibration:
    return calibrated(whole)


def watched(
    watch: SlipWatch, samples: Iterable[TrackerSample], profile: Calibration
) -> Iterator[tuple[float, str]]:
    """When what was said."""
    given = list(samples)
    times = np.arange(0.0, given[-1].time_s, TURN_S).tolist()
    i = 0
    for before, now_s in pairwise(times):
        assert before < now_s
        begin = i
        while i < len(given) and given[i].time_s <= now_s:
            i += 1
        yield from ((now_s, s.text) for s in watch.add(now_s, given[begin:i], profile))


@pytest.mark.parametrize(
    ("shift", "turn", "what"),
    [
        ((0.0, -0.06, 0.0), (0.0, 0.0, 0.0), "pelvis tracker may have slipped"),
        ((0.0, 0.0, 0.0), (0.4, 0.0, 0.0), "pelvis tracker may have slipped"),
        ((0.06, 0.0, -0.02), (0.0, 0.6, 0.0), "pelvis tracker may have slipped"),
    ],
)
def test_a_slipped_tracker_is_told_once(
    whole: SimulatedTake,
    profile: Calibration,
    shift: tuple[float, ...],
    turn: tuple[float, ...],
    what: str,
) -> None:
    take = take_of(at_ease(32.0), strapped(whole.user, shift, turn))
    said = list(watched(SlipWatch(), take_samples(take), profile))
    assert len(said) == 1
    assert what in said[0][1]
    least_s = min(LOOKS.values()) * EVERY_S - EVERY_S
    assert said[0][0] >= least_s, "one look is not enough"


def test_nothing_is_said_while_all_is_well(whole: SimulatedTake, profile: Calibration) -> None:
    take = take_of(at_ease(30.0), whole.user)
    assert list(watched(SlipWatch(), take_samples(take), profile)) == []


def test_who_sits_or_bows_is_not_judged(whole: SimulatedTake, profile: Calibration) -> None:
    for motion in (seated(at_ease(15.0), 0.6), at_ease(15.0, (0.5, 0.0, 0.0))):
        low = replace(motion, p_hips=motion.p_hips - [0.0, 0.08, 0.0])
        assert list(watched(SlipWatch(), take_samples(take_of(low, whole.user)), profile)) == []


def test_one_look_that_is_right_begins_the_count_anew(
    whole: SimulatedTake, profile: Calibration
) -> None:
    slipped = strapped(whole.user, (0.0, -0.06, 0.0), (0.0, 0.0, 0.0))
    wrong = list(take_samples(take_of(at_ease(24.0), slipped)))
    right = list(take_samples(take_of(at_ease(24.0), whole.user)))
    # every third look falls on a moment in which all is right
    mixed = [(right if int(a.time_s / EVERY_S) % 3 == 0 else wrong)[i] for i, a in enumerate(wrong)]
    assert list(watched(SlipWatch(), mixed, profile)) == []


def test_a_warning_of_one_thing_hides_no_other(whole: SimulatedTake, profile: Calibration) -> None:
    low = take_of(at_ease(14.0), strapped(whole.user, (0.0, -0.06, 0.0), (0.0, 0.0, 0.0)))
    turned = take_of(at_ease(40.0), strapped(whole.user, (0.0, 0.0, 0.0), (0.0, 0.6, 0.0)))
    samples = list(take_samples(low))
    samples += [replace(s, time_s=s.time_s + 14.0) for s in take_samples(turned)]
    said = [text for _, text in watched(SlipWatch(), samples, profile)]
    assert len(said) == len(set(said)) == 2
    assert "look straight ahead" in said[1]


def test_after_another_calibration_all_is_watched_anew(
    whole: SimulatedTake, profile: Calibration
) -> None:
    slipped = strapped(whole.user, (0.0, -0.06, 0.0), (0.0, 0.0, 0.0))
    samples = list(take_samples(take_of(at_ease(12.0), slipped)))
    watch = SlipWatch()
    assert len(list(watched(watch, samples, profile))) == 1
    later = [replace(s, time_s=s.time_s + 12.0) for s in samples]
    again = replace(profile, floor_m=profile.floor_m)
    assert len(list(watched(watch, samples + later, profile))) == 0, "not twice"
    later = [replace(s, time_s=s.time_s + 24.0) for s in samples]
    assert len(list(watched(watch, samples + later, again))) == 1
