"""Where the file of the base stations lies when nobody says otherwise."""

from pathlib import Path

import platformdirs

from lobstr_hw.drivers import with_option

__all__ = ["default_stations_path", "with_station_file"]


def default_stations_path() -> Path:
    """In the user's configuration folder; it need not exist yet."""
    return platformdirs.user_config_path("lobstr-hw", appauthor=False) / "base_stations.json"


def with_station_file(spec: str) -> str:
    """A driver's spec, NAME[:key=value,...]; a driver that keeps base stations is told where.

    Raises:
        ValueError: there is no such driver.
    """
    return with_option(spec, "stations", default_stations_path()) or spec
