"""The network for recordings: chunks join without a seam, and nobody takes it for a live one."""

import numpy as np
import pytest
from support.motions import walking

from lobstr_hw.errors import ModelError
from lobstr_hw.features import POINT_JOINTS, Points, clip_points
from lobstr_hw.lower_body import mirror_pose_6d, pose_from_6d, toes_in_reference
from lobstr_hw.predictors import SHIPPED_TWO_WAY, SHIPPED_WEIGHTS, load_predictor, two_way
from lobstr_hw.predictors.two_way import TwoWay, chunk_starts, chunk_weights, load_two_way
from lobstr_hw.rotations import Array
from lobstr_hw.skeleton import Joint


@pytest.fixture(scope="module")
def shipped() -> TwoWay:
    return load_two_way()


def points(duration_s: float, seed: int = 0, mirrored: bool = False) -> Points:
    p, R = walking(duration_s, seed=seed).joints()
    joints = list(POINT_JOINTS)
    if mirrored:
        swapped = {Joint.LEFT_HAND: Joint.RIGHT_HAND, Joint.RIGHT_HAND: Joint.LEFT_HAND}
        joints = [swapped.get(joint, joint) for joint in joints]
        S = np.diag([-1.0, 1.0, 1.0])
        p, R = p @ S, S @ R @ S
    return clip_points(p[:, joints], R[:, joints])


def toes(pose: Array) -> Array:
    return toes_in_reference(pose_from_6d(pose))


@pytest.mark.parametrize("frames", [2, 119, 120, 121, 140, 181, 1500, 5000])
def test_every_frame_is_covered_and_its_weights_add_up_to_one(frames: int) -> None:
    starts = chunk_starts(frames)
    length = min(frames, two_way.CHUNK)
    weights = chunk_weights(starts, length, frames)
    total = np.zeros(frames)
    for a, row in zip(starts, weights, strict=True):
        total[a : a + length] += row
        if a > 0:
            assert not row[: two_way.ALONE].any(), "an inner end knows one side only"
        if a + length < frames:
            assert not row[-two_way.ALONE :].any()
    np.testing.assert_allclose(total, 1.0, atol=1e-12)
    assert weights[0, 0] == weights[-1, -1] == 1.0, "the recording's own ends"


def test_weights_change_slowly_from_frame_to_frame() -> None:
    starts = chunk_starts(2000)
    steps = np.diff(chunk_weights(starts, two_way.CHUNK, 2000), axis=1)
    assert np.abs(steps).max() < 0.1


def test_joined_chunks_are_no_rougher_than_each_by_itself(shipped: TwoWay) -> None:
    recording = points(30.0)
    joined = toes(shipped.say(recording)[0])
    for order in (1, 2, 3):
        rough: list[Array] = []
        alone: list[Array] = []
        for a in chunk_starts(len(joined))[3:-3:4]:
            piece = recording.take(slice(a, a + two_way.CHUNK))
            inner = slice(two_way.ALONE, two_way.CHUNK - two_way.ALONE)
            one = toes(shipped.say(piece)[0])[inner]
            for kept, said in ((alone, one), (rough, joined[a : a + two_way.CHUNK][inner])):
                kept.append(np.linalg.norm(np.diff(said, n=order, axis=0), axis=-1))
        assert np.max(rough) < 1.1 * np.max(alone)
        assert np.mean(rough) < 1.05 * np.mean(alone)


def test_the_mirror_image_gets_the_mirrored_answer(shipped: TwoWay) -> None:
    pose, logits = shipped.say(points(3.0))
    mirrored, mirrored_logits = shipped.say(points(3.0, mirrored=True))
    np.testing.assert_allclose(mirrored, mirror_pose_6d(pose), atol=1e-4)
    np.testing.assert_allclose(mirrored_logits, logits[:, [2, 3, 0, 1]], atol=1e-3)


def test_the_same_recording_gives_the_same_bytes(shipped: TwoWay) -> None:
    first, again = (shipped.say(points(15.0, seed=2)) for _ in range(2))
    assert all(a.tobytes() == b.tobytes() for a, b in zip(first, again, strict=True))


def test_the_future_matters_and_the_far_future_does_not(shipped: TwoWay) -> None:
    recording = points(10.0)
    whole = toes(shipped.say(recording)[0])
    shorter = toes(shipped.say(recording.take(slice(300)))[0])
    difference = np.abs(whole[:300] - shorter).max(axis=(1, 2))
    assert difference[-5:].max() > 0.005
    assert difference[:100].max() < 0.5 * difference[-5:].max()


@pytest.mark.parametrize("spec", ["lobstr-two-way", str(SHIPPED_TWO_WAY)])
def test_as_a_live_predictor_it_is_refused_with_what_to_do(spec: str) -> None:
    with pytest.raises(ModelError, match=r"for recordings.*lobstr-log export LOG --bvh OUT --ref"):
        load_predictor(spec)


def test_a_live_network_is_no_network_for_recordings() -> None:
    with pytest.raises(ModelError, match="'lobstr' is a live network"):
        load_two_way(SHIPPED_WEIGHTS)


def test_missing_weights_are_told() -> None:
    with pytest.raises(ModelError, match="no such weights file"):
        load_two_way(SHIPPED_TWO_WAY.with_name("nobody.onnx"))
