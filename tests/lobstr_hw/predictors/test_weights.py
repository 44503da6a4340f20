"""Weights and card: what fits is read, what does not is refused with the reason."""

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lobstr_hw.errors import ModelError
from lobstr_hw.predictors import PREDICTOR_NAMES, SHIPPED, SHIPPED_WEIGHTS, load_predictor
from lobstr_hw.predictors.weights import load_network, read_card, write_card

Card = dict[str, Any]


@pytest.fixture
def weights(tmp_path: Path) -> Path:
    """A copy of the shipped files that a test may spoil."""
    for suffix in (".onnx", ".json"):
        shutil.copy(SHIPPED_WEIGHTS.with_suffix(suffix), tmp_path)
    return tmp_path / SHIPPED_WEIGHTS.name


def spoil(weights: Path, change: Callable[[Card], Any]) -> None:
    path = weights.with_suffix(".json")
    card = json.loads(path.read_text(encoding="utf-8"))
    change(card)
    path.write_text(json.dumps(card), encoding="utf-8")


def test_a_card_written_and_read_says_the_same(weights: Path, tmp_path: Path) -> None:
    card = read_card(weights.with_suffix(".json"))
    write_card(tmp_path / "copy.json", card)
    copy = read_card(tmp_path / "copy.json")
    assert copy.model == card.model
    assert copy.joint_order == card.joint_order
    for name in ("input_mean", "input_scale", "output_mean", "contact_mean"):
        assert (getattr(copy, name) == getattr(card, name)).all()


def test_the_deviation_has_a_floor() -> None:
    assert read_card(SHIPPED_WEIGHTS.with_suffix(".json")).input_scale.min() >= np.float32(1e-3)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("feature_version", 99),
        ("skeleton_version", 99),
        ("input_size", 36),
        ("joint_order", ["left_foot"]),
        ("format", 99),
    ],
)
def test_a_card_of_another_version_is_refused_with_both_values(
    weights: Path, key: str, value: object
) -> None:
    spoil(weights, lambda card: card.update({key: value}))
    with pytest.raises(ModelError, match=rf"{key} is {re.escape(repr(value))}, this code has"):
        load_network(weights)


@pytest.mark.parametrize(
    "change",
    [
        lambda card: card.pop("output_mean"),
        lambda card: card["input_mean"].pop(),
        lambda card: card.update(input_scale=["x"] * 37),
        lambda card: card.update(feature_form="other"),
        lambda card: card.update(needs=["tail"]),
        lambda card: card.update(input_mean=[float("nan")] * 37),
    ],
)
def test_a_damaged_card_is_refused(weights: Path, change: Callable[[Card], Any]) -> None:
    spoil(weights, change)
    with pytest.raises(ModelError, match=r"card is damaged.*lobstr-train --export"):
        load_network(weights)


def test_a_card_of_another_network_is_refused(weights: Path) -> None:
    spoil(weights, lambda card: card.update(hidden_size=card["hidden_size"] + 1))
    with pytest.raises(ModelError, match="the card needs"):
        load_network(weights)


def test_a_missing_card_says_that_there_are_two_files(weights: Path) -> None:
    weights.with_suffix(".json").unlink()
    with pytest.raises(ModelError, match=r"NAME\.onnx and NAME\.json"):
        load_network(weights)


def test_a_card_that_is_no_json_is_refused(weights: Path) -> None:
    for text in ("{", "[]"):
        weights.with_suffix(".json").write_text(text, encoding="utf-8")
        with pytest.raises(ModelError, match="JSON"):
            load_network(weights)


def test_cut_weights_are_refused(weights: Path) -> None:
    weights.write_bytes(weights.read_bytes()[:1000])
    with pytest.raises(ModelError, match="damaged weights"):
        load_network(weights)


def test_a_missing_file_and_an_unknown_name_are_told(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="no such weights file"):
        load_predictor(str(tmp_path / "none.onnx"))
    with pytest.raises(ModelError, match=", ".join(PREDICTOR_NAMES)):
        load_predictor("lobster")


def test_a_file_is_loaded_by_its_path(weights: Path) -> None:
    assert load_predictor(str(weights)).card == load_predictor("lobstr").card


@pytest.mark.parametrize("name", sorted(SHIPPED))
def test_a_shipped_network_is_the_one_it_is_named_after(name: str) -> None:
    if not SHIPPED[name].is_file():
        pytest.skip(f"{SHIPPED[name].name} does not ship yet")
    card = load_predictor(name).card
    assert card.name == name
    assert card.details["licences"]
