"""Options and shared fixtures of all tests."""

import pytest
from hypothesis import settings

settings.register_profile("untimed", deadline=None)  # a busy machine is not a failed law
settings.load_profile("untimed")
pytest.register_assert_rewrite("support.driver_contract")  # its asserts explain themselves too


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--hardware", action="store", metavar="DRIVER", help="run on a real device")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Long runs and test beds are asked for by name; devices by --hardware."""
    asked = config.getoption("-m") or ""
    soak, bed = "soak" in asked, "bed" in asked
    for item in items:
        if "bed" in item.keywords and not bed:
            item.add_marker(pytest.mark.skip(reason="needs a test bed: pytest -m bed"))
        if "soak" in item.keywords and not soak:
            item.add_marker(pytest.mark.skip(reason="takes long: pytest -m soak"))
        if "hardware" in item.keywords and not config.getoption("--hardware"):
            item.add_marker(pytest.mark.skip(reason="needs a device: pytest --hardware DRIVER"))
