"""Any OpenXR runtime, through the package ``pyopenxr``: headset, hands and trackers."""

from lobstr_hw.drivers.openxr.driver import OpenXRDriver

__all__ = ["OpenXRDriver"]
