"""Text in images: content, place, visibility and readability of everything written."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gen_data.config.base_model import Strict
from gen_data.core import sample
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.interfaces import AssetLibrary, WrittenTextures
from gen_data.core.rolling_shutter_projection import project_moving_points
from gen_data.core.scene import Scene
from gen_data.core.se3 import Array
from gen_data.core.surface_points import SurfacePoints
from gen_data.core.surface_text import SurfaceQuads, SurfaceText, place_writing

CAPITALS_PX, LETTERS_PX = 7.0, 9.0
"""Least height of readable characters: ISO 9241-303 requires 5 by 7 dots for digits and capitals
alone, and 7 by 9 dots where letters of both cases are read."""
READABLE_SHARE = 0.5
"""Least visible share of every character of a readable word (assumed)."""
GRID = 5
"""Points per side of a character at which its visibility is decided."""
NEAR_M, NEAR_SHARE = 0.003, 0.001
"""What is nearer than the text by more hides it: this, and this share of the distance."""
_PLACES = 4096
"""Assets whose lines are kept in memory."""


class Text(Strict):
    """Lines of text in the image: number plates, signs, labels, covers, posters, screens.

    For every line, word and character: the quad of its ink, projected through the lens, also behind
    what hides it; content, language, visibility, and size in pixels. Lines without a visible
    character of the least height are left out. Text that is seen from behind or mirrored has a
    visibility of 0; text in mirrors and behind panes of glass counts as hidden.

    A word is readable if its highest character is at least 9 px high, or 7 px if it has no small
    letters, in the direction in which the image shortens it most (ISO 9241-303: a matrix of 7 by 9
    dots, and of 5 by 7 for digits and capitals alone), and half of each character is visible.
    Contrast, blur and noise do not count.

    Attributes:
        min_height_px: Least height of the highest character of a line.
    """

    channels: ClassVar[frozenset[Channel]] = frozenset({Channel.INSTANCE, Channel.RANGE})
    type: Literal["text"] = "text"
    min_height_px: float = Field(4.0, gt=0)

    def annotate_image(
        self,
        scene: Scene,
        assets: AssetLibrary,
        reading: SensorReading,
        truth: sample.ImageTruth,
    ) -> sample.ImageTruth:
        """Fill in ``texts``; empty where nothing in the image is written on."""
        found = list(_lines(scene, assets, reading, self.min_height_px))
        if not found:
            return replace(truth, texts=())
        views = _project(scene, assets, reading, found)
        texts = (_describe(scene, *pair) for pair in zip(found, views, strict=True))
        kept = (text for text in texts if text is not None and self._is_listed(text))
        return replace(truth, texts=tuple(kept))

    def _is_listed(self, text: sample.TextTruth) -> bool:
        return any(
            word.visible_fraction > 0.0 and word.height_px >= self.min_height_px
            for word in text.words
        )


def can_write(assets: AssetLibrary, textures: tuple[str, ...]) -> bool:
    """Whether any of some textures has writing."""
    return isinstance(assets, WrittenTextures) and any(map(assets.writing, filter(None, textures)))


@lru_cache(maxsize=_PLACES)
def _texts_on(
    assets: AssetLibrary, asset_id: str, textures: tuple[str, ...]
) -> tuple[SurfaceText, ...]:
    """Lines on a mesh whose slots have these textures; empty = none, or without the mesh's UVs."""
    if not can_write(assets, textures):
        return ()
    assert isinstance(assets, WrittenTextures)
    mesh = assets.mesh(asset_id)
    return tuple(
        text
        for slot, texture in enumerate(textures)
        if texture
        for text in place_writing(mesh, slot, assets.writing(texture))
    )


@dataclass(frozen=True, eq=False, slots=True)
class _Line:
    """A line on a body of a scene; its quads: the line's, then each word's and its characters'."""

    body: int
    text: SurfaceText
    quads: SurfaceQuads
    mirrored: NDArray[np.bool_]


def _lines(
    scene: Scene, assets: AssetLibrary, reading: SensorReading, min_height_px: float
) -> Iterator[_Line]:
    """Lines on bodies that are near enough, in the order of the bodies."""
    camera = reading.camera
    eye = np.asarray(camera.T_world_camera.translation_m)
    focal_px = max(camera.intrinsics.fx_px, camera.intrinsics.fy_px)
    for number, body in enumerate(scene.bodies):
        materials = body.materials or assets.materials(body.asset)
        textures = tuple("" if m.texture_scale_m else m.texture for m in materials)
        texts = _texts_on(assets, body.asset, textures) if any(textures) else ()
        if not texts:
            continue
        low, high = (np.asarray(corner) * body.scale for corner in assets.bounds_m(body.asset))
        centre = body.T_world_body.apply(0.5 * (low + high)[None])[0]
        near_m = float(np.linalg.norm(centre - eye) - 0.5 * np.linalg.norm(high - low))
        mesh = assets.mesh(body.asset)
        for text in texts:
            # Lenses enlarge by less than twice their focal length.
            side_m = _sides_m(text.quad.positions_m(mesh))[:, 1::2].max() * body.scale
            if 2.0 * focal_px * side_m >= min_height_px * near_m:
                parts = [text.quad, *(word.quads for word in text.words)]
                face = np.concatenate([part.face for part in parts])
                weights = np.concatenate([part.weights for part in parts])
                flags = [word.mirrored for word in text.words]
                mirrored = np.concatenate([flags[0][:1], *flags])
                yield _Line(number, text, SurfaceQuads(face, weights), mirrored)


def _sides_m(quads: Array) -> Array:
    """Lengths of the sides of quads [..., 4, k], [..., 4]: upper, right, lower, left."""
    return np.asarray(np.linalg.norm(np.roll(quads, -1, axis=-2) - quads, axis=-1))


@dataclass(frozen=True, eq=False, slots=True)
class _View:
    """Quads of a line in an image.

    Attributes:
        places_m: Corners in the world at the image's instant, [n, 4, 3].
        image_px: Corners, [n, 4, 2]; NaN where the lens has no image of them.
        visible: Visible share of each, [n].
    """

    places_m: Array
    image_px: Array
    visible: Array


def _project(
    scene: Scene, assets: AssetLibrary, reading: SensorReading, lines: list[_Line]
) -> Iterator[_View]:
    """Project lines, and find what is visible of each of their quads."""
    counts = [4 * len(line.quads.face) for line in lines]
    meshes = [assets.mesh(scene.bodies[line.body].asset) for line in lines]
    pairs = list(zip(lines, meshes, strict=True))
    points = SurfacePoints(
        np.repeat([line.body for line in lines], counts),
        tuple(
            scene.bodies[line.body].asset
            for line, n in zip(lines, counts, strict=True)
            for _ in range(n)
        ),
        np.concatenate([line.quads.face.reshape(-1) for line in lines]),
        np.concatenate([line.quads.weights.reshape(-1, 3) for line in lines]),
        np.concatenate([line.quads.positions_m(mesh).reshape(-1, 3) for line, mesh in pairs]),
    )
    p_body = points.on_bodies(scene, assets)
    world = points.moving(scene, p_body)
    p_camera, image_px, _ = project_moving_points(scene, reading.camera, world, len(p_body))
    places_m = world(np.zeros(len(p_body)))
    ends = np.cumsum(counts)[:-1]
    parts = (np.split(values, ends) for values in (places_m, p_camera, image_px))
    for line, place_m, p, uv in zip(lines, *parts, strict=True):
        quads = p.reshape(-1, 4, 3)
        instance = scene.bodies[line.body].instance_id
        visible = _visible_shares(reading, instance, quads, line.mirrored)
        yield _View(place_m.reshape(-1, 4, 3), uv.reshape(-1, 4, 2), visible)


def _visible_shares(
    reading: SensorReading, instance_id: int, quads: Array, mirrored: NDArray[np.bool_]
) -> Array:
    """Visible share of quads [n, 4, 3] in the camera frame, by the pixels of a grid of points."""
    share = (np.arange(GRID) + 0.5) / GRID
    x, y = (axis.reshape(-1) for axis in np.meshgrid(share, share))
    bilinear = np.stack([(1 - x) * (1 - y), x * (1 - y), x * y, (1 - x) * y])
    points = np.einsum("qs,nqi->nsi", bilinear, quads, optimize=False)
    lens = reading.camera.intrinsics
    uv = lens.project(points.reshape(-1, 3)).reshape(*points.shape[:2], 2)
    u, v = uv[..., 0], uv[..., 1]
    inside = (u >= 0.0) & (u < lens.width_px) & (v >= 0.0) & (v < lens.height_px)
    columns, rows = (np.where(inside, a, 0.0).astype(np.intp) for a in (u, v))
    away_m = np.linalg.norm(points, axis=2)
    range_m = reading.channels[Channel.RANGE][rows, columns].astype(np.float64)
    own = reading.channels[Channel.INSTANCE][rows, columns] == instance_id
    # The centre of the pixel is up to 0.7 px from the point: ranges differ by as much as they do
    # over that part of the quad.
    right, down = quads[:, 1] - quads[:, 0], quads[:, 3] - quads[:, 0]
    spread_m = np.ptp(np.linalg.norm(quads, axis=2), axis=1)
    corners_px = lens.project(quads.reshape(-1, 3)).reshape(-1, 4, 2)
    short_px = np.nan_to_num(_sides_m(corners_px).min(axis=1), nan=1.0)
    slack_m = NEAR_M + spread_m / np.maximum(short_px, 0.7)
    near = np.abs(range_m - away_m) <= slack_m[:, None] + NEAR_SHARE * away_m
    towards = (np.cross(right, down) * quads.mean(axis=1)).sum(axis=1) > 0.0
    seen = inside & own & near & (towards & ~mirrored)[:, None]
    return np.asarray(seen.mean(axis=1))


def _describe(scene: Scene, line: _Line, view: _View) -> sample.TextTruth | None:
    """A line in an image; None if the lens has no image of a part of it."""
    if not np.isfinite(view.image_px).all():
        return None
    body, start, words, shares = scene.bodies[line.body], 1, [], []
    areas = _areas_px(view.image_px)
    for word in line.text.words:
        n = len(word.quads.face)
        rows = slice(start + 1, start + n)
        start += n
        letters = word.text or [""] * (n - 1)
        characters = tuple(
            sample.CharacterTruth(letter, _quad(uv), round(float(seen), 3))
            for letter, uv, seen in zip(
                letters, view.image_px[rows], view.visible[rows], strict=True
            )
        )
        share = _mean(view.visible[rows], areas[rows])
        shares.append((share, float(areas[rows].sum())))
        height_px, scale = _size(view.image_px[rows], view.places_m[rows])
        least_px = LETTERS_PX if word.text.upper() != word.text else CAPITALS_PX
        readable = (
            bool(word.text)
            and height_px * scale >= least_px
            and bool((view.visible[rows] >= READABLE_SHARE).all())
        )
        stroke_px = line.text.stroke * height_px * scale
        made = sample.WordTruth(
            word.text,
            _quad(view.image_px[rows.start - 1]),
            characters,
            round(share, 3),
            round(height_px, 2),
            round(stroke_px, 2),
            readable,
        )
        words.append(made)
    visible = _mean(*np.array(shares).T)
    return sample.TextTruth(
        line.text.text, line.text.language, _quad(view.image_px[0]), body.name, body.instance_id,
        round(visible, 3), line.text.complete, tuple(words),
    )  # fmt: skip


def _size(image_px: Array, places_m: Array) -> tuple[float, float]:
    """Height of the highest of some characters [px], and how much the image shortens them.

    The second is the scale along the worse direction over the one along the height, at most 1.
    """
    px, m = _sides_m(image_px), np.maximum(_sides_m(places_m), 1e-9)
    highest = int((m[:, 1] + m[:, 3]).argmax())
    height_px = float(px[highest, 1] + px[highest, 3]) / 2.0
    up = (px[:, 1] + px[:, 3]).sum() / (m[:, 1] + m[:, 3]).sum()
    across = (px[:, 0] + px[:, 2]).sum() / (m[:, 0] + m[:, 2]).sum()
    return height_px, float(min(1.0, across / max(up, 1e-9)))


def _areas_px(image_px: Array) -> Array:
    """Areas of quads [n, 4, 2]."""
    u, v = image_px[..., 0], image_px[..., 1]
    doubled = (u * np.roll(v, -1, axis=1) - np.roll(u, -1, axis=1) * v).sum(axis=1)
    return np.asarray(0.5 * np.abs(doubled))


def _mean(values: Array, weights: Array) -> float:
    return float((values * weights).sum() / max(float(weights.sum()), 1e-9))


def _quad(uv: Array) -> sample.QuadPx:
    a, b, c, d = ((round(float(u), 2), round(float(v), 2)) for u, v in uv)
    return (a, b, c, d)
