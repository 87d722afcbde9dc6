"""`host ports`: the serial ports of this computer, and which of them may be the logger."""

from __future__ import annotations

import argparse
import json
from typing import Any


def add_parser(subparsers: Any) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "ports",
        help="list the serial ports with a logger plugged in",
        description="List the serial ports of this computer, those that look like a Mega first.",
        epilog="Exit code 5 if nothing is plugged in by USB.",
    )
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(args: argparse.Namespace) -> int:
    """Print the ports; exit code 5 without one on USB."""
    from host.errors import ExitCode
    from host.link.serial import DeviceError, SerialPort, serial_ports

    def row(port: SerialPort) -> str:
        return f"{port.device:<16}  {port.usb_ids:<9}  {port.looks_like:<30}  {port.description}"

    ports = serial_ports()
    if args.json:
        print(json.dumps([_as_json(port) for port in ports], indent=2))
    elif ports:
        print(f"{'port':<16}  {'USB ids':<9}  {'looks like':<30}  description")
        print("\n".join(row(port) for port in ports))
    if not any(port.usb_ids for port in ports):
        raise DeviceError(
            "nothing is plugged in by USB; a cable that only charges carries no data,"
            " and a clone with CH340 needs its driver on Windows and macOS"
        )
    return int(ExitCode.OK)


def _as_json(port: Any) -> dict[str, object]:
    return {
        "device": port.device,
        "description": port.description,
        "usb_ids": port.usb_ids or None,
        "serial_number": port.serial_number or None,
        "looks_like": port.looks_like,
        "is_mega": port.is_mega,
        "may_be_mega": port.is_mega or bool(port.chip),
    }
