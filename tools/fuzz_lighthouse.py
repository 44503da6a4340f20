"""Feed the Lighthouse parsers with what no device would say, guided by coverage.

    pip install atheris==3.0.0        (Linux and macOS)
    python tools/fuzz_lighthouse.py --runs 1000000 [PARSER ...] [--write docs/results.md]

Only documented errors may come out of a parser, within bounded memory and time. What breaks one is
kept as a file beside where this was run; make a test of it.
"""

import argparse
import datetime
import importlib
import json
import re
import struct
import subprocess
import sys
import tempfile
import zlib
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from results_page import write_section

HEADING = "## Lighthouse: fuzzing"
LONGEST, MEMORY_MB, SECONDS = 4096, 600, 20
"""Of an input; what a parser may use, the libraries included; what one input may take."""
DONE = re.compile(r"#(\d+)\s+DONE\s+cov: (\d+) ft: (\d+) corp: (\d+)/")
Target = Callable[[bytes], object]


def reports(data: bytes) -> None:
    """Reports of one device, each behind a byte that says how long it is; then what they mean."""
    from lobstr_hw.drivers.lighthouse.decoding import DeviceDecoder
    from lobstr_hw.drivers.lighthouse.device_reader import DeviceReader
    from lobstr_hw.drivers.lighthouse.made_room import made_device

    if len(data) < 2:
        return
    reader = DeviceReader(old_radio=bool(data[0] & 1), gen2_light=bool(data[0] & 2))
    decoder, at = DeviceDecoder(made_device("fuzzed")), 1
    while at < len(data):
        length = data[at]
        reader.feed(data[at + 1 : at + 1 + length])
        at += 1 + length
    decoder.decode(reader.take())


def messages(data: bytes) -> None:
    """One radio message, its light in both forms, and words."""
    from lobstr_hw.drivers.lighthouse.compact_light import parse_compact_light
    from lobstr_hw.drivers.lighthouse.gen2_words import parse_words
    from lobstr_hw.drivers.lighthouse.radio import parse_message

    for old in (False, True):
        message = parse_message(data, old)
        if message is not None:
            parse_compact_light(message.light, 1 << 40)
            parse_words(message.light)
    parse_compact_light(data, 1 << 40)
    parse_words(data)


def config(data: bytes) -> None:
    """A configuration, packed or not."""
    from lobstr_hw.drivers.lighthouse.device_config import (
        inflate_config,
        join_pieces,
        parse_config,
    )
    from lobstr_hw.errors import FileFormatError

    pieces = [data[k : k + 64] for k in range(0, len(data), 64)]
    with suppress(FileFormatError):
        parse_config(data)
    with suppress(FileFormatError):
        parse_config(inflate_config(data))
    with suppress(FileFormatError):
        inflate_config(join_pieces(pieces))


def ootx(data: bytes) -> None:
    """A station's bits, some missed, and its payload."""
    from lobstr_hw.drivers.lighthouse.ootx import GEN1_PAYLOAD, GEN2_PAYLOAD, OotxReader
    from lobstr_hw.drivers.lighthouse.station_message import parse_station

    parse_station(data)
    bits = [bit for byte in data for bit in _bits(byte)]
    for length in (GEN1_PAYLOAD, GEN2_PAYLOAD):
        payload = OotxReader(length).feed(bits)
        if payload is not None:
            parse_station(payload)


def _bits(byte: int) -> list[int | None]:
    """Four bits; where one of the other four is set, it was missed."""
    return [None if byte >> (k + 4) & 1 else byte >> k & 1 for k in range(4)]


def usb(data: bytes) -> None:
    """A capture of Linux or Windows."""
    _recording(data)


def survive(data: bytes) -> None:
    """A text recording."""
    _recording(data)


def stations(data: bytes) -> None:
    """A file of base stations."""
    from lobstr_hw.drivers.lighthouse.station_file import load_stations
    from lobstr_hw.errors import StationFileError

    with suppress(StationFileError):
        load_stations(_file(data))


def _recording(data: bytes) -> None:
    from lobstr_hw.drivers.lighthouse.decoding import DeviceDecoder
    from lobstr_hw.drivers.lighthouse.recordings import read_recording
    from lobstr_hw.errors import FileFormatError

    with suppress(FileFormatError):
        for device in read_recording(_file(data)):
            if device.model is not None:
                DeviceDecoder(device.model, device.ranges).decode(device.events)


def _file(data: bytes) -> Path:
    path = Path(tempfile.gettempdir()) / f"fuzzed-{_NAME}"
    path.write_bytes(data)
    return path


_NAME = "input"
TARGETS: dict[str, Target] = {
    f.__name__: f for f in (reports, messages, config, ootx, usb, survive, stations)
}
SHARES = {"messages": 0.66, "config": 0.18, "stations": 0.04}
"""Of all inputs, by how quick a parser is; 3 % each for the others."""


def seeds(name: str) -> list[bytes]:
    """Inputs that make sense, to begin with."""
    from lobstr_hw.drivers.lighthouse.made_room import made_reports, made_stations
    from lobstr_hw.drivers.lighthouse.station_file import save_stations

    said = made_reports(0.2, 0)
    match name:
        case "reports":
            some = b"".join(bytes([len(r)]) + r for r in said[:40])
            return [b"\2" + some, b"\1" + _framed(0x24, 59), b"\0" + _framed(0x25, 64)]
        case "messages":
            return [bytes([1, 20, 2, 0xF0]) + bytes(range(25)), bytes([1, 9, 2, 0x10, *range(9)])]
        case "config":
            return [_json(), zlib.compress(_json()), zlib.compress(bytes(1 << 21))]
        case "ootx":
            return [bytes(17) + b"\1" * 60, bytes(range(43)), bytes(33)]
        case "usb":
            return [_usbmon(said[:10]), _usbpcap(said[:10])]
        case "survive":
            line = b"0.1 T20 i 7 1000 0 1 2 3 4 5 0 0 0 1\n0.2 T20 C 1 2000 300\n"
            light = b"0.3 T20 Y 1 3000 1 0\n0.4 T20 W 1 0 4000 0\n"
            return [line, b"0.0 T20 CONFIG " + _json().replace(b"\n", b"") + b"\n" + line + light]
    path = Path(tempfile.gettempdir()) / "fuzz-seed.json"
    save_stations(path, made_stations(), {})
    data = path.read_bytes()
    path.unlink()
    return [data, b'{"format": 1, "stations": []}']


def _framed(report_id: int, length: int) -> bytes:
    return bytes([length, report_id]) + bytes(range(length - 1))


def _json() -> bytes:
    said = {
        "device_serial_number": "LHR-0",
        "device_class": "generic_tracker",
        "imu": {"acc_bias": [0, 0, 0], "plus_x": [1, 0, 0], "plus_z": [0, 0, 1],
                "position": [0, 0, 0]},
        "lighthouse_config": {"modelPoints": [[0, 0, 0.1]], "modelNormals": [[0, 0, 1]],
                              "channelMap": [3]},
    }  # fmt: skip
    return json.dumps(said).encode()


def _usbmon(said: Sequence[bytes]) -> bytes:
    from lobstr_hw.drivers.lighthouse.usb_report import ReportKind, UsbReport
    from lobstr_hw.drivers.lighthouse.usbmon_writer import UsbmonWriter

    path = Path(tempfile.gettempdir()) / "fuzz-seed.pcap"
    writer, packed = UsbmonWriter(path), zlib.compress(_json())
    pieces = [packed[k : k + 62] for k in range(0, len(packed), 62)] + [b""]
    answers = [b"\x10\0\0", *(bytes([0x11, len(p)]) + p for p in pieces), b"\1\3\2"]
    for data in answers:
        writer.add(UsbReport((1, 2), 1.0, ReportKind.FEATURE_GET, 0, data))
    for data in said:
        writer.add(UsbReport((1, 2), 2.0, ReportKind.INPUT, 0x81, data))
    writer.close()
    data = path.read_bytes()
    path.unlink()
    return data


def _usbpcap(said: Sequence[bytes]) -> bytes:
    made = struct.pack("<IIIHHqI", 0x0A0D0D0A, 28, 0x1A2B3C4D, 1, 0, -1, 28)
    for data in said:
        head = struct.pack("<HQIHBHHBBI", 27, 1, 0, 9, 1, 1, 2, 0x81, 1, len(data))
        packet = head + data
        packet += bytes(-len(packet) % 4)
        size = 32 + len(packet)
        block = struct.pack("<IIIIIII", 6, size, 0, 0, 1, len(head) + len(data), len(head))
        made += block + packet + struct.pack("<I", size)
    return made


@dataclass(frozen=True, slots=True)
class Fuzzed:
    """One parser's run: inputs, places in the code reached, and pairs of them; or what broke it."""

    name: str
    inputs: int
    reached: int
    features: int
    kept: int
    broke: str


def fuzz(name: str, runs: int, minutes: float) -> Fuzzed:
    """Run one parser in a process of its own: the fuzzer ends the process that it runs in."""
    with tempfile.TemporaryDirectory() as folder:
        corpus = Path(folder)
        for k, data in enumerate(seeds(name)):
            (corpus / f"seed{k}").write_bytes(data)
        command = [sys.executable, __file__, "--inside", name, "--runs", str(runs)]
        done = subprocess.run(
            [*command, "--corpus", folder, "--minutes", str(minutes)],
            stderr=subprocess.PIPE,
            text=True,
            check=False,
            start_new_session=True,  # Ctrl-C is for this process, which keeps what was found
        )
    end = DONE.search(done.stderr)
    broke = "" if done.returncode == 0 and end else done.stderr[-3000:]
    inputs, reached, features, kept = map(int, end.groups()) if end else (0, 0, 0, 0)
    return Fuzzed(name, inputs, reached, features, kept, broke)


def inside(name: str, runs: int, corpus: str, minutes: float) -> None:
    """Never returns."""
    global _NAME
    _NAME = name
    atheris = importlib.import_module("atheris")  # mypy need not know it
    with atheris.instrument_imports(include=["lobstr_hw.drivers.lighthouse"]):
        TARGETS[name](seeds(name)[0])
    limits = [f"-max_len={LONGEST}", f"-rss_limit_mb={MEMORY_MB}", f"-timeout={SECONDS}"]
    limits.append(f"-max_total_time={60 * minutes:.0f}")
    atheris.Setup([sys.argv[0], corpus, f"-runs={runs}", "-seed=1", *limits], TARGETS[name])
    atheris.Fuzz()


def section(found: Sequence[Fuzzed], runs: int, minutes: float) -> str:
    """The section of docs/results.md."""
    lines = [
        HEADING,
        "",
        f"atheris 3.0.0 (libFuzzer), seed 1, inputs of up to {LONGEST} bytes, {MEMORY_MB} MB and"
        f" {SECONDS} s each at most; only documented errors. Reached: branches of"
        " `drivers/lighthouse` that were taken.",
        "",
        f"`python tools/fuzz_lighthouse.py --runs {runs} --minutes {minutes:g}`,"
        f" {datetime.date.today().isoformat()}.",
        "",
        "| parser | inputs | reached | kept as different | broke |",
        "|---|---|---|---|---|",
    ]
    lines += [
        f"| {f.name} | {f.inputs:,} | {f.reached} | {f.kept} | {'yes' if f.broke else 'no'} |"
        for f in found
    ]
    return "\n".join([*lines, f"| all | {sum(f.inputs for f in found):,} | | | |", ""])


def main() -> int:
    """Fuzz, print the section, write it where asked; fail where a parser broke."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("parsers", nargs="*", metavar="PARSER", help=", ".join(TARGETS))
    parser.add_argument("--runs", type=int, default=100_000, help="inputs in all")
    parser.add_argument("--minutes", type=float, default=60.0, help="for each parser at most (60)")
    parser.add_argument("--jobs", type=int, default=2, help="parsers at a time")
    parser.add_argument("--write", type=Path, help="a file with such a section, to be replaced")
    parser.add_argument("--inside", help=argparse.SUPPRESS)
    parser.add_argument("--corpus", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.inside:
        inside(asked.inside, asked.runs, asked.corpus, asked.minutes)
    unknown = set(asked.parsers) - set(TARGETS)
    if unknown:
        parser.error(f"no such parser: {', '.join(sorted(unknown))}")
    names = asked.parsers or list(TARGETS)
    runs = [int(asked.runs * SHARES.get(name, 0.03)) for name in names]
    with ThreadPoolExecutor(asked.jobs) as pool:
        found = list(pool.map(fuzz, names, runs, [asked.minutes] * len(names)))
    for one in found:
        if one.broke:
            print(f"{one.name}:\n{one.broke}", file=sys.stderr)
    text = section(found, asked.runs, asked.minutes)
    print(text)
    if asked.write is not None:
        write_section(text, asked.write)
    return 1 if any(one.broke for one in found) else 0


if __name__ == "__main__":
    sys.exit(main())
