"""Reads from SteamVR what a device is."""

import ctypes
from collections.abc import Callable, Mapping
from typing import Any

from lobstr_hw.drivers.chosen_roles import hint
from lobstr_hw.drivers.driver import DeviceInfo
from lobstr_hw.drivers.openvr.roles import HEADSET, Facts, device_kind, said_role
from lobstr_hw.trackers import TrackerRole

__all__ = ["DeviceReader"]

SETTING_BYTES = 256
WORN = {1: True, 2: True, 3: False}
"""Activity levels of a headset: in use, just now in use, standing by; others say nothing."""


class DeviceReader:
    """Asks a running SteamVR about devices by their index; what it does not know is empty."""

    def __init__(self, openvr: Any, system: Any, chosen: Mapping[str, TrackerRole]) -> None:
        """Keep the vendor's module and system, and which serials the user gave a role."""
        self._openvr, self._system, self._chosen = openvr, system, chosen
        # asked first: where the interface is missing, the package would end the session
        known = openvr.isInterfaceVersionValid(openvr.IVRSettings_Version)
        self._settings = openvr.VRSettings() if known else None

    def serial(self, index: int) -> str:
        """Empty while SteamVR does not know it: a device that just woke up."""
        return self._text(index, self._openvr.Prop_SerialNumber_String)

    def controller_type(self, index: int) -> str:
        """As in ``knuckles`` or ``vive_tracker_waist``."""
        return self._text(index, self._openvr.Prop_ControllerType_String)

    def info(self, index: int) -> DeviceInfo:
        """All there is to say about a device."""
        facts = self._facts(index)
        return DeviceInfo(
            facts.serial,
            device_kind(facts),
            model=self._text(index, self._openvr.Prop_ModelNumber_String),
            role_hint=hint(facts.serial, said_role(facts), self._chosen),
            firmware=self._text(index, self._openvr.Prop_TrackingFirmwareVersion_String),
            battery=self._battery(index),
            worn=self._worn(index) if facts.device_class == HEADSET else None,
        )

    def _facts(self, index: int) -> Facts:
        return Facts(
            self.serial(index),
            self._system.getTrackedDeviceClass(index),
            self._system.getControllerRoleForTrackedDeviceIndex(index),
            self.controller_type(index),
            self._role_setting(index),
        )

    def _role_setting(self, index: int) -> str:
        registered = self._text(index, self._openvr.Prop_RegisteredDeviceType_String)
        # Lighthouse trackers are registered as htc/vive_tracker<serial>
        for name in (registered, f"htc/vive_tracker{self.serial(index)}"):
            found = self._setting(f"/devices/{name}") if name else ""
            if found:
                return found
        return ""

    def _setting(self, key: str) -> str:
        if self._settings is None:
            return ""
        # not settings.getString: it takes the length from a C function that returns nothing
        value = ctypes.create_string_buffer(SETTING_BYTES)
        error = self._openvr.EVRSettingsError()
        self._settings.function_table.getString(
            b"trackers", key.encode(), value, SETTING_BYTES, ctypes.byref(error)
        )
        return value.value.decode(errors="replace") if error.value == 0 else ""

    def _battery(self, index: int) -> float | None:
        prop = self._openvr.Prop_DeviceBatteryPercentage_Float
        found = self._asked(lambda: self._system.getFloatTrackedDeviceProperty(index, prop), None)
        return None if found is None else float(found)

    def _worn(self, index: int) -> bool | None:
        return WORN.get(self._system.getTrackedDeviceActivityLevel(index))

    def _text(self, index: int, prop: int) -> str:
        found = self._asked(lambda: self._system.getStringTrackedDeviceProperty(index, prop), "")
        return str(found)

    def _asked(self, ask: Callable[[], Any], otherwise: Any) -> Any:
        try:
            return ask()
        except (self._openvr.OpenVRError, KeyError, UnicodeDecodeError):
            # KeyError: the package's answer to an error code younger than itself
            return otherwise
