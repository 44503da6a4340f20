"""Laws of a network that listens to others: what is heard, when it matters, and going on."""

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from support.motions import walking

from lobstr_hw.errors import ModelError
from lobstr_hw.training.config import TrainingConfig, read_config, recipe_config, write_config
from lobstr_hw.training.dataset import Clips, Float32, statistics

if TYPE_CHECKING:
    from lobstr_hw.training.checkpoint import Run

torch = pytest.importorskip("torch", reason="pip install torch==2.13.0 'lobstr-hw[train]'")
pytestmark = pytest.mark.torch

SMALL = recipe_config(
    "carried", steps=6, batch=4, window=20, hidden_size=12, validate_every=100, precision="fp32"
)


@pytest.fixture(scope="module")
def clips() -> Clips:
    return Clips.of(replace(walking(3.0, seed=i), name=f"set/{i}") for i in range(3))


@pytest.fixture(scope="module")
def teachers(clips: Clips, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, ...]:
    """Two finished runs of unlike size."""
    parent = tmp_path_factory.mktemp("teachers")
    sizes = {"a": 12, "b": 20}
    for seed, (name, size) in enumerate(sizes.items(), start=7):
        kept(trained(clips, replace(SMALL, hidden_size=size, seed=seed)), parent / name)
    return tuple(str(parent / name) for name in sizes)


def trained(
    clips: Clips, config: TrainingConfig, steps: int | None = None
) -> "tuple[Run, TrainingConfig]":
    from lobstr_hw.training.checkpoint import new_run
    from lobstr_hw.training.loop import train

    run = new_run(config, statistics(clips, config))
    for _ in train(run, clips, None, config):
        if run.step == steps:
            break
    return run, config


def kept(run: "tuple[Run, TrainingConfig]", folder: Path) -> Path:
    from lobstr_hw.training.checkpoint import save_checkpoint

    folder.mkdir()
    write_config(folder / "config.json", run[1])
    save_checkpoint(folder / "checkpoint.pt", run[0])
    return folder


def heard(x: Float32, *teachers: str, cuts: int = 1) -> list[np.ndarray]:
    """Poses and contacts over a chunk that comes in pieces."""
    from lobstr_hw.training.teachers import Teachers

    listening = Teachers(replace(SMALL, teachers=teachers))
    state = torch.zeros(1, len(x), listening.state_size)
    poses, contacts = [], []
    for piece in np.split(x, cuts, axis=1):
        pose, contact, state = listening.say(piece, state)
        poses.append(pose.numpy())
        contacts.append(contact.numpy())
    return [np.concatenate(poses, axis=1), np.concatenate(contacts, axis=1)]


def some_input() -> Float32:
    return 0.1 * np.random.default_rng(3).standard_normal((2, 12, 37)).astype(np.float32)


def test_the_mean_of_the_teachers_is_heard(teachers: tuple[str, ...]) -> None:
    x = some_input()
    both, one, other = heard(x, *teachers), heard(x, teachers[0]), heard(x, teachers[1])
    for mean, a, b in zip(both, one, other, strict=True):
        np.testing.assert_allclose(mean, 0.5 * (a + b), atol=1e-6)
        assert np.abs(a - b).max() > 1e-4
    assert ((both[1] > 0.0) & (both[1] < 1.0)).all()


def test_teachers_carry_their_states_from_chunk_to_chunk(teachers: tuple[str, ...]) -> None:
    x = some_input()
    for whole, pieces in zip(heard(x, *teachers), heard(x, *teachers, cuts=3), strict=True):
        np.testing.assert_allclose(pieces, whole, atol=1e-5)


def test_who_does_not_heed_the_teachers_learns_as_without(
    clips: Clips, teachers: tuple[str, ...]
) -> None:
    alone = trained(clips, SMALL)[0].network.state_dict()
    deaf = trained(clips, replace(SMALL, teachers=teachers, taught=0.0))[0].network.state_dict()
    heeding = trained(clips, replace(SMALL, teachers=teachers))[0].network.state_dict()
    for name, weights in alone.items():
        torch.testing.assert_close(deaf[name], weights)
    assert any(not torch.allclose(heeding[name], weights) for name, weights in alone.items())


def test_a_pupil_comes_closer_to_its_teacher(clips: Clips, teachers: tuple[str, ...]) -> None:
    config = replace(SMALL, teachers=teachers[:1], taught=1.0, steps=150, seed=2)
    run, _ = trained(clips, config)
    totals = np.array(run.curve)[:, 1]
    assert totals[-10:].mean() < 0.5 * totals[:5].mean()


def test_a_pupil_goes_on_after_a_stop_as_if_nothing_had_happened(
    clips: Clips, teachers: tuple[str, ...], tmp_path: Path
) -> None:
    from lobstr_hw.training.checkpoint import load_checkpoint
    from lobstr_hw.training.loop import train

    config = replace(SMALL, teachers=teachers)
    folder = kept(trained(clips, config, steps=3), tmp_path / "run")
    assert read_config(folder / "config.json") == config
    run = load_checkpoint(folder / "checkpoint.pt", config)
    for _ in train(run, clips, None, config):
        pass
    for name, weights in trained(clips, config)[0].network.state_dict().items():
        torch.testing.assert_close(run.network.state_dict()[name], weights, rtol=0.0, atol=0.0)


def test_only_live_networks_teach(clips: Clips, teachers: tuple[str, ...], tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="no training configuration"):
        heard(some_input(), str(tmp_path / "nowhere"))
    paper = recipe_config("paper", steps=1, batch=4, hidden_size=8)
    folder = kept(trained(clips, paper), tmp_path / "paper")
    with pytest.raises(ModelError, match="cannot teach"):
        heard(some_input(), str(folder))
    with pytest.raises(ModelError, match="teachers"):
        replace(paper, teachers=teachers)


def test_who_has_not_finished_does_not_teach(clips: Clips, tmp_path: Path) -> None:
    folder = kept(trained(clips, SMALL, steps=3), tmp_path / "half")
    with pytest.raises(ModelError, match=r"at step 3 of 6\. .*--resume"):
        heard(some_input(), str(folder))


def test_the_card_tells_who_taught_but_not_where(
    clips: Clips, teachers: tuple[str, ...], tmp_path: Path
) -> None:
    from lobstr_hw.training.shipping import export_run

    pytest.importorskip("onnx", reason="pip install 'lobstr-hw[train]'")
    folder = kept(trained(clips, replace(SMALL, teachers=teachers)), tmp_path / "run")
    (folder / "data.json").write_text("{}", encoding="utf-8")
    export_run(folder, tmp_path / "lobstr.onnx")
    text = (tmp_path / "lobstr.json").read_text(encoding="utf-8")
    told = json.loads(text)["details"]["configuration"]["teachers"]
    assert [teacher["hidden_size"] for teacher in told] == [12, 20]
    assert str(Path(teachers[0]).parent) not in text
