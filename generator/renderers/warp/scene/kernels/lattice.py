"""The lattice: a sparse grid of pixels at which light is computed first.

Light varies slowly along a surface. Shadows, ambient occlusion and shading are computed on the
lattice, and all other pixels interpolate between lattice points on the same stretch of surface.
"""

import warp as wp

from gen_data.renderers.warp.scene.kernels import material_eval, ray_queries, records

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})


@wp.struct
class Lattice:
    """G-buffer at the lattice's points, flat, row by row.

    Attributes:
        stride: Pixels between neighbouring points. The last column and row are the image's last.
        body: -1 for the background.
        surface: Index of the material.
        pixel: Index of the pixel.
        p_m, normal: Point [m] and smooth unit normal in the world.
        origin_m: Origin of rays that leave the surface.
        skip: A convex body on which the point lies and which cannot shade it, or -1.
    """

    stride: int
    width: int
    height: int
    body: wp.array[int]
    surface: wp.array[int]
    pixel: wp.array[int]
    skip: wp.array[int]
    p_m: wp.array[wp.vec3]
    normal: wp.array[wp.vec3]
    origin_m: wp.array[wp.vec3]


@wp.func
def ray_origin(
    world: records.World, hit: wp.vec2i, weight: wp.vec2, p_world: wp.vec3, d_world: wp.vec3
):
    """Origin of rays just off the smooth surface that the vertex normals describe.

    Source: Hanika, "Hacking the shadow terminator", Ray Tracing Gems II, 2021.
    """
    b = hit[0]
    g = world.bodies[b].geometry
    corner = records.face_vertices(world, g, hit[1])
    p0 = records.vertex_at(world, g, corner[0])
    p1 = records.vertex_at(world, g, corner[1])
    p2 = records.vertex_at(world, g, corner[2])
    side = wp.where(records.is_back_face(weight), -1.0, 1.0)
    u = records.first_weight(weight)
    v = weight[1]
    w = 1.0 - u - v
    p = p0 * w + p1 * u + p2 * v
    n0 = records.normal_at(world, g, corner[0]) * side
    n1 = records.normal_at(world, g, corner[1]) * side
    n2 = records.normal_at(world, g, corner[2]) * side
    # Project the point onto each vertex's tangent plane, and interpolate: coarse meshes then do not
    # shade themselves where the smooth normal still faces the light.
    shift = n0 * (w * wp.min(0.0, wp.dot(p - p0, n0)))
    shift += n1 * (u * wp.min(0.0, wp.dot(p - p1, n1)))
    shift += n2 * (v * wp.min(0.0, wp.dot(p - p2, n2)))
    if material_eval.is_translucent(world, records.surface_index(world, hit)):
        # Light of either side counts: the point must lie on the side of the sheet that it is for.
        shift = wp.vec3(0.0)
    flat = records.fast_normalize(wp.cross(p1 - p0, p2 - p0)) * side
    lift_m = ray_queries.OFFSET_M + ray_queries.OFFSET_PER_DISTANCE * wp.length(d_world)
    return p_world + world.bodies[b].R_world_mesh @ (flat * lift_m - shift * world.bodies[b].scale)


@wp.kernel
def sample_lattice(
    view: records.View,
    world: records.World,
    images: records.GBufferRecord,
    lattice: Lattice,
):
    """Compute the lattice's points from the G-buffer."""
    i = wp.tid()
    x = wp.min(lattice.stride * (i % lattice.width), view.width - 1)
    y = wp.min(lattice.stride * (i / lattice.width), view.height - 1)
    pixel = y * view.width + x
    hit = images.hits[pixel]
    lattice.body[i] = hit[0]
    lattice.pixel[i] = pixel
    lattice.surface[i] = -1
    if hit[0] < 0:
        return
    lattice.surface[i] = records.surface_index(world, hit)
    offset = records.pixel_ray(view, pixel) * images.z_m[pixel]
    p = view.eye_m + offset
    lattice.p_m[i] = p
    lattice.normal[i] = images.normals[pixel]
    lattice.origin_m[i] = ray_origin(world, hit, images.weights[pixel], p, offset)
    convex = world.geometries[world.bodies[hit[0]].geometry].convex
    # Only its own back could occlude a point on the front of a convex solid, and that is behind the
    # horizon.
    lattice.skip[i] = wp.where(convex != 0 and images.weights[pixel][0] < 1.5, hit[0], -1)


@wp.func
def sheet_side(world: records.World, lattice: Lattice, i: int):
    """Direction away from a translucent surface on its visible side, any length; 0 for others."""
    side = wp.vec3(0.0)
    if material_eval.is_translucent(world, lattice.surface[i]):
        side = lattice.origin_m[i] - lattice.p_m[i]
    return side


@wp.struct
class Departure:
    """Where rays from a point towards a lamp begin.

    Attributes:
        origin_m: Just off the surface, on the lamp's side of a translucent one.
        normal: Normal of the horizon above which the lamp lights the point.
        skip: As for Lattice.
    """

    origin_m: wp.vec3
    normal: wp.vec3
    skip: int


@wp.func
def departure_to(world: records.World, lattice: Lattice, i: int, to_lamp: wp.vec3):
    """Start of the rays from lattice point i towards a lamp in the given direction."""
    start = Departure()
    start.origin_m = lattice.origin_m[i]
    start.normal = lattice.normal[i]
    start.skip = lattice.skip[i]
    side = sheet_side(world, lattice, i)
    if wp.dot(side, side) > 0.0:
        start.normal = side
        if wp.dot(side, to_lamp) < 0.0:
            start.origin_m = lattice.p_m[i] - side
            start.normal = -side
            start.skip = -1
    return start


@wp.func
def points_agree(p: wp.vec3, n: wp.vec3, q: wp.vec3, m: wp.vec3, tolerance_m: float):
    """Cosine between the normals of two points on one stretch of surface; else 0."""
    cosine = wp.dot(n, m)
    # One stretch of surface: normals within 26 degrees, and one point in the other's tangent plane.
    if cosine < 0.9 or wp.abs(wp.dot(n, q - p)) > tolerance_m:
        cosine = 0.0
    return cosine


@wp.struct
class Cell:
    """Position of a pixel between four lattice points.

    Attributes:
        first: Index of the upper left point.
        right, down: Fractions towards its neighbours, [0, 1).
    """

    first: int
    right: float
    down: float


@wp.func
def cell_at(view: records.View, lattice: Lattice, x: int, y: int):
    """The cell of a pixel."""
    column = x / lattice.stride
    row = y / lattice.stride
    cell = Cell()
    cell.first = row * lattice.width + column
    cell.right = float(x - column * lattice.stride) * step_at(lattice, x, view.width)
    cell.down = float(y - row * lattice.stride) * step_at(lattice, y, view.height)
    return cell


@wp.func
def step_at(lattice: Lattice, x: int, width: int):
    """Width of one pixel in units of its cell; the last cell of a row or column may be narrower."""
    first = x - x % lattice.stride
    return 1.0 / float(wp.max(wp.min(lattice.stride, width - 1 - first), 1))


@wp.func
def cell_corner(lattice: Lattice, cell: Cell, k: int):
    """The k-th lattice point of a cell and its bilinear weight."""
    wx = wp.where((k & 1) == 1, cell.right, 1.0 - cell.right)
    wy = wp.where(k >= 2, cell.down, 1.0 - cell.down)
    return cell.first + (k & 1) + wp.where(k >= 2, lattice.width, 0), wx * wy
