"""Alpha test: holes that a texture's coverage cuts into faces, and clear faces that rays pass.

Coverage is sampled bilinearly at the texture's finest level, and a point is a hole where it is
below one half. The mip level does not depend on distance, so labels, shadows and laser beams agree
everywhere.
"""

import inspect

import warp as wp

from gen_data.renderers.warp.scene.kernels.bvh_traverse import Found, any_in_mesh, first_in_mesh
from gen_data.renderers.warp.scene.kernels.records import (
    CLEAR,
    UNSHADED,
    World,
    face_vertices,
    floor_int,
    vertex_at,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

# Few bodies have holes: these functions are compiled once per module, not inlined at every call.
OUT_OF_LINE = {"inline": False} if "inline" in inspect.signature(wp.func).parameters else {}
# A ray that has passed a face continues this far behind it [m].
STEP_M = wp.constant(2.0e-5)
# Limit on the faces of one body that a ray passes; it bounds the loop, not the image.
FACES_MAX = wp.constant(64)


@wp.func
def dominant_axis(normal: wp.vec3):
    """Number of the largest component of a normal, which selects a texture's projection."""
    n = wp.abs(normal)
    axis = int(1)
    if n[0] > n[1] and n[0] > n[2]:
        axis = 0
    elif n[2] > n[1]:
        axis = 2
    return axis


@wp.func
def project_uv(p: wp.vec3, axis: int):
    """Texture coordinates along one axis; X and Y faces keep Z upright."""
    u = p[0]
    v = p[2]
    if axis == 0:
        u = p[1]
    elif axis == 2:
        v = p[1]
    return wp.vec2(u, v)


@wp.func
def is_covered(world: World, texture: int, uv: wp.vec2):
    """Whether a texture's coverage is at least one half; textures repeat, rows run from the top."""
    width = world.textures[texture].width
    height = world.textures[texture].height
    # Beyond a million repeats, single precision holds no position within a texel.
    u = wp.clamp(uv[0], -1.0e6, 1.0e6)
    v = wp.clamp(uv[1], -1.0e6, 1.0e6)
    # Texel centres are at half-integers; v grows upwards while rows are stored from the top.
    x = (u - float(floor_int(u))) * float(width) - 0.5
    y = (1.0 - (v - float(floor_int(v)))) * float(height) - 0.5
    x0 = floor_int(x)
    y0 = floor_int(y)
    right = x - float(x0)
    down = y - float(y0)
    # x0 lies from -1 to width - 1: comparisons replace a remainder.
    xa = wp.where(x0 < 0, width - 1, x0)
    xb = wp.where(x0 + 1 >= width, 0, x0 + 1)
    top = wp.where(y0 < 0, height - 1, y0) * width
    below = wp.where(y0 + 1 >= height, 0, y0 + 1) * width
    c = world.textures[texture].cover
    upper = float(c[top + xa]) * (1.0 - right) + float(c[top + xb]) * right
    lower = float(c[below + xa]) * (1.0 - right) + float(c[below + xb]) * right
    # One half of the eight-bit range.
    return upper * (1.0 - down) + lower * down >= 127.5


@wp.func
def uv_at(world: World, surface: int, b: int, face: int, weights: wp.vec3):
    """Texture coordinates at a point of a face: by UVs, or projected along its dominant axis.

    Args:
        weights: Barycentric, of the face's three corners.
    """
    g = world.bodies[b].geometry
    corner = face_vertices(world, g, face)
    scale_m = world.surfaces[surface].texture_scale_m
    uv = world.geometries[g].uvs[corner[0]] * weights[0]
    uv += world.geometries[g].uvs[corner[1]] * weights[1]
    uv += world.geometries[g].uvs[corner[2]] * weights[2]
    if scale_m > 0.0:
        p0 = vertex_at(world, g, corner[0])
        p1 = vertex_at(world, g, corner[1])
        p2 = vertex_at(world, g, corner[2])
        axis = dominant_axis(wp.cross(p1 - p0, p2 - p0))
        p = p0 * weights[0] + p1 * weights[1] + p2 * weights[2]
        uv = project_uv(p * (world.bodies[b].scale / scale_m), axis)
    return uv


@wp.func(**OUT_OF_LINE)
def is_hole(world: World, b: int, face: int, weights: wp.vec3):
    """Whether a point of a face is a hole."""
    g = world.bodies[b].geometry
    surface = world.bodies[b].first_material + world.geometries[g].face_slots[face]
    texture = world.surfaces[surface].texture
    hole = bool(False)
    if texture >= 0:
        if world.textures[texture].has_cover != 0:
            uv = uv_at(world, surface, b, face, weights)
            hole = not is_covered(world, texture, uv)
    return hole


@wp.func
def is_passable(world: World, b: int, face: int, weights: wp.vec3, through: int):
    """Whether a ray passes a point of a face.

    Args:
        through: HOLES, or HOLES and CLEAR: shadow rays also pass clear faces.
    """
    clear = bool(False)
    if (through & CLEAR) != 0:
        g = world.bodies[b].geometry
        surface = world.bodies[b].first_material + world.geometries[g].face_slots[face]
        # Shadow rays are binary: a face counts as clear if it passes more than half of the light.
        clear = world.surfaces[surface].transmission > 0.5 or world.surfaces[surface].opacity < 0.5
    if not clear:
        clear = is_hole(world, b, face, weights)
    return clear


@wp.func
def is_passed(world: World, b: int, through: int):
    """Whether a ray that passes ``through`` passes all faces of a body."""
    return (through & CLEAR) != 0 and (world.bodies[b].cutouts & UNSHADED) != 0


@wp.struct
class Strike:
    """Intersection of a ray with a mesh.

    Attributes:
        face: -1 for a miss.
        t: Parameter along the ray.
        u, v: Barycentric, of the face's first and second corner.
    """

    face: int
    t: float
    u: float
    v: float


@wp.func
def to_strike(found: Found):
    """Convert a result of the tree traversal to single precision."""
    strike = Strike()
    strike.t = float(found[0])
    strike.u = float(found[1])
    strike.v = float(found[2])
    strike.face = int(found[3])
    return strike


@wp.func(**OUT_OF_LINE)
def first_opaque_hit(world: World, b: int, o: wp.vec3, d: wp.vec3, reach: float, through: int):
    """The first point of a body with holes that a ray does not pass."""
    g = world.bodies[b].geometry
    strike = Strike()
    strike.face = -1
    begin = float(0.0)
    faces = int(0)
    going = bool(True)
    while going:
        going = False
        met = to_strike(first_in_mesh(world.geometries[g].tree, o + d * begin, d, reach - begin))
        if met.face >= 0:
            weights = wp.vec3(met.u, met.v, 1.0 - met.u - met.v)
            if is_passable(world, b, met.face, weights, through):
                # A relative step for distant hits and an absolute one for near hits: the same face
                # is not found again.
                begin += met.t * 1.000001 + STEP_M / wp.length(d)
                faces += 1
                going = faces < FACES_MAX
            else:
                strike = met
                strike.t = begin + met.t
    return strike


@wp.func
def closest_solid_hit(world: World, b: int, o: wp.vec3, d: wp.vec3, reach: float, through: int):
    """The first point of a body that a ray does not pass.

    Args:
        o, d: The ray in the mesh frame.
        reach: Largest parameter along it.
        through: Surfaces that the ray may pass: HOLES, CLEAR or both.
    """
    g = world.bodies[b].geometry
    strike = Strike()
    if is_passed(world, b, through):
        strike.face = -1
    elif (world.bodies[b].cutouts & through) != 0:
        # Only bodies whose flags match need a test at every face.
        strike = first_opaque_hit(world, b, o, d, reach, through)
    else:
        strike = to_strike(first_in_mesh(world.geometries[g].tree, o, d, reach))
    return strike


@wp.func
def is_mesh_intersected(world: World, b: int, o: wp.vec3, d: wp.vec3, reach: float, through: int):
    """Whether a body blocks a ray; arguments as for closest_solid_hit."""
    g = world.bodies[b].geometry
    hit = not is_passed(world, b, through)
    if hit:
        # The cheaper any-hit query comes first: only hits on cut-outs need the test at every face.
        hit = any_in_mesh(world.geometries[g].tree, o, d, reach)
    if hit and (world.bodies[b].cutouts & through) != 0:
        hit = first_opaque_hit(world, b, o, d, reach, through).face >= 0
    return hit
