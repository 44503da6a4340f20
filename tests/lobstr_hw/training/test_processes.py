"""Training in several processes, as torchrun starts them."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from support.motions import walking

from lobstr_hw.bvh_writer import write_bvh
from lobstr_hw.errors import ModelError
from lobstr_hw.runtime.commands.train import main
from lobstr_hw.splits import PARTS
from lobstr_hw.training.config import TrainingConfig, read_config, recipe_config, write_config
from lobstr_hw.training.dataset import Clips, save_clips, statistics

if TYPE_CHECKING:
    from torch import Tensor

torch = pytest.importorskip("torch", reason="pip install torch==2.13.0 'lobstr-hw[train]'")
pytestmark = pytest.mark.torch

SMALL = TrainingConfig(steps=2, batch=8, window=12, hidden_size=8, device="cpu", checkpoint_every=1)
TORCHRUN = [sys.executable, "-m", "torch.distributed.run", "--standalone", "--nproc-per-node", "2"]

ONE_STEP = """
import sys
from pathlib import Path
import torch
from lobstr_hw.training.checkpoint import new_run
from lobstr_hw.training.config import read_config
from lobstr_hw.training.dataset import load_clips, statistics
from lobstr_hw.training.loop import train_step
from lobstr_hw.training.processes import average_gradients, processes, share_of

folder = Path(sys.argv[1])
config, clips = read_config(folder / "config.json"), load_clips(folder / "clips.npz")
with processes() as who:
    run = new_run(config, statistics(clips, config))
    average_gradients(run.network, who)
    train_step(run, clips, share_of(config, who))
    gradients = [parameter.grad for parameter in run.network.parameters()]
    torch.save(gradients, folder / f"gradients-{who.rank}.pt")
"""


@pytest.fixture(scope="module")
def clips() -> Clips:
    return Clips.of(replace(walking(2.0, seed=i), name=f"set/{i}") for i in range(2))


def test_the_gradient_of_two_processes_is_that_of_one_with_both_shares(
    clips: Clips, tmp_path: Path
) -> None:
    write_config(tmp_path / "config.json", SMALL)
    save_clips(tmp_path / "clips.npz", clips)
    (tmp_path / "step.py").write_text(ONE_STEP, encoding="utf-8")
    subprocess.run([*TORCHRUN, str(tmp_path / "step.py"), str(tmp_path)], check=True)
    first, second = (torch.load(tmp_path / f"gradients-{rank}.pt") for rank in (0, 1))
    for mine, of_other, expected in zip(first, second, alone(clips), strict=True):
        assert torch.equal(mine, of_other)
        assert torch.allclose(mine, expected, rtol=1e-4, atol=1e-7)
        assert mine.abs().max() > 0.0


def alone(clips: Clips) -> "list[Tensor]":
    """Gradients of one process over the windows of both shares."""
    from lobstr_hw.training.checkpoint import new_run
    from lobstr_hw.training.dataset import draw_windows
    from lobstr_hw.training.losses import Targets, losses
    from lobstr_hw.training.processes import Processes, share_of

    run = new_run(SMALL, statistics(clips, SMALL))
    drawn = []
    for rank in (0, 1):
        share = share_of(SMALL, Processes(2, rank))
        rng = np.random.default_rng([share.seed, 0])
        drawn.append(draw_windows(clips, share.batch, share, share.augmentation, rng))
    assert np.abs(drawn[0].x - drawn[1].x).max() > 0.0, "each draws its own"
    x, pose, before, contact = (
        torch.from_numpy(np.concatenate([getattr(windows, name) for windows in drawn]))
        for name in ("x", "pose", "pose_before", "contact")
    )
    z = (x - torch.from_numpy(run.stats.input_mean)) / torch.from_numpy(run.stats.input_scale)
    said, logits, _ = run.network(z)
    total = losses(said, logits, Targets(pose, before, contact), SMALL.weights).total
    return list(torch.autograd.grad(total, list(run.network.parameters())))


def test_a_batch_that_cannot_be_shared_evenly_is_refused() -> None:
    from lobstr_hw.training.processes import Processes, share_of

    assert share_of(SMALL, Processes()) == SMALL
    assert share_of(SMALL, Processes(4, 3)).batch == 2
    with pytest.raises(ModelError, match="evenly"):
        share_of(SMALL, Processes(3, 0))


def test_the_streams_of_all_processes_are_kept_together_and_shared_out_again() -> None:
    from lobstr_hw.training.checkpoint import Carried
    from lobstr_hw.training.processes import Processes, gathered, part_of
    from lobstr_hw.training.streams import Position

    hidden, position = torch.arange(6.0)[None, :, None], Position(np.arange(6), 10 + np.arange(6))
    whole = Carried(hidden, 100.0 * hidden, position)
    parts = [part_of(whole, Processes(2, rank)) for rank in (0, 1)]
    assert [part.hidden.flatten().tolist() for part in parts if part] == [[0, 1, 2], [3, 4, 5]]
    assert [part.taught.flatten().tolist() for part in parts if part] == [
        [0, 100, 200],
        [300, 400, 500],
    ]
    assert [part.position.chunk.tolist() for part in parts if part] == [[10, 11, 12], [13, 14, 15]]
    assert gathered(whole, Processes()) is whole


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("shared")
    (root / "made" / "clips").mkdir(parents=True)
    for seed in range(2):
        walk = walking(6.0, seed=seed)
        path = root / "made" / "clips" / f"walk_{seed}.bvh"
        write_bvh(path, walk.p_hips, walk.R_local, walk.rate_hz)
    parts: dict[str, list[str]] = {part: [] for part in PARTS}
    split = {**parts, "train": ["made/walk_0"], "validation": ["made/walk_1"]}
    (root / "split.json").write_text(json.dumps(split), encoding="utf-8")
    small = {"steps": 2, "batch": 4, "window": 20, "hidden_size": 8, "validate_every": 1}
    write_config(
        root / "config.json", recipe_config("carried", device="cpu", schedule="decay", **small)
    )
    return root


def test_the_command_trains_carried_state_in_two_processes_and_goes_on_in_one(
    data: Path, tmp_path: Path
) -> None:
    from lobstr_hw.training.checkpoint import load_checkpoint

    for module in ("tqdm", "matplotlib"):
        pytest.importorskip(module, reason="pip install 'lobstr-hw[train]'")
    run = tmp_path / "run"
    common = [str(data), "--split", str(data / "split.json"), "--out", str(run)]
    command = [*TORCHRUN, "-m", "lobstr_hw.runtime.commands.train", *common]
    subprocess.run([*command, "--config", str(data / "config.json")], check=True)
    assert main([*common, "--resume", "--steps", "3"]) == 0
    end = load_checkpoint(run / "checkpoint.pt", read_config(run / "config.json"))
    assert end.step == 3
    assert [row[0] for row in end.validation] == [1.0, 2.0, 3.0]
    assert end.carried is not None
    assert end.carried.hidden.shape == (1, 4, 8), "the streams of both"
    assert len((run / "curve.csv").read_text(encoding="utf-8").splitlines()) == 1 + 3
