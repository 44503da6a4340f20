"""A run: it learns, it survives a kill, and what is exported is what was trained."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from support.motions import walking

from lobstr_hw.errors import ModelError
from lobstr_hw.predictors import load_predictor
from lobstr_hw.training.config import TrainingConfig, write_config
from lobstr_hw.training.dataset import Clips, save_clips, statistics

if TYPE_CHECKING:
    from lobstr_hw.training.checkpoint import Run

torch = pytest.importorskip("torch", reason="pip install torch==2.13.0 'lobstr-hw[train]'")
pytestmark = pytest.mark.torch

SMALL = TrainingConfig(
    steps=12,
    batch=8,
    window=10,
    hidden_size=16,
    validation_windows=16,
    validate_every=5,
    checkpoint_every=4,
)


@pytest.fixture(scope="module")
def clips() -> Clips:
    return Clips.of(replace(walking(2.0, seed=i), name=f"set/{i}") for i in range(3))


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


def test_the_loss_falls_and_validation_is_kept_at_its_steps(clips: Clips) -> None:
    config = replace(SMALL, steps=80, batch=32, hidden_size=32)
    run = trained(clips, config)
    total = np.array(run.curve)[:, 1]
    assert total[-10:].mean() < 0.6 * total[:5].mean()
    assert [row[0] for row in run.validation] == [float(s) for s in range(5, 81, 5)]
    assert run.validation[-1][1] < run.validation[0][1]


def test_the_learning_rate_decays_each_step(clips: Clips) -> None:
    run = trained(clips, SMALL)
    rates = np.array(run.curve)[:, -1]
    assert rates[0] == pytest.approx(1e-3)
    assert rates[1:] / rates[:-1] == pytest.approx(np.full(11, 0.999))


def test_the_same_seed_gives_the_same_weights_and_another_does_not(clips: Clips) -> None:
    a, b = trained(clips, SMALL), trained(clips, SMALL)
    assert same_weights(a, b)
    assert a.curve == b.curve
    assert not same_weights(a, trained(clips, replace(SMALL, seed=2)))


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
    if run.step == 7:
        os._exit(9)  # gone, like after a kill: nothing is cleaned up
"""


def test_a_killed_run_that_goes_on_ends_like_one_that_never_stopped(
    clips: Clips, tmp_path: Path
) -> None:
    from lobstr_hw.training.checkpoint import load_checkpoint
    from lobstr_hw.training.loop import train

    write_config(tmp_path / "config.json", SMALL)
    save_clips(tmp_path / "clips.npz", clips)
    killed = subprocess.run([sys.executable, "-c", KILLED, str(tmp_path)], check=False)
    assert killed.returncode == 9
    run = load_checkpoint(tmp_path / "checkpoint.pt", SMALL)
    assert run.step == 4
    for _ in train(run, clips, clips, SMALL):
        pass
    whole = trained(clips, SMALL)
    assert same_weights(run, whole)
    assert run.curve == whole.curve
    assert run.validation == whole.validation


def test_a_checkpoint_is_replaced_whole(clips: Clips, tmp_path: Path) -> None:
    """A write that was cut off leaves the old file as it is."""
    from lobstr_hw.training.checkpoint import load_checkpoint, save_checkpoint

    run = trained(clips, replace(SMALL, steps=4))
    save_checkpoint(tmp_path / "checkpoint.pt", run)
    (tmp_path / "checkpoint.partial").write_bytes(b"cut")
    assert load_checkpoint(tmp_path / "checkpoint.pt", SMALL).step == 4


def test_what_is_no_checkpoint_of_this_configuration_is_refused(
    clips: Clips, tmp_path: Path
) -> None:
    from lobstr_hw.training.checkpoint import load_checkpoint, save_checkpoint

    path = tmp_path / "checkpoint.pt"
    with pytest.raises(ModelError, match="without --resume"):
        load_checkpoint(path, SMALL)
    path.write_bytes(b"not a checkpoint")
    with pytest.raises(ModelError, match="not a checkpoint"):
        load_checkpoint(path, SMALL)
    save_checkpoint(path, trained(clips, replace(SMALL, steps=1)))
    with pytest.raises(ModelError, match="not a checkpoint of this configuration"):
        load_checkpoint(path, replace(SMALL, hidden_size=32))


def export(clips: Clips, folder: Path) -> Path:
    from lobstr_hw.training.checkpoint import save_checkpoint
    from lobstr_hw.training.shipping import export_run

    write_config(folder / "config.json", SMALL)
    save_checkpoint(folder / "checkpoint.pt", trained(clips, SMALL))
    data = {"split": "made", "minutes_by_set": {"snu_ys2010": 1.0, "mine": 1.0}}
    (folder / "data.json").write_text(json.dumps(data), encoding="utf-8")
    (folder / "scores.json").write_text(json.dumps({"all": {"network": 1}}), encoding="utf-8")
    export_run(folder, folder / "net.onnx", {"test": folder / "scores.json"})
    return folder / "net.onnx"


def test_the_exported_file_says_what_the_network_says(clips: Clips, tmp_path: Path) -> None:
    from lobstr_hw.training.checkpoint import load_checkpoint
    from lobstr_hw.training.export import measure_export

    pytest.importorskip("onnx", reason="pip install 'lobstr-hw[train]'")
    path = export(clips, tmp_path)
    run = load_checkpoint(tmp_path / "checkpoint.pt", SMALL)
    error = measure_export(run.network, path)
    assert 0.0 < error.pose < 2e-3
    assert error.hidden < 2e-3


def test_the_exported_files_are_a_predictor_with_the_runs_story(
    clips: Clips, tmp_path: Path
) -> None:
    pytest.importorskip("onnx", reason="pip install 'lobstr-hw[train]'")
    card = load_predictor(str(export(clips, tmp_path))).card
    assert card.details["steps_done"] == 12
    assert card.details["configuration"]["seed"] == SMALL.seed
    assert card.details["data"]["split"] == "made"
    assert "Apache-2.0" in card.details["licences"]["snu_ys2010"]
    assert card.details["licences"]["mine"] == "not known to this project"
    assert card.details["metrics"] == {"test": {"network": 1}}
    assert card.details["float16_storage_error"]["pose"] > 0.0


def test_sixteen_bit_products_train_too(clips: Clips) -> None:
    run = trained(clips, replace(SMALL, precision="bf16"))
    assert np.isfinite(np.array(run.curve)).all()
    assert all(p.dtype == torch.float32 for p in run.network.parameters())
