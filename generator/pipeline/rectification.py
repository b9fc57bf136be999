"""Rectification: image and labels of a bent lens as a pinhole at the same place has them.

Photographs are interpolated bilinearly, as ``cv2.undistort`` does. Label images take the pixel that
the ray through the centre of the new pixel meets, without mixing: ids are never invented, and a
label differs from a rendered pinhole's only where a silhouette passes between the centres of
the two pixels, which are at most half a pixel of the original apart on each axis. Everything that
follows from label images is computed again from the rectified ones, by the annotators.

Image coordinates are ours: pixel ``i`` covers ``[i, i + 1)``. OpenCV's are smaller by 0.5.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.annotations import amodal_masks, boxes2d, instance_extents, instance_masks, lanes
from gen_data.annotations.annotate import Thresholds, is_listed
from gen_data.annotations.oriented_boxes2d import OrientedBoxes2d
from gen_data.annotations.part_masks import PartMasks
from gen_data.annotations.visibility import Visibility
from gen_data.core import errors, lens, se3
from gen_data.core.boxes import BoxPx, tight_box
from gen_data.core.capture import LAYERS, Channel, SensorReading, Silhouette
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.sample import (
    TRACK_STATES,
    BorderTruth,
    ImageTruth,
    KeypointTruth,
    MaskPx,
    ObjectTruth,
    SensorTracks,
)
from gen_data.core.scene import Scene
from gen_data.exporters.base import Rectify

WIDEST_DEG = 150.0
"""Widest field that is chosen without being asked for: beyond, nearly all pixels show the rim."""

INTERPOLATED = frozenset({Channel.RGB, Channel.INFRARED})
NOTHING: Mapping[Channel, float] = {
    Channel.RGB: 0,
    Channel.INFRARED: 0,
    Channel.Z_DEPTH: np.inf,
    Channel.RANGE: np.inf,
    Channel.MEASURED_DEPTH: np.inf,
    Channel.NORMALS: 0,
    Channel.INSTANCE: 0,
    Channel.PART: 0,
    Channel.CATEGORY: 0,
    Channel.OBJECT_COORDINATES: 0,
    Channel.SCENE_FLOW: np.nan,
    Channel.SEEN_IN_MIRROR: 0,
    Channel.MIRRORED_POSITION: np.nan,
    **LAYERS,
}
"""Channels that can be rectified, with the value of a pixel whose ray the original does not show.

Disparities and flow are displacements in the original image, and are left out.
"""

NO_MASK = MaskPx(0, 0, np.zeros((0, 0), dtype=bool))
EDGE_POINTS = 256
"""Points per side of a box whose new extent is sought."""

_DECIMALS = 6
"""Of image coordinates: the last bits of tan() differ between processors."""
_ROWS_AT_ONCE = 64


def rectified_intrinsics(source: Intrinsics, wanted: Rectify) -> Intrinsics:
    """The pinhole that shows a camera's image, of the same size.

    By default the widest one with the same aspect of pixels and a centred principal point whose
    every pixel the original shows: ``cv2.getOptimalNewCameraMatrix`` with ``alpha=0`` and
    ``centerPrincipalPoint=True``, exact instead of by a rectangle inscribed in 9 x 9 points.

    Raises:
        ConfigError: that pinhole has 150 degrees or more, or the lens is a panorama's, which has
            no widest pinhole.
    """
    if wanted.hfov_deg is not None:
        hfov_rad = math.radians(wanted.hfov_deg)
        return Intrinsics.from_hfov(source.width_px, source.height_px, hfov_rad)
    if wanted.keep_focal:
        return replace(source, lens=lens.PINHOLE)
    widest_px = 0.5 * source.width_px / math.tan(math.radians(0.5 * WIDEST_DEG))
    low, high = widest_px, 64.0 * source.width_px
    whole = source.lens.model != "equirectangular"
    if not whole or _is_covered(source, low) or not _is_covered(source, high):
        raise errors.ConfigError(
            f"rectify: the lens '{source.lens.model}' sees too much for one pinhole, whose image "
            f"would be wider than {WIDEST_DEG:g} degrees; expected rectify: {{hfov_deg: 90}}, the "
            "horizontal field of the rectified image, or a list cameras: without this camera"
        )
    while high - low > 0.5e-6:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if _is_covered(source, middle) else (middle, high)
    return _centred(source, math.ceil(high * 1e6) / 1e6)


def _centred(source: Intrinsics, fx_px: float) -> Intrinsics:
    """A pinhole of the size and the aspect of pixels of ``source``, centred."""
    width, height = source.width_px, source.height_px
    fy_px = round(fx_px * source.fy_px / source.fx_px, _DECIMALS)
    return Intrinsics(width, height, fx_px, fy_px, 0.5 * width, 0.5 * height)


def _is_covered(source: Intrinsics, fx_px: float) -> bool:
    """Whether the original shows the centres of all pixels at the rim of a pinhole's image."""
    width, height = source.width_px, source.height_px
    u, v = np.arange(width) + 0.5, np.arange(height) + 0.5
    rim = [np.stack(np.broadcast_arrays(u, end), -1) for end in (0.5, height - 0.5)]
    rim += [np.stack(np.broadcast_arrays(end, v), -1) for end in (0.5, width - 0.5)]
    seen = source.project(_centred(source, fx_px).rays(np.concatenate(rim)))
    # NaN, outside the lens's field, compares as False.
    return bool(((seen >= 0.5) & (seen <= np.array([width, height]) - 0.5)).all())


@dataclass(frozen=True, eq=False)
class Rectification:
    """The map from the image of a bent lens to the image of a pinhole with the same pose.

    Attributes:
        source: Intrinsics of the image as it is.
        target: A pinhole.
    """

    source: Intrinsics
    target: Intrinsics

    def image(self, channel: Channel, image: NDArray[Any]) -> NDArray[Any]:
        """One channel as the pinhole shows it, [height, width, ...]; see ``NOTHING``."""
        if channel in INTERPOLATED:
            return self._interpolated(image)
        if channel is Channel.RANGE:
            # The surface keeps its depth at the other ray, as the depth image has it.
            depth = image.astype(np.float64) * self.source.pixel_rays()[..., 2]
            rays = self.target.pixel_rays()[..., 2]
            return np.asarray(self.nearest(depth, np.inf) / rays, np.float32)
        return self.nearest(image, NOTHING[channel])

    def nearest(self, image: NDArray[Any], nothing: float) -> NDArray[Any]:
        """The pixels that the rays through the new centres meet, [height, width, ...]."""
        return self._take(image, self._places(self._window), nothing)

    def mask(self, mask: MaskPx) -> MaskPx:
        """A mask with its parts outside the new image, on a canvas of three by three images."""
        height, width = mask.pixels.shape
        whole = np.zeros((self.source.height_px, self.source.width_px), bool)
        whole[mask.y_px : mask.y_px + height, mask.x_px : mask.x_px + width] = mask.pixels
        edge = self._edge(BoxPx(mask.x_px, mask.y_px, mask.x_px + width, mask.y_px + height))
        area = self._canvas
        if np.isfinite(edge).all():
            area = _around(edge, margin_px=2).intersection(area)
        seen = self._take(whole, self._places(area), 0)
        box = tight_box(seen, area.x_min, area.y_min)
        if box is None:
            return NO_MASK
        return MaskPx(box.x_min, box.y_min, seen[box.window(area.x_min, area.y_min)])

    def points(self, points_px: se3.Array) -> se3.Array:
        """Image points [..., 2] in the new image, or outside it; NaN where it has none."""
        return self.target.project(self.source.rays(points_px))

    def shows(self, points_px: se3.Array) -> NDArray[np.bool_]:
        """Whether points [..., 2] are inside the new image."""
        size = (self.target.width_px, self.target.height_px)
        return np.asarray(((points_px >= 0.0) & (points_px < size)).all(axis=-1))

    def box(self, box: BoxPx) -> BoxPx | None:
        """Box on the canvas around the new places of a box's edge; None if it has none."""
        edge = self._edge(box)
        edge = edge[np.isfinite(edge).all(axis=-1)]
        area = _around(edge).intersection(self._canvas) if len(edge) else None
        return None if area is None or area.is_empty else area

    @property
    def _window(self) -> BoxPx:
        return BoxPx(0, 0, self.target.width_px, self.target.height_px)

    @property
    def _canvas(self) -> BoxPx:
        width, height = self.target.width_px, self.target.height_px
        return BoxPx(-width, -height, 2 * width, 2 * height)

    @cached_property
    def _inside(self) -> se3.Array:
        """Original coordinates of the centres of the new pixels, [height, width, 2]; NaN = none."""
        return self._sources(self._window)

    @cached_property
    def _everywhere(self) -> NDArray[np.int32]:
        return self._pixels(self._canvas)

    def _places(self, area: BoxPx) -> NDArray[np.int32]:
        """Places in the flat original of the pixels of an area, [h, w]; -1 = none."""
        return self._everywhere if area == self._canvas else self._pixels(area)

    def _pixels(self, area: BoxPx) -> NDArray[np.int32]:
        places = np.full((area.height_px, area.width_px), -1, np.int32)
        size = np.array([self.source.width_px, self.source.height_px])
        for first in range(0, area.height_px, _ROWS_AT_ONCE):
            last = min(first + _ROWS_AT_ONCE, area.height_px)
            band = BoxPx(area.x_min, area.y_min + first, area.x_max, area.y_min + last)
            at = self._inside if band == self._window else self._sources(band)
            seen = np.asarray(((at >= 0.0) & (at < size)).all(axis=-1))
            columns, rows = np.moveaxis(np.where(seen[..., None], at, 0.0).astype(np.int32), -1, 0)
            places[first:last] = np.where(seen, rows * self.source.width_px + columns, -1)
        return places

    def _sources(self, area: BoxPx) -> se3.Array:
        u = np.arange(area.x_min, area.x_max) + 0.5
        v = np.arange(area.y_min, area.y_max) + 0.5
        centres = np.stack(np.meshgrid(u, v), axis=-1)
        return np.asarray(np.round(self.source.project(self.target.rays(centres)), _DECIMALS))

    def _edge(self, box: BoxPx) -> se3.Array:
        """New places of points along the edge of a box, [n, 2]."""
        u = np.linspace(box.x_min, box.x_max, EDGE_POINTS)
        v = np.linspace(box.y_min, box.y_max, EDGE_POINTS)
        edge = [np.stack(np.broadcast_arrays(u, end), -1) for end in (box.y_min, box.y_max)]
        edge += [np.stack(np.broadcast_arrays(end, v), -1) for end in (box.x_min, box.x_max)]
        return self.points(np.concatenate(edge))

    def _take(self, image: NDArray[Any], places: NDArray[np.int32], nothing: float) -> NDArray[Any]:
        found = image.reshape(-1, *image.shape[2:])[places]
        found[places < 0] = nothing
        return np.asarray(found)

    def _interpolated(self, image: NDArray[Any]) -> NDArray[Any]:
        """Between the four nearest centres; beyond the outermost, the outermost."""
        last = np.array([self.source.width_px - 1, self.source.height_px - 1])
        seen = np.asarray(((self._inside >= 0.0) & (self._inside < last + 1)).all(axis=-1))
        at = np.clip(np.where(seen[..., None], self._inside, 0.5) - 0.5, 0.0, last)
        column, row = np.moveaxis(at.astype(np.intp), -1, 0)
        right, below = np.minimum(column + 1, last[0]), np.minimum(row + 1, last[1])
        x, y = np.moveaxis(at % 1.0, -1, 0)
        if image.ndim > x.ndim:
            x, y = x[..., None], y[..., None]
        upper = image[row, column] * (1.0 - x) + image[row, right] * x
        lower = image[below, column] * (1.0 - x) + image[below, right] * x
        mixed = np.rint(upper * (1.0 - y) + lower * y).astype(image.dtype)
        mixed[~seen] = 0
        return np.asarray(mixed)


def _around(points_px: se3.Array, margin_px: int = 0) -> BoxPx:
    """Whole pixels around points [n, 2]."""
    # Far beyond the canvas, numbers need not fit into integers.
    points = np.clip(points_px, -1e6, 1e6)
    low, high = np.floor(points.min(axis=0)) - margin_px, np.ceil(points.max(axis=0)) + margin_px
    return BoxPx(int(low[0]), int(low[1]), int(high[0]), int(high[1]))


@lru_cache(maxsize=8)
def rectification(source: Intrinsics, wanted: Rectify) -> Rectification:
    """The map of a camera; cameras of a rig keep theirs. Raises ConfigError: see above."""
    return Rectification(source, rectified_intrinsics(source, wanted))


def rectified_truth(
    truth: ImageTruth,
    scene: Scene,
    bent: Rectification,
    thresholds: Thresholds,
    parts: NDArray[np.uint16] | None = None,
) -> ImageTruth:
    """The annotations of an image as they are of its rectified image.

    Annotations derived from pixels are computed from the rectified masks. Silhouettes are known
    inside the
    original image, from ``amodal_mask``: shares of silhouettes are exact for objects that the
    original does not truncate; of others, the part outside the original counts in proportion.
    Without amodal masks, the hidden part of an object counts in proportion to its visible one.

    Args:
        truth: Annotations of the original image, with instance masks.
        scene: At the image's instant.
        bent: Map of its camera.
        thresholds: For listing objects, as in the original.
        parts: Rectified part ids [height, width]; None = not known, then ``part_px`` is None.

    Returns:
        The annotations, except sentences (``utterances``) and written text (``texts``), which hold
        for the original image only. Results of third-party annotators (``extra``) are the
        original's.
    """
    camera = replace(truth.camera, intrinsics=bent.target)
    masks = {t.instance.instance_id: bent.mask(t.mask) for t in truth.objects if t.mask is not None}
    ids = np.zeros((bent.target.height_px, bent.target.width_px), np.uint16)
    for number, mask in masks.items():
        _paste(ids, mask, number)
    channels: dict[Channel, NDArray[Any]] = {Channel.INSTANCE: ids}
    if parts is not None:
        channels[Channel.PART] = parts
    whole = {
        t.instance.instance_id: _silhouette(t.instance.instance_id, bent.mask(t.amodal_mask))
        for t in truth.objects
        if t.amodal_mask is not None
    }
    reading = SensorReading(camera.name, camera, channels, whole)
    seen = instance_extents.find_extents(ids)
    objects = []
    for thing in truth.objects:
        number = thing.instance.instance_id
        extent = seen.get(number)
        again = replace(
            thing,
            visible_px=extent.visible_px if extent else 0,
            box=extent.box if extent else None,
            keypoints=_keypoints(thing.keypoints, bent),
        )
        again = _pixel_labels(again, scene, reading)
        again = _silhouette_labels(thing, again, scene, reading, bent, masks.get(number, NO_MASK))
        if is_listed(again, thresholds):
            objects.append(again)
    relations = truth.relations
    if relations is not None:
        shown = {t.instance.instance_id for t in objects if t.box is not None}
        lost = {t.instance.instance_id for t in truth.objects} - shown
        relations = tuple(r for r in relations if not {r.subject, r.object} & lost)
    return replace(
        truth,
        camera=camera,
        objects=tuple(objects),
        borders=None if truth.borders is None else _borders(truth.borders, bent),
        free_space=None
        if truth.free_space is None
        else _clipped(bent.mask(truth.free_space), bent),
        relations=relations,
        utterances=None,
        texts=None,
    )


def rectified_tracks(tracks: SensorTracks, bent: Rectification) -> SensorTracks:
    """Tracked points in the new image; points outside it are ``outside`` or ``behind``."""
    image_px = bent.points(tracks.image_px.astype(np.float64))
    state = tracks.state.copy()
    state[~bent.shows(image_px)] = TRACK_STATES.index("outside")
    state[np.isnan(image_px[:, 0])] = TRACK_STATES.index("behind")
    hidden_by = np.where(state == tracks.state, tracks.hidden_by, np.uint16(0))
    return SensorTracks(tracks.position_m, image_px.astype(np.float32), state, hidden_by)


def _pixel_labels(thing: ObjectTruth, scene: Scene, reading: SensorReading) -> ObjectTruth:
    thing = instance_masks.InstanceMasks().annotate(scene, reading, thing)
    if thing.oriented_box is not None:
        thing = OrientedBoxes2d().annotate(scene, reading, replace(thing, oriented_box=None))
    if thing.part_px is not None:
        known = Channel.PART in reading.channels
        thing = (
            PartMasks().annotate(scene, reading, replace(thing, part_px=None))
            if known
            else (replace(thing, part_px=None))
        )
    return thing


def _silhouette_labels(
    thing: ObjectTruth,
    again: ObjectTruth,
    scene: Scene,
    reading: SensorReading,
    bent: Rectification,
    visible: MaskPx,
) -> ObjectTruth:
    """Labels of the whole silhouette; ``visible`` is the visible mask on the canvas."""
    cut = thing.truncation or 0.0
    if thing.amodal_mask is not None:
        again = amodal_masks.AmodalMasks().annotate(scene, reading, again)
    if thing.amodal_mask is not None and thing.amodal_mask.pixels.any():
        again = boxes2d.Boxes2d().annotate(scene, reading, again)
        shares = Visibility().annotate(scene, reading, again)
        visible_fraction = (shares.visible_fraction or 0.0) * (1.0 - cut)
        inside, occlusion = 1.0 - (shares.truncation or 0.0), shares.occlusion
    else:
        all_px = int(np.count_nonzero(visible.pixels))
        inside = again.visible_px / all_px if all_px else 0.0
        visible_fraction, occlusion = (thing.visible_fraction or 0.0) * inside, thing.occlusion
    if thing.amodal_box is None:
        again = replace(again, amodal_box=None)
    elif thing.amodal_mask is None or cut > 0.0:
        around = bent.box(thing.amodal_box)
        known = again.amodal_box if thing.amodal_mask is not None else None
        both = around.union(known) if around and known else around or known
        again = replace(again, amodal_box=both)
    if thing.visible_fraction is None:
        return again
    truncation = 1.0 - inside * (1.0 - cut)
    return replace(
        again, visible_fraction=visible_fraction, occlusion=occlusion, truncation=truncation
    )


def _silhouette(number: int, mask: MaskPx) -> Silhouette:
    return Silhouette(number, mask.x_px, mask.y_px, mask.pixels)


def _paste(ids: NDArray[np.uint16], mask: MaskPx, number: int) -> None:
    """Give the pixels of a mask that are inside an image a number."""
    height, width = mask.pixels.shape
    box = BoxPx(mask.x_px, mask.y_px, mask.x_px + width, mask.y_px + height)
    inner = box.clipped(ids.shape[1], ids.shape[0])
    if inner is not None:
        ids[inner.window()][mask.pixels[inner.window(mask.x_px, mask.y_px)]] = number


def _clipped(mask: MaskPx, bent: Rectification) -> MaskPx:
    """The part of a mask inside the new image, tight."""
    ids = np.zeros((bent.target.height_px, bent.target.width_px), np.uint16)
    _paste(ids, mask, 1)
    box = tight_box(ids > 0)
    return NO_MASK if box is None else MaskPx(box.x_min, box.y_min, ids[box.window()] > 0)


def _keypoints(
    points: Sequence[KeypointTruth] | None, bent: Rectification
) -> tuple[KeypointTruth, ...] | None:
    """Keypoints at their new places; whether something hides one does not depend on the lens."""
    if points is None:
        return None
    moved = []
    for point in points:
        place = bent.points(np.array(point.image_px))
        if point.visibility == 0 or not bent.shows(place):
            moved.append(KeypointTruth(point.name, point.position_m))
        else:
            moved.append(replace(point, image_px=(float(place[0]), float(place[1]))))
    return tuple(moved)


def _borders(borders: Sequence[BorderTruth], bent: Rectification) -> tuple[BorderTruth, ...]:
    cut = []
    for border in borders:
        places = bent.points(np.array(border.points_px))
        for start, end in lanes.runs(np.flatnonzero(bent.shows(places))):
            points = tuple((round(float(u), 2), round(float(v), 2)) for u, v in places[start:end])
            cut.append(replace(border, points_px=points, visible=border.visible[start:end]))
    return tuple(cut)
