"""FlightGear flies JSBSim: the aircraft's own XML behind FlightGear's controls, and a -set.xml."""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree import ElementTree

KNOTS = 3600.0 / 1852.0
FEET = 1.0 / 0.3048
# FlightGear's controls: stick forward, roll right, nose right positive; ours trailing edge down,
# roll right, trailing edge left.
CONTROLS = (
    ("elevator", "fcs/elevator-cmd-norm", "fcs/elevator-pos-rad", 1.0),
    ("aileron", "fcs/aileron-cmd-norm", "fcs/left-aileron-pos-rad", 1.0),
    ("rudder", "fcs/rudder-cmd-norm", "fcs/rudder-pos-rad", -1.0),
)
# Without an engine of JSBSim's own FlightGear hands no throttle on: its property is read itself.
THROTTLE = "/controls/engines/engine[0]/throttle"
LIMITS = (
    "For FlightGear: put this file and its NAME-set.xml into a folder of --fg-aircraft and start"
    " with --aircraft=NAME. It starts in the air and has no landing gear and no 3D model.",
    f"Sticks move the surfaces to their full travel; the throttle is {THROTTLE}.",
)


def with_controls(xml: str, limit_rad: Mapping[str, float]) -> str:
    """Return JSBSim's XML of an aircraft with surfaces and throttle driven by FlightGear's.

    Parameters
    ----------
    xml : str
    limit_rad : mapping of str to float
        Full travel of elevator, aileron and rudder, rad.
    """
    root = ElementTree.fromstring(xml)
    about = root.find("fileheader/description")
    if about is not None:
        about.text = "\n".join([about.text or "", *LIMITS])
    channel = ElementTree.Element("channel", name="sticks")
    for surface, command, position, sign in CONTROLS:
        _gain(channel, f"{surface}-travel", command, position, sign * limit_rad[surface])
    _gain(channel, "throttle-travel", THROTTLE, "fcs/throttle-shaft", 1.0)
    rotor = next(part for part in root if part.tag == "flight_control")
    first = next(k for k, part in enumerate(rotor) if part.tag == "channel")
    rotor.insert(first, channel)
    declared = ElementTree.Element("property", value="0")
    declared.text = THROTTLE
    rotor.insert(0, declared)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def set_text(name: str, title: str, airspeed_mps: float) -> str:
    """Return FlightGear's ``NAME-set.xml`` of an aircraft that starts at an airspeed."""
    root = ElementTree.Element("PropertyList")
    sim = ElementTree.SubElement(root, "sim")
    presets = ElementTree.SubElement(sim, "presets")
    for parent, tag, text in (
        (sim, "description", title), (sim, "author", "host identify"),
        (sim, "flight-model", "jsb"), (sim, "aero", name),
        (presets, "onground", "false"),
        (presets, "altitude-ft", f"{100.0 * FEET:.0f}"),
        (presets, "airspeed-kt", f"{airspeed_mps * KNOTS:.1f}"),
    ):  # fmt: skip
        ElementTree.SubElement(parent, tag).text = text
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _gain(channel: ElementTree.Element, name: str, source: str, target: str, gain: float) -> None:
    part = ElementTree.SubElement(channel, "pure_gain", name=name)
    for tag, text in (("input", source), ("gain", repr(gain)), ("output", target)):
        ElementTree.SubElement(part, tag).text = text
