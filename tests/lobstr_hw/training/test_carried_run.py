"""Carried training: its losses, its state, and that it survives a kill."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from support.motions import walking

from lobstr_hw.features import reference_frames
from lobstr_hw.lower_body import pose_6d, toes_in_reference, true_lower_body
from lobstr_hw.predictors import load_predictor
from lobstr_hw.rotations import heading_angle, rotation_x
from lobstr_hw.skeleton import Joint
from lobstr_hw.training.config import (
    LossWeights,
    TrainingConfig,
    read_config,
    recipe_config,
    write_config,
)
from lobstr_hw.training.dataset import Clips, save_clips, statistics

if TYPE_CHECKING:
    from lobstr_hw.training.checkpoint import Run

torch = pytest.importorskip("torch", reason="pip install torch==2.13.0 'lobstr-hw[train]'")
pytestmark = pytest.mark.torch

SMALL = recipe_config(
    "carried",
    steps=12,
    batch=4,
    window=15,
    hidden_size=16,
    precision="fp32",
    average=0.0,
    mirror_mean=False,
    validate_every=5,
    checkpoint_every=4,
)


@pytest.fixture(scope="module")
def clips() -> Clips:
    return Clips.of(replace(walking(3.0, seed=i), name=f"set/{i}") for i in range(3))


def trained(clips: Clips, config: TrainingConfig) -> "Run":
    from lobstr_hw.training.checkpoint import new_run
    from lobstr_hw.training.loop import train

    run = new_run(config, statistics(clips, config))
    for _ in train(run, clips, clips, config):
        pass
    return run


def same_weights(a: "Run", b: "Run") -> bool:
    pairs = zip(a.network.state_dict().values(), b.network.state_dict().values(), strict=True)
    return all(torch.equal(x, y) for x, y in pairs)


def test_a_carried_run_learns_and_scores_whole_clips(clips: Clips) -> None:
    run = trained(clips, replace(SMALL, steps=80, batch=8, hidden_size=32))
    total = np.array(run.curve)[:, 1]
    assert total[-10:].mean() < 0.6 * total[:5].mean()
    assert [row[0] for row in run.validation] == [float(s) for s in range(5, 81, 5)]
    assert all(len(row) == 6 for row in run.validation)
    assert run.validation[-1][1] < 0.7 * run.validation[0][1]


KILLED = """
import os, sys
from pathlib import Path
from lobstr_hw.training.checkpoint import new_run, save_checkpoint
from lobstr_hw.training.config import read_config
from lobstr_hw.training.dataset import load_clips, statistics
from lobstr_hw.training.loop import train

folder = Path(sys.argv[1])
config, clips = read_config(folder / "config.json"), load_clips(folder / "clips.npz")
run = new_run(config, statistics(clips, config))
for run in train(run, clips, clips, config):
    if run.step % config.checkpoint_every == 0:
        save_checkpoint(folder / "checkpoint.pt", run)
    if run.step == 11:
        os._exit(9)  # gone, like after a kill: nothing is cleaned up
"""


def test_a_killed_carried_run_goes_on_with_state_streams_and_best_weights(
    clips: Clips, tmp_path: Path
) -> None:
    from lobstr_hw.training.checkpoint import load_checkpoint
    from lobstr_hw.training.loop import train

    write_config(tmp_path / "config.json", SMALL)
    save_clips(tmp_path / "clips.npz", clips)
    killed = subprocess.run([sys.executable, "-c", KILLED, str(tmp_path)], check=False)
    assert killed.returncode == 9
    run = load_checkpoint(tmp_path / "checkpoint.pt", SMALL)
    assert run.step == 8
    for _ in train(run, clips, clips, SMALL):
        pass
    whole = trained(clips, SMALL)
    assert same_weights(run, whole)
    assert run.curve == whole.curve
    assert run.validation == whole.validation
    assert run.carried is not None and whole.carried is not None
    assert torch.equal(run.carried.hidden, whole.carried.hidden)
    assert run.best is not None and whole.best is not None
    assert all(torch.equal(run.best[name], whole.best[name]) for name in whole.best)


def test_the_state_goes_on_from_chunk_to_chunk_and_is_zero_where_an_episode_begins(
    clips: Clips,
) -> None:
    """Without learning, chunk by chunk is the same as the episodes in one go."""
    from lobstr_hw.training.checkpoint import new_run
    from lobstr_hw.training.episodes import EpisodeSource
    from lobstr_hw.training.loop import train
    from lobstr_hw.training.streams import Position, Streams

    own_hands = replace(SMALL.carried, borrowed_hands=0.0)
    config = replace(SMALL, learning_rate=0.0, carried=own_hands)
    run = new_run(config, statistics(clips, config))
    streams = Streams(EpisodeSource(clips, config), config, Position.start(config.batch))
    whole = torch.zeros(1, config.batch, config.hidden_size)
    for _ in train(run, clips, None, config):
        chunk = streams.next_chunk()
        whole[:, torch.from_numpy(chunk.first)] = 0.0
        z = torch.from_numpy((chunk.x - run.stats.input_mean) / run.stats.input_scale)
        with torch.no_grad():
            whole = run.network(z, whole)[2]
        assert run.carried is not None
        assert torch.allclose(run.carried.hidden, whole, atol=1e-5)


def test_the_truth_costs_nothing_and_a_constant_error_costs_no_velocity() -> None:
    from lobstr_hw.training.carried_losses import ChunkTargets, carried_losses

    walk = walking(1.0, turn_rad_s=0.0)
    R_ref = reference_frames(walk.R_local[:, Joint.HIPS])
    joints = true_lower_body(walk.R_local, R_ref)
    still = np.repeat(joints[:1], len(joints), axis=0)
    tipped = still.copy()
    tipped[:, 0, 1] = tipped[:, 0, 1] @ rotation_x(0.2)

    def terms(said: np.ndarray, true: np.ndarray, yaw: np.ndarray) -> list[float]:
        as_batch = [torch.from_numpy(pose_6d(j).astype(np.float32))[None] for j in (said, true)]
        frames = len(joints)
        truth = ChunkTargets(
            as_batch[1],
            torch.zeros(1, frames, 2, dtype=torch.int64),
            torch.from_numpy(yaw.astype(np.float32))[None],
            torch.ones(1, frames),
        )
        logits = torch.zeros(1, frames, 4)
        out = carried_losses(as_batch[0], logits, truth, LossWeights(1.0, 1.0, 1.0, 1.0))
        return [float(v) for v in (out.pose, out.toe, out.velocity)]

    yaw = heading_angle(R_ref)[0]
    assert terms(joints, joints, yaw) == pytest.approx([0.0, 0.0, 0.0], abs=1e-4)
    straight = np.zeros(len(joints))
    pose, toe, velocity = terms(tipped, still, straight)
    assert pose > 0.001 and toe > 0.01
    assert velocity == pytest.approx(0.0, abs=1e-5)
    # the same error of someone who turns sweeps through the world
    assert terms(tipped, still, np.linspace(0.0, 3.0, len(joints)))[2] > 0.001
    # and the velocity term is the true one: metres per step in the world
    moving = toes_in_reference(joints) - toes_in_reference(still)
    expected = np.linalg.norm(np.diff(moving, axis=0), axis=-1).mean()
    assert terms(joints, still, straight)[2] == pytest.approx(expected, rel=1e-3)


def test_frames_that_do_not_count_have_no_gradient() -> None:
    from lobstr_hw.training.carried_losses import ChunkTargets, carried_losses

    torch.manual_seed(0)
    pose = torch.randn(2, 8, 48, requires_grad=True)
    logits = torch.randn(2, 8, 4, requires_grad=True)
    counted = torch.ones(2, 8)
    counted[0, :3] = 0.0
    truth = ChunkTargets(
        torch.randn(2, 8, 48), torch.ones(2, 8, 2, dtype=torch.int64), torch.zeros(2, 8), counted
    )
    total = carried_losses(pose, logits, truth, LossWeights(velocity=0.0, contact=1.0)).total
    for gradient in torch.autograd.grad(total, (pose, logits)):
        moved = gradient.abs().sum(-1) > 0.0
        assert (moved == (counted > 0.0)).all()


def test_the_leg_points_are_those_of_the_ground_floor() -> None:
    from lobstr_hw.training.kinematics import leg_points_in_reference

    walk = walking(1.0)
    p, _ = walk.joints()
    R_ref = reference_frames(walk.R_local[:, Joint.HIPS])
    pose = pose_6d(true_lower_body(walk.R_local, R_ref)).astype(np.float32)
    points = leg_points_in_reference(torch.from_numpy(pose)).numpy()
    below = [
        [Joint.LEFT_LOWER_LEG, Joint.LEFT_FOOT, Joint.LEFT_TOES],
        [Joint.RIGHT_LOWER_LEG, Joint.RIGHT_FOOT, Joint.RIGHT_TOES],
    ]
    in_world = walk.p_hips[:, None, None] + (R_ref[:, None, None] @ points[..., None])[..., 0]
    assert in_world == pytest.approx(p[:, np.array(below)], abs=1e-5)


def test_the_best_weights_are_exported_with_the_recipe_on_the_card(
    clips: Clips, tmp_path: Path
) -> None:
    from lobstr_hw.training.checkpoint import save_checkpoint
    from lobstr_hw.training.export import measure_export
    from lobstr_hw.training.shipping import export_run

    pytest.importorskip("onnx", reason="pip install 'lobstr-hw[train]'")
    run = trained(clips, SMALL)
    assert run.best is not None
    run.best = {name: value + 0.01 for name, value in run.best.items()}
    write_config(tmp_path / "config.json", SMALL)
    save_checkpoint(tmp_path / "checkpoint.pt", run)
    (tmp_path / "data.json").write_text(json.dumps({"minutes_by_set": {}}), encoding="utf-8")
    export_run(tmp_path, tmp_path / "net.onnx")
    assert measure_export(run.network, tmp_path / "net.onnx").pose > 5e-3
    run.network.load_state_dict(run.best)
    assert measure_export(run.network, tmp_path / "net.onnx").pose < 2e-3
    card = load_predictor(str(tmp_path / "net.onnx")).card
    assert card.name == "lobstr"
    assert card.details["recipe"] == "carried"
    best = min(run.validation, key=lambda row: row[1])
    assert card.details["validation"]["step"] == best[0]
    assert card.details["validation"]["toe_cm"] == pytest.approx(best[1], abs=1e-3)


def test_a_recipe_written_and_read_is_the_same(tmp_path: Path) -> None:
    write_config(tmp_path / "config.json", SMALL)
    assert read_config(tmp_path / "config.json") == SMALL
    document = json.loads((tmp_path / "config.json").read_text(encoding="utf-8"))
    del document["recipe"], document["carried"]
    (tmp_path / "older.json").write_text(json.dumps(document), encoding="utf-8")
    assert read_config(tmp_path / "older.json").recipe == "paper"
