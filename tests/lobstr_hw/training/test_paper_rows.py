"""The rows of the paper's tables: trained alike but for what their table is about."""

from dataclasses import fields, replace
from pathlib import Path

import pytest

from lobstr_hw.training.config import TrainingConfig, recipe_config

pytest.importorskip("torch", reason="pip install torch==2.13.0 'lobstr-hw[train]'")
pytestmark = pytest.mark.torch

ABOUT = {1: "network", 2: "weights", 3: "feature_form"}


def changed(config: TrainingConfig, base: TrainingConfig) -> set[str]:
    return {f.name for f in fields(base) if getattr(config, f.name) != getattr(base, f.name)}


@pytest.mark.parametrize("table", [1, 2, 3])
def test_the_rows_of_a_table_differ_only_in_what_it_is_about(table: int) -> None:
    from paper_rows import BASE, SETTINGS, TABLES

    rows = [SETTINGS[row] for row in TABLES[table]]
    values = {str(getattr(row, ABOUT[table])) for row in rows}
    assert len(values) == len(rows)
    assert all(changed(row, BASE) <= {ABOUT[table]} for row in rows)
    paper = recipe_config("paper")
    assert changed(BASE, paper) == {"precision"}
    assert (BASE.hidden_size, BASE.batch, BASE.window) == (1024, 256, 45)


def test_the_paper_s_losses_are_the_base_and_P_has_pose_and_contact_only() -> None:
    from paper_rows import BASE, SETTINGS

    P, PK = SETTINGS["gru-p"].weights, SETTINGS["gru-pk"].weights
    assert replace(P, toe=BASE.weights.toe) == PK
    assert replace(PK, velocity=BASE.weights.velocity) == BASE.weights
    assert P.toe == P.velocity == 0.0


def test_a_run_s_steps_are_those_of_its_newest_checkpoint(tmp_path: Path) -> None:
    from paper_rows import steps_done

    assert steps_done(tmp_path) == 0
    (tmp_path / "curve.csv").write_text("step,total\n1,2.0\n2,1.0\n", encoding="utf-8")
    assert steps_done(tmp_path) == 0, "no checkpoint to go on from"
    (tmp_path / "checkpoint.pt").write_bytes(b"")
    assert steps_done(tmp_path) == 2
