"""Words for residuals."""

from dataclasses import replace

import pytest
from support.calibrations import calibrated
from support.motions import walking

from lobstr_hw.calibration import Residuals
from lobstr_hw.calibration.verdict import Grade, findings, verdict
from lobstr_hw.simulation import simulate


def test_nothing_to_complain_about_is_good() -> None:
    assert verdict(Residuals()) is Grade.GOOD
    assert not any(finding.advice for finding in findings(Residuals()))


@pytest.mark.parametrize(
    "odd",
    [
        Residuals(spread_m=0.039),
        Residuals(spread_rad=0.09),
        Residuals(heading_disagreement_rad=-0.5),
        Residuals(misfit=3.0),
    ],
)
def test_one_odd_number_makes_it_poor_and_says_what_to_do(odd: Residuals) -> None:
    assert verdict(odd) is Grade.POOR
    bad = [finding for finding in findings(odd) if finding.grade is not Grade.GOOD]
    assert len(bad) == 1
    assert bad[0].advice


def test_the_sign_of_the_heading_disagreement_does_not_matter() -> None:
    a = Residuals(heading_disagreement_rad=0.3)
    assert findings(a) == findings(replace(a, heading_disagreement_rad=-0.3))


def test_most_sloppy_t_poses_are_not_poor() -> None:
    grades = [verdict(calibrated(simulate(walking(1.0), seed)).residuals) for seed in range(15)]
    assert grades.count(Grade.POOR) <= 2
