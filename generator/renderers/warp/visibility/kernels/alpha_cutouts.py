"""Holes of rasterised triangles: the alpha test at points of an image.

Texture coordinates are linear on a triangle, so over 1/z they are linear in the image of a pinhole.
Source: Heckbert and Moreton, "Interpolation for polygon texture mapping and shading", 1991.
"""

import warp as wp

from gen_data.renderers.warp.scene.kernels import alpha_test, records

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})


@wp.struct
class Cutout:
    """Holes of a triangle.

    The coordinate u at image point (x, y) and depth z is ``u + (c_u + x * dx_u + y * dy_u) * z``,
    with x and y in pixels and z in metres; v correspondingly.

    Attributes:
        texture: The texture that cuts the holes; -1 for a solid triangle.
    """

    texture: int
    u: float
    v: float
    c_u: float
    c_v: float
    dx_u: float
    dx_v: float
    dy_u: float
    dy_v: float


@wp.func
def make_cutout(view: records.View, world: records.World, b: int, face: int):
    """Where a face of a body has holes, before a pinhole."""
    cutout = Cutout()
    cutout.texture = -1
    if (world.bodies[b].cutouts & records.HOLES) == 0:
        return cutout
    g = world.bodies[b].geometry
    surface = world.bodies[b].first_material + world.geometries[g].face_slots[face]
    texture = world.surfaces[surface].texture
    if texture < 0:
        return cutout
    if world.textures[texture].has_cover == 0:
        return cutout
    corner = records.face_vertices(world, g, face)
    p = records.vertex_at(world, g, corner[0])
    e1 = records.vertex_at(world, g, corner[1]) - p
    e2 = records.vertex_at(world, g, corner[2]) - p
    n = wp.cross(e1, e2)
    squared = wp.dot(n, n)
    if squared == 0.0:
        return cutout
    # Gradients of the barycentric weights of the second and third corner.
    along_1 = wp.cross(e2, n) * (1.0 / squared)
    along_2 = wp.cross(n, e1) * (1.0 / squared)
    uv = world.geometries[g].uvs[corner[0]]
    d1 = world.geometries[g].uvs[corner[1]] - uv
    d2 = world.geometries[g].uvs[corner[2]] - uv
    scale_m = world.surfaces[surface].texture_scale_m
    if scale_m > 0.0:
        axis = alpha_test.dominant_axis(n)
        scale = world.bodies[b].scale / scale_m
        uv = alpha_test.project_uv(p * scale, axis)
        d1 = alpha_test.project_uv(e1 * scale, axis)
        d2 = alpha_test.project_uv(e2 * scale, axis)
    cutout.texture = texture
    eye = world.bodies[b].eye_mesh - p
    cutout.u = uv[0] + wp.dot(along_1 * d1[0] + along_2 * d2[0], eye)
    cutout.v = uv[1] + wp.dot(along_1 * d1[1] + along_2 * d2[1], eye)
    # Along directions (x, y, 1) of the camera frame.
    to_camera = wp.transpose(world.bodies[b].B_mesh_camera)
    u = to_camera @ (along_1 * d1[0] + along_2 * d2[0])
    v = to_camera @ (along_1 * d1[1] + along_2 * d2[1])
    cutout.dx_u = u[0] * view.inverse_fx
    cutout.dx_v = v[0] * view.inverse_fx
    cutout.dy_u = u[1] * view.inverse_fy
    cutout.dy_v = v[1] * view.inverse_fy
    cutout.c_u = u[2] - view.cx * cutout.dx_u - view.cy * cutout.dy_u
    cutout.c_v = v[2] - view.cx * cutout.dx_v - view.cy * cutout.dy_v
    return cutout
