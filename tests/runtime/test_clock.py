import ast
from pathlib import Path

import lobstr_hw.runtime
from lobstr_hw.runtime.clock import HostClock

RUNTIME = Path(lobstr_hw.runtime.__path__[0])


def test_the_clock_starts_at_zero_and_never_goes_back() -> None:
    clock = HostClock()
    times = [clock.now_s() for _ in range(1000)]
    assert 0.0 <= times[0] < 1.0
    assert times == sorted(times)


def test_waiting_takes_at_least_as_long_as_asked_for() -> None:
    clock = HostClock()
    before = clock.now_s()
    clock.sleep(0.005)
    clock.sleep(-1.0)
    assert clock.now_s() - before >= 0.005


def test_no_other_module_of_the_loop_reads_time() -> None:
    for path in sorted([*RUNTIME.glob("*.py"), *RUNTIME.glob("outputs/*.py")]):
        if path.name == "clock.py":
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert not {"time", "datetime"} & set(names), path.name
