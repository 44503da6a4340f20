"""What the recipe that ships has besides: its own GRU, mean weights, mirror images, everybody."""

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from support.motions import walking

from lobstr_hw.bvh_writer import write_bvh
from lobstr_hw.features import mirror_features
from lobstr_hw.lower_body import mirror_pose_6d
from lobstr_hw.predictors.weights import load_network
from lobstr_hw.runtime.commands.train import main
from lobstr_hw.splits import PARTS
from lobstr_hw.training.config import recipe_config, write_config
from lobstr_hw.training.dataset import Clips, statistics

if TYPE_CHECKING:
    from torch import Tensor
    from torch.nn import GRU

    from lobstr_hw.training.checkpoint import Run
    from lobstr_hw.training.network import LobstrNetwork

torch = pytest.importorskip("torch", reason="pip install torch==2.13.0 'lobstr-hw[train]'")
pytestmark = pytest.mark.torch

SMALL = replace(
    recipe_config("carried"),
    steps=9,
    batch=4,
    window=15,
    hidden_size=16,
    precision="bf16",
    average=0.9,
    mirror_mean=True,
    everybody=False,
    schedule="decay",
    validate_every=4,
    checkpoint_every=3,
)


@pytest.fixture(scope="module")
def clips() -> Clips:
    return Clips.of(replace(walking(3.0, seed=i), name=f"set/{i}") for i in range(3))


def network(hidden: int) -> "LobstrNetwork":
    from lobstr_hw.training.network import LobstrNetwork

    torch.manual_seed(3)
    return LobstrNetwork(hidden, 0.1 * torch.randn(48))


def gru() -> "GRU":
    torch.manual_seed(3)
    cell: GRU = torch.nn.GRU(37, 24, batch_first=True)
    return cell


def outcome(states: "Tensor", leaves: "list[Tensor]") -> "list[Tensor]":
    """States, and the gradients of a weighed sum of them."""
    weight = torch.randn(states.shape, generator=torch.Generator().manual_seed(1))
    return [states.detach(), *torch.autograd.grad((states * weight).sum(), leaves)]


@pytest.mark.parametrize(("kind", "tolerance"), [("float32", 1e-5), ("bfloat16", 2e-2)])
def test_the_own_gru_and_its_gradients_are_torchs(kind: str, tolerance: float) -> None:
    from lobstr_hw.training.recurrence import run_gru

    cell = gru()
    x = torch.randn(5, 20, 37, requires_grad=True)
    h = torch.randn(1, 5, 24, requires_grad=True)
    leaves = [*cell.parameters(), x, h]
    states, last = run_gru(cell, x, h, getattr(torch, kind))
    assert torch.equal(states[:, -1], last[0])
    pairs = zip(outcome(states, leaves), outcome(cell(x, h)[0], leaves), strict=True)
    for mine, expected in pairs:
        assert (mine - expected).norm() < tolerance * expected.norm()


def test_a_state_that_changes_by_less_than_sixteen_bits_hold_still_changes() -> None:
    from lobstr_hw.training.recurrence import run_gru

    cell = gru()
    with torch.no_grad():
        for parameter in cell.parameters():
            parameter.zero_()
        _, _, bias, _ = cell.parameters()
        bias[24:48] = 7.0  # z = 0.9991: a thousandth of the way in each frame
        bias[48:] = 1.0
        states, _ = run_gru(cell, torch.zeros(1, 1000, 37), 0.5 * torch.ones(1, 1, 24))
        expected, _ = cell(torch.zeros(1, 1000, 37), 0.5 * torch.ones(1, 1, 24))
    assert expected[0, -1].mean() - 0.5 > 0.1
    assert torch.allclose(states, expected, atol=1e-4)


def test_who_is_mirrored_gets_the_mirrored_answer() -> None:
    from lobstr_hw.training.mirrored import MirrorMean

    both = MirrorMean(network(24))
    x = torch.randn(2, 30, 37)
    mirrored = torch.from_numpy(mirror_features(x.numpy().astype(np.float64)).astype(np.float32))
    with torch.no_grad():
        pose, logits, _ = both(x, last_only=False)
        pose_there, logits_there, _ = both(mirrored, last_only=False)
    assert pose_there.numpy() == pytest.approx(mirror_pose_6d(pose.numpy()), abs=1e-5)
    feet = logits.reshape(2, 30, 2, 2)
    assert torch.allclose(logits_there.reshape(2, 30, 2, 2), feet.flip(2), atol=1e-5)


def test_the_cosine_rises_falls_without_a_step_up_and_ends_low() -> None:
    from lobstr_hw.training.schedule import learning_rate

    config = replace(SMALL, steps=2000, learning_rate=1e-3, schedule="cosine")
    rates = np.array([learning_rate(config, step) for step in range(2000)])
    top = int(rates.argmax())
    assert 50 < top < 150 and rates[top] == pytest.approx(1e-3, rel=0.02)
    assert (np.diff(rates[: top + 1]) > 0.0).all() and (np.diff(rates[top:]) < 0.0).all()
    assert rates[1000] > 0.4e-3 and rates[-1] < 0.03e-3


def trained(clips: Clips, run: "Run") -> "Run":
    from lobstr_hw.training.loop import train

    for _ in train(run, clips, clips, SMALL):
        pass
    return run


def test_mean_weights_go_on_after_a_stop_and_are_what_is_validated_and_exported(
    clips: Clips, tmp_path: Path
) -> None:
    from lobstr_hw.training.checkpoint import load_checkpoint, new_run, save_checkpoint
    from lobstr_hw.training.export import measure_export
    from lobstr_hw.training.loop import train
    from lobstr_hw.training.mirrored import MirrorMean
    from lobstr_hw.training.shipping import export_run

    pytest.importorskip("onnx", reason="pip install 'lobstr-hw[train]'")
    run = new_run(SMALL, statistics(clips, SMALL))
    for _ in train(run, clips, clips, replace(SMALL, steps=5)):
        pass
    run.validation, run.best = run.validation[:1], None  # as if it had been stopped, not ended
    save_checkpoint(tmp_path / "checkpoint.pt", run)
    resumed = trained(clips, load_checkpoint(tmp_path / "checkpoint.pt", SMALL))
    whole = trained(clips, new_run(SMALL, statistics(clips, SMALL)))
    assert resumed.average is not None and whole.average is not None
    assert all(torch.equal(resumed.average[k], whole.average[k]) for k in whole.average)
    assert resumed.validation == whole.validation
    own = whole.network.state_dict()
    assert not torch.equal(own["pose.weight"], whole.average["pose.weight"])
    whole.best = None  # as in a run on everybody
    write_config(tmp_path / "config.json", SMALL)
    save_checkpoint(tmp_path / "checkpoint.pt", whole)
    (tmp_path / "data.json").write_text(json.dumps({"minutes_by_set": {}}), encoding="utf-8")
    export_run(tmp_path, tmp_path / "net.onnx")
    whole.network.load_state_dict(whole.average)
    assert measure_export(MirrorMean(whole.network), tmp_path / "net.onnx").pose < 2e-3


def test_the_exported_mirror_mean_says_what_torch_says_over_carried_steps(
    clips: Clips, tmp_path: Path
) -> None:
    from lobstr_hw.training.checkpoint import Run
    from lobstr_hw.training.export import export_network, measure_export, stored
    from lobstr_hw.training.mirrored import MirrorMean
    from lobstr_hw.training.shipping import network_card

    pytest.importorskip("onnx", reason="pip install 'lobstr-hw[train]'")
    inner = network(16)
    optimizer = torch.optim.Adam(inner.parameters())
    run = Run(inner, optimizer, statistics(clips, SMALL))
    path = tmp_path / "net.onnx"
    export_network(MirrorMean(inner), network_card(run, SMALL, {}), path)
    error = measure_export(stored(MirrorMean(inner)), path, steps=2000)
    assert max(error.pose, error.contact_logit, error.hidden) < 1e-4
    assert load_network(path).card.hidden_size == 32


def test_with_everybody_the_validation_people_are_trained_on_and_nothing_is_validated(
    tmp_path: Path,
) -> None:
    for module in ("tqdm", "matplotlib"):
        pytest.importorskip(module, reason="pip install 'lobstr-hw[train]'")
    folder = tmp_path / "data" / "walks" / "clips"
    folder.mkdir(parents=True)
    for i in range(3):
        walk = walking(2.0, seed=i)
        write_bvh(folder / f"w{i}.bvh", walk.p_hips, walk.R_local, walk.rate_hz)
    split: dict[str, list[str]] = {part: [] for part in PARTS}
    split |= {"train": ["walks/w0"], "validation": ["walks/w1"], "test": ["walks/w2"]}
    (tmp_path / "split.json").write_text(json.dumps(split), encoding="utf-8")
    write_config(tmp_path / "small.json", replace(SMALL, steps=1, window=10))
    for name, flags, clips_trained in (("some", [], 1), ("all", ["--everybody"], 2)):
        common = ["--split", str(tmp_path / "split.json"), "--config", str(tmp_path / "small.json")]
        out = tmp_path / name
        arguments = [str(tmp_path / "data"), *common, "--out", str(out), *flags]
        assert main([*arguments, "--cache", str(tmp_path / "cache")]) == 0
        described = json.loads((out / "data.json").read_text(encoding="utf-8"))
        assert described["clips"] == clips_trained == len(described["parts"])
        validated = (out / "validation.csv").read_text(encoding="utf-8").splitlines()
        assert len(validated) == (2 if name == "some" else 1)


def test_a_run_made_on_an_accelerator_is_exported_where_there_is_none(
    clips: Clips, tmp_path: Path
) -> None:
    from lobstr_hw.training.checkpoint import new_run, save_checkpoint
    from lobstr_hw.training.shipping import export_run

    pytest.importorskip("onnx", reason="pip install 'lobstr-hw[train]'")
    # made here on the CPU; what a checkpoint holds does not tell
    save_checkpoint(tmp_path / "checkpoint.pt", new_run(SMALL, statistics(clips, SMALL)))
    write_config(tmp_path / "config.json", replace(SMALL, device="cuda"))
    (tmp_path / "data.json").write_text("{}", encoding="utf-8")
    export_run(tmp_path, tmp_path / "out.onnx")
    assert (
        load_network(tmp_path / "out.onnx").card.model.details["configuration"]["device"] == "cuda"
    )
