"""Faces of traffic signs, drawn from discs, polygons and strokes.

Coordinates of a face: x to the right and y up in [-0.5, 0.5], as ``signs.plate_outline`` has them.
Colours are the sRGB values of RAL 3020, 5017, 1023, 9017 and 9016, which EN 12899-1 signs are made
in.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from gen_data.content.procedural.textures import artwork as art
from gen_data.content.scenery.signs import SIGNS, Shape, plate_outline, sign_name
from gen_data.core import asset_types, noise
from gen_data.core.variant_rng import variant_rng

if TYPE_CHECKING:
    from PIL.Image import Image


SIZE_PX = 256
_DRAWN_PX = 4 * SIZE_PX

Point = tuple[float, float]
Color = tuple[int, int, int]

COLORS: Mapping[str, Color] = {
    "red": (187, 30, 16),
    "blue": (0, 91, 140),
    "yellow": (240, 202, 0),
    "black": (42, 41, 42),
    "white": (241, 240, 234),
    "green": (0, 131, 81),
}


@dataclass(frozen=True, slots=True)
class Face:
    """An image drawn on in a sign's own coordinates.

    Attributes:
        image: Square image, ``_DRAWN_PX`` wide.
        shape: Outline of the plate.
    """

    image: "Image"
    shape: Shape

    def draw(self, steps: Sequence[Any]) -> None:
        """Draw steps one over the other: ``[method, *arguments]``, or lists of steps."""
        for step in steps:
            if isinstance(step[0], str):
                arguments = [COLORS.get(a, a) if isinstance(a, str) else a for a in step[1:]]
                getattr(self, step[0])(*arguments)
            else:
                self.draw(step)

    def disc(self, centre: Point, radius: float, fill: Color) -> None:
        """Draw a filled circle."""
        x, y = self._px(centre)
        r = radius * _DRAWN_PX
        art.pen(self.image).ellipse([x - r, y - r, x + r, y + r], fill=fill)

    def polygon(self, points: Sequence[Point], fill: Color) -> None:
        """Draw a filled polygon."""
        art.pen(self.image).polygon([self._px(p) for p in points], fill=fill)

    def stroke(self, points: Sequence[Point], width: float, fill: Color) -> None:
        """Draw a line with round ends and corners."""
        pen = art.pen(self.image)
        path = [self._px(p) for p in points]
        pen.line(path, fill=fill, width=max(1, round(width * _DRAWN_PX)))
        for p in points:
            self.disc(p, 0.5 * width, fill)

    def text(self, low: Point, high: Point, text: str, fill: Color, bold: int = 3) -> None:
        """Draw a word fitted into a rectangle."""
        box = (low[0] + 0.5, 0.5 - high[1], high[0] + 0.5, 0.5 - low[1])
        art.text(self.image, box, text, fill, bold)

    def fill(self, fill: Color, scale: float) -> None:
        """Draw the plate's own outline, scaled about the middle of the image."""
        points = scale * plate_outline(self.shape)
        self.polygon([(float(x), float(y)) for x, y in points], fill)

    def triangle(self, fill: Color, size: float, up: float) -> None:
        """Draw an equilateral triangle about the plate's centroid, its sides ``size`` long."""
        # The plate's bounding box is centred, its centroid lies a sixth of its height off.
        middle = -up * math.sqrt(3.0) / 12.0
        radius, third = size / math.sqrt(3.0), 2 * math.pi / 3
        turns = (0.5 * math.pi + k * third for k in range(3))
        points = [(radius * math.cos(t), middle + up * radius * math.sin(t)) for t in turns]
        self.polygon(points, fill)

    def arrow(self, start: Point, tip: Point, width: float) -> None:
        """Draw a white arrow."""
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
        self.polygon(shaft, COLORS["white"])
        self.head(tip, along, 2.2 * width, COLORS["white"])

    def head(self, tip: Point, along: Point, size: float, fill: Color) -> None:
        """Draw the head of an arrow."""
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
        self.polygon(corners, fill)

    def circling_arrows(self) -> None:
        """Draw three white arrows that follow one another around a circle."""
        for k in range(3):
            start = 2.0 * math.pi * k / 3 + 0.5
            turns = [start + 1.35 * i / 8 for i in range(9)]
            arc = [(0.25 * math.cos(t), 0.25 * math.sin(t)) for t in turns]
            self.stroke(arc[:-1], 0.075, COLORS["white"])
            along = (-math.sin(turns[-1]), math.cos(turns[-1]))
            tip = (arc[-1][0] + 0.12 * along[0], arc[-1][1] + 0.12 * along[1])
            self.head(tip, along, 0.17, COLORS["white"])

    def walker(self, centre: Point, height: float, fill: Color) -> None:
        """Draw a walking figure of a given height."""
        h = height

        def at(x: float, y: float) -> Point:
            return (centre[0] + x * h, centre[1] + y * h)

        w = 0.1 * h
        self.disc(at(0.02, 0.42), 0.085 * h, fill)
        self.stroke([at(0.0, 0.25), at(-0.03, -0.05)], 1.7 * w, fill)
        self.stroke([at(0.0, -0.05), at(0.13, -0.26), at(0.2, -0.48)], w, fill)
        self.stroke([at(-0.03, -0.05), at(-0.1, -0.27), at(-0.24, -0.45)], w, fill)
        self.stroke([at(0.02, 0.27), at(0.17, 0.1), at(0.27, 0.07)], 0.75 * w, fill)
        self.stroke([at(-0.03, 0.27), at(-0.17, 0.12), at(-0.2, -0.02)], 0.75 * w, fill)

    def _px(self, p: Point) -> Point:
        return ((p[0] + 0.5) * _DRAWN_PX, (0.5 - p[1]) * _DRAWN_PX)


def traffic_sign(seed: int, sign: str) -> asset_types.TextureData:
    """The face of a sign of ``signs.SIGNS``, a little dirty; the plate cuts its outline out."""
    made = SIGNS[sign_name(seed, sign)]
    face = Face(art.canvas(_DRAWN_PX, _DRAWN_PX, COLORS["white"]), made.shape)
    face.draw(made.face)
    clean = art.resize_texture(face.image, SIZE_PX, SIZE_PX).albedo.astype(np.float32)
    rng = variant_rng("traffic_sign/dirt", seed)
    streaks = noise.smoothstep(0.1, 0.9, noise.fbm((3, 24), 4, rng, size_px=SIZE_PX))
    dirt = 1.0 - rng.between(0.02, 0.1) * streaks
    return asset_types.TextureData(np.round(clean * dirt[..., None]).astype(np.uint8))
