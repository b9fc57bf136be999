"""Text in images: content, place, visibility and readability of everything written."""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gen_data.config.base_model import Strict
from gen_data.core import sample
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.interfaces import AssetLibrary, WrittenAssets
from gen_data.core.rolling_shutter_projection import project_moving_points
from gen_data.core.scene import Scene
from gen_data.core.se3 import Array
from gen_data.core.surface_points import SurfacePoints
from gen_data.core.surface_text import SurfaceQuads, SurfaceText, place_on_mesh, place_writing

CAPITALS_PX, LETTERS_PX = 7.0, 9.0
"""Least height of readable characters: ISO 9241-303 requires 5 by 7 dots for digits and capitals
alone, and 7 by 9 dots where letters of both cases are read."""
READABLE_SHARE = 0.5
"""Least visible share of every character of a readable word (assumed)."""
MODULE_PX = 2.0
"""Least width of a module of a readable code: two samples per module, by the sampling theorem."""
GRID = 5
"""Points per side of a character at which its visibility is decided."""
NEAR_M, NEAR_SHARE = 0.003, 0.001
"""Surfaces nearer than the text by more hide it: this, and this share of the distance."""
MARGIN_PX = 64.0
"""Lines this far outside the image are looked at more closely."""
_PLACES = 1024
"""Assets whose lines are kept in memory."""


class Text(Strict):
    """Lines of text in the image: number plates, signs, labels, covers, posters, words on roads.

    For every line, word and character: the quad of its ink, projected through the lens, also where
    hidden; content, language, visibility, and size in pixels. Lines without a visible
    character of the least height are left out. Text that is seen from behind or mirrored has a
    visibility of 0; text in mirrors and behind panes of glass counts as hidden.

    A word is readable if its highest character is at least 9 px high, or 7 px if it has no small
    letters, in the direction in which the image shortens it most (ISO 9241-303: a matrix of 7 by 9
    dots, and of 5 by 7 for digits and capitals alone), and half of each character is visible. A
    code is readable if its modules are 2 px wide and all of it is visible. Contrast, blur and noise
    do not count.

    Attributes:
        min_height_px: Least height of the highest character of a line.
    """

    channels: ClassVar[frozenset[Channel]] = frozenset({Channel.INSTANCE, Channel.RANGE})
    type: Literal["text"] = "text"
    min_height_px: float = Field(4.0, gt=0)

    def annotate_image(
        self, scene: Scene, assets: AssetLibrary, reading: SensorReading, truth: sample.ImageTruth
    ) -> sample.ImageTruth:
        """Fill in ``texts``; empty where nothing in the image is written on."""
        found = _lines_in_view(scene, assets, reading, self.min_height_px)
        if not found:
            return replace(truth, texts=())
        view = _project(scene, assets, reading, found)
        lens = reading.camera.intrinsics
        texts, start, size = [], 0, (lens.width_px, lens.height_px)
        for line in found:
            rows = slice(start, start + line.count)
            start = rows.stop
            if view.visible[rows].any() and np.isfinite(view.image_px[rows]).all():
                texts.append(_describe(scene, line, view.take(rows), size))
        return replace(truth, texts=tuple(text for text in texts if self._is_listed(text)))

    def _is_listed(self, text: sample.TextTruth) -> bool:
        return any(
            word.visible_fraction > 0.0 and word.height_px >= self.min_height_px
            for word in text.words
        )


def can_write(assets: AssetLibrary, ids: tuple[str, ...]) -> bool:
    """Whether any of some textures and objects has writing; empty ids have none."""
    return isinstance(assets, WrittenAssets) and any(map(assets.writing, filter(None, ids)))


@dataclass(frozen=True, eq=False, slots=True)
class _Written:
    """Lines on a mesh, and their quads: of each the line's, then every word's with its letters'.

    Attributes:
        lines: Lines that are not mirrored everywhere.
        starts: Number of the first quad of each line, and the count of all.
        quads: Quads on the mesh, [n].
        mirrored: Whether each is mirrored on the outside of the surface, bool [n].
        height_m: Height of each line's quad.
    """

    lines: tuple[SurfaceText, ...]
    starts: NDArray[np.intp]
    quads: SurfaceQuads
    mirrored: NDArray[np.bool_]
    height_m: Array


@lru_cache(maxsize=_PLACES)
def _written_on(assets: AssetLibrary, asset_id: str, textures: tuple[str, ...]) -> _Written | None:
    """Lines on a mesh whose slots have these textures; empty = none, or without the mesh's UVs."""
    if not can_write(assets, (asset_id, *textures)):
        return None
    assert isinstance(assets, WrittenAssets)
    mesh = assets.mesh(asset_id)
    own = map(place_on_mesh, assets.writing(asset_id))
    printed = (
        line
        for slot, texture in enumerate(textures)
        if texture
        for line in place_writing(mesh, slot, assets.writing(texture))
        if not all(word.mirrored.all() for word in line.words)
    )
    lines = (*own, *printed)
    if not lines:
        return None
    parts = [[line.quad, *(word.quads for word in line.words)] for line in lines]
    flat = [quads for part in parts for quads in part]
    quads = SurfaceQuads(*(np.concatenate([getattr(q, name) for q in flat])
                           for name in ("face", "weights", "corners_m")))  # fmt: skip
    starts = np.cumsum([0, *(sum(len(q.face) for q in part) for part in parts)])
    flags = [f for line in lines for f in ([line.words[0].mirrored[:1]],
                                           [word.mirrored for word in line.words])]  # fmt: skip
    height_m = sides(quads.corners_m[starts[:-1]])[:, 1::2].max(axis=1)
    mirrored = np.concatenate([flag for part in flags for flag in part])
    return _Written(lines, starts, quads, mirrored, height_m)


@dataclass(frozen=True, eq=False, slots=True)
class _Line:
    """A line on a body of a scene."""

    body: int
    written: _Written
    number: int

    @property
    def text(self) -> SurfaceText:
        return self.written.lines[self.number]

    @property
    def rows(self) -> slice:
        """Its quads."""
        return slice(*self.written.starts[self.number : self.number + 2].tolist())

    @property
    def count(self) -> int:
        return int(np.diff(self.written.starts[self.number : self.number + 2])[0])


def _lines_in_view(
    scene: Scene, assets: AssetLibrary, reading: SensorReading, min_height_px: float
) -> list[_Line]:
    """Lines on bodies that may be in the image and high enough, in the order of the bodies."""
    camera, found, corners = reading.camera, [], []
    lens = camera.intrinsics
    T_camera_world = camera.T_world_camera.inverse()
    shown = set(np.unique(reading.channels[Channel.INSTANCE]).tolist())
    for number, body in enumerate(scene.bodies):
        if body.instance_id not in shown:
            continue
        materials = body.materials or assets.materials(body.asset)
        textures = tuple("" if m.texture_scale_m else m.texture for m in materials)
        written = _written_on(assets, body.asset, textures)
        if written is not None:
            p_body = written.quads.corners_m[written.starts[:-1]] * body.scale
            p_camera = (T_camera_world @ body.T_world_body).apply(p_body.reshape(-1, 3))
            near_m = np.linalg.norm(p_camera, axis=1).reshape(-1, 4).min(axis=1)
            # Lenses enlarge by less than twice their focal length.
            high_px = 2.0 * max(lens.fx_px, lens.fy_px) * written.height_m * body.scale
            for k in np.flatnonzero(high_px >= min_height_px * near_m).tolist():
                found.append(_Line(number, written, k))
                corners.append(p_camera[4 * k : 4 * k + 4])
    if not found:
        return []
    uv = lens.project(np.concatenate(corners)).reshape(-1, 4, 2)
    low, high = uv.min(axis=1), uv.max(axis=1)
    # Bent lines reach beyond their corners; rows of rolling shutters are exposed at other times.
    reach = high - low + MARGIN_PX
    size = (lens.width_px, lens.height_px)
    inside = ((high + reach > 0.0) & (low - reach < size)).all(axis=1)
    return [found[k] for k in np.flatnonzero(inside).tolist()]


def sides(quads: Array) -> Array:
    """Lengths of the sides of quads [..., 4, k], [..., 4]: upper, right, lower, left."""
    return np.asarray(np.linalg.norm(quads[..., [1, 2, 3, 0], :] - quads, axis=-1))


@dataclass(frozen=True, eq=False, slots=True)
class _View:
    """Quads in an image.

    Attributes:
        places_m: Corners in the world at the image's instant, [n, 4, 3].
        image_px: Corners, [n, 4, 2]; NaN where the lens has no image of them.
        visible: Visible share of each, [n].
    """

    places_m: Array
    image_px: Array
    visible: Array

    def take(self, rows: slice) -> "_View":
        return _View(self.places_m[rows], self.image_px[rows], self.visible[rows])


def _project(
    scene: Scene, assets: AssetLibrary, reading: SensorReading, lines: list[_Line]
) -> _View:
    """Project the quads of lines, and find the visible part of each."""
    counts = [line.count for line in lines]
    body = np.repeat([line.body for line in lines], counts)
    parts = [(line.written, line.rows) for line in lines]
    points = SurfacePoints(
        np.repeat(body, 4),
        tuple(scene.bodies[k].asset for k in np.repeat(body, 4).tolist()),
        np.concatenate([w.quads.face[rows].reshape(-1) for w, rows in parts]),
        np.concatenate([w.quads.weights[rows].reshape(-1, 3) for w, rows in parts]),
        np.concatenate([w.quads.corners_m[rows].reshape(-1, 3) for w, rows in parts]),
    )
    p_body = points.on_bodies(scene, assets)
    world = points.moving(scene, p_body)
    p_camera, image_px, _ = project_moving_points(scene, reading.camera, world, len(p_body))
    ids = np.array([scene.bodies[line.body].instance_id for line in lines])
    mirrored = np.concatenate([w.mirrored[rows] for w, rows in parts])
    visible = _visible_shares(reading, np.repeat(ids, counts), p_camera.reshape(-1, 4, 3), mirrored)
    places_m = world(np.zeros(len(p_body))).reshape(-1, 4, 3)
    return _View(places_m, image_px.reshape(-1, 4, 2), visible)


def _visible_shares(
    reading: SensorReading,
    instance_id: NDArray[np.integer],
    quads: Array,
    mirrored: NDArray[np.bool_],
) -> Array:
    """Visible shares [n] of quads [n, 4, 3] in the camera frame, by the pixels of their points."""
    share = (np.arange(GRID) + 0.5) / GRID
    x, y = (axis.reshape(-1) for axis in np.meshgrid(share, share))
    bilinear = np.stack([(1 - x) * (1 - y), x * (1 - y), x * y, (1 - x) * y])
    right, down = quads[:, 1] - quads[:, 0], quads[:, 3] - quads[:, 0]
    outward = (np.cross(right, down) * quads.sum(axis=1)).sum(axis=1) > 0.0
    shares = np.zeros(len(quads))
    shown = np.flatnonzero(outward & ~mirrored)
    quads = quads[shown]
    points = np.einsum("qs,nqi->nsi", bilinear, quads, optimize=False)
    lens = reading.camera.intrinsics
    uv = lens.project(points.reshape(-1, 3)).reshape(*points.shape[:2], 2)
    u, v = uv[..., 0], uv[..., 1]
    inside = (u >= 0.0) & (u < lens.width_px) & (v >= 0.0) & (v < lens.height_px)
    columns, rows = (np.where(inside, a, 0.0).astype(np.intp) for a in (u, v))
    away_m = np.linalg.norm(points, axis=2)
    range_m = reading.channels[Channel.RANGE][rows, columns].astype(np.float64)
    own = reading.channels[Channel.INSTANCE][rows, columns] == instance_id[shown, None]
    # The centre of the pixel is up to 0.7 px from the point: ranges differ by as much as they do
    # over that part of the quad.
    spread_m = np.ptp(np.linalg.norm(quads, axis=2), axis=1)
    corners_px = lens.project(quads.reshape(-1, 3)).reshape(-1, 4, 2)
    short_px = np.nan_to_num(sides(corners_px).min(axis=1), nan=1.0)
    slack_m = NEAR_M + spread_m / np.maximum(short_px, 0.7)
    near = np.abs(range_m - away_m) <= slack_m[:, None] + NEAR_SHARE * away_m
    shares[shown] = (inside & own & near).mean(axis=1)
    return shares


def _describe(scene: Scene, line: _Line, view: _View, size: tuple[int, int]) -> sample.TextTruth:
    """A line in an image of a size [px]."""
    text, body, start, words, shares = line.text, scene.bodies[line.body], 1, [], []
    areas = _areas_px(view.image_px)
    quads: list[sample.QuadPx] = [
        (tuple(a), tuple(b), tuple(c), tuple(d))
        for a, b, c, d in np.round(view.image_px, 2).tolist()
    ]
    for word in text.words:
        n = len(word.quads.face)
        rows = slice(start + 1, start + n)
        letters = word.text if text.kind == "print" else [word.text]
        visible = view.visible[rows]
        characters = map(sample.CharacterTruth, letters, quads[rows], np.round(visible, 3).tolist())
        share = _mean(visible, areas[rows])
        shares.append((share, float(areas[rows].sum())))
        height_px, scale = _size(view.image_px[rows], view.places_m[rows])
        stroke_px = text.stroke * height_px * scale
        if text.kind == "code":
            inside = ((view.image_px >= 0.0) & (view.image_px <= size)).all()
            readable = stroke_px >= MODULE_PX and bool(inside and visible.min() == 1.0)
        else:
            least_px = LETTERS_PX if word.text.upper() != word.text else CAPITALS_PX
            readable = text.kind == "print" and height_px * scale >= least_px
            readable = readable and bool((visible >= READABLE_SHARE).all())
        made = sample.WordTruth(
            word.text,
            quads[start],
            tuple(characters),
            round(share, 3),
            round(height_px, 2),
            round(stroke_px, 2),
            readable,
        )
        words.append(made)
        start += n
    return sample.TextTruth(
        text.text,
        text.language,
        text.kind,
        quads[0],
        body.name,
        body.instance_id,
        round(_mean(*np.array(shares).T), 3),
        text.complete,
        tuple(words),
    )


def _size(image_px: Array, places_m: Array) -> tuple[float, float]:
    """Height of the highest of some characters [px], and how much the image shortens them.

    The second is the scale along the worse direction over the one along the height, at most 1.
    """
    px, m = sides(image_px), np.maximum(sides(places_m), 1e-9)
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
