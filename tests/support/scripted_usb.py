"""A USB device that answers and sends what a script holds. Standard library only: it stands behind
the test beds, whose Python has no numpy, as well as behind a fake transport."""

import json
from dataclasses import dataclass, field
from pathlib import Path

__all__ = ["FeatureAnswers", "ScriptedDevice", "load_script", "save_script"]

CONFIG_START, CONFIG_PIECE = 0x10, 0x11


@dataclass
class ScriptedDevice:
    """One device.

    Attributes:
        vendor: of its USB identity.
        product: of its USB identity.
        address: on the bus, 2 and up.
        serial: its USB string.
        name: its USB string.
        ends: interrupt endpoints in, by interface.
        features: what it answers, by report id: one after the other, the last one for ever.
            A report that is not here STALLs.
        reports: time in s, interface, data.
    """

    vendor: int
    product: int
    address: int = 2
    serial: str = ""
    name: str = ""
    ends: tuple[int, ...] = (0x81,)
    features: dict[int, list[bytes]] = field(default_factory=dict)
    reports: list[tuple[float, int, bytes]] = field(default_factory=list)


class FeatureAnswers:
    """Answers by the script; faults are told to it.

    Attributes:
        stalled: report ids that are refused.
        config_pieces: it stops answering after so many pieces of its configuration.
        longest: answers are cut to so many bytes.
        garbled: pieces of the configuration hold noise.
        sent: what was written to it.
    """

    def __init__(self, features: dict[int, list[bytes]]) -> None:
        self._features = features
        self._asked: dict[int, int] = {}
        self.stalled: set[int] = set()
        self.config_pieces: int | None = None
        self.longest: int | None = None
        self.garbled = False
        self.sent: list[bytes] = []

    def get(self, report_id: int) -> bytes | None:
        """The answer; None: STALL."""
        answers = self._features.get(report_id)
        if not answers or report_id in self.stalled:
            return None
        if report_id == CONFIG_START:
            self._asked[CONFIG_PIECE] = 0
        nth = self._asked.get(report_id, 0)
        self._asked[report_id] = nth + 1
        answer = answers[min(nth, len(answers) - 1)]
        if report_id == CONFIG_PIECE:
            if self.config_pieces is not None and nth >= self.config_pieces:
                return None
            if self.garbled:
                answer = answer[:4] + bytes(b ^ 0x5A for b in answer[4:])
        return answer[: self.longest]

    def set(self, data: bytes) -> bool:
        """Something is written to it; False: STALL."""
        if data[0] in self.stalled:
            return False
        self.sent.append(data)
        return True


def save_script(devices: list[ScriptedDevice], path: Path) -> None:
    """As JSON."""
    script = [
        {
            **vars(d),
            "features": {str(k): [a.hex() for a in v] for k, v in d.features.items()},
            "reports": [[t, i, data.hex()] for t, i, data in d.reports],
        }
        for d in devices
    ]
    path.write_text(json.dumps(script), encoding="utf-8")


def load_script(path: Path) -> list[ScriptedDevice]:
    """From JSON."""
    script = json.loads(path.read_text(encoding="utf-8"))
    return [
        ScriptedDevice(
            **{
                **d,
                "ends": tuple(d["ends"]),
                "features": {
                    int(k): [bytes.fromhex(a) for a in v] for k, v in d["features"].items()
                },
                "reports": [(t, i, bytes.fromhex(data)) for t, i, data in d["reports"]],
            }
        )
        for d in script
    ]
