"""Training of the network for recordings: what is scored, that it learns, and survives a kill."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from support.motions import walking

from lobstr_hw.errors import ModelError
from lobstr_hw.features import clip_features, clip_points
from lobstr_hw.lower_body import pose_6d, pose_from_6d
from lobstr_hw.predictors.two_way import load_two_way
from lobstr_hw.rotations import rotation_x
from lobstr_hw.training.config import (
    CarriedSettings,
    TrainingConfig,
    recipe_config,
    write_config,
)
from lobstr_hw.training.dataset import Clips, save_clips, statistics

if TYPE_CHECKING:
    from lobstr_hw.training.checkpoint import Run

torch = pytest.importorskip("torch", reason="pip install torch==2.13.0 'lobstr-hw[train]'")
pytestmark = pytest.mark.torch

SMALL = recipe_config(
    "two-way",
    steps=12,
    batch=4,
    window=60,
    hidden_size=16,
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


def test_it_learns_and_scores_whole_clips(clips: Clips) -> None:
    run = trained(clips, replace(SMALL, steps=60, hidden_size=32))
    total = np.array(run.curve)[:, 1]
    assert total[-10:].mean() < 0.6 * total[:5].mean()
    assert [row[0] for row in run.validation] == [float(s) for s in range(5, 61, 5)]
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


def test_a_killed_run_that_goes_on_ends_with_the_same_bits(clips: Clips, tmp_path: Path) -> None:
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
    assert run.curve == whole.curve
    assert run.validation == whole.validation
    pairs = zip(run.network.state_dict().values(), whole.network.state_dict().values(), strict=True)
    assert all(torch.equal(a, b) for a, b in pairs)
    assert run.best is not None and whole.best is not None
    assert all(torch.equal(run.best[name], whole.best[name]) for name in whole.best)


def test_inner_ends_are_not_scored_and_some_ends_are(clips: Clips) -> None:
    from lobstr_hw.training.two_way import counted_frames

    settings, frames = SMALL.two_way, 120
    counted = counted_frames(4000, frames, settings, np.random.default_rng(3))
    inside = slice(settings.margin, frames - settings.margin)
    assert counted[:, inside].all()
    assert not counted[:, : settings.end_margin].any()
    assert not counted[:, frames - settings.end_margin :].any()
    for edge in (settings.end_margin, frames - 1 - settings.end_margin):
        assert counted[:, edge].mean() == pytest.approx(settings.end_share, abs=0.03)
    both = counted[:, settings.end_margin] * counted[:, frames - 1 - settings.end_margin]
    assert both.mean() == pytest.approx(settings.end_share**2, abs=0.02), "each end by itself"


@pytest.mark.parametrize("precision", ["bf16", "fp32"])
def test_what_is_trained_is_what_the_network_says(clips: Clips, precision: str) -> None:
    """The fast recurrence of bfloat16 products differs by their rounding only."""
    from lobstr_hw.training.checkpoint import new_run
    from lobstr_hw.training.recurrence import run_gru_both_ways

    network = new_run(SMALL, statistics(clips, SMALL)).network
    z = torch.randn(3, 60, 37, generator=torch.Generator().manual_seed(2))
    kind = {"bf16": torch.bfloat16, "fp32": torch.float32}[precision]
    gru = network.encoder
    assert isinstance(gru, torch.nn.GRU)
    with torch.no_grad():
        fast = network.heads(run_gru_both_ways(gru, z, kind))
        plain = network(z, last_only=False)[:2]
    for a, b in zip(fast, plain, strict=True):
        assert float((a - b).abs().max()) < {"bf16": 5e-3, "fp32": 1e-6}[precision]


def test_validation_is_in_chunks_with_the_mirror_image_as_recordings_are(
    exported: tuple["Run", Path], clips: Clips
) -> None:
    from lobstr_hw.training.two_way import InChunks

    run, path = exported
    p, R = (a[: clips.start[1]].astype(np.float64) for a in (clips.p, clips.R))
    points = clip_points(np.concatenate([p, p[::-1]]), np.concatenate([R, R[::-1]]))
    assert len(points.p) > 2 * 120
    x = clip_features(points).astype(np.float32)
    z = torch.from_numpy((x - run.stats.input_mean) / run.stats.input_scale)
    with torch.no_grad():
        pose, logits, _ = InChunks(run.network).eval()(z[None])
    said, said_logits = load_two_way(path).say(points)
    np.testing.assert_allclose(said, pose[0].numpy(), atol=2e-3)
    np.testing.assert_allclose(said_logits, logits[0].numpy(), atol=2e-3)


def test_only_feet_that_stand_pay_for_being_planted() -> None:
    from lobstr_hw.training.carried_losses import ChunkTargets
    from lobstr_hw.training.two_way import planted_term

    rng = np.random.default_rng(5)
    joints = np.broadcast_to(np.eye(3), (10, 2, 4, 3, 3)).copy()
    wrong = joints.copy()
    wrong[:, 0, 1] = rotation_x(0.2 * rng.standard_normal(10))  # the left thigh shakes
    said, true = (torch.from_numpy(pose_6d(j).astype(np.float32))[None] for j in (wrong, joints))

    def cost(left: int, right: int, counted: float = 1.0) -> float:
        contact = torch.tensor([left, right]).expand(1, 10, 2)
        truth = ChunkTargets(true, contact, torch.zeros(1, 10), torch.full((1, 10), counted))
        return float(planted_term(said, truth))

    assert cost(1, 0) > 0.01
    assert cost(0, 1) == pytest.approx(0.0, abs=1e-5)
    assert cost(1, 1) == pytest.approx(0.5 * cost(1, 0), rel=1e-3)
    assert cost(1, 1, counted=0.0) == 0.0


@pytest.mark.parametrize(
    "change",
    [
        {"carried": CarriedSettings(mean_chunks=3.0)},
        {"mirror_mean": True},
    ],
)
def test_settings_that_do_not_go_with_it_are_refused_before_the_training(
    change: dict[str, Any],
) -> None:
    with pytest.raises(ModelError, match=next(iter(change))):
        replace(SMALL, **change)


@pytest.fixture(scope="module")
def exported(clips: Clips, tmp_path_factory: pytest.TempPathFactory) -> tuple["Run", Path]:
    from lobstr_hw.training.checkpoint import save_checkpoint
    from lobstr_hw.training.shipping import export_run

    pytest.importorskip("onnx", reason="pip install 'lobstr-hw[train]'")
    folder = tmp_path_factory.mktemp("run")
    run = trained(clips, SMALL)
    write_config(folder / "config.json", SMALL)
    save_checkpoint(folder / "checkpoint.pt", run)
    (folder / "data.json").write_text(json.dumps({"minutes_by_set": {}}), encoding="utf-8")
    export_run(folder, folder / "net.onnx")
    assert run.best is not None
    run.network.load_state_dict(run.best)
    return run, folder / "net.onnx"


def test_the_exported_graph_says_what_the_network_says(
    exported: tuple["Run", Path], clips: Clips
) -> None:
    """A clip and its mirror image, averaged: to what float16 costs."""
    run, path = exported
    two_way = load_two_way(path)
    assert two_way.card.name == "lobstr-two-way"
    assert two_way.card.details["recipe"] == "two-way"
    p, R = (a[: clips.start[1]].astype(np.float64) for a in (clips.p, clips.R))
    points = clip_points(p, R)
    x = clip_features(points)
    z = torch.from_numpy((x.astype(np.float32) - run.stats.input_mean) / run.stats.input_scale)
    run.network.eval()
    with torch.no_grad():
        pose, logits, _ = run.network(z[None], last_only=False)
    said, said_logits = two_way.forward(x)
    np.testing.assert_allclose(said, pose[0].numpy(), atol=2e-3)
    np.testing.assert_allclose(said_logits, logits[0].numpy(), atol=2e-3)
    assert np.isfinite(pose_from_6d(two_way.say(points)[0])).all()
