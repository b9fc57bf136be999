"""Pictures on mugs and boxes: scenes, faces and animals as photographs, cartoons or lines."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Literal, NamedTuple, get_args

import numpy as np

from gen_data.content.procedural.textures import artwork as art
from gen_data.content.procedural.textures.artwork import Color, Place
from gen_data.core.variant_rng import VariantRng

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageDraw import ImageDraw

Manner = Literal["photograph", "cartoon", "lines"]
MANNERS: tuple[Manner, ...] = get_args(Manner)

_INK: Color = (30, 28, 30)
_SKIES = (
    ((96, 158, 214), (214, 232, 242)), ((244, 168, 92), (250, 222, 170)),
    ((120, 106, 168), (238, 172, 160)), ((150, 182, 200), (228, 234, 236)),
)  # fmt: skip
_LANDS = ((92, 132, 62), (60, 104, 70), (142, 150, 84), (176, 142, 92), (84, 110, 132))
_COATS = (
    (226, 154, 66), (120, 84, 58), (232, 226, 214), (70, 68, 72), (150, 150, 156), (236, 190, 200),
    (108, 170, 214), (250, 214, 92), (140, 190, 120), (196, 92, 78),
)  # fmt: skip
_SKINS = ((250, 220, 192), (232, 186, 146), (196, 140, 100), (140, 92, 64), (252, 226, 110))


class _Pen(NamedTuple):
    """A drawing context, width of its outlines [px], and whether shapes are filled."""

    draw: ImageDraw
    line_px: int
    fills: bool
    paper: Color

    def disc(self, at: Place, rx: float, ry: float, fill: Color) -> None:
        """An ellipse of half axes [px] around a point."""
        x, y = at
        box = [x - rx, y - ry, x + rx, y + ry]
        shown = fill if self.fills or fill == _INK else self.paper
        self.draw.ellipse(box, fill=shown, outline=self._edge(), width=max(1, self.line_px))

    def shape(self, corners: list[Place], fill: Color) -> None:
        """A polygon."""
        self.draw.polygon(corners, fill=fill if self.fills else self.paper)
        if self.line_px:
            self.draw.line([*corners, corners[0]], fill=_INK, width=self.line_px, joint="curve")

    def arc(self, at: Place, r: float, low_deg: float, high_deg: float) -> None:
        """An arc of a circle, clockwise from +x."""
        x, y = at
        self.draw.arc([x - r, y - r, x + r, y + r], low_deg, high_deg, _INK, max(2, self.line_px))

    def stroke(self, path: list[Place], wide: float = 1.0) -> None:
        """A line."""
        self.draw.line(path, fill=_INK, width=max(1, round(wide * max(2, self.line_px))))

    def _edge(self) -> Color | None:
        return _INK if self.line_px else None


def picture(w: int, h: int, paper: Color, rng: VariantRng, manner: Manner | None = None) -> Image:
    """A picture of one of the subjects.

    Args:
        w: Width [px].
        h: Height [px].
        paper: Colour of the paper, which cartoons and lines leave free.
        rng: Draws everything.
        manner: Technique; None = drawn.
    """
    manner = rng.choose(MANNERS) if manner is None else manner
    subject = rng.choose(tuple(_SUBJECTS))
    if manner == "photograph":
        return _photograph(w, h, subject, rng)
    if manner == "lines" and art.brightness(paper) < 90.0:
        # Black lines need a pale panel.
        paper = (238, 234, 224)
    image = art.canvas(w, h, paper)
    line_px = max(2, round(min(w, h) / 60)) if manner == "lines" else rng.choose((0, 2, 3))
    pen = _Pen(art.pen(image), line_px, manner == "cartoon", paper)
    _SUBJECTS[subject](pen, (0.5 * w, 0.5 * h), 0.46 * min(w, h), rng)
    return image


def _photograph(w: int, h: int, subject: str, rng: VariantRng) -> Image:
    """A scene with soft edges, shading and grain; people and animals stand before it."""
    from PIL import ImageFilter
    from PIL.Image import fromarray

    image = art.canvas(w, h, (200, 200, 200))
    pen = _Pen(art.pen(image), 0, True, (200, 200, 200))
    at = 0.5 * w, 0.5 * h
    _scene(pen, at, 0.5 * max(w, h), rng)
    image = image.filter(ImageFilter.GaussianBlur(rng.between(1.0, 3.0)))
    if subject != "scene":
        front = _Pen(art.pen(image), 0, True, (200, 200, 200))
        _SUBJECTS[subject](front, (at[0], at[1] + 0.06 * h), 0.42 * min(w, h), rng)
    image = image.filter(ImageFilter.GaussianBlur(max(0.8, min(w, h) / 160)))
    y, x = np.mgrid[0:h, 0:w].astype(np.float32)
    light = 1.0 + 0.3 * ((x / w - 0.5) * rng.between(-1.0, 1.0) + (0.5 - y / h))
    values = np.asarray(image, np.float32) * light[..., None]
    values += 7.0 * (rng.random(w * h).reshape(h, w, 1).astype(np.float32) - 0.5)
    return fromarray(np.clip(np.rint(values), 0, 255).astype(np.uint8))


def _scene(pen: _Pen, at: Place, r: float, rng: VariantRng) -> None:
    """Sky, sun, hills or sea, trees and a house or a boat."""
    (cx, cy), (high, low) = at, rng.choose(_SKIES)
    for k in range(24):
        top = cy - r + k * r / 12
        if pen.fills:
            strip = [cx - r, top, cx + r, top + r / 12 + 1]
            pen.draw.rectangle(strip, fill=art.blend(high, low, k / 23))
    sun = cx + rng.between(-0.6, 0.6) * r, cy - rng.between(0.25, 0.6) * r
    pen.disc(sun, 0.13 * r, 0.13 * r, (255, 244, 206))
    for k in range(3):
        level = cy + (0.28 * k - 0.05) * r
        waves = [(rng.between(1.5, 5.0), rng.between(0, 6.3)) for _ in range(2)]
        tall = r * (0.2 - 0.05 * k)
        ridge = [
            (cx + t * r / 16,
             level - tall * sum(math.sin(f * t / 16 + p) for f, p in waves) / 2)
            for t in range(-16, 17)
        ]  # fmt: skip
        land = art.blend(rng.choose(_LANDS), low, 0.5 - 0.22 * k)
        pen.shape([(cx - r, cy + r), *ridge, (cx + r, cy + r)], land)
    for _ in range(rng.choose((0, 3, 6))):
        x, y = cx + rng.between(-0.9, 0.9) * r, cy + rng.between(0.15, 0.7) * r
        _tree(pen, (x, y), rng.between(0.1, 0.24) * r, rng)
    rng.choose((_house, _boat, _tree))(pen, (cx + rng.between(-0.5, 0.5) * r, cy + 0.5 * r),
                                       0.26 * r, rng)  # fmt: skip


def _tree(pen: _Pen, at: Place, r: float, rng: VariantRng) -> None:
    (x, y), green = at, art.blend((44, 92, 52), (120, 150, 60), rng.between(0.0, 1.0))
    pen.shape([(x - 0.1 * r, y), (x + 0.1 * r, y), (x + 0.1 * r, y + r), (x - 0.1 * r, y + r)],
              (96, 70, 48))  # fmt: skip
    if rng.chance(0.5):
        pen.disc((x, y - 0.2 * r), 0.55 * r, 0.7 * r, green)
        return
    for k in range(3):
        top = y - (1.1 - 0.4 * k) * r
        wide = (0.35 + 0.15 * k) * r
        pen.shape([(x, top), (x + wide, top + 0.6 * r), (x - wide, top + 0.6 * r)], green)


def _house(pen: _Pen, at: Place, r: float, rng: VariantRng) -> None:
    x, y = at
    wall = rng.choose(((240, 232, 214), (222, 190, 150)))
    roof = rng.choose(((168, 70, 52), (92, 82, 84)))
    pen.shape([(x - r, y - 0.4 * r), (x + r, y - 0.4 * r), (x + r, y + r), (x - r, y + r)], wall)
    pen.shape([(x - 1.2 * r, y - 0.4 * r), (x, y - 1.3 * r), (x + 1.2 * r, y - 0.4 * r)], roof)
    for dx in (-0.6, 0.3):
        box = [(x + dx * r, y - 0.1 * r), (x + (dx + 0.35) * r, y - 0.1 * r),
               (x + (dx + 0.35) * r, y + 0.35 * r), (x + dx * r, y + 0.35 * r)]  # fmt: skip
        pen.shape(box, (92, 120, 150))


def _boat(pen: _Pen, at: Place, r: float, rng: VariantRng) -> None:
    (x, y), sail = at, rng.choose(((246, 244, 238), (206, 70, 60)))
    pen.shape([(x - r, y + 0.4 * r), (x + r, y + 0.4 * r), (x + 0.6 * r, y + 0.9 * r),
               (x - 0.6 * r, y + 0.9 * r)], (128, 60, 40))  # fmt: skip
    pen.shape([(x, y - 1.2 * r), (x + 0.8 * r, y + 0.25 * r), (x, y + 0.25 * r)], sail)
    pen.shape([(x - 0.1 * r, y - r), (x - 0.7 * r, y + 0.25 * r), (x - 0.1 * r, y + 0.25 * r)],
              sail)  # fmt: skip


def _eyes(pen: _Pen, at: Place, apart: float, r: float) -> None:
    for side in (-1, 1):
        eye = at[0] + side * apart, at[1]
        pen.disc(eye, r, 1.2 * r, (250, 250, 250))
        pen.disc((eye[0], eye[1] + 0.2 * r), 0.5 * r, 0.6 * r, _INK)


def _face(pen: _Pen, at: Place, r: float, rng: VariantRng) -> None:
    """A head with hair, eyes, mouth, and sometimes glasses."""
    (x, y), skin = at, rng.choose(_SKINS)
    hair = rng.choose(((52, 38, 30), (110, 70, 40), (214, 176, 96), (60, 60, 64), (170, 60, 40)))
    if rng.chance(0.7):
        wide, low = rng.between(0.8, 0.98), rng.between(0.6, 1.0)
        pen.disc((x, y - 0.15 * r), wide * r, low * r, hair)
    pen.disc((x, y + 0.05 * r), 0.7 * r, 0.84 * r, skin)
    if rng.chance(0.6):
        fringe = [(x - 0.66 * r, y - 0.3 * r), (x - 0.4 * r, y - 0.78 * r),
                  (x + 0.4 * r, y - 0.78 * r), (x + 0.66 * r, y - 0.3 * r),
                  (x + 0.1 * r, y - 0.46 * r)]  # fmt: skip
        pen.shape(fringe, hair)
    _eyes(pen, (x, y - 0.06 * r), 0.28 * r, 0.12 * r)
    if rng.chance(0.35):
        for side in (-1, 1):
            pen.draw.ellipse(
                [x + side * 0.28 * r - 0.22 * r, y - 0.28 * r,
                 x + side * 0.28 * r + 0.22 * r, y + 0.16 * r],
                outline=_INK, width=max(2, round(0.03 * r)),
            )  # fmt: skip
    pen.stroke([(x, y + 0.1 * r), (x - 0.07 * r, y + 0.28 * r), (x + 0.05 * r, y + 0.3 * r)])
    smile = rng.between(0.2, 0.36) * r
    pen.arc((x, y + 0.3 * r), smile, 20, 160)


def _beast(pen: _Pen, at: Place, r: float, rng: VariantRng) -> None:
    """The head of a cat, bear or rabbit."""
    (x, y), coat = at, rng.choose(_COATS)
    inner = art.blend(coat, (250, 200, 200), 0.5)
    kind = rng.choose(("cat", "bear", "rabbit"))
    for side in (-1, 1):
        if kind == "cat":
            ear = [(x + side * 0.8 * r, y - 0.95 * r), (x + side * 0.2 * r, y - 0.62 * r),
                   (x + side * 0.78 * r, y - 0.1 * r)]  # fmt: skip
            pen.shape(ear, coat)
        elif kind == "bear":
            pen.disc((x + side * 0.6 * r, y - 0.6 * r), 0.27 * r, 0.27 * r, coat)
        else:
            pen.disc((x + side * 0.3 * r, y - 0.52 * r), 0.17 * r, 0.46 * r, coat)
            pen.disc((x + side * 0.3 * r, y - 0.52 * r), 0.08 * r, 0.34 * r, inner)
    pen.disc((x, y + 0.1 * r), 0.8 * r, 0.72 * r, coat)
    _eyes(pen, (x, y - 0.02 * r), 0.33 * r, 0.13 * r)
    pen.disc((x, y + 0.36 * r), 0.3 * r, 0.22 * r, art.blend(coat, (255, 255, 255), 0.5))
    pen.disc((x, y + 0.27 * r), 0.09 * r, 0.06 * r, _INK)
    pen.arc((x - 0.1 * r, y + 0.38 * r), 0.1 * r, 0, 160)
    pen.arc((x + 0.1 * r, y + 0.38 * r), 0.1 * r, 20, 180)
    if kind == "cat":
        for side in (-1, 1):
            for k in (-1, 0, 1):
                start = x + side * 0.3 * r, y + (0.36 + 0.04 * k) * r
                pen.stroke([start, (x + side * 0.9 * r, y + (0.36 + 0.14 * k) * r)], 0.6)


def _animal(pen: _Pen, at: Place, r: float, rng: VariantRng) -> None:
    """A whole animal from the side: elephant, dog, bird or fish."""
    return rng.choose((_four_legs, _bird, _fish))(pen, at, r, rng)


def _four_legs(pen: _Pen, at: Place, r: float, rng: VariantRng) -> None:
    (x, y), coat = at, rng.choose(_COATS)
    trunk = rng.chance(0.4)
    for dx in (-0.55, -0.3, 0.2, 0.42):
        pen.shape([(x + dx * r, y), (x + (dx + 0.17) * r, y), (x + (dx + 0.17) * r, y + 0.8 * r),
                   (x + dx * r, y + 0.8 * r)], art.blend(coat, _INK, 0.15))  # fmt: skip
    pen.stroke([(x - 0.7 * r, y), (x - 0.9 * r, y - rng.between(-0.3, 0.4) * r)], 2.0)
    pen.disc((x, y + 0.05 * r), 0.75 * r, 0.42 * r, coat)
    head = x + 0.68 * r, y - 0.3 * r
    if trunk:
        path: list[Place] = [(head[0] + 0.2 * r, head[1]), (head[0] + 0.32 * r, head[1] + 0.5 * r),
                             (head[0] + 0.2 * r, head[1] + 0.95 * r),
                             (head[0] + 0.06 * r, head[1] + 0.5 * r)]  # fmt: skip
        pen.shape(path, coat)
    pen.disc(head, 0.33 * r, 0.3 * r, coat)
    pen.disc((head[0] - 0.22 * r, head[1] - 0.02 * r), 0.14 * r, 0.3 * r,
             art.blend(coat, _INK, 0.3))  # fmt: skip
    pen.disc((head[0] + 0.1 * r, head[1] - 0.06 * r), 0.05 * r, 0.05 * r, _INK)


def _bird(pen: _Pen, at: Place, r: float, rng: VariantRng) -> None:
    (x, y), coat = at, rng.choose(_COATS)
    for dx in (-0.08, 0.12):
        pen.stroke([(x + dx * r, y + 0.4 * r), (x + dx * r, y + 0.85 * r)])
    pen.shape([(x - 0.5 * r, y), (x - r, y - 0.3 * r), (x - 0.9 * r, y + 0.2 * r)], coat)
    pen.disc((x, y + 0.08 * r), 0.6 * r, 0.42 * r, coat)
    wing = [(x - 0.3 * r, y - 0.02 * r), (x + 0.3 * r, y - 0.02 * r), (x - 0.1 * r, y + 0.4 * r)]
    pen.shape(wing, art.blend(coat, _INK, 0.25))
    beak = [(x + 0.7 * r, y - 0.4 * r), (x + 0.98 * r, y - 0.28 * r), (x + 0.7 * r, y - 0.22 * r)]
    pen.shape(beak, (240, 168, 48))
    pen.disc((x + 0.5 * r, y - 0.34 * r), 0.28 * r, 0.28 * r, coat)
    pen.disc((x + 0.58 * r, y - 0.4 * r), 0.05 * r, 0.06 * r, _INK)


def _fish(pen: _Pen, at: Place, r: float, rng: VariantRng) -> None:
    (x, y), coat = at, rng.choose(_COATS)
    fin = art.blend(coat, (255, 255, 255), 0.3)
    pen.shape([(x - 0.5 * r, y), (x - r, y - 0.42 * r), (x - r, y + 0.42 * r)], fin)
    pen.shape([(x - 0.2 * r, y - 0.3 * r), (x + 0.1 * r, y - 0.75 * r), (x + 0.4 * r, y - 0.3 * r)],
              fin)  # fmt: skip
    pen.disc((x + 0.1 * r, y), 0.75 * r, 0.42 * r, coat)
    for k in range(3):
        pen.arc((x - 0.15 * r + 0.22 * k * r, y), 0.3 * r, -50, 50)
    _eyes(pen, (x + 0.56 * r, y - 0.08 * r), 0.0, 0.08 * r)


def _flowers(pen: _Pen, at: Place, r: float, rng: VariantRng) -> None:
    """A bunch of three flowers."""
    for k in range(3):
        turn = 0.7 * (k - 1)
        x, y = at[0] + 0.55 * r * math.sin(turn) * 1.2, at[1] - 0.35 * r * math.cos(turn)
        pen.stroke([(at[0], at[1] + 0.95 * r), (x, y)], 1.5)
        petal = rng.choose(_COATS)
        for i in range(7):
            a = 2.0 * math.pi * i / 7
            pen.disc((x + 0.22 * r * math.cos(a), y + 0.22 * r * math.sin(a)), 0.14 * r, 0.14 * r,
                     petal)  # fmt: skip
        pen.disc((x, y), 0.13 * r, 0.13 * r, (244, 200, 64))


_SUBJECTS: Mapping[str, Callable[[_Pen, Place, float, VariantRng], None]] = {
    "scene": _scene, "face": _face, "beast": _beast, "animal": _animal, "flowers": _flowers,
}  # fmt: skip
