"""Who may open a USB device, and what mends it: on Linux the udev rules that lie beside this file.

60-lobstr-hw.rules gives devices to whoever sits at the machine (the tag uaccess); it has to sort
before systemd's 73-seat-late.rules, which acts on that tag.
"""

import os
import sys
from pathlib import Path

from lobstr_hw.errors import DriverUnavailable

__all__ = ["RULES", "device_node", "may_open", "no_permission"]

RULES = Path(__file__).with_name("60-lobstr-hw.rules")
LINUX_CURE = (
    "run  lobstr-devices --install-udev-rules  once (it asks for your password), then unplug the "
    "device and plug it in again"
)


def device_node(path: bytes) -> Path | None:
    """The device file behind one of hidapi's paths: itself (hidraw), or 1-2.3:1.0 (libusb)."""
    text = path.decode("utf-8", "replace")
    if sys.platform != "linux" or text.startswith("/dev/"):
        return Path(text) if text.startswith("/dev/") else None
    place = Path("/sys/bus/usb/devices") / text.split(":")[0]
    try:
        bus, device = (int((place / name).read_text()) for name in ("busnum", "devnum"))
    except (OSError, ValueError):
        return None
    return Path(f"/dev/bus/usb/{bus:03d}/{device:03d}")


def may_open(node: Path) -> bool:
    """Whether a device file lets this user in; one that is not there is no matter of permission."""
    return not node.exists() or os.access(node, os.R_OK | os.W_OK)


def no_permission(name: str) -> DriverUnavailable:
    """The error for a device that this user may not open."""
    if sys.platform == "linux":
        return DriverUnavailable(f"no permission for {name} on USB: {LINUX_CURE}")
    if sys.platform == "win32":
        cure = "close SteamVR; pyusb also needs the driver WinUSB, which Zadig installs"
    else:
        cure = "allow this terminal in System Settings, Privacy and Security, Input Monitoring"
    return DriverUnavailable(f"the system does not let this program open {name} on USB: {cure}")
