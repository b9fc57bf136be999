"""Amodal silhouettes: each instance alone, on a canvas three images wide and high."""

from __future__ import annotations

import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.generator.core.boxes import BoxPx, tight_box
from gen_data.generator.core.capture import Silhouette
from gen_data.generator.core.scene import Camera, Scene
from gen_data.generator.renderers.warp.device_cache import DeviceCache
from gen_data.generator.renderers.warp.scene.kernels import records
from gen_data.generator.renderers.warp.scene.scene_packing import PackedWorld
from gen_data.generator.renderers.warp.visibility.alpha_cutouts import has_cutouts, trace_outlines
from gen_data.generator.renderers.warp.visibility.amodal_lens import (
    mask_offsets,
    trace_masks,
    union_box,
)
from gen_data.generator.renderers.warp.visibility.gbuffer import (
    GBuffer,
    Projected,
    project_vertices,
)
from gen_data.generator.renderers.warp.visibility.kernels import rasterizer
from gen_data.generator.renderers.warp.visibility.kernels.amodal import Canvas, draw_silhouettes

_NOTHING = np.zeros((0, 0), np.bool_)
_UNSNAPPED = -(2**31)


def render_silhouettes(
    scene: Scene,
    camera: Camera,
    world: PackedWorld,
    view: records.View,
    cache: DeviceCache,
    gbuffer: GBuffer,
    seen_ids: NDArray[np.uint16],
) -> dict[int, Silhouette]:
    """The silhouette of every annotated instance, by instance id.

    Coverage is the rasteriser's for a pinhole, else that of rays. It is united with ``seen_ids``,
    the image of visible instance ids: where rays decide visibility, they may differ from the
    rasteriser by a pixel at an edge.
    """
    if view.lens == records.PINHOLE:
        projected = gbuffer.projected or project_vertices(world, view, cache)
        boxes, drawn = _rasterize_masks(scene, world, view, projected, cache)
    else:
        boxes, drawn = trace_masks(scene, world, view, camera, cache)
    found: dict[int, Silhouette] = {}
    first = 0
    for instance_id, box in boxes.items():
        end = first + box.width_px * box.height_px
        pixels = drawn[first:end].reshape(box.height_px, box.width_px) > 0
        _unite(pixels, box, seen_ids, instance_id)
        found[instance_id] = _crop(instance_id, pixels, box)
        first = end
    return found


def _rasterize_masks(
    scene: Scene, world: PackedWorld, view: records.View, projected: Projected, cache: DeviceCache
) -> tuple[dict[int, BoxPx], NDArray[np.uint8]]:
    """A bounding box of each annotated instance's silhouette, and the masks of all boxes."""
    p_camera, xy = projected.p_camera, projected.xy
    boxes = _boxes_px(scene, world, view, projected)
    canvases, size = _canvases(scene, boxes, projected.reached)
    mask = wp.zeros(size, dtype=wp.uint8, device=cache.device)
    cutouts = has_cutouts(world.body_records)[canvases["body"]]
    if not cutouts.all():
        drawn_into = wp.array(canvases[~cutouts], dtype=Canvas, device=cache.device)
        inputs = [view, world.record, p_camera, xy, drawn_into]
        wp.launch(draw_silhouettes, len(drawn_into), inputs, [mask], device=cache.device)
    if cutouts.any():
        trace_outlines(world, view, canvases[cutouts], mask)
    drawn: NDArray[np.uint8] = mask.numpy()
    return boxes, drawn


def _boxes_px(
    scene: Scene, world: PackedWorld, view: records.View, projected: Projected
) -> dict[int, BoxPx]:
    """Pixels of the canvas that each annotated instance's vertices span; may be empty."""
    canvas = BoxPx(-view.width, -view.height, 2 * view.width, 2 * view.height)
    annotated = sorted(i.instance_id for i in scene.instances if i.annotated)
    boxes = dict.fromkeys(annotated, BoxPx(0, 0, 0, 0))
    # All bodies at once: hundreds of small queries take longer than drawing them.
    first = world.body_records["first_vertex"]
    solid = np.flatnonzero(np.diff([*first, world.vertex_count]))
    p_camera, xy = projected.p_camera.numpy(), projected.xy.numpy()
    nearest = np.maximum.reduceat(p_camera[:, 2], first[solid])
    lows = np.minimum.reduceat(xy, first[solid], axis=0)
    highs = np.maximum.reduceat(xy, first[solid], axis=0)
    drawn = np.isin(solid, projected.reached) & (nearest >= rasterizer.Z_NEAR_M)
    for k in np.flatnonzero(drawn).tolist():
        instance_id = scene.bodies[solid[k]].instance_id
        if instance_id in boxes:
            # A triangle clipped at the camera's plane may reach anywhere.
            cut = lows[k, 0] == _UNSNAPPED
            reached = canvas if cut else _clip_to_canvas(canvas, lows[k] >> 8, (highs[k] >> 8) + 1)
            boxes[instance_id] = union_box(boxes[instance_id], reached)
    return boxes


def _clip_to_canvas(canvas: BoxPx, low: NDArray[np.int32], high: NDArray[np.int32]) -> BoxPx:
    x_min, y_min = max(int(low[0]), canvas.x_min), max(int(low[1]), canvas.y_min)
    x_max, y_max = min(int(high[0]), canvas.x_max), min(int(high[1]), canvas.y_max)
    return BoxPx(x_min, y_min, max(x_max, x_min), max(y_max, y_min))


def _canvases(
    scene: Scene, boxes: dict[int, BoxPx], reached: NDArray[np.int32]
) -> tuple[NDArray[np.void], int]:
    """One record per projected body of an instance with a box, and the size of all masks."""
    first_pixels, size = mask_offsets(boxes)
    drawn = [
        (number, scene.bodies[number].instance_id)
        for number in reached.tolist()
        if scene.bodies[number].instance_id in boxes
        and boxes[scene.bodies[number].instance_id].width_px
    ]
    values = np.zeros(len(drawn), dtype=Canvas.numpy_dtype())
    for value, (number, instance_id) in zip(values, drawn, strict=True):
        box = boxes[instance_id]
        value["body"] = number
        value["first_pixel"] = first_pixels[instance_id]
        value["window"]["x0"], value["window"]["y0"] = box.x_min, box.y_min
        value["window"]["width"], value["window"]["height"] = box.width_px, box.height_px
    return values, size


def _unite(
    pixels: NDArray[np.bool_], box: BoxPx, seen_ids: NDArray[np.uint16], instance_id: int
) -> None:
    """Add an instance's visible pixels to its silhouette, in place."""
    inside = box.clipped(seen_ids.shape[1], seen_ids.shape[0])
    if inside is None:
        return
    rows = slice(inside.y_min - box.y_min, inside.y_max - box.y_min)
    columns = slice(inside.x_min - box.x_min, inside.x_max - box.x_min)
    window = seen_ids[inside.y_min : inside.y_max, inside.x_min : inside.x_max]
    pixels[rows, columns] |= window == instance_id


def _crop(instance_id: int, pixels: NDArray[np.bool_], box: BoxPx) -> Silhouette:
    tight = tight_box(pixels)
    if tight is None:
        return Silhouette(instance_id, 0, 0, _NOTHING)
    mask = pixels[tight.y_min : tight.y_max, tight.x_min : tight.x_max]
    return Silhouette(instance_id, box.x_min + tight.x_min, box.y_min + tight.y_min, mask)
