"""From (body, face) at a pixel to what lies there, and to label images."""

from __future__ import annotations

import warp as wp

from generator.renderers.kernels.records import (
    Body,
    Geometry,
    View,
    World,
    pixel_direction,
    unit,
)

wp.set_module_options({"enable_backward": False, "max_unroll": 3})


@wp.struct
class Hit:
    """Where a ray meets the plane of one triangle.

    Attributes:
        z_m: Distance along the optical axis.
        u, v: Barycentric weights of the second and third vertex, within the triangle.
        outside: 1 where the ray meets the side the triangle is wound for.
    """

    z_m: float
    u: float
    v: float
    outside: int


@wp.func
def intersect(body: Body, geometry: Geometry, face: int, d_camera: wp.vec3):
    """The ray's meeting with one triangle it is known to hit, or to miss by a rounding.

    Source: Moeller and Trumbore, "Fast, minimum storage ray-triangle intersection", 1997.
    """
    p0 = geometry.vertices_m[geometry.faces[3 * face]]
    e1 = geometry.vertices_m[geometry.faces[3 * face + 1]] - p0
    e2 = geometry.vertices_m[geometry.faces[3 * face + 2]] - p0
    d = body.B_mesh_camera @ d_camera
    to_eye = body.eye_mesh - p0
    p = wp.cross(d, e2)
    q = wp.cross(to_eye, e1)
    det = wp.dot(e1, p)
    hit = Hit()
    hit.outside = wp.where(det > 0.0, 1, 0)
    inverse = 1.0 / wp.where(wp.abs(det) < 1.0e-30, 1.0e-30, det)
    u = wp.dot(to_eye, p) * inverse
    v = wp.dot(d, q) * inverse
    z = wp.dot(e2, q) * inverse
    if u < 0.0 or v < 0.0 or u + v > 1.0:
        # Snapping moved an edge across this pixel's centre: take the triangle's nearest point.
        u = wp.clamp(u, 0.0, 1.0)
        v = wp.clamp(v, 0.0, 1.0 - u)
        p_camera = body.A_camera_mesh @ (p0 + e1 * u + e2 * v) + body.t_camera_mesh
        z = p_camera[2]
    hit.u = u
    hit.v = v
    hit.z_m = z
    return hit


@wp.func
def smooth_normal(
    body: Body, geometry: Geometry, face: int, hit: Hit, d_world: wp.vec3
):
    """Interpolated unit normal in the world, on the viewer's side."""
    n = (
        geometry.normals[geometry.faces[3 * face]] * (1.0 - hit.u - hit.v)
        + geometry.normals[geometry.faces[3 * face + 1]] * hit.u
        + geometry.normals[geometry.faces[3 * face + 2]] * hit.v
    )
    if hit.outside == 0:
        n = -n
    n = unit(body.R_world_mesh @ n)
    # Interpolation may tip a normal over the horizon: bring it back to where it is seen edge-on.
    over = wp.dot(n, d_world)
    if over > 0.0:
        n = unit(n - d_world * (over * 1.001 / wp.dot(d_world, d_world)))
    return n


@wp.kernel
def resolve(
    view: View,
    world: World,
    hits: wp.array(dtype=wp.vec2i),
    z_m: wp.array(dtype=float),
    weights: wp.array(dtype=wp.vec2),
    normals: wp.array(dtype=wp.vec3),
):
    """z-depth (inf for nothing), barycentric weights and smooth world normal of every pixel.

    Weights are stored as (u, v), with 2 added to u where the inside of the triangle is seen.
    """
    i = wp.tid()
    b = hits[i][0]
    if b < 0:
        z_m[i] = wp.inf
        normals[i] = wp.vec3(0.0)
        return
    x = float(i % view.width) + 0.5
    y = float(i / view.width) + 0.5
    d = pixel_direction(view, x, y)
    body = world.bodies[b]
    geometry = world.geometries[body.geometry]
    hit = intersect(body, geometry, hits[i][1], d)
    z_m[i] = hit.z_m
    weights[i] = wp.vec2(hit.u + wp.where(hit.outside == 1, 0.0, 2.0), hit.v)
    normals[i] = smooth_normal(body, geometry, hits[i][1], hit, view.R_world_camera @ d)


@wp.kernel
def label_ids(
    hits: wp.array(dtype=wp.vec2i),
    ids: wp.array(dtype=wp.uint16),
    labels: wp.array(dtype=wp.uint16),
):
    """The id of the body at every pixel; ``ids[0]`` is for nothing, ``ids[1 + b]`` for b."""
    i = wp.tid()
    labels[i] = ids[hits[i][0] + 1]


@wp.kernel
def label_ranges(view: View, z_m: wp.array(dtype=float), ranges_m: wp.array(dtype=float)):
    """Distance along the ray."""
    i = wp.tid()
    x = float(i % view.width) + 0.5
    y = float(i / view.width) + 0.5
    ranges_m[i] = z_m[i] * wp.length(pixel_direction(view, x, y))


@wp.kernel
def label_normals(
    view: View, normals: wp.array(dtype=wp.vec3), normals_camera: wp.array(dtype=wp.vec3)
):
    """Normals in the camera frame."""
    i = wp.tid()
    normals_camera[i] = wp.transpose(view.R_world_camera) @ normals[i]


@wp.struct
class BoxFrame:
    """Mesh frame to the unit cube of an instance's box; ``labelled`` is 0 for the background."""

    A_box_mesh: wp.mat33
    t_box_mesh: wp.vec3
    labelled: int


@wp.kernel
def label_object_coordinates(
    world: World,
    hits: wp.array(dtype=wp.vec2i),
    weights: wp.array(dtype=wp.vec2),
    frames: wp.array(dtype=BoxFrame),
    coordinates: wp.array(dtype=wp.vec3),
):
    """Position within the instance's box, [0, 1] per axis."""
    i = wp.tid()
    b = hits[i][0]
    p = wp.vec3(0.0)
    if b >= 0:
        if frames[b].labelled != 0:
            m = mesh_point(world.geometries[world.bodies[b].geometry], hits[i][1], weights[i])
            q = frames[b].A_box_mesh @ m + frames[b].t_box_mesh
            p = wp.vec3(
                wp.clamp(q[0], 0.0, 1.0), wp.clamp(q[1], 0.0, 1.0), wp.clamp(q[2], 0.0, 1.0)
            )
    coordinates[i] = p


@wp.func
def mesh_point(geometry: Geometry, face: int, weight: wp.vec2):
    """The point of a triangle with stored barycentric weights."""
    u = weight[0]
    if u > 1.5:
        u -= 2.0
    v = weight[1]
    return (
        geometry.vertices_m[geometry.faces[3 * face]] * (1.0 - u - v)
        + geometry.vertices_m[geometry.faces[3 * face + 1]] * u
        + geometry.vertices_m[geometry.faces[3 * face + 2]] * v
    )
