"""Faces of traffic signs, drawn from discs, polygons and strokes.

Coordinates: x to the right and y up in [-0.5, 0.5], as ``signs.plate_outline`` has them. Colours
are the sRGB values of RAL 3020, 5017, 1023, 9017 and 9016, which EN 12899-1 signs are made in.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gen_data.generator.assets.procedural.noise import fbm, smoothstep
from gen_data.generator.assets.procedural.textures import artwork as art
from gen_data.generator.assets.procedural.variant_rng import uniform_between, variant_rng
from gen_data.generator.assets.scenery.signs import plate_outline, sign_name
from gen_data.generator.core.asset_types import TextureData

if TYPE_CHECKING:
    from PIL.Image import Image

SIZE_PX = 256
_DRAWN_PX = 4 * SIZE_PX

RED = (187, 30, 16)
BLUE = (0, 91, 140)
YELLOW = (240, 202, 0)
BLACK = (42, 41, 42)
WHITE = (241, 240, 234)
GREEN = (0, 131, 81)

Point = tuple[float, float]
Color = tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class Face:
    """An image that is drawn on in a sign's own coordinates."""

    image: Image

    def disc(self, centre: Point, radius: float, fill: Color) -> None:
        """A filled circle."""
        x, y = self._px(centre)
        r = radius * _DRAWN_PX
        art.pen(self.image).ellipse([x - r, y - r, x + r, y + r], fill=fill)

    def polygon(self, points: Sequence[Point], fill: Color) -> None:
        """A filled polygon."""
        art.pen(self.image).polygon([self._px(p) for p in points], fill=fill)

    def stroke(self, points: Sequence[Point], width: float, fill: Color) -> None:
        """A line with round ends and corners."""
        pen = art.pen(self.image)
        path = [self._px(p) for p in points]
        pen.line(path, fill=fill, width=max(1, round(width * _DRAWN_PX)))
        for p in points:
            self.disc(p, 0.5 * width, fill)

    def text(self, low: Point, high: Point, text: str, fill: Color, bold: int = 3) -> None:
        """A word fitted into a rectangle."""
        box = (low[0] + 0.5, 0.5 - high[1], high[0] + 0.5, 0.5 - low[1])
        art.text(self.image, box, text, fill, bold)

    def _px(self, p: Point) -> Point:
        return ((p[0] + 0.5) * _DRAWN_PX, (0.5 - p[1]) * _DRAWN_PX)


def traffic_sign(seed: int, sign: str) -> TextureData:
    """The face of a sign of ``signs.SIGNS``, a little dirty; the plate cuts its outline out."""
    name = sign_name(seed, sign)
    face = Face(art.canvas(_DRAWN_PX, _DRAWN_PX, WHITE))
    FACES[name](face)
    clean = art.resize_texture(face.image, SIZE_PX, SIZE_PX).albedo.astype(np.float32)
    rng = variant_rng("traffic_sign/dirt", seed)
    streaks = smoothstep(0.1, 0.9, fbm((3, 24), 4, rng, size_px=SIZE_PX))
    dirt = 1.0 - uniform_between(0.02, 0.1, rng) * streaks
    return TextureData(np.round(clean * dirt[..., None]).astype(np.uint8))


def _ring(face: Face, inner: Color = WHITE) -> None:
    """A disc with a red border on a white edge."""
    face.disc((0, 0), 0.51, WHITE)
    face.disc((0, 0), 0.49, RED)
    face.disc((0, 0), 0.39, inner)


def _speed(limit: str) -> Callable[[Face], None]:
    def draw(face: Face) -> None:
        _ring(face)
        wide = 0.27 if len(limit) < 3 else 0.32
        face.text((-wide, -0.17), (wide, 0.17), limit, BLACK, 5)

    return draw


def _no_entry(face: Face) -> None:
    face.disc((0, 0), 0.49, RED)
    face.polygon([(-0.36, -0.085), (0.36, -0.085), (0.36, 0.085), (-0.36, 0.085)], WHITE)


def _no_vehicles(face: Face) -> None:
    _ring(face)


def _no_stopping(face: Face) -> None:
    _ring(face, BLUE)
    for s in (-1.0, 1.0):
        face.stroke([(-0.29, 0.29 * s), (0.29, -0.29 * s)], 0.085, RED)


def _no_parking(face: Face) -> None:
    _ring(face, BLUE)
    face.stroke([(-0.29, 0.29), (0.29, -0.29)], 0.085, RED)


def _stop(face: Face) -> None:
    _fill(face, "octagon", RED, 1.0)
    _fill(face, "octagon", WHITE, 0.985)
    _fill(face, "octagon", RED, 0.93)
    face.text((-0.4, -0.15), (0.4, 0.15), "STOP", WHITE, 4)


def _yield(face: Face) -> None:
    _fill(face, "yield", RED, 1.2)
    _triangle(face, WHITE, 0.66, -1.0)


def _priority_road(face: Face) -> None:
    _fill(face, "diamond", BLACK, 1.02)
    _fill(face, "diamond", WHITE, 0.96)
    _fill(face, "diamond", YELLOW, 0.68)


def _blue_disc(face: Face) -> None:
    face.disc((0, 0), 0.52, WHITE)
    face.disc((0, 0), 0.485, BLUE)


def _straight_ahead(face: Face) -> None:
    _blue_disc(face)
    _arrow(face, (0.0, -0.32), (0.0, 0.34), 0.11)


def _turn_right(face: Face) -> None:
    _blue_disc(face)
    face.stroke([(-0.17, -0.3), (-0.17, 0.04), (0.1, 0.04)], 0.11, WHITE)
    _arrow(face, (0.0, 0.04), (0.35, 0.04), 0.11)


def _keep_right(face: Face) -> None:
    _blue_disc(face)
    _arrow(face, (-0.24, 0.24), (0.24, -0.24), 0.11)


def _roundabout(face: Face) -> None:
    _blue_disc(face)
    for k in range(3):
        start = 2.0 * math.pi * k / 3 + 0.5
        turns = [start + 1.35 * i / 8 for i in range(9)]
        arc = [(0.25 * math.cos(t), 0.25 * math.sin(t)) for t in turns]
        face.stroke(arc[:-1], 0.075, WHITE)
        along = (-math.sin(turns[-1]), math.cos(turns[-1]))
        tip = (arc[-1][0] + 0.12 * along[0], arc[-1][1] + 0.12 * along[1])
        _head(face, tip, along, 0.17)


def _cycle_path(face: Face) -> None:
    _blue_disc(face)
    for x in (-0.19, 0.19):
        face.disc((x, -0.1), 0.135, WHITE)
        face.disc((x, -0.1), 0.105, BLUE)
    frame = [(-0.19, -0.1), (-0.08, 0.1), (0.11, 0.1), (-0.02, -0.1), (-0.08, 0.1)]
    face.stroke(frame, 0.032, WHITE)
    face.stroke([(-0.19, -0.1), (-0.02, -0.1)], 0.032, WHITE)
    face.stroke([(0.19, -0.1), (0.09, 0.17), (0.17, 0.19)], 0.032, WHITE)
    face.stroke([(-0.14, 0.15), (-0.04, 0.15)], 0.036, WHITE)


def _foot_path(face: Face) -> None:
    _blue_disc(face)
    _walker(face, (0.0, -0.02), 0.6, WHITE)


def _warning(face: Face) -> None:
    _fill(face, "triangle", RED, 1.2)
    _triangle(face, WHITE, 0.66, 1.0)


def _danger(face: Face) -> None:
    _warning(face)
    face.polygon([(-0.035, 0.14), (0.035, 0.14), (0.024, -0.1), (-0.024, -0.1)], BLACK)
    face.disc((0.0, -0.17), 0.036, BLACK)


def _right_curve(face: Face) -> None:
    _warning(face)
    face.stroke([(-0.06, -0.22), (-0.06, -0.08), (-0.03, -0.01), (0.03, 0.05)], 0.05, BLACK)
    _head(face, (0.09, 0.11), (0.7, 0.7), 0.13, BLACK)


def _pedestrians(face: Face) -> None:
    _warning(face)
    _walker(face, (0.0, -0.07), 0.34, BLACK)


def _signals_ahead(face: Face) -> None:
    _warning(face)
    face.polygon([(-0.06, -0.24), (0.06, -0.24), (0.06, 0.12), (-0.06, 0.12)], BLACK)
    for y, color in ((0.06, RED), (-0.06, YELLOW), (-0.18, GREEN)):
        face.disc((0.0, y), 0.042, color)


def _crossroads(face: Face) -> None:
    _warning(face)
    for s in (-1.0, 1.0):
        face.stroke([(-0.11, -0.08 - 0.11 * s), (0.11, -0.08 + 0.11 * s)], 0.055, BLACK)


def _blue_square(face: Face, shape: str = "square") -> None:
    _fill(face, shape, WHITE, 1.05)
    _fill(face, shape, BLUE, 0.955)


def _parking(face: Face) -> None:
    _blue_square(face)
    face.text((-0.2, -0.32), (0.22, 0.32), "P", WHITE, 4)


def _pedestrian_crossing(face: Face) -> None:
    _blue_square(face)
    face.polygon([(-0.4, -0.33), (0.4, -0.33), (0.0, 0.38)], WHITE)
    for k in range(4):
        x = -0.27 + 0.155 * k
        face.polygon([(x, -0.3), (x + 0.075, -0.3), (x + 0.075, -0.23), (x, -0.23)], BLACK)
    _walker(face, (0.0, -0.06), 0.36, BLACK)


def _dead_end(face: Face) -> None:
    _blue_square(face)
    face.polygon([(-0.06, -0.38), (0.06, -0.38), (0.06, 0.12), (-0.06, 0.12)], WHITE)
    face.polygon([(-0.22, 0.12), (0.22, 0.12), (0.22, 0.27), (-0.22, 0.27)], RED)


def _zone_30(face: Face) -> None:
    _fill(face, "square", BLACK, 1.0)
    _fill(face, "square", WHITE, 0.97)
    face.disc((0.0, 0.1), 0.32, RED)
    face.disc((0.0, 0.1), 0.255, WHITE)
    face.text((-0.17, -0.02), (0.17, 0.22), "30", BLACK, 5)
    face.text((-0.32, -0.43), (0.32, -0.28), "ZONE", BLACK, 3)


def _one_way(face: Face) -> None:
    _blue_square(face, "wide")
    _arrow(face, (-0.42, 0.0), (0.42, 0.0), 0.075)


FACES: Mapping[str, Callable[[Face], None]] = {
    "speed_limit_30": _speed("30"),
    "speed_limit_50": _speed("50"),
    "speed_limit_70": _speed("70"),
    "speed_limit_100": _speed("100"),
    "no_entry": _no_entry,
    "no_vehicles": _no_vehicles,
    "no_stopping": _no_stopping,
    "no_parking": _no_parking,
    "stop": _stop,
    "yield": _yield,
    "priority_road": _priority_road,
    "straight_ahead": _straight_ahead,
    "turn_right": _turn_right,
    "keep_right": _keep_right,
    "roundabout": _roundabout,
    "cycle_path": _cycle_path,
    "foot_path": _foot_path,
    "danger": _danger,
    "right_curve": _right_curve,
    "pedestrians": _pedestrians,
    "signals_ahead": _signals_ahead,
    "crossroads": _crossroads,
    "parking": _parking,
    "pedestrian_crossing": _pedestrian_crossing,
    "dead_end": _dead_end,
    "zone_30": _zone_30,
    "one_way": _one_way,
}


def _fill(face: Face, shape: str, fill: Color, scale: float) -> None:
    """A plate's own outline, scaled about the middle of the image."""
    points = scale * plate_outline(shape)  # type: ignore[arg-type]
    face.polygon([(float(x), float(y)) for x, y in points], fill)


def _triangle(face: Face, fill: Color, size: float, up: float) -> None:
    """An equilateral triangle about the plate's centroid, its sides ``size`` long."""
    # The plate's bounding box is centred, its centroid lies a sixth of its height off.
    middle = -up * math.sqrt(3.0) / 12.0
    points = [
        (size / math.sqrt(3.0) * math.cos(t), middle + up * size / math.sqrt(3.0) * math.sin(t))
        for t in (0.5 * math.pi, 0.5 * math.pi + 2 * math.pi / 3, 0.5 * math.pi + 4 * math.pi / 3)
    ]
    face.polygon(points, fill)


def _arrow(face: Face, start: Point, tip: Point, width: float) -> None:
    """A white arrow."""
    dx, dy = tip[0] - start[0], tip[1] - start[1]
    length = math.hypot(dx, dy)
    along = (dx / length, dy / length)
    neck = (tip[0] - 1.4 * width * along[0], tip[1] - 1.4 * width * along[1])
    across = (-0.5 * width * along[1], 0.5 * width * along[0])
    shaft = [
        (start[0] + across[0], start[1] + across[1]),
        (neck[0] + across[0], neck[1] + across[1]),
        (neck[0] - across[0], neck[1] - across[1]),
        (start[0] - across[0], start[1] - across[1]),
    ]
    face.polygon(shaft, WHITE)
    _head(face, tip, along, 2.2 * width)


def _head(face: Face, tip: Point, along: Point, size: float, fill: Color = WHITE) -> None:
    """An arrow's head."""
    x, y = along
    norm = math.hypot(x, y)
    x, y = x / norm, y / norm
    back = (tip[0] - 0.75 * size * x, tip[1] - 0.75 * size * y)
    wing = (-0.55 * size * y, 0.55 * size * x)
    corners = [
        tip,
        (back[0] + wing[0], back[1] + wing[1]),
        (back[0] - wing[0], back[1] - wing[1]),
    ]
    face.polygon(corners, fill)


def _walker(face: Face, centre: Point, height: float, fill: Color) -> None:
    """A walking figure of a given height."""
    h = height

    def at(x: float, y: float) -> Point:
        return (centre[0] + x * h, centre[1] + y * h)

    w = 0.1 * h
    face.disc(at(0.02, 0.42), 0.085 * h, fill)
    face.stroke([at(0.0, 0.25), at(-0.03, -0.05)], 1.7 * w, fill)
    face.stroke([at(0.0, -0.05), at(0.13, -0.26), at(0.2, -0.48)], w, fill)
    face.stroke([at(-0.03, -0.05), at(-0.1, -0.27), at(-0.24, -0.45)], w, fill)
    face.stroke([at(0.02, 0.27), at(0.17, 0.1), at(0.27, 0.07)], 0.75 * w, fill)
    face.stroke([at(-0.03, 0.27), at(-0.17, 0.12), at(-0.2, -0.02)], 0.75 * w, fill)
