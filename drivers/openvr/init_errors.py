"""SteamVR's reasons not to start a session, in the words of this project."""

from lobstr_hw.errors import DeviceBusy, DriverError, DriverUnavailable, TrackerNotFound

__all__ = ["translated"]

NO_STEAMVR = {
    "Init_InstallationNotFound",
    "Init_InstallationCorrupt",
    "Init_VRClientDLLNotFound",
    "Init_FileNotFound",
    "Init_FactoryNotFound",
    "Init_PathRegistryNotFound",
    "Init_NoConfigPath",
    "Init_NoLogPath",
}
NO_HEADSET = {"Init_HmdNotFound", "Init_HmdNotFoundPresenceFailed", "Init_HmdDriverIdIsNone"}
OTHER_VERSION = {
    "Init_InterfaceNotFound",
    "Init_InvalidInterface",
    "Init_MismatchedRuntimes",
    "OpenVRError",  # the package's own name for the first of these
}
BUSY = {
    "Init_Retry",
    "Init_AnotherAppLaunching",
    "Init_ShuttingDown",
    "Init_RebootingBusy",
    "Init_FirmwareUpdateBusy",
    "Init_FirmwareRecoveryBusy",
    "Init_USBServiceBusy",
}


def translated(error: Exception) -> DriverError:
    """The error to raise ``from`` one of the vendor's, which says what to do next.

    Args:
        error: an ``InitError`` of the package openvr; a KeyError, its answer to a code that is
            younger than the package.
    """
    reason = type(error).__name__.removeprefix("InitError_")
    if reason == "Init_NoServerForBackgroundApp":
        return DriverUnavailable("SteamVR is not running. Start it, then try again.")
    if reason in NO_STEAMVR:
        return DriverUnavailable(
            f"SteamVR is not installed here ({reason}). Install Steam and SteamVR, start SteamVR "
            "once, then try again."
        )
    if reason in NO_HEADSET:
        return TrackerNotFound(
            f"SteamVR sees no headset ({reason}). Plug it in and switch it on, wait until SteamVR "
            "shows it, then try again."
        )
    if reason in BUSY:
        return DeviceBusy(f"SteamVR is busy ({reason}). Wait until it is ready, then try again.")
    if reason in OTHER_VERSION:
        return DriverUnavailable(
            f"this SteamVR does not offer what the package openvr asks for ({reason}). Update "
            "SteamVR; if that does not help: pip install --upgrade openvr"
        )
    return DriverUnavailable(
        f"SteamVR let no session begin ({reason}: {error}). Restart SteamVR, then try again."
    )
