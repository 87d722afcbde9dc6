"""The pin map: what is committed is current, and every kind of conflict stops generation."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

HW = Path(__file__).resolve().parents[2] / "hw"
FRAMES = (HW.parent / "protocol" / "frames.toml").read_text()
PIN_MAP = (HW / "pin_map.toml").read_text()


def load_module(name: str) -> ModuleType:
    """Load a program of hw/, which is no package."""
    spec = importlib.util.spec_from_file_location(f"hw_{name}", HW / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[f"hw_{name}"] = module
    folder = str((HW / name).parent)  # as if it were run: its neighbours are found
    if folder not in sys.path:
        sys.path.append(folder)
    spec.loader.exec_module(module)
    return module


GENERATOR = load_module("generate")


def test_committed_files_are_current() -> None:
    done = subprocess.run(
        [sys.executable, HW / "generate.py", "--check"], capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(
    ("before", "after", "complaint"),
    [
        ('pin = "3"', 'pin = "2"', "pin 2: used by servo_aileron and servo_elevator"),
        ('pin = "41"', 'pin = "70"', "the Mega has no pin 70"),
        ('pin = "11"', 'pin = "4"', "pin 4 cannot do OC1A"),
        ('name = "led"', 'name = "buzzer"', "two signals are called buzzer"),
        ('name = "timer 0"', 'name = "timer 5"', "timer 5: claimed for"),
        ("rudder pulse (mode 14", "tone (mode 14", "servo_rudder: OC1A needs timer 1"),
        (
            'name = "rc_4"\npin = "A12"\nfunction = "PCINT20"',
            'name = "rc_4"\npin = "10"\nfunction = "PCINT4"',
            "rc_4: port B also carries the card's SPI",
        ),
    ],
)
def test_conflicts_are_refused(before: str, after: str, complaint: str) -> None:
    assert before in PIN_MAP
    with pytest.raises(GENERATOR.PinMapError, match=complaint):
        GENERATOR.load_signals(PIN_MAP.replace(before, after))


def test_scan_order_gives_the_delays_of_the_schema() -> None:
    signals = GENERATOR.load_signals(PIN_MAP)
    order = GENERATOR.analogue_order(FRAMES, signals)
    assert [name for name, _ in order][-1] == "rail"
    assert len({channel for _, channel in order}) == 11
    with pytest.raises(GENERATOR.PinMapError, match="beta_b"):
        GENERATOR.analogue_order(FRAMES.replace("delay_us = -2040", "delay_us = -2041"), signals)
