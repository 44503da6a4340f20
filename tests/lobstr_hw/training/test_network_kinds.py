"""The kinds of networks of the tables: each learns, resumes, and says the same when exported."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, get_args

import numpy as np
import pytest
from support.motions import walking

from lobstr_hw.errors import ModelError
from lobstr_hw.features import Form
from lobstr_hw.predictors.weights import load_network
from lobstr_hw.training.config import (
    STEPPED_KINDS,
    LossWeights,
    NetworkKind,
    TrainingConfig,
    recipe_config,
)
from lobstr_hw.training.dataset import Clips, statistics

if TYPE_CHECKING:
    from lobstr_hw.training.checkpoint import Run
    from lobstr_hw.training.network import LobstrNetwork

torch = pytest.importorskip("torch", reason="pip install torch==2.13.0 'lobstr-hw[train]'")
pytestmark = pytest.mark.torch

KINDS: tuple[NetworkKind, ...] = get_args(NetworkKind)
SMALL = TrainingConfig(
    steps=6, batch=8, window=16, hidden_size=16, device="cpu", validation_windows=8
)


@pytest.fixture(scope="module")
def clips() -> Clips:
    return Clips.of(replace(walking(2.0, seed=i), name=f"set/{i}") for i in range(2))


def started(clips: Clips, config: TrainingConfig) -> "Run":
    from lobstr_hw.training.checkpoint import new_run

    return new_run(config, statistics(clips, config))


def go_on(run: "Run", clips: Clips, config: TrainingConfig) -> "Run":
    from lobstr_hw.training.loop import train

    for _ in train(run, clips, clips, config):
        pass
    return run


def same_weights(a: "Run", b: "Run") -> bool:
    pairs = zip(a.network.state_dict().values(), b.network.state_dict().values(), strict=True)
    return all(torch.equal(x, y) for x, y in pairs)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("precision", ["fp32", "bf16"])
def test_a_resumed_run_of_any_kind_ends_like_one_that_never_stopped(
    clips: Clips, tmp_path: Path, kind: NetworkKind, precision: str
) -> None:
    from lobstr_hw.training.checkpoint import load_checkpoint, save_checkpoint

    changes = {"network": kind, "precision": precision}
    config = replace(SMALL, **changes)  # type: ignore[arg-type]
    first = go_on(started(clips, config), clips, replace(config, steps=3))
    save_checkpoint(tmp_path / "checkpoint.pt", first)
    resumed = go_on(load_checkpoint(tmp_path / "checkpoint.pt", config), clips, config)
    whole = go_on(started(clips, config), clips, config)
    assert same_weights(resumed, whole)
    assert resumed.curve == whole.curve
    assert not same_weights(resumed, started(clips, config))


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_learns(clips: Clips, kind: NetworkKind) -> None:
    config = replace(SMALL, steps=60, batch=16, hidden_size=32, network=kind)
    run = go_on(started(clips, config), clips, config)
    total = np.array(run.curve)[:, 1]
    assert total[-10:].mean() < 0.7 * total[:5].mean()


def test_a_checkpoint_of_another_kind_is_refused(clips: Clips, tmp_path: Path) -> None:
    from lobstr_hw.training.checkpoint import load_checkpoint, save_checkpoint

    save_checkpoint(tmp_path / "checkpoint.pt", started(clips, SMALL))
    with pytest.raises(ModelError, match="not a checkpoint of this configuration"):
        load_checkpoint(tmp_path / "checkpoint.pt", replace(SMALL, network="lstm"))


def test_only_windows_train_the_tables_networks() -> None:
    with pytest.raises(ModelError, match="--recipe paper"):
        recipe_config("carried", network="lstm")


def test_the_papers_recipe_has_no_mean_of_the_weights() -> None:
    with pytest.raises(ModelError, match="average"):
        recipe_config("paper", average=0.9)


@pytest.mark.parametrize("form", get_args(Form))
def test_every_form_of_the_input_trains_and_is_exported(
    clips: Clips, tmp_path: Path, form: Form
) -> None:
    pytest.importorskip("onnx", reason="pip install 'lobstr-hw[train]'")
    from lobstr_hw.training.export import export_network
    from lobstr_hw.training.shipping import network_card

    config = replace(SMALL, feature_form=form)
    run = go_on(started(clips, config), clips, config)
    export_network(run.network, network_card(run, config, {}), tmp_path / "net.onnx")
    exported = load_network(tmp_path / "net.onnx")
    assert exported.card.feature_form == form
    assert exported.session.get_inputs()[0].shape[1] == (64 if form == "combined" else 37)


def network_of(kind: NetworkKind, hidden_size: int = 24) -> "LobstrNetwork":
    """With outputs as large as a trained one's."""
    from lobstr_hw.training.network import LobstrNetwork

    torch.manual_seed(3)
    network = LobstrNetwork(hidden_size, torch.randn(48), kind)
    with torch.no_grad():
        network.pose.weight *= 4.0
        network.contact.weight *= 20.0
    return network


@pytest.mark.parametrize("kind", STEPPED_KINDS)
def test_torch_and_the_exported_file_agree_over_ten_thousand_carried_steps(
    clips: Clips, tmp_path: Path, kind: NetworkKind
) -> None:
    """Of the matrices that the file holds; what rounding them costs is measured elsewhere."""
    pytest.importorskip("onnx", reason="pip install 'lobstr-hw[train]'")
    from lobstr_hw.training.export import export_network, stored
    from lobstr_hw.training.shipping import network_card

    config = replace(SMALL, network=kind, hidden_size=24)
    run = replace(started(clips, config), network=network_of(kind))
    export_network(run.network, network_card(run, config, {}), tmp_path / "net.onnx")
    exported = load_network(tmp_path / "net.onnx")
    x = np.random.default_rng(5).standard_normal((10_000, 37)).astype(np.float32)
    x += 2.0 * np.sin(np.arange(10_000) / 300.0)[:, None].astype(np.float32)
    with torch.no_grad():
        pose, contact, _ = stored(run.network)(torch.from_numpy(x)[None], last_only=False)
    state = np.zeros((1, exported.card.hidden_size), dtype=np.float32)
    worst = 0.0
    for row, of_pose, of_contact in zip(x, pose[0].numpy(), contact[0].numpy(), strict=True):
        state, pose_file, contact_file = exported.step(row[None], state)
        worst = max(
            worst, np.abs(pose_file - of_pose).max(), np.abs(contact_file - of_contact).max()
        )
    assert worst < 1e-4
    assert pose.std(dim=1).max() > 0.1, "the outputs move"


@pytest.mark.parametrize("kind", ["fc6", "cnn1d"])
def test_a_network_without_a_step_is_not_exported(
    clips: Clips, tmp_path: Path, kind: NetworkKind
) -> None:
    pytest.importorskip("onnx", reason="pip install 'lobstr-hw[train]'")
    from lobstr_hw.training.export import export_network
    from lobstr_hw.training.shipping import network_card

    config = replace(SMALL, network=kind)
    run = started(clips, config)
    with pytest.raises(ModelError, match="no step to export"):
        export_network(run.network, network_card(run, config, {}), tmp_path / "net.onnx")


def test_a_network_that_sees_a_window_answers_for_its_last_frame_only() -> None:
    """What lies beyond the window cannot matter; every frame of it can."""
    for kind in ("fc6", "cnn1d"):
        network = network_of(kind)
        x = torch.randn(4, 45, 37, requires_grad=True)
        pose, contact, state = network(x)
        assert pose.shape == (4, 48)
        assert contact.shape == (4, 4)
        assert state.shape == (1, 4, 0)
        (gradient,) = torch.autograd.grad(pose.sum(), x)
        assert (gradient.abs().amax(dim=(0, 2))[: 45 // 8 * 8] > 0.0).all()


def test_an_accelerator_that_is_not_there_is_told(
    clips: Clips, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(ModelError, match="--device cpu"):
        started(clips, replace(SMALL, device="cuda"))
    assert started(clips, replace(SMALL, device="auto")).network.output_mean.device.type == "cpu"


def test_a_loss_that_is_left_out_has_no_gradient(clips: Clips) -> None:
    """P and PK of the paper's Table 2 train other weights than all losses together do."""
    ends = []
    for weights in (LossWeights(), LossWeights(velocity=0.0), LossWeights(toe=0.0, velocity=0.0)):
        config = replace(SMALL, weights=weights)
        ends.append(go_on(started(clips, config), clips, config))
    assert not same_weights(ends[0], ends[1])
    assert not same_weights(ends[1], ends[2])


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_said_of_a_row_of_windows_is_what_is_said_of_each(
    clips: Clips, kind: NetworkKind
) -> None:
    from lobstr_hw.training.windowed import windowed

    config = replace(SMALL, network=kind)
    run = started(clips, config)
    x = np.random.default_rng(2).standard_normal((40, 37))
    said = windowed(run, config, x, 20, 40)
    assert said.pose.shape == (20, 48)
    for i in (20, 33, 39):
        window = (x[i - 15 : i + 1] - run.stats.input_mean) / run.stats.input_scale
        with torch.no_grad():
            pose, logits, _ = run.network(torch.from_numpy(window.astype(np.float32))[None])
        assert said.pose[i - 20] == pytest.approx(pose[0].numpy(), rel=1e-4, abs=1e-4)
        assert said.logits[i - 20] == pytest.approx(logits[0].numpy(), rel=1e-4, abs=1e-4)
