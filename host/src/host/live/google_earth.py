"""The track for Google Earth: a network link that asks again every second."""

from __future__ import annotations

from collections.abc import Sequence

_AGAIN_S = 1.0


def network_link(url: str) -> str:
    """Return the KML that a user opens once; it loads `url` every second."""
    import simplekml

    kml = simplekml.Kml(name="host live")
    link = kml.newnetworklink(name="live track")
    link.link.href = url
    link.link.refreshmode = simplekml.RefreshMode.oninterval
    link.link.refreshinterval = _AGAIN_S
    return str(kml.kml())


def track_document(places: Sequence[tuple[float, float, float]]) -> str:
    """Return the track so far and where the aircraft is.

    Parameters
    ----------
    places : sequence of (float, float, float)
        Latitude, longitude (deg), height above mean sea level (m).
    """
    import simplekml

    kml = simplekml.Kml(name="flight")
    there = [(longitude, latitude, height) for latitude, longitude, height in places]
    if there:
        line = kml.newlinestring(name="track", coords=there)
        line.altitudemode = simplekml.AltitudeMode.absolute
        line.extrude = 1
        line.style.linestyle.width = 3
        line.style.linestyle.color = simplekml.Color.red
        point = kml.newpoint(name="aircraft", coords=there[-1:])
        point.altitudemode = simplekml.AltitudeMode.absolute
    return str(kml.kml())
