"""GPX 1.1 (topografix.com/GPX/1/1): a track in segments, marks as waypoints."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as Xml

from host.export.kml_writer import Geography, Place, utc_text
from host.text import shown

GPX = "http://www.topografix.com/GPX/1/1"


def write_gpx(path: Path, geography: Geography) -> None:
    """Write a GPX file.

    Parameters
    ----------
    path : Path
    geography : Geography
        Tracks become segments of one track, pieces tracks of their own, marks waypoints.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    Xml.register_namespace("", GPX)
    root = Xml.Element(f"{{{GPX}}}gpx", {"version": "1.1", "creator": "flight-test-host"})
    about = _child(root, "metadata")
    _child(about, "name", geography.name)
    data = [f"{name}: {value}" for name, value in geography.data.items()]
    _child(about, "desc", "; ".join([geography.text, *data]))
    for name, place in geography.marks:
        _point(root, "wpt", place, name)
    _track(root, geography.name, [list(one.places) for one in geography.tracks])
    for piece in geography.pieces:
        _track(root, piece.name, [list(piece.places)], piece.text)
    Xml.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)


def _track(root: Xml.Element, name: str, segments: list[list[Place]], text: str = "") -> None:
    track = _child(root, "trk")
    _child(track, "name", name)
    if text:
        _child(track, "desc", text)
    for places in segments:
        segment = _child(track, "trkseg")
        for place in places:
            _point(segment, "trkpt", place)


def _point(parent: Xml.Element, kind: str, place: Place, name: str = "") -> None:
    point = _child(parent, kind)
    point.set("lat", f"{place.latitude_deg:.7f}")
    point.set("lon", f"{place.longitude_deg:.7f}")
    if place.height_m == place.height_m:
        _child(point, "ele", f"{place.height_m:.2f}")
    _child(point, "time", utc_text(place.utc_s))
    if name:
        _child(point, "name", name)


def _child(parent: Xml.Element, name: str, text: str | None = None) -> Xml.Element:
    made = Xml.SubElement(parent, f"{{{GPX}}}{name}")
    if text is not None:
        made.text = shown(text)
    return made
