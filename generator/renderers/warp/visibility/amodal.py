"""Amodal silhouettes: each instance alone, on a canvas three images wide and high.

Silhouettes of a pinhole camera are rasterised; with other lenses, they are found by rays. The
canvas then extends the lens model: its pixels outside the image have the directions of a larger
sensor behind the same lens, and none beyond the lens's field.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.core import asset_types, se3
from gen_data.core.boxes import BoxPx, tight_box
from gen_data.core.capture import Silhouette
from gen_data.core.scene import Scene
from gen_data.renderers.warp.device import launch
from gen_data.renderers.warp.native_code import LANES
from gen_data.renderers.warp.scene.distortion_lut import NODE_STRIDE_PX
from gen_data.renderers.warp.scene.kernels import records
from gen_data.renderers.warp.scene.scene_packing import pack_view
from gen_data.renderers.warp.visibility import gbuffer, reprojection
from gen_data.renderers.warp.visibility.frame_context import CameraView, RowBand, pack_state
from gen_data.renderers.warp.visibility.kernels import amodal, amodal_lens
from gen_data.renderers.warp.visibility.kernels.rasterizer import Z_NEAR_M, Outline

_NOTHING = np.zeros((0, 0), np.bool_)
_UNSNAPPED = -(2**31)
_BANDS = 12
_ROWS, _PARTS = 16, 32
"""On a GPU: rows of an outline, and threads that share its faces."""
EMPTY = BoxPx(0, 0, 0, 0)
_EDGES = np.array([(k, k | bit) for bit in (1, 2, 4) for k in range(8) if not k & bit]).T
"""Corners at the ends of a box's twelve edges, [2, 12], as of CORNERS."""


def render_silhouettes(frame: CameraView, seen_ids: NDArray[np.uint16]) -> dict[int, Silhouette]:
    """The silhouette of every annotated instance, by instance id.

    Coverage is the rasteriser's for a pinhole, otherwise the one found by rays. It is united with
    ``seen_ids``, the image of visible instance ids: where rays decide visibility, they may differ
    from the rasteriser by a pixel at an edge.
    """
    pinhole = frame.view.lens == records.PINHOLE
    boxes, drawn = _rasterize_masks(frame) if pinhole else _trace_masks(frame)
    found: dict[int, Silhouette] = {}
    first = 0
    for instance_id, box in boxes.items():
        end = first + box.width_px * box.height_px
        pixels = drawn[first:end].reshape(box.height_px, box.width_px)
        _unite(pixels, box, seen_ids, instance_id)
        found[instance_id] = _crop(instance_id, pixels, box)
        first = end
    return found


def _rasterize_masks(frame: CameraView) -> tuple[dict[int, BoxPx], NDArray[np.bool_]]:
    """A bounding box of each annotated instance's silhouette, and the masks of all boxes."""
    scene, world, view, cache = frame.state.scene, frame.world, frame.view, frame.cache
    projected = frame.gbuffer.projected or gbuffer.project_vertices(world, view, cache)
    boxes = _boxes_px(frame, projected)
    whole = {
        number: boxes.get(scene.bodies[number].instance_id, EMPTY)
        for number in projected.reached.tolist()
    }
    shared = not cache.device.is_cpu
    outlines, size = _outline_records(scene, boxes, whole, _ROWS if shared else None)
    mask = _Mask.allocate(size + LANES, cache.device)
    listed = wp.array(outlines, dtype=Outline, device=cache.device)
    # On the CPU, threads run one after another anyway; on a GPU, a few bodies need thousands.
    parts = _PARTS if shared else 1
    inputs = [view, world.record, projected.p_camera, projected.xy, listed, parts]
    frame.launch(amodal.draw_silhouettes, (len(outlines), parts), inputs, [mask.pixels])
    return boxes, mask.read()


@dataclass(frozen=True, eq=False, slots=True)
class _Mask:
    """Pixels on the device, 0 or 1, which the host reads as bits.

    Attributes:
        words: Eight pixels each.
        pixels: The same memory, one byte per pixel.
    """

    words: wp.array
    pixels: wp.array

    @classmethod
    def allocate(cls, size: int, device: wp.Device) -> "_Mask":
        """At least ``size`` pixels, all 0."""
        words = wp.zeros(-(-size // 8), dtype=wp.uint64, device=device)
        pixels = wp.array(ptr=words.ptr, shape=8 * words.size, dtype=wp.uint8, device=device)
        return cls(words, pixels)

    def read(self) -> NDArray[np.bool_]:
        bits = wp.empty(self.words.size, dtype=wp.uint8, device=self.words.device)
        launch(amodal.pack_bits, bits.size, [self.words], [bits], device=bits.device)
        return np.unpackbits(bits.numpy(), bitorder="little").view(np.bool_)


def _boxes_px(frame: CameraView, projected: gbuffer.Projected) -> dict[int, BoxPx]:
    """Pixels of the canvas that each annotated instance's vertices span; may be empty."""
    scene, view = frame.state.scene, frame.view
    canvas = gbuffer.canvas_box(view)
    annotated = sorted(i.instance_id for i in scene.instances if i.annotated)
    boxes = dict.fromkeys(annotated, EMPTY)
    extents = projected.extents.numpy()
    lows, highs = extents["low"].min(axis=1), extents["high"].max(axis=1)
    for k in np.flatnonzero(extents["farthest_m"].max(axis=1) >= Z_NEAR_M).tolist():
        number = projected.reached[k]
        instance_id = scene.bodies[number].instance_id
        if instance_id in boxes:
            if lows[k, 0] == _UNSNAPPED:
                (corners_m,) = gbuffer.box_corners(frame.world.body_records[[number]], view)
                reached = clipped_box_px(corners_m, view)
            else:
                reached = BoxPx(*(lows[k] >> 8).tolist(), *((highs[k] >> 8) + 1).tolist())
            boxes[instance_id] = boxes[instance_id].union(reached.intersection(canvas))
    return boxes


def clipped_box_px(corners_m: se3.Array, view: records.View) -> BoxPx:
    """Pixels that a box may cover which reaches behind a pinhole's plane.

    ``corners_m`` are its corners in the camera frame, [3, 8], in the order of CORNERS.
    """
    # Slightly nearer than where triangles are clipped: vertices are single precision.
    near_m = 0.999 * Z_NEAR_M
    a, b = corners_m[:, _EDGES[0]], corners_m[:, _EDGES[1]]
    cut = (a[2] < near_m) != (b[2] < near_m)
    share = (near_m - a[2, cut]) / (b[2, cut] - a[2, cut])
    crossings_m = a[:, cut] + (b[:, cut] - a[:, cut]) * share
    front = corners_m[2] >= near_m
    if not front.any():
        # Rounding: a vertex that lies in the plane itself.
        return gbuffer.canvas_box(view)
    x, y, z = np.concatenate([corners_m[:, front], crossings_m], axis=1)
    u, v = view.fx * x / z + view.cx, view.fy * y / z + view.cy
    return BoxPx(
        math.floor(u.min()) - 1,
        math.floor(v.min()) - 1,
        math.ceil(u.max()) + 1,
        math.ceil(v.max()) + 1,
    )


def _outline_records(
    scene: Scene, boxes: dict[int, BoxPx], of_bodies: dict[int, BoxPx], band: int | None
) -> tuple[NDArray[np.void], int]:
    """Records of the bodies whose boxes are not empty, and the size of all instances' masks.

    Masks fill the boxes of the instances, one after another; each body's box is in its instance's.
    A record has ``band`` rows at most; all of them if it is None.
    """
    first_pixels, size = {}, 0
    for instance_id, box in boxes.items():
        first_pixels[instance_id] = size
        size += box.width_px * box.height_px
    rows = []
    for number, box in of_bodies.items():
        if box.is_empty:
            continue
        instance_id = scene.bodies[number].instance_id
        whole = boxes[instance_id]
        offset = (box.y_min - whole.y_min) * whole.width_px + box.x_min - whole.x_min
        window = (box.x_min, box.y_min, box.width_px, box.height_px)
        place = (first_pixels[instance_id] + offset, whole.width_px)
        for first in range(0, box.height_px, band or box.height_px):
            last = min(first + (band or box.height_px), box.height_px) - 1
            rows.append((number, window, first, last, *place))
    return np.array(rows, dtype=Outline.numpy_dtype()), size


def _unite(
    pixels: NDArray[np.bool_], box: BoxPx, seen_ids: NDArray[np.uint16], instance_id: int
) -> None:
    """Add an instance's visible pixels to its silhouette, in place."""
    inside = box.clipped(seen_ids.shape[1], seen_ids.shape[0])
    if inside is not None:
        pixels[inside.window(box.x_min, box.y_min)] |= seen_ids[inside.window()] == instance_id


def _crop(instance_id: int, pixels: NDArray[np.bool_], box: BoxPx) -> Silhouette:
    tight = tight_box(pixels)
    if tight is None:
        return Silhouette(instance_id, 0, 0, _NOTHING)
    x_px, y_px = box.x_min + tight.x_min, box.y_min + tight.y_min
    return Silhouette(instance_id, x_px, y_px, pixels[tight.window()])


def _trace_masks(frame: CameraView) -> tuple[dict[int, BoxPx], NDArray[np.bool_]]:
    """A bounding box of each annotated instance's silhouette, and the masks of all boxes."""
    scene, camera, cache = frame.state.scene, frame.state.camera, frame.cache
    world, view = frame.world, frame.view
    optics = cache.optics(camera.intrinsics)
    annotated = sorted(i.instance_id for i in scene.instances if i.annotated)
    boxes = dict.fromkeys(annotated, EMPTY)
    of_bodies: dict[int, BoxPx] = {}
    R_camera_world = camera.T_world_camera.rotation().T
    step_rad = _widest_step(optics.nodes)
    for number, body in enumerate(scene.bodies):
        if body.instance_id in boxes:
            ends_m = np.stack([world.body_records[end][number] for end in ("low_m", "high_m")])
            axis, half_rad = bounding_cone(ends_m - np.array(camera.T_world_camera.translation_m))
            cosines = optics.nodes @ (R_camera_world @ axis).astype(np.float32)
            # Every visible pixel has a node within the diagonal of a cell.
            near = cosines >= math.cos(min(half_rad + 1.5 * step_rad, math.pi))
            of_bodies[number] = _box_around(near, view).intersection(gbuffer.canvas_box(view))
            boxes[body.instance_id] = boxes[body.instance_id].union(of_bodies[number])
    windows, size = _outline_records(scene, boxes, of_bodies, None)
    mask = _Mask.allocate(size, cache.device)
    if len(windows):
        shape = (len(windows), int(windows["window"]["height"].max()))
        records_ = wp.array(windows, dtype=Outline, device=cache.device)
        inputs = [view, world.record, optics.nodes_on_device, NODE_STRIDE_PX, Z_NEAR_M, records_]
        frame.launch(amodal_lens.trace_silhouettes, shape, inputs, [mask.pixels])
    return boxes, mask.read()


def bounding_cone(ends_m: se3.Array) -> tuple[se3.Array, float]:
    """Axis and half angle of a cone from the origin around a box; pi if it contains the origin.

    ``ends_m`` are its low and high corner, [2, 3].
    """
    centre = ends_m.mean(axis=0)
    distance_m = math.sqrt(float((centre * centre).sum()))
    radius_m = 0.5 * math.sqrt(float(((ends_m[1] - ends_m[0]) ** 2).sum()))
    if distance_m <= radius_m:
        return np.array([0.0, 0.0, 1.0]), math.pi
    axis = centre / distance_m
    corners = ends_m[gbuffer.CORNERS, [0, 1, 2]]
    cosines = corners @ axis / np.sqrt((corners * corners).sum(axis=1))
    least = float(cosines.min())
    # Cones below 90 degrees are convex: one that contains all corners contains the box.
    narrow_rad = math.acos(min(least, 1.0)) if least > 0.0 else math.pi
    return axis, min(narrow_rad, math.asin(radius_m / distance_m))


def _box_around(marked: NDArray[np.bool_], view: records.View) -> BoxPx:
    """Bounding box of marked nodes [rows, columns] and two more cells, in the image."""
    nodes = tight_box(marked)
    if nodes is None:
        return EMPTY
    x0, y0, stride = -view.width, -view.height, NODE_STRIDE_PX
    x_min, y_min = x0 + (nodes.x_min - 2) * stride, y0 + (nodes.y_min - 2) * stride
    return BoxPx(
        x_min, y_min, x0 + (nodes.x_max + 1) * stride + 1, y0 + (nodes.y_max + 1) * stride + 1
    )


def _widest_step(nodes: asset_types.Float32) -> float:
    """Largest angle between neighbouring visible nodes [rad]."""
    widest = 0.0
    for a, b in ((nodes[1:], nodes[:-1]), (nodes[:, 1:], nodes[:, :-1])):
        chords = ((a - b) ** 2).sum(axis=-1)
        widest = max(widest, float(np.max(chords, initial=0.0, where=np.isfinite(chords))))
    return 2.0 * math.asin(min(0.5 * math.sqrt(widest), 1.0))


def rolling_silhouettes(
    bands: Sequence[RowBand], ids: NDArray[np.uint16], reference: CameraView
) -> dict[int, Silhouette]:
    """Silhouettes with each row at its own instant, approximated by a dozen bands.

    The canvas above the image is as at the first row, below it as at the last row. Visible pixels
    are always included.
    """
    if len(bands) > _BANDS:
        starts = [band.first for band in bands][:: -(-len(bands) // _BANDS)]
        bands = reprojection.make_bands(reference.state, starts)
    pieces: dict[int, list[Silhouette]] = {}
    height = reference.state.camera.intrinsics.height_px
    none, unseen = np.zeros_like(ids), replace(reference.gbuffer, projected=None)
    for band in bands:
        world = pack_state(band.state, reference.context, reference)
        view = pack_view(band.state.camera, reference.cache)
        reference = CameraView(band.state, world, view, unseen, reference.context)
        drawn = render_silhouettes(reference, none)
        top = band.first if band.first > 0 else -height
        end = band.end if band.end < height else 2 * height
        for instance_id, outline in drawn.items():
            pieces.setdefault(instance_id, []).append(_crop_rows(outline, top, end))
    return {
        k: _merge(k, [*parts, Silhouette(k, 0, 0, ids == k)]) for k, parts in sorted(pieces.items())
    }


def _crop_rows(outline: Silhouette, top: int, end: int) -> Silhouette:
    """Rows ``top`` to ``end`` (exclusive) of a silhouette."""
    first = max(top - outline.y_px, 0)
    mask = outline.mask[first : max(end - outline.y_px, first)]
    return replace(outline, y_px=outline.y_px + first, mask=mask)


def _merge(instance_id: int, parts: Sequence[Silhouette]) -> Silhouette:
    filled = [part for part in parts if part.mask.any()]
    if not filled:
        return Silhouette(instance_id, 0, 0, _NOTHING)
    boxes = [
        BoxPx(p.x_px, p.y_px, p.x_px + p.mask.shape[1], p.y_px + p.mask.shape[0]) for p in filled
    ]
    whole = reduce(BoxPx.union, boxes)
    mask = np.zeros((whole.height_px, whole.width_px), np.bool_)
    for part, box in zip(filled, boxes, strict=True):
        mask[box.window(whole.x_min, whole.y_min)] |= part.mask
    return _crop(instance_id, mask, whole)
