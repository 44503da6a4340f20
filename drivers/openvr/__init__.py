"""SteamVR, through the package ``openvr``: headset, controllers and every tracker it knows."""

from lobstr_hw.drivers.openvr.driver import OpenVRDriver

__all__ = ["OpenVRDriver"]
