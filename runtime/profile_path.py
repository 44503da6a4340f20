"""Where a calibration profile lies when nobody says otherwise."""

from pathlib import Path

import platformdirs

__all__ = ["default_profile_path"]


def default_profile_path() -> Path:
    """In the user's configuration folder; it need not exist yet."""
    return platformdirs.user_config_path("lobstr-hw", appauthor=False) / "profile.json"
