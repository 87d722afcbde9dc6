"""Pictures for a notebook: shown beneath the cell, saved under their names."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from host.sysid.answer.answer_figures import save_all
from host.sysid.pipeline.notebook_html import escaped

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Pictures(Mapping[str, "Figure"]):
    """Figures of matplotlib by name."""

    def __init__(self, figures: Mapping[str, Figure]) -> None:
        self._figures = dict(figures)

    def __getitem__(self, name: str) -> Figure:
        """Return a figure by name."""
        return self._figures[name]

    def __iter__(self) -> Iterator[str]:
        """Go through the names."""
        return iter(self._figures)

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self._figures)

    def __repr__(self) -> str:
        """Return the names."""
        return f"Pictures({', '.join(self._figures)})"

    def save(self, folder: str | Path) -> list[Path]:
        """Write each as SVG into a folder and return the files.

        Raises
        ------
        UsageError
            If one cannot be written.
        """
        return save_all(self._figures, Path(folder))

    def _repr_html_(self) -> str:
        """Return all as images, in which nothing can run."""
        return "".join(_image(name, figure) for name, figure in self._figures.items())


def _image(name: str, figure: Figure) -> str:
    svg_bytes = io.BytesIO()
    figure.savefig(svg_bytes, format="svg")
    text = base64.b64encode(svg_bytes.getvalue()).decode("ascii")
    return f'<img alt="{escaped(name)}" src="data:image/svg+xml;base64,{text}"/>'
