"""Names of pins: ``PK0`` by port and bit, or the number printed on an Arduino Mega."""

from __future__ import annotations

PORTS = "ABCDEFGHJKL"

# Digital pins 0..53, then A0..A15: Debian arduino-core-avr, variants/mega/pins_arduino.h.
_MEGA = (
    "PE0 PE1 PE4 PE5 PG5 PE3 PH3 PH4 PH5 PH6 PB4 PB5 PB6 PB7 PJ1 PJ0 PH1 PH0 PD3 PD2 PD1 PD0 "
    "PA0 PA1 PA2 PA3 PA4 PA5 PA6 PA7 PC7 PC6 PC5 PC4 PC3 PC2 PC1 PC0 PD7 PG2 PG1 PG0 "
    "PL7 PL6 PL5 PL4 PL3 PL2 PL1 PL0 PB3 PB2 PB1 PB0 "
    "PF0 PF1 PF2 PF3 PF4 PF5 PF6 PF7 PK0 PK1 PK2 PK3 PK4 PK5 PK6 PK7"
).split()


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
