"""Which surface is seen at every pixel centre."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import warp as wp

from generator.renderers.kernels import raster, rays, records, surface
from generator.renderers.packing import PackedWorld
from generator.renderers.stock import AssetStock


@dataclass(frozen=True, eq=False, slots=True)
class Projected:
    """All vertices of a world, body after body.

    Attributes:
        p_camera: In the camera frame [m].
        xy: Snapped to the image plane; see generator.renderers.kernels.raster.
    """

    p_camera: wp.array
    xy: wp.array


@dataclass(frozen=True, eq=False, slots=True)
class Seen:
    """Flat images of what is seen, row by row.

    Attributes:
        hits: (body, face); (-1, -1) where there is nothing.
        z_m: Depth along the optical axis; inf.
        weights: Barycentric (u, v); u + 2 where a triangle's inside is seen.
        normals: Smooth, unit, world frame, towards the camera; 0.
        projected: What was drawn; None where rays were traced.
    """

    hits: wp.array
    z_m: wp.array
    weights: wp.array
    normals: wp.array
    projected: Projected | None


def see(
    world: PackedWorld,
    view: records.View,
    stock: AssetStock,
    method: Literal["auto", "raster", "rays"],
) -> Seen:
    """The surfaces at all pixel centres of a view."""
    n = view.width * view.height
    drawn = method == "raster" or (method == "auto" and stock.device.is_cpu)
    projected = project(world, view, stock) if drawn else None
    seen = Seen(
        stock.scratch("hits", n, wp.vec2i),
        stock.scratch("z", n, float),
        stock.scratch("weights", n, wp.vec2),
        stock.scratch("normals", n, wp.vec3),
        projected,
    )
    if projected is not None:
        _rasterise(world, view, stock, projected, seen.hits)
    else:
        inputs = [view, world.record, raster.Z_NEAR_M]
        wp.launch(rays.trace_pixels, n, inputs, [seen.hits], device=stock.device)
    # One thread per row on the CPU, where threads run one after the other anyway.
    run = view.width if stock.device.is_cpu else 1
    outputs = [seen.z_m, seen.weights, seen.normals]
    inputs = [view, world.record, run, seen.hits]
    wp.launch(
        surface.resolve, (view.height, view.width // run), inputs, outputs, device=stock.device
    )
    return seen


def project(world: PackedWorld, view: records.View, stock: AssetStock) -> Projected:
    """All vertices as the camera sees them; valid until the next call."""
    count = max(world.vertex_count, 1)
    projected = Projected(
        stock.scratch("p camera", count, wp.vec3), stock.scratch("xy", count, wp.vec2i)
    )
    inputs = [view, world.record]
    outputs = [projected.p_camera, projected.xy]
    bodies = len(world.placed)
    wp.launch(raster.project_vertices, bodies, inputs, outputs, device=stock.device)
    return projected


def _rasterise(
    world: PackedWorld,
    view: records.View,
    stock: AssetStock,
    projected: Projected,
    hits: wp.array,
) -> None:
    nearness = stock.scratch("nearness", view.width * view.height, float)
    nearness.zero_()
    hits.fill_(wp.vec2i(-1, -1))
    window = raster.Window()
    window.width, window.height = view.width, view.height
    inputs = [view, window, world.record, projected.p_camera, projected.xy]
    bodies = len(world.placed)
    wp.launch(raster.draw_bodies, bodies, inputs, [nearness, hits], device=stock.device)
