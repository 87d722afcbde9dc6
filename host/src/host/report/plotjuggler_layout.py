"""A layout for PlotJuggler: the strips of our page over the curves of an exported file.

PlotJuggler was not run; its elements are those that it writes itself (layout files of its users).
"""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as Xml

from host.constants import DEG_PER_RAD
from host.report.channel_list import shown_name
from host.report.shown_flight import ShownFlight
from host.report.strip_list import strips_of

_COLOURS = ("#0b5cad", "#c2410c", "#15803d", "#7e22ce")
PREFIX = {"ulog": "flight_test/", "mcap": "/flight/"}


def write_layout(flight: ShownFlight, path: Path, kind: str) -> None:
    """Write a layout next to an exported file; curves in degrees, as our page has them.

    Parameters
    ----------
    flight : ShownFlight
    path : Path
    kind : str
        ``ulog`` or ``mcap``: how PlotJuggler names its curves.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    columns = {shown_name(name): name for name in flight.columns if name != "t_s"}
    strips = [one for one in strips_of(columns) if one.on]
    root = Xml.Element("root")
    window = Xml.SubElement(root, "tabbed_widget", {"name": "Main Window", "parent": "main_window"})
    tab = Xml.SubElement(window, "Tab", tab_name="flight", containers="1")
    sizes = ";".join(f"{1.0 / len(strips):.6f}" for _ in strips)
    splitter = Xml.SubElement(
        Xml.SubElement(tab, "Container"), "DockSplitter",
        orientation="-", count=str(len(strips)), sizes=sizes,
    )  # fmt: skip
    for strip in strips:
        area = Xml.SubElement(splitter, "DockArea", name=strip.name)
        plot = Xml.SubElement(area, "plot", style="Lines", mode="TimeSeries")
        Xml.SubElement(plot, "limitY")
        for colour, channel in zip(_COLOURS, strip.channels, strict=False):
            name = PREFIX[kind] + columns[channel]
            curve = Xml.SubElement(plot, "curve", name=name, color=colour)
            if channel != columns[channel]:
                change = Xml.SubElement(curve, "transform", name="Scale/Offset",
                                        alias=f"{channel}")  # fmt: skip
                Xml.SubElement(change, "options", value_scale=f"{DEG_PER_RAD:.9f}",
                               value_offset="0", time_offset="0")  # fmt: skip
    Xml.SubElement(window, "currentTabIndex", index="0")
    Xml.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)
