"""Which surface is seen at every pixel centre."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import warp as wp

from generator.renderers.kernels import raster, rays, records, surface
from generator.renderers.packing import PackedWorld
from generator.renderers.stock import AssetStock


@dataclass(frozen=True, eq=False, slots=True)
class Seen:
    """Flat images of what is seen, row by row.

    Attributes:
        hits: (body, face); (-1, -1) where there is nothing.
        z_m: Depth along the optical axis; inf.
        weights: Barycentric (u, v); u + 2 where a triangle's inside is seen.
        normals: Smooth, unit, world frame, towards the camera; 0.
    """

    hits: wp.array
    z_m: wp.array
    weights: wp.array
    normals: wp.array


def see(
    world: PackedWorld,
    view: records.View,
    stock: AssetStock,
    method: Literal["auto", "raster", "rays"],
) -> Seen:
    """The surfaces at all pixel centres of a view."""
    n = view.width * view.height
    seen = Seen(
        stock.scratch("hits", n, wp.vec2i),
        stock.scratch("z", n, float),
        stock.scratch("weights", n, wp.vec2),
        stock.scratch("normals", n, wp.vec3),
    )
    if method == "raster" or (method == "auto" and stock.device.is_cpu):
        _rasterise(world, view, stock, seen.hits)
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


def project(world: PackedWorld, view: records.View, stock: AssetStock) -> tuple[wp.array, wp.array]:
    """All vertices in the camera frame, and snapped to the image plane."""
    p_camera = wp.zeros(world.vertex_count, dtype=wp.vec3, device=stock.device)
    xy = wp.zeros(world.vertex_count, dtype=wp.vec2i, device=stock.device)
    inputs = [view, world.record]
    wp.launch(
        raster.project_vertices, len(world.placed), inputs, [p_camera, xy], device=stock.device
    )
    return p_camera, xy


def _rasterise(world: PackedWorld, view: records.View, stock: AssetStock, hits: wp.array) -> None:
    nearness = stock.scratch("nearness", view.width * view.height, float)
    nearness.zero_()
    hits.fill_(wp.vec2i(-1, -1))
    window = raster.Window()
    window.width, window.height = view.width, view.height
    p_camera, xy = project(world, view, stock)
    wp.launch(
        raster.draw_bodies,
        len(world.placed),
        [view, window, world.record, p_camera, xy],
        [nearness, hits],
        device=stock.device,
    )
