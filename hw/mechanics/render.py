"""A picture of bodies: parallel light, no perspective, hidden faces by depth; numpy alone."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

Array = np.ndarray[Any, np.dtype[Any]]
_SUN = np.array([0.35, -0.5, 0.8]) / np.linalg.norm([0.35, -0.5, 0.8])
# Pixels are drawn three times finer and averaged.
_FINER = 3
_EDGE_MM = 0.6


def view(azimuth_deg: float, elevation_deg: float) -> Array:
    """Return rows right, up, towards the eye, for an eye at that azimuth (0 from x) and height."""
    a, e = np.radians([azimuth_deg, elevation_deg])
    eye = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return np.stack([right, np.cross(eye, right), eye])


def triangles(shape: Any, tolerance_mm: float = 0.1) -> Array:
    """Return a body's surface, shape (n, 3, 3)."""
    points, faces = shape.tessellate(tolerance_mm, 0.3)
    places = np.array([(p.X, p.Y, p.Z) for p in points])
    return np.asarray(places[np.array(faces, dtype=int)])


def draw(
    path: Path,
    bodies: Sequence[tuple[Array, str]],
    *,
    azimuth_deg: float = -60.0,
    elevation_deg: float = 30.0,
    width_px: int = 800,
) -> None:
    """Write a PNG.

    Parameters
    ----------
    path
        File to write.
    bodies
        Triangles and colour of each.
    azimuth_deg, elevation_deg
        Where the eye stands.
    width_px
        Width; the height follows.
    """
    turn = view(azimuth_deg, elevation_deg)
    seen = [(mesh @ turn.T, mesh, colour) for mesh, colour in bodies]
    corners = np.concatenate([m.reshape(-1, 3) for m, _, _ in seen])
    low, high = corners.min(axis=0), corners.max(axis=0)
    scale = (width_px - 24) * _FINER / (high[0] - low[0])
    wide = width_px * _FINER
    tall = int((high[1] - low[1]) * scale) + 24 * _FINER
    depth = np.full((tall, wide), -np.inf)
    shade = np.full((tall, wide, 3), 255.0)
    owner = np.full((tall, wide), -1)
    for number, (mesh, world, colour) in enumerate(seen):
        tint = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)], dtype=float)
        for corner, place in zip(mesh, world, strict=True):
            normal = np.cross(place[1] - place[0], place[2] - place[0])
            length = float(np.linalg.norm(normal))
            if length > 0.0:
                light = 0.55 + 0.45 * abs(float(normal @ _SUN)) / length
                x = (corner[:, 0] - low[0]) * scale + 12 * _FINER
                y = (high[1] - corner[:, 1]) * scale + 12 * _FINER
                _fill(depth, shade, owner, x, y, corner[:, 2], tint * light, number)
    _outline(depth, shade, owner)
    whole = shade[: tall - tall % _FINER]
    small = whole.reshape(tall // _FINER, _FINER, width_px, _FINER, 3)
    picture = Image.fromarray(small.mean(axis=(1, 3)).astype(np.uint8))
    path.parent.mkdir(parents=True, exist_ok=True)
    picture.quantize(64, dither=Image.Dither.NONE).save(path, optimize=True)


def _fill(
    depth: Array, shade: Array, owner: Array, x: Array, y: Array, z: Array, tint: Array, number: int
) -> None:
    x1, x2 = max(int(x.min()), 0), min(int(x.max()) + 2, depth.shape[1])
    y1, y2 = max(int(y.min()), 0), min(int(y.max()) + 2, depth.shape[0])
    area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0])
    if abs(area) < 1e-9 or x1 >= x2 or y1 >= y2:
        return
    px, py = np.meshgrid(np.arange(x1, x2) + 0.5, np.arange(y1, y2) + 0.5)
    b = ((px - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (py - y[0])) / area
    c = ((x[1] - x[0]) * (py - y[0]) - (px - x[0]) * (y[1] - y[0])) / area
    here = z[0] + b * (z[1] - z[0]) + c * (z[2] - z[0])
    window = (slice(y1, y2), slice(x1, x2))
    hit = (b >= -1e-6) & (c >= -1e-6) & (b + c <= 1.0 + 1e-6) & (here > depth[window])
    depth[window][hit] = here[hit]
    shade[window][hit] = tint
    owner[window][hit] = number


def _outline(depth: Array, shade: Array, owner: Array) -> None:
    # Dark where another body begins, or the same one stands further back.
    far = np.where(np.isfinite(depth), depth, -1e6)
    edge = np.zeros(depth.shape, dtype=bool)
    for axis in (0, 1):
        step = np.abs(np.diff(far, axis=axis)) > _EDGE_MM
        other = np.diff(owner, axis=axis) != 0
        grow = [(0, 1) if k == axis else (0, 0) for k in (0, 1)]
        edge |= np.pad(step | other, grow)
    shade[edge] *= 0.25
