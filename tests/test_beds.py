"""A missing test bed."""

import os

import pytest
from support.beds import environment, need


def test_a_bed_that_is_there_is_no_reason_to_skip() -> None:
    need("a floor", "build a house", present=True)


def test_a_missing_bed_skips_on_a_persons_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CI", raising=False)
    with pytest.raises(pytest.skip.Exception, match="needs a floor: build a house"):
        need("a floor", "build a house", present=False)


def test_a_missing_bed_fails_a_build(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CI", "true")
    with pytest.raises(pytest.fail.Exception, match="needs a floor: build a house"):
        need("a floor", "build a house", present=False)


def test_an_environment_is_put_back(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LOBSTR_TEST_A", "before")
    monkeypatch.delenv("LOBSTR_TEST_B", raising=False)
    with environment(LOBSTR_TEST_A="during", LOBSTR_TEST_B="during"):
        assert os.environ["LOBSTR_TEST_A"] == os.environ["LOBSTR_TEST_B"] == "during"
    assert os.environ["LOBSTR_TEST_A"] == "before"
    assert "LOBSTR_TEST_B" not in os.environ
