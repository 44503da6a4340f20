"""An OpenXR runtime's reasons not to start a session, in the words of this project."""

from lobstr_hw.errors import DeviceBusy, DriverError, DriverUnavailable, TrackerNotFound

__all__ = ["translated"]

NO_RUNTIME = {"RuntimeUnavailableError", "FileAccessErrorError", "FileContentsInvalidError"}
NO_HEADSET = {"FormFactorUnavailableError", "FormFactorUnsupportedError"}


def translated(error: Exception) -> DriverError:
    """The error to raise ``from`` one of the vendor's, which says what to do next.

    Args:
        error: an ``XrException``; or a ValueError, the package's answer to a code it does not know.
    """
    reason = type(error).__name__
    if reason in NO_RUNTIME:
        return DriverUnavailable(
            f"no OpenXR runtime is active here ({error}) Start SteamVR (Settings, OpenXR, set as "
            "active runtime) or Monado, then try again."
        )
    if reason in NO_HEADSET:
        return TrackerNotFound(
            f"the OpenXR runtime has no headset ({error}) Plug it in and switch it on, then try "
            "again."
        )
    if reason == "LimitReachedError":
        return DeviceBusy(
            f"the OpenXR runtime takes no further session ({error}) Close other programs that use "
            "the headset, then try again."
        )
    return DriverUnavailable(
        f"the OpenXR runtime let no session begin ({reason}: {error}) Restart it, then try again; "
        "or use --driver openvr with SteamVR."
    )
