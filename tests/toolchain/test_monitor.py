"""`pio device monitor` listens at the speed at which the firmware speaks."""

from __future__ import annotations

import configparser
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize(
    ("environment", "source", "name"),
    [
        ("mega2560", "firmware/app/instrument.cpp", "kUsbBaud"),
        ("arduimu", "firmware/drivers/ublox.h", "kBaud"),
    ],
)
def test_monitor_speed_is_that_of_the_firmware(environment: str, source: str, name: str) -> None:
    settings = configparser.ConfigParser(interpolation=None)
    settings.read(ROOT / "platformio.ini", encoding="utf-8")
    text = (ROOT / source).read_text(encoding="utf-8")
    found = re.search(rf"constexpr uint32_t {name} = (\d+)", text)
    assert found is not None
    assert settings[f"env:{environment}"]["monitor_speed"] == found[1]
