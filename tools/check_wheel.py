"""Fail when the wheel lacks a file of the tree, or puts anything but lobstr_hw into site-packages.

python tools/check_wheel.py dist/lobstr_hw-*.whl
"""

import subprocess
import sys
import zipfile
from pathlib import Path, PurePosixPath

FOLDERS = ("lobstr_hw", "calibration", "drivers", "runtime")
SHIPPED = {".py", ".typed", ".onnx", ".json", ".mcap", ".csv", ".md", ".rules"}
SIZE_LIMIT_MB = 25.0


def expected() -> set[str]:
    """Tracked files of the four code folders, by their place in site-packages."""
    listed = subprocess.run(["git", "ls-files", "-z", *FOLDERS], capture_output=True, check=True)
    names = [n for n in listed.stdout.decode().split("\0") if PurePosixPath(n).suffix in SHIPPED]
    return {n if n.startswith("lobstr_hw/") else f"lobstr_hw/{n}" for n in names}


def main() -> None:
    wheel = Path(sys.argv[1])
    names = set(zipfile.ZipFile(wheel).namelist())
    strangers = {n.split("/")[0] for n in names if not n.endswith("/")} - {"lobstr_hw"}
    strangers = {s for s in strangers if not s.endswith(".dist-info")}
    missing = sorted(expected() - names)
    if strangers or missing:
        sys.exit(f"{wheel.name}: missing {missing}, beside lobstr_hw {sorted(strangers)}")
    size_mb = wheel.stat().st_size / 1e6
    if size_mb > SIZE_LIMIT_MB:
        sys.exit(f"{wheel.name} has {size_mb:.1f} MB, more than {SIZE_LIMIT_MB}")
    print(f"{wheel.name}: {len(names)} files, {size_mb:.1f} MB, nothing missing")


if __name__ == "__main__":
    main()
