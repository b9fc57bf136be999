"""Amodal silhouettes for lenses with distortion, by rays instead of rasterisation."""

import warp as wp

from gen_data.renderers.warp.scene.kernels import alpha_test, records
from gen_data.renderers.warp.scene.kernels.ray_queries import FARTHEST
from gen_data.renderers.warp.visibility.kernels.rasterizer import Outline

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})


@wp.func
def canvas_direction(view: records.View, nodes: wp.array2d[wp.vec4], stride: int, x: int, y: int):
    """Unit direction through a pixel's centre inside or outside the image; 0 if not shown.

    Args:
        nodes: Directions at every ``stride``-th pixel centre of the canvas.
    """
    d = wp.vec4(0.0)
    if x >= 0 and x < view.width and y >= 0 and y < view.height:
        d = view.directions[y * view.width + x]
        if d[3] == 0.0:
            d = wp.vec4(0.0)
    else:
        # Outside the image: bilinear interpolation between nodes, if the lens shows all four.
        column = (x + view.width) / stride
        row = (y + view.height) / stride
        right = float(x + view.width - column * stride) / float(stride)
        down = float(y + view.height - row * stride) / float(stride)
        a = nodes[row, column]
        b = nodes[row, column + 1]
        c = nodes[row + 1, column]
        e = nodes[row + 1, column + 1]
        if a[3] * b[3] * c[3] * e[3] > 0.0:
            d = (a * (1.0 - right) + b * right) * (1.0 - down) + (
                c * (1.0 - right) + e * right
            ) * down
    return records.fast_normalize(wp.vec3(d[0], d[1], d[2]))


@wp.kernel
def trace_silhouettes(
    view: records.View,
    world: records.World,
    nodes: wp.array2d[wp.vec4],
    stride: int,
    t_min: float,
    windows: wp.array[Outline],
    mask: wp.array[wp.uint8],
):
    """Write 1 at every pixel whose ray meets a body; one row of one window per thread."""
    k, row = wp.tid()
    silhouette = windows[k]
    if row >= silhouette.window.height:
        return
    b = silhouette.body
    for column in range(silhouette.window.width):
        i = silhouette.first_pixel + row * silhouette.stride + column
        if mask[i] == wp.uint8(0):
            x = silhouette.window.x0 + column
            y = silhouette.window.y0 + row
            d = view.R_world_camera @ canvas_direction(view, nodes, stride, x, y)
            if wp.dot(d, d) > 0.5:
                o = records.to_mesh_point(world, b, view.eye_m + d * t_min)
                way = records.to_mesh_vector(world, b, d)
                if alpha_test.is_mesh_intersected(world, b, o, way, FARTHEST, records.HOLES):
                    mask[i] = wp.uint8(1)
