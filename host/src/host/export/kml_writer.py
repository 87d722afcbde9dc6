"""KML 2.2 with Google's gx:Track, and KMZ: a path with time, pieces of it, marks.

Schemas: OGC 07-147r2 and developers.google.com/kml, kml22gx.xsd. Names come in as text; what XML
cannot hold is shown as its code before.
"""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from xml.etree import ElementTree as Xml

from host.text import shown

KML = "http://www.opengis.net/kml/2.2"
GX = "http://www.google.com/kml/ext/2.2"
_DATE = (1980, 1, 1, 0, 0, 0)  # of the file in the archive: the same bytes twice


@dataclass(frozen=True, slots=True)
class Place:
    """Where something was and when: UTC s since 1970, deg, deg, m above mean sea level."""

    utc_s: float
    latitude_deg: float
    longitude_deg: float
    height_m: float


@dataclass(frozen=True, slots=True)
class Path3d:
    """A named way; `colour` is ``aabbggrr``."""

    name: str
    places: Sequence[Place]
    colour: str = "ffaaaaaa"
    text: str = ""


@dataclass(frozen=True, slots=True)
class Geography:
    """Tracks, pieces and marks of a file of places.

    Attributes
    ----------
    name, text : str
    tracks : list of Path3d
        With time; several where the record has gaps.
    pieces : list of Path3d
        Without time: test points.
    marks : list of (str, Place)
    data : mapping of str to str
        Shown with the document.
    """

    name: str
    text: str
    tracks: list[Path3d]
    pieces: list[Path3d] = field(default_factory=list)
    marks: list[tuple[str, Place]] = field(default_factory=list)
    data: dict[str, str] = field(default_factory=dict)


def kml_text(geography: Geography) -> bytes:
    """Return a KML document."""
    Xml.register_namespace("", KML)
    Xml.register_namespace("gx", GX)
    root = Xml.Element(f"{{{KML}}}kml")
    document = _child(root, "Document")
    _child(document, "name", geography.name)
    _child(document, "description", geography.text)
    extended = _child(document, "ExtendedData") if geography.data else None
    for name, value in geography.data.items():
        if extended is not None:
            one = _child(extended, "Data")
            one.set("name", shown(name))
            _child(one, "value", value)
    for path in geography.tracks:
        _track(document, path)
    for path in geography.pieces:
        _piece(document, path)
    for name, place in geography.marks:
        mark = _child(document, "Placemark")
        _child(mark, "name", name)
        _child(_child(mark, "TimeStamp"), "when", utc_text(place.utc_s))
        point = _child(mark, "Point")
        _child(point, "altitudeMode", "absolute")
        _child(point, "coordinates", _corner(place, ","))
    return bytes(Xml.tostring(root, encoding="utf-8", xml_declaration=True))


def write_kml(path: Path, geography: Geography) -> None:
    """Write a KML file, or a KMZ archive if its name ends so.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    text = kml_text(geography)
    if path.suffix.lower() != ".kmz":
        path.write_bytes(text)
        return
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(zipfile.ZipInfo("doc.kml", _DATE), text, zipfile.ZIP_DEFLATED)


def utc_text(utc_s: float) -> str:
    """Return an instant as XML has it, to a millisecond."""
    at = datetime.fromtimestamp(round(utc_s, 3), UTC)
    return at.strftime("%Y-%m-%dT%H:%M:%S.") + f"{at.microsecond // 1000:03d}Z"


def _track(document: Xml.Element, path: Path3d) -> None:
    mark = _styled(document, path, 2)
    track = Xml.SubElement(mark, f"{{{GX}}}Track")
    _child(track, "altitudeMode", "absolute")
    for place in path.places:
        _child(track, "when", utc_text(place.utc_s))
    for place in path.places:
        Xml.SubElement(track, f"{{{GX}}}coord").text = _corner(place, " ")


def _piece(document: Xml.Element, path: Path3d) -> None:
    mark = _styled(document, path, 4)
    line = _child(mark, "LineString")
    _child(line, "extrude", "1")
    _child(line, "altitudeMode", "absolute")
    _child(line, "coordinates", " ".join(_corner(place, ",") for place in path.places))


def _styled(document: Xml.Element, path: Path3d, width: int) -> Xml.Element:
    mark = _child(document, "Placemark")
    _child(mark, "name", path.name)
    if path.text:
        _child(mark, "description", path.text)
    style = _child(mark, "Style")
    line = _child(style, "LineStyle")
    _child(line, "color", path.colour)
    _child(line, "width", str(width))
    return mark


def _corner(place: Place, between: str) -> str:
    height = place.height_m if place.height_m == place.height_m else 0.0
    numbers = (f"{place.longitude_deg:.7f}", f"{place.latitude_deg:.7f}", f"{height:.2f}")
    return between.join(numbers)


def _child(parent: Xml.Element, name: str, text: str | None = None) -> Xml.Element:
    made = Xml.SubElement(parent, f"{{{KML}}}{name}")
    if text is not None:
        made.text = shown(text)
    return made
