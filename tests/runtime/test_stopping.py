import signal

import pytest

from lobstr_hw.runtime.stopping import SIGNALS, StopRequest


@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_sets_a_flag_and_the_next_one_has_its_usual_effect(number: int) -> None:
    usual = signal.getsignal(number)
    with StopRequest() as stop:
        assert not stop()
        assert signal.getsignal(number) != usual
        signal.raise_signal(number)
        assert stop()
        assert signal.getsignal(number) == usual


def test_without_a_signal_everything_is_given_back() -> None:
    usual = [signal.getsignal(number) for number in SIGNALS]
    with StopRequest() as stop:
        pass
    assert not stop()
    assert [signal.getsignal(number) for number in SIGNALS] == usual
