"""A USB device with HID interfaces as the kernel shows it to umockdev. Standard library only."""

import struct
from dataclasses import dataclass

__all__ = ["HID_DESCRIPTOR", "Place", "descriptors", "records"]

HID_DESCRIPTOR = bytes.fromhex("0600ff0901a101150026ff0075089540090181020901b102c0")
"""Vendor-defined: 64 bytes in, a feature report of 64 bytes."""
HID_CLASS, HID_TYPE, INTERRUPT = 3, 0x21, 3


@dataclass(frozen=True)
class Place:
    """Where a device hangs, from one plugging in to the next.

    Attributes:
        port: of the bus.
        address: on the bus.
        hidraw: number of its first device file of that kind.
    """

    port: int
    address: int
    hidraw: int

    @property
    def syspath(self) -> str:
        """In sysfs."""
        return f"/devices/pci0000:00/0000:00:14.0/usb1/1-{self.port}"

    @property
    def usb_node(self) -> str:
        """Device file for libusb."""
        return f"/dev/bus/usb/001/{self.address:03d}"

    def hidraw_node(self, interface: int) -> str:
        """Device file for hidraw."""
        return f"/dev/hidraw{self.hidraw + interface}"


def descriptors(vendor: int, product: int, ends: tuple[int, ...]) -> tuple[bytes, bytes]:
    """Device and configuration: an HID interface with an interrupt endpoint in for each end."""
    body = b"".join(
        struct.pack("<9B", 9, 4, number, 0, 1, HID_CLASS, 0, 0, 0)
        + struct.pack("<BBHBBBH", 9, HID_TYPE, 0x0110, 0, 1, 0x22, len(HID_DESCRIPTOR))
        + struct.pack("<BBBBHB", 7, 5, end, INTERRUPT, 64, 1)
        for number, end in enumerate(ends)
    )
    device = struct.pack(
        "<BBHBBBBHHHBBBB", 18, 1, 0x0200, 0, 0, 0, 64, vendor, product, 0x0100, 1, 2, 3, 1
    )
    whole = struct.pack("<BBHBBBBB", 9, 2, 9 + len(body), len(ends), 1, 0, 0x80, 250) + body
    return device, whole


def records(
    vendor: int, product: int, serial: str, name: str, ends: tuple[int, ...], place: Place
) -> list[str]:
    """The device and below it, for each interface, itself, its HID device and the file of that."""
    both = b"".join(descriptors(vendor, product, ends)).hex().upper()
    found = [
        f"P: {place.syspath}\nN: {place.usb_node[5:]}\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\n"
        f"E: DEVNAME={place.usb_node}\nE: BUSNUM=001\nE: DEVNUM={place.address:03d}\nE: MAJOR=189\n"
        f"E: MINOR={place.address - 1}\n"
        f"A: idVendor={vendor:04x}\\n\nA: idProduct={product:04x}\\n\n"
        f"A: manufacturer=Valve\\n\nA: product={name}\\n\nA: serial={serial}\\n\n"
        f"A: bcdDevice=0100\\n\nA: busnum=1\\n\nA: devnum={place.address}\\n\nA: speed=12\\n\n"
        "A: bConfigurationValue=1\\n\nA: bNumConfigurations=1\\n\n"
        f"H: descriptors={both}\n"
    ]
    for number in range(len(ends)):
        interface = f"{place.syspath}/1-{place.port}:1.{number}"
        node = place.hidraw_node(number)
        hid = f"{interface}/0003:{vendor:04X}:{product:04X}.{place.hidraw + number:04X}"
        found += [
            f"P: {interface}\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_interface\n"
            f"A: bInterfaceNumber={number:02x}\\n\nA: bInterfaceClass=03\\n\n",
            f"P: {hid}\nE: SUBSYSTEM=hid\nE: HID_ID=0003:{vendor:08X}:{product:08X}\n"
            f"E: HID_NAME={name}\nE: HID_UNIQ={serial}\n"
            f"A: uevent=DRIVER=hid-generic\\nHID_ID=0003:{vendor:08X}:{product:08X}\\n"
            f"HID_NAME={name}\\nHID_UNIQ={serial}\\n\n"
            f"H: report_descriptor={HID_DESCRIPTOR.hex().upper()}\n",
            f"P: {hid}/hidraw/{node[5:]}\nN: {node[5:]}\nE: SUBSYSTEM=hidraw\nE: DEVNAME={node}\n"
            f"E: MAJOR=245\nE: MINOR={place.hidraw + number}\n"
            f"L: device=../../../{hid.rsplit('/', 1)[1]}\n",
        ]
    return found
