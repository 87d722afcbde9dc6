"""A study's picture: a quarter of what matplotlib writes, nothing of it gone."""

from __future__ import annotations

import io
from xml.etree import ElementTree

import numpy as np
from matplotlib.figure import Figure
from studies.study_table import small_svg

SVG = "{http://www.w3.org/2000/svg}"


def test_a_picture_keeps_its_words_lines_and_places() -> None:
    figure = Figure(figsize=(4, 3))
    axes = figure.subplots()
    t = np.linspace(0.0, 1.0, 60)
    axes.plot(t, np.cos(40.0 * t), label="a & <b>")
    axes.set_title("error, %")
    axes.legend()
    large = io.BytesIO()
    figure.savefig(large, format="svg")
    small = small_svg(figure)
    assert len(small) < 0.6 * len(large.getvalue())
    root = ElementTree.fromstring(small)
    words = [one.text for one in root.iter(f"{SVG}text")]
    assert {"error, %", "a & <b>", "0.2"} <= set(words)
    longest = max((one.get("d", "") for one in root.iter(f"{SVG}path")), key=len)
    places = np.array(longest.replace("M", "").split(), dtype=float).reshape(-1, 2)
    assert len(places) == 60
    step = np.diff(places[:, 0])
    assert np.ptp(step) < 0.2  # even, to a tenth of a point
