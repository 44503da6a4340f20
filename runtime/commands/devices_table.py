"""The tables of ``lobstr-devices``."""

from collections.abc import Sequence

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from lobstr_hw.runtime.device_watch import DeviceReport, DriverReport
from lobstr_hw.trackers import TrackingState

__all__ = ["page"]

LOW_BATTERY = 0.2


def page(reports: Sequence[DriverReport]) -> RenderableType:
    """The devices that are there; then the drivers that show none, and what mends it."""
    parts: list[RenderableType] = []
    if any(report.devices for report in reports):
        parts.append(_devices(reports))
    empty = [report for report in reports if not report.devices]
    if empty:
        parts += [Text(), _drivers(empty)] if parts else [_drivers(empty)]
    return Group(*parts)


def _table(*titles: str) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold")
    for title in titles:
        # a command that is cut cannot be copied
        table.add_column(title, overflow="fold")
    return table


def _devices(reports: Sequence[DriverReport]) -> Table:
    titles = ["driver", "serial", "kind", "model", "role", "state", "battery", "firmware"]
    sees = any(d.stations_in_view is not None for report in reports for d in report.devices)
    table = _table(*titles, *(["sees"] if sees else []))
    for report in reports:
        for device in report.devices:
            role = (device.role_hint or "-").replace("_", " ")
            cells = (device.serial, device.kind, device.model or "-", role)
            last = (_state(device), _battery(device.battery), Text(device.firmware or "-"))
            table.add_row(report.name, *map(Text, cells), *last, *([_sees(device)] if sees else []))
    return table


def _drivers(reports: Sequence[DriverReport]) -> Table:
    table = _table("driver", "", "what to do")
    for report in reports:
        style = "green" if report.available and not report.missing else "yellow"
        table.add_row(report.name, Text(_words(report), style), Text(report.fix, "cyan"))
    return table


def _words(report: DriverReport) -> str:
    if report.missing:
        return report.missing if report.available else f"missing: {report.missing}"
    return "ready, not looked at" if report.fix else "ready, nothing there"


def _state(device: DeviceReport) -> Text:
    worn = " (worn)" if device.worn else ""
    if device.state is None:
        return Text("-" + worn)
    good = device.state in (TrackingState.OK, TrackingState.INERTIAL)
    return Text(device.state.replace("_", " ") + worn, "green" if good else "yellow")


def _sees(device: DeviceReport) -> Text:
    """Base stations in view, and on how many sensors."""
    if device.stations_in_view is None:
        return Text("-")
    if not device.stations_in_view:
        return Text("no station", "yellow")
    many = "" if device.stations_in_view == 1 else "s"
    return Text(f"{device.stations_in_view} station{many}, {device.sensors_hit} sensors")


def _battery(battery: float | None) -> Text:
    if battery is None:
        return Text("-")
    return Text(f"{battery:.0%}", "red" if battery < LOW_BATTERY else "")
