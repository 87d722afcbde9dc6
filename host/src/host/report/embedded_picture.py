"""A figure of matplotlib -> an image in a page: nothing in it runs, the same bytes twice."""

from __future__ import annotations

import base64
import io
import re
from typing import TYPE_CHECKING

from host.report.html_text import escaped

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_ILLEGAL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff\ud800-\udfff]")  # in XML 1.0


def picture(figure: Figure, text: str) -> str:
    """Return an ``<img>`` with the drawing in it.

    Parameters
    ----------
    figure : Figure
    text : str
        What it shows, for those who do not see it, and under it.
    """
    import matplotlib as mpl

    svg_text = io.StringIO()
    with mpl.rc_context({"svg.hashsalt": "host"}):
        figure.savefig(svg_text, format="svg", metadata={"Date": None})
    body = base64.b64encode(_ILLEGAL.sub("", svg_text.getvalue()).encode("utf-8")).decode("ascii")
    about = escaped(text)
    return (
        f'<figure><img alt="{about}" src="data:image/svg+xml;base64,{body}">'
        f"<figcaption>{about}</figcaption></figure>"
    )
