"""Figures of matplotlib by name: shown beneath a notebook's cell, saved whole or not at all."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from host.export.atomic_files import atomic_write, file_names
from host.text import shown

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


def save_all(pictures: Mapping[str, Figure], folder: Path) -> list[Path]:
    """Write pictures as SVG under their names and return where."""
    named = zip(file_names(pictures), pictures.values(), strict=True)
    return [save(figure, folder / f"{name}.svg") for name, figure in named]


def save(figure: Figure, path: Path) -> Path:
    """Write a figure, whole or not at all; return where.

    Raises
    ------
    UsageError
        If it cannot be written.
    """
    with atomic_write(path) as part:
        figure.savefig(part)
    return path


def _image(name: str, figure: Figure) -> str:
    svg_bytes = io.BytesIO()
    figure.savefig(svg_bytes, format="svg")
    text = base64.b64encode(svg_bytes.getvalue()).decode("ascii")
    label = html.escape(shown(name), quote=True)
    return f'<img alt="{label}" style="max-width:100%" src="data:image/svg+xml;base64,{text}"/>'
