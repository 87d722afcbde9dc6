"""A vane in a file of its own, named by an aircraft file: frequency, damping, friction.

``[sensors] vane = "vane.toml"`` by the aircraft file; what ``hw/mechanics`` makes of its solids
is such a file. A number stands in one of the two files, never in both.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from host.errors import UsageError
from host.files import toml_reader

KEYS = ("vane_frequency_hz_per_mps", "vane_damping", "vane_friction_rad")


def with_vane(
    document: Mapping[str, object], folder: Path, where: str, error: type[UsageError]
) -> dict[str, object]:
    """Return an aircraft's document with the numbers of the vane file it names.

    Parameters
    ----------
    document : mapping
        The aircraft file.
    folder : Path
        Where a name without a folder of its own is looked for.
    where : str
        The aircraft file, for messages.
    error : type
        What to raise.

    Raises
    ------
    UsageError
        As `error`: no such vane file, a number missing in it or stated twice.
    """
    sensors = document.get("sensors")
    if not isinstance(sensors, dict) or "vane" not in sensors:
        return dict(document)
    named = sensors["vane"]
    if not isinstance(named, str) or not named.endswith(".toml"):
        raise error(f"{where}: sensors.vane is {named!r}, expected the name of a .toml file")
    vane = toml_reader.read(folder / named, folder, "vane file", error)
    missing = [key for key in (*KEYS, "source") if key not in vane]
    if missing:
        raise error(f"{where}: {named} has no {missing[0]}, expected {', '.join(KEYS)} and source")
    twice = [key for key in KEYS if key in sensors]
    if twice:
        raise error(f"{where}: {twice[0]} stands there and in {named}: delete one")
    own = sensors.get("sources", {})
    sources = (own if isinstance(own, dict) else {}) | dict.fromkeys(KEYS, vane["source"])
    merged = sensors | {key: vane[key] for key in KEYS} | {"sources": sources}
    return dict(document) | {"sensors": merged}
