"""An OpenXR runtime to play with: ``fake_openxr.c`` behind the loader of the real package pyopenxr.

The structs are those of the C file, word for word.
"""

import ctypes
import json
import mmap
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from support.beds import environment, need

from lobstr_hw.rotations import Array, to_quat_xyzw

SOURCE = Path(__file__).parent / "fake_openxr.c"
HEADER = Path("/usr/include/openxr/openxr.h")
PLACES, XDEVS, MESSAGES = 16, 8, 64
BUTTONS = ("trigger", "grip", "menu", "system", "a", "b")

ROTATION_VALID, PLACE_VALID, ROTATION_TRACKED, PLACE_TRACKED = 1, 2, 4, 8
IN_SIGHT = 15

HEAD, LEFT, RIGHT = "/user/head", "/user/hand/left", "/user/hand/right"
TRACKER_ROLE = "/user/vive_tracker_htcx/role/"


class Place(ctypes.Structure):
    """One device, or the place where one could be."""

    _fields_ = [
        ("path", ctypes.c_char * 64),
        ("persistent", ctypes.c_char * 64),
        ("connected", ctypes.c_int32),
        ("flags", ctypes.c_uint32),
        ("p", ctypes.c_float * 3),
        ("quat_xyzw", ctypes.c_float * 4),
        ("velocity", ctypes.c_float * 3),
        ("has_velocity", ctypes.c_int32),
        ("pressed", ctypes.c_uint32 * len(BUTTONS)),
        ("changed_ns", ctypes.c_int64),
    ]


class XDev(ctypes.Structure):
    _fields_ = [
        ("name", ctypes.c_char * 64),
        ("serial", ctypes.c_char * 64),
        ("there", ctypes.c_int32),
        ("can_create_space", ctypes.c_int32),
        ("place", ctypes.c_int32),
    ]


class Message(ctypes.Structure):
    _fields_ = [("kind", ctypes.c_uint32), ("value", ctypes.c_int32)]


class Stage(ctypes.Structure):
    """All that the fake runtime plays, and what it was asked."""

    _fields_ = [
        *(
            (f"refuse_{name}", ctypes.c_int32)
            for name in ("instance", "system", "session", "locate")
        ),
        ("without", ctypes.c_uint32),
        ("messages_sent", ctypes.c_uint32),
        ("focus_withheld", ctypes.c_int32),
        ("focus_lost_unsaid", ctypes.c_int32),
        ("xdev_generation", ctypes.c_uint32),
        ("clock_offset_ns", ctypes.c_int64),
        ("messages", Message * MESSAGES),
        ("places", Place * PLACES),
        ("xdevs", XDev * XDEVS),
        *(
            (name, ctypes.c_uint32)
            for name in (
                "instances",
                "destroyed",
                "sessions",
                "begun",
                "ended",
                "syncs",
                "located",
                "messages_read",
                "profiles_suggested",
                "bindings_suggested",
            )
        ),
        ("last_time_ns", ctypes.c_int64),
        ("base_space", ctypes.c_int32),
    ]


class OpenXR:
    """What a test does to a runtime, its devices and its user."""

    def __init__(self, stage: Stage) -> None:
        self.stage = stage

    def add(self, index: int, path: str, persistent: str = "") -> Place:
        """Switch a device on, in sight."""
        place: Place = self.stage.places[index]
        place.path, place.persistent = path.encode(), persistent.encode()
        place.connected, place.flags = 1, IN_SIGHT
        self.move(index, np.eye(3), np.array([0.0, 1.0, 0.0]))
        return place

    def add_xdev(self, index: int, name: str, serial: str, place: int) -> XDev:
        """A device on Monado's list, which is located at one of the places."""
        xdev: XDev = self.stage.xdevs[index]
        xdev.name, xdev.serial = name.encode(), serial.encode()
        xdev.there = xdev.can_create_space = 1
        xdev.place = place
        self.stage.xdev_generation += 1
        return xdev

    def move(self, index: int, R: Array, p: Array) -> None:
        """Put a device somewhere over the floor."""
        self.stage.places[index].p[:] = p.tolist()
        self.stage.places[index].quat_xyzw[:] = to_quat_xyzw(R).tolist()

    def wait(self, seconds: float) -> None:
        """Let time pass on the runtime's clock."""
        self.stage.clock_offset_ns += round(seconds * 1e9)

    def send(self, kind: int, value: int = 0) -> None:
        """Queue a message of the runtime."""
        self.stage.messages[self.stage.messages_sent % MESSAGES] = Message(kind, value)
        self.stage.messages_sent += 1


def build_runtime(folder: Path) -> Path:
    """Compile the fake runtime into ``folder``; the manifest that leads to it."""
    compiler = shutil.which("cc")
    need("Linux, for the runtime is built there", "run it on Linux", sys.platform == "linux")
    need("a C compiler", "apt-get install gcc libc6-dev", compiler is not None)
    need("OpenXR's headers", "apt-get install libopenxr-dev", HEADER.exists())
    need("the package pyopenxr", "pip install 'lobstr-hw[openxr]'", find_spec("xr") is not None)
    folder.mkdir(exist_ok=True)
    library = folder / "fake_openxr.so"
    flags = ["-std=c11", "-O1", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared"]
    command = [compiler or "cc", *flags, "-o", str(library), str(SOURCE), "-lm"]
    subprocess.run(command, check=True)
    manifest = folder / "runtime.json"
    runtime = {"name": "fake", "library_path": str(library)}
    manifest.write_text(
        json.dumps({"file_format_version": "1.0.0", "runtime": runtime}), encoding="utf-8"
    )
    return manifest


@contextmanager
def running_openxr(manifest: Path, stage_file: Path) -> Iterator[OpenXR]:
    """A runtime without devices, found through the environment."""
    stage_file.write_bytes(bytes(ctypes.sizeof(Stage)))
    with stage_file.open("r+b") as file:
        stage = Stage.from_buffer(mmap.mmap(file.fileno(), 0))  # unmapped with its last user
    quiet = {"XR_LOADER_DEBUG": "none"}
    with environment(XR_RUNTIME_JSON=str(manifest), FAKE_OPENXR_STAGE=str(stage_file), **quiet):
        yield OpenXR(stage)
        stage.refuse_instance = 0
        _let_go()


def _let_go() -> None:
    """The loader keeps a runtime, and what it said it can do, until an instance of it ends."""
    import xr

    xr.destroy_instance(xr.create_instance(xr.InstanceCreateInfo(enabled_extension_names=[])))
