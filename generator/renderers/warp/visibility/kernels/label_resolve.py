"""Attributes of the visible (body, face) at each pixel, and label images."""

import warp as wp

from gen_data.renderers.warp.scene.kernels import records

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})


@wp.struct
class Facet:
    """A triangle prepared for many rays from the camera's centre.

    For a direction d in the camera frame and ``det = d . across``: the barycentric weights of the
    second and third vertex are ``d . along_u / det`` and ``d . along_v / det``, z-depth is ``depth
    / det``, and the sign of ``det`` separates front from back. Source: Moeller and Trumbore, "Fast,
    minimum storage ray-triangle intersection", 1997, with the products of the triangle's own
    vectors precomputed.

    Attributes:
        z_m: z-depths of the three vertices.
        n, n_u, n_v: Normal of the first vertex and the differences to the others, world frame.
    """

    across: wp.vec3
    along_u: wp.vec3
    along_v: wp.vec3
    depth: float
    z_m: wp.vec3
    n: wp.vec3
    n_u: wp.vec3
    n_v: wp.vec3


@wp.func
def make_facet(world: records.World, hit: wp.vec2i):
    """The facet of a (body, face)."""
    b = hit[0]
    g = world.bodies[b].geometry
    corner = records.face_vertices(world, g, hit[1])
    p = records.vertex_at(world, g, corner[0])
    e1 = records.vertex_at(world, g, corner[1]) - p
    e2 = records.vertex_at(world, g, corner[2]) - p
    # In the mesh frame: only the results are rotated.
    to_eye = world.bodies[b].eye_mesh - p
    camera = wp.transpose(world.bodies[b].B_mesh_camera)
    q = wp.cross(to_eye, e1)
    f = Facet()
    f.across = camera @ wp.cross(e2, e1)
    f.along_u = camera @ wp.cross(e2, to_eye)
    f.along_v = camera @ q
    f.depth = wp.dot(e2, q)
    A = world.bodies[b].A_camera_mesh
    row = wp.vec3(A[2, 0], A[2, 1], A[2, 2])
    z = wp.dot(row, p) + world.bodies[b].t_camera_mesh[2]
    f.z_m = wp.vec3(z, z + wp.dot(row, e1), z + wp.dot(row, e2))
    R = world.bodies[b].R_world_mesh
    f.n = R @ records.normal_at(world, g, corner[0])
    f.n_u = R @ records.normal_at(world, g, corner[1]) - f.n
    f.n_v = R @ records.normal_at(world, g, corner[2]) - f.n
    return f


@wp.func
def face_viewer(n: wp.vec3, d_world: wp.vec3):
    """A unit normal that does not face away from the viewer.

    Interpolation may tip a normal over the horizon: it is brought back to grazing view.
    """
    m = records.fast_normalize(n)
    over = wp.dot(m, d_world)
    if over > 0.0:
        # A thousandth beyond grazing: exactly there, rounding would decide.
        m = records.fast_normalize(m - d_world * (over * 1.001 / wp.dot(d_world, d_world)))
    return m


@wp.func
def nearest_on_edge(a: wp.vec3, b: wp.vec3):
    """Share of the way from a to b, and squared distance, of the point nearest to the origin."""
    edge = b - a
    square = wp.dot(edge, edge)
    share = wp.clamp(-wp.dot(a, edge) / wp.where(square > 0.0, square, 1.0), 0.0, 1.0)
    nearest = a + edge * share
    return wp.vec2(share, wp.dot(nearest, nearest))


@wp.func
def across_ray(p: wp.vec3, way: wp.vec3):
    """The part of a vector perpendicular to a unit direction."""
    return p - way * wp.dot(p, way)


@wp.func
def weight_beside(world: records.World, hit: wp.vec2i, d: wp.vec3):
    """Barycentric weights (u, v) of the point on a face nearest to a camera-frame ray next to it.

    Weights clamped one by one would give a far corner where the ray misses a sliver.
    """
    b = hit[0]
    g = world.bodies[b].geometry
    corner = records.face_vertices(world, g, hit[1])
    eye = world.bodies[b].eye_mesh
    way = wp.normalize(world.bodies[b].B_mesh_camera @ d)
    p0 = across_ray(records.vertex_at(world, g, corner[0]) - eye, way)
    p1 = across_ray(records.vertex_at(world, g, corner[1]) - eye, way)
    p2 = across_ray(records.vertex_at(world, g, corner[2]) - eye, way)
    first = nearest_on_edge(p0, p1)
    second = nearest_on_edge(p1, p2)
    third = nearest_on_edge(p2, p0)
    weight = wp.vec2(first[0], 0.0)
    if second[1] < first[1] and second[1] <= third[1]:
        weight = wp.vec2(1.0 - second[0], second[0])
    elif third[1] < first[1]:
        weight = wp.vec2(0.0, 1.0 - third[0])
    return weight


@wp.struct
class Point:
    """A point of a face at a point of the image; fields as ``resolve`` stores them."""

    way: wp.vec3
    weight: wp.vec2
    normal: wp.vec3


@wp.func
def point_at(view: records.View, world: records.World, hit: wp.vec2i, x_px: float, y_px: float):
    """Intersection of a pixel's ray with the plane of a face."""
    facet = make_facet(world, hit)
    d = records.pixel_direction(view, x_px, y_px)
    det = wp.dot(d, facet.across)
    inverse = 1.0 / wp.where(wp.abs(det) < 1.0e-30, 1.0e-30, det)
    u = wp.dot(d, facet.along_u) * inverse
    v = wp.dot(d, facet.along_v) * inverse
    if u < 0.0 or v < 0.0 or u + v > 1.0:
        # Subpixel rays may miss the face: moved to its edge, whose attributes are defined.
        weight = weight_beside(world, hit, d)
        u = weight[0]
        v = weight[1]
    side = wp.where(det < 0.0, -1.0, 1.0)
    d_world = view.R_world_camera @ d
    point = Point()
    point.way = d_world * (facet.depth * inverse)
    point.weight = wp.vec2(u + 1.0 - side, v)
    point.normal = face_viewer((facet.n + facet.n_u * u + facet.n_v * v) * side, d_world)
    return point


@wp.kernel
def resolve(
    view: records.View,
    world: records.World,
    run: int,
    images: records.GBufferRecord,
):
    """Depth (inf for nothing), barycentric weights and smooth world normal of every pixel.

    Weights are stored as (u, v), with 2 added to u where the back of the triangle is visible.

    Args:
        run: Pixels in a row per thread: neighbours on one triangle share its preparation.
        images: With ``hits`` filled in. ``z_m`` are parameters of the pixels' rays: z-depths for a
            pinhole, else ranges.
    """
    y, segment = wp.tid()
    x = segment * run
    end = wp.min(x + run, view.width)
    row = y * view.width
    while x < end:
        hit = images.hits[row + x]
        if hit[0] < 0:
            images.z_m[row + x] = wp.inf
            images.normals[row + x] = wp.vec3(0.0)
            x += 1
        else:
            facet = make_facet(world, hit)
            same = bool(True)
            while same:
                d = records.pixel_direction(view, float(x) + 0.5, float(y) + 0.5)
                det = wp.dot(d, facet.across)
                # Seen edge-on after snapping; the branch below repairs depth and weights.
                inverse = 1.0 / wp.where(wp.abs(det) < 1.0e-30, 1.0e-30, det)
                u = wp.dot(d, facet.along_u) * inverse
                v = wp.dot(d, facet.along_v) * inverse
                z = facet.depth * inverse
                if u < 0.0 or v < 0.0 or u + v > 1.0:
                    # Snapping moved an edge across this pixel's centre.
                    weight = weight_beside(world, hit, d)
                    u = weight[0]
                    v = weight[1]
                    z = facet.z_m[0] * (1.0 - u - v) + facet.z_m[1] * u + facet.z_m[2] * v
                    if view.lens != records.PINHOLE:
                        z = distance_to(world, hit, wp.vec2(u, v))
                n = facet.n + facet.n_u * u + facet.n_v * v
                side = wp.where(det < 0.0, -1.0, 1.0)
                images.z_m[row + x] = z
                images.weights[row + x] = wp.vec2(u + 1.0 - side, v)
                images.normals[row + x] = face_viewer(n * side, view.R_world_camera @ d)
                x += 1
                same = False
                if x < end:
                    same = images.hits[row + x][0] == hit[0] and images.hits[row + x][1] == hit[1]


@wp.kernel
def label_ids(hits: wp.array[wp.vec2i], ids: wp.array[wp.uint16], labels: wp.array[wp.uint16]):
    """Id of the body at every pixel; ``ids[0]`` is the background's, ``ids[1 + b]`` is b's."""
    i = wp.tid()
    labels[i] = ids[hits[i][0] + 1]


@wp.kernel
def label_ranges(view: records.View, z_m: wp.array[float], ranges_m: wp.array[float]):
    """Distance along the ray [m]."""
    i = wp.tid()
    x = float(i % view.width) + 0.5
    y = float(i / view.width) + 0.5
    ranges_m[i] = z_m[i] * wp.length(records.pixel_direction(view, x, y))


@wp.kernel
def label_z_depths(view: records.View, ranges_m: wp.array[float], z_m: wp.array[float]):
    """Distance along the optical axis [m]; inf behind the camera's plane."""
    i = wp.tid()
    z = ranges_m[i] * view.directions[i][2]
    # NaN, outside the lens's field, compares false and counts as nothing.
    if not z > 0.0:
        z = wp.inf
    z_m[i] = z


@wp.kernel
def label_normals(
    view: records.View, normals: wp.array[wp.vec3], normals_camera: wp.array[wp.vec3]
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
    world: records.World,
    hits: wp.array[wp.vec2i],
    weights: wp.array[wp.vec2],
    frames: wp.array[BoxFrame],
    coordinates: wp.array[wp.vec3],
):
    """Position within the instance's box, [0, 1] per axis; 0 for the background."""
    i = wp.tid()
    b = hits[i][0]
    # Rounding may leave the box by a hair.
    p = wp.vec3(0.0)
    if b >= 0:
        if frames[b].labelled != 0:
            m = records.mesh_point(world, hits[i], weights[i])
            q = frames[b].A_box_mesh @ m + frames[b].t_box_mesh
            p = wp.vec3(
                wp.clamp(q[0], 0.0, 1.0), wp.clamp(q[1], 0.0, 1.0), wp.clamp(q[2], 0.0, 1.0)
            )
    coordinates[i] = p


@wp.func
def distance_to(world: records.World, hit: wp.vec2i, weight: wp.vec2):
    """Distance from the camera's centre to a point of a (body, face) [m]."""
    b = hit[0]
    m = records.mesh_point(world, hit, weight)
    return wp.length(world.bodies[b].A_camera_mesh @ m + world.bodies[b].t_camera_mesh)
