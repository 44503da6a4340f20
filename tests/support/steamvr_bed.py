"""A SteamVR to play with: ``fake_vrclient.c`` behind the real package openvr.

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

from lobstr_hw.rotations import Array

SOURCE = Path(__file__).parent / "fake_vrclient.c"
DEVICES, EVENTS, SETTINGS = 64, 512, 8

HEADSET, CONTROLLER, TRACKER, BASE_STATION = 1, 2, 3, 4
LEFT, RIGHT = 1, 2
RUNNING_OK = 200


class Device(ctypes.Structure):
    """One slot of SteamVR's device table."""

    _fields_ = [
        *((name, ctypes.c_int32) for name in ("device_class", "hand", "result", "activity")),
        ("connected", ctypes.c_uint8),
        ("valid", ctypes.c_uint8),
        ("unused", ctypes.c_uint8 * 2),
        ("T", ctypes.c_float * 12),
        ("velocity", ctypes.c_float * 3),
        ("spin", ctypes.c_float * 3),
        ("battery", ctypes.c_float),
        *((name, ctypes.c_char * 32) for name in ("serial", "model", "firmware")),
        *((name, ctypes.c_char * 64) for name in ("controller_type", "registered_type")),
    ]


class Event(ctypes.Structure):
    _fields_ = [
        ("type", ctypes.c_uint32),
        ("device", ctypes.c_uint32),
        ("age_s", ctypes.c_float),
        ("button", ctypes.c_uint32),
    ]


class Setting(ctypes.Structure):
    _fields_ = [("key", ctypes.c_char * 128), ("value", ctypes.c_char * 64)]


class Stage(ctypes.Structure):
    """All that the fake SteamVR plays, and what it was asked."""

    _fields_ = [
        ("init_error", ctypes.c_int32),
        ("hidden_interface", ctypes.c_int32),
        ("events_raised", ctypes.c_uint32),
        ("events", Event * EVENTS),
        ("trackers", Setting * SETTINGS),
        ("devices", Device * DEVICES),
        ("app_type", ctypes.c_int32),
        ("origin", ctypes.c_int32),
        ("predicted_s", ctypes.c_float),
        *(
            (name, ctypes.c_uint32)
            for name in ("inits", "cleanups", "quits_acknowledged", "poses_asked", "events_read")
        ),
    ]


class SteamVR:
    """What a test does to SteamVR, its devices and its user."""

    def __init__(self, stage: Stage) -> None:
        self.stage = stage

    def add(
        self,
        index: int,
        device_class: int,
        serial: str,
        controller_type: str = "",
        hand: int = 0,
        p: tuple[float, float, float] = (0.0, 1.0, 0.0),
    ) -> Device:
        """Switch a device on, in sight."""
        device: Device = self.stage.devices[index]
        device.device_class, device.hand, device.result = device_class, hand, RUNNING_OK
        device.connected = device.valid = 1
        device.battery = -1.0
        device.serial, device.model = serial.encode(), b"a model"
        device.controller_type = controller_type.encode()
        self.move(index, np.eye(3), np.array(p))
        return device

    def move(self, index: int, R: Array, p: Array) -> None:
        """Put a device somewhere, in the standing universe."""
        T = np.concatenate([R, np.reshape(p, (3, 1))], axis=1)
        self.stage.devices[index].T[:] = T.ravel().tolist()

    def raise_event(self, kind: int, device: int = 0, age_s: float = 0.0, button: int = 0) -> None:
        """Queue an event for whoever polls."""
        self.stage.events[self.stage.events_raised % EVENTS] = Event(kind, device, age_s, button)
        self.stage.events_raised += 1

    def set_role(self, registered_type: str, value: str) -> None:
        """Choose a role in "Manage Trackers"."""
        free = next(s for s in self.stage.trackers if s.key in (b"", registered_type.encode()))
        free.key, free.value = f"/devices/{registered_type}".encode(), value.encode()


def build_runtime(folder: Path) -> Path:
    """Compile the fake client library into ``folder``; the path registry that leads to it."""
    compiler = shutil.which("cc")
    need("Linux, for the client library is built there", "run it on Linux", sys.platform == "linux")
    need("a C compiler", "apt-get install gcc libc6-dev", compiler is not None)
    need("the package openvr", "pip install 'lobstr-hw[openvr]'", find_spec("openvr") is not None)
    library = folder / "runtime" / "bin" / "linux64" / "vrclient.so"
    library.parent.mkdir(parents=True)
    flags = ["-std=c11", "-O1", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared"]
    command = [compiler or "cc", *flags, *_table_layout(), "-o", str(library), str(SOURCE)]
    subprocess.run(command, check=True)
    registry = folder / "openvrpaths.vrpath"
    paths = {"runtime": [str(folder / "runtime")], "config": [str(folder)], "log": [str(folder)]}
    registry.write_text(
        json.dumps({**paths, "version": 1, "jsonid": "vrpathreg"}), encoding="utf-8"
    )
    return registry


def _table_layout() -> Iterator[str]:
    """Where the installed package expects each function."""
    import openvr

    tables = {"SYSTEM": openvr.IVRSystem_FnTable, "SETTINGS": openvr.IVRSettings_FnTable}
    for table, layout in tables.items():
        yield f"-D{table}_SLOTS={len(layout._fields_)}"
        yield from (f"-DSLOT_{field[0]}={slot}" for slot, field in enumerate(layout._fields_))


@contextmanager
def running_steamvr(registry: Path, stage_file: Path) -> Iterator[SteamVR]:
    """A SteamVR without devices, found through the environment."""
    stage_file.write_bytes(bytes(ctypes.sizeof(Stage)))
    with stage_file.open("r+b") as file:
        stage = Stage.from_buffer(mmap.mmap(file.fileno(), 0))  # unmapped with its last user
    with environment(VR_PATHREG_OVERRIDE=str(registry), FAKE_STEAMVR_STAGE=str(stage_file)):
        yield SteamVR(stage)
