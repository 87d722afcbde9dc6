"""Names of pins: ``PK0`` by port and bit, or the number printed on an Arduino Mega."""

from __future__ import annotations

PORTS = "ABCDEFGHJKL"

# Digital pins 0..53, then A0..A15: Debian arduino-core-avr, variants/mega/pins_arduino.h.
_MEGA_PORTS = (
    ("E", "0145"), ("G", "5"), ("E", "3"), ("H", "3456"), ("B", "4567"), ("J", "10"), ("H", "10"),
    ("D", "3210"), ("A", "01234567"), ("C", "76543210"), ("D", "7"), ("G", "210"),
    ("L", "76543210"), ("B", "3210"), ("F", "01234567"), ("K", "01234567"),
)  # fmt: skip
_MEGA = tuple(f"P{port}{bit}" for port, bits in _MEGA_PORTS for bit in bits)


def pin_number(name: str) -> int:
    """Number of a pin in the simulator.

    Parameters
    ----------
    name : str
        Port and bit, as in ``PK0``.

    Returns
    -------
    int
        Port index * 8 + bit, 0..87.

    Raises
    ------
    ValueError
        If the ATmega2560 has no such pin.
    """
    if len(name) == 3 and name[0] == "P" and name[1] in PORTS and name[2] in "01234567":
        return PORTS.index(name[1]) * 8 + int(name[2])
    raise ValueError(f"no such pin: found {name!r}, expected P, a port of {PORTS} and a bit 0..7")


def pin_name(number: int) -> str:
    """Name of a pin by its number in the simulator, the inverse of :func:`pin_number`."""
    return f"P{PORTS[number // 8]}{number % 8}"


def arduino_pin(label: int | str) -> str:
    """Name of the pin that carries a label of the Arduino Mega.

    Parameters
    ----------
    label : int or str
        0..53, or ``A0``..``A15``.

    Returns
    -------
    str
        Port and bit, as in ``PK0`` for ``A8``.

    Raises
    ------
    ValueError
        If the board has no such label.
    """
    text = str(label)
    index = 54 + int(text[1:]) if text[:1] == "A" and text[1:].isdigit() else -1
    if text.isdigit():
        index = int(text)
    if not 0 <= index < len(_MEGA) or (text.isdigit() and index > 53):
        raise ValueError(f"no such Mega pin: found {label!r}, expected 0..53 or A0..A15")
    return _MEGA[index]
