"""Amodal silhouettes with a rolling shutter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.core.boxes import tight_box
from gen_data.generator.core.capture import Silhouette
from gen_data.generator.renderers.warp.frame_context import (
    CameraView,
    RenderContext,
    RowBand,
    pack_state,
)
from gen_data.generator.renderers.warp.scene.scene_packing import pack_view
from gen_data.generator.renderers.warp.visibility.amodal import render_silhouettes
from gen_data.generator.renderers.warp.visibility.motion_bounds import make_bands

_BANDS = 12


def rolling_silhouettes(
    bands: Sequence[RowBand], ids: NDArray[np.uint16], context: RenderContext, reference: CameraView
) -> dict[int, Silhouette]:
    """Silhouettes with each row at its own instant, approximated by a dozen bands.

    The canvas above the image is as at the first row, below it as at the last row. Visible pixels
    are always included.
    """
    if len(bands) > _BANDS:
        starts = [band.first for band in bands][:: -(-len(bands) // _BANDS)]
        bands = make_bands(reference.state, starts)
    pieces: dict[int, list[Silhouette]] = {}
    height = reference.state.camera.intrinsics.height_px
    none, unseen = np.zeros_like(ids), replace(reference.gbuffer, projected=None)
    for band in bands:
        scene, camera = band.state.scene, band.state.camera
        world, view = pack_state(band.state, context, reference), pack_view(camera, context.cache)
        reference = CameraView(band.state, world, view, unseen)
        drawn = render_silhouettes(scene, camera, world, view, context.cache, unseen, none)
        top = band.first if band.first > 0 else -height
        end = band.end if band.end < height else 2 * height
        for instance_id, outline in drawn.items():
            pieces.setdefault(instance_id, []).append(_crop_rows(outline, top, end))
    return {k: _merge(k, [*parts, _visible_mask(k, ids)]) for k, parts in sorted(pieces.items())}


def _visible_mask(instance_id: int, ids: NDArray[np.uint16]) -> Silhouette:
    """The visible pixels of an instance."""
    return Silhouette(instance_id, 0, 0, ids == instance_id)


def _crop_rows(outline: Silhouette, top: int, end: int) -> Silhouette:
    """Rows ``top`` to ``end`` (exclusive) of a silhouette."""
    first = max(top - outline.y_px, 0)
    mask = outline.mask[first : max(end - outline.y_px, first)]
    return replace(outline, y_px=outline.y_px + first, mask=mask)


def _merge(instance_id: int, parts: Sequence[Silhouette]) -> Silhouette:
    """One silhouette from several bands of rows."""
    filled = [part for part in parts if part.mask.any()]
    if not filled:
        return Silhouette(instance_id, 0, 0, np.zeros((0, 0), np.bool_))
    x0, y0 = min(p.x_px for p in filled), min(p.y_px for p in filled)
    x1 = max(p.x_px + p.mask.shape[1] for p in filled)
    y1 = max(p.y_px + p.mask.shape[0] for p in filled)
    mask = np.zeros((y1 - y0, x1 - x0), np.bool_)
    for part in filled:
        rows = slice(part.y_px - y0, part.y_px - y0 + part.mask.shape[0])
        columns = slice(part.x_px - x0, part.x_px - x0 + part.mask.shape[1])
        mask[rows, columns] |= part.mask
    box = tight_box(mask, x0, y0)
    assert box is not None
    tight = mask[box.y_min - y0 : box.y_max - y0, box.x_min - x0 : box.x_max - x0]
    return Silhouette(instance_id, box.x_min, box.y_min, tight)
