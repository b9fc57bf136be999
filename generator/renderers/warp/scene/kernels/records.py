"""What the host hands to kernels."""

from __future__ import annotations

import warp as wp

NOTHING = wp.constant(-1)
# Smoother surfaces mirror what is around them; on others an environment will do.
MIRROR_ROUGHNESS = wp.constant(0.1)
PINHOLE = wp.constant(0)
BROWN_CONRADY = wp.constant(1)
KANNALA_BRANDT = wp.constant(2)
EQUIRECTANGULAR = wp.constant(3)
HOLES = wp.constant(1)
CLEAR = wp.constant(2)

Coefficients = wp.types.vector(length=8, dtype=wp.float32)


@wp.struct
class View:
    """A camera; image coordinates have pixel centres at i + 0.5.

    Attributes:
        inverse_fx, inverse_fy: Reciprocal focal lengths [1/px].
        lens: PINHOLE, or one of the models of gen_data.generator.core.lens.
        coefficients: Of the lens.
        directions: Unit, camera frame, through every pixel centre, and in the fourth place the
            angle that the pixel covers, 0 where the lens shows nothing; empty for a pinhole.
        R_world_camera: Camera X right, Y down, Z forward.
        eye_m: Camera centre in the world.
        pixel_rad: Angle one pixel covers at the image centre.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    inverse_fx: float
    inverse_fy: float
    lens: int
    coefficients: Coefficients
    directions: wp.array(dtype=wp.vec4)
    R_world_camera: wp.mat33
    eye_m: wp.vec3
    pixel_rad: float


@wp.struct
class Geometry:
    """One mesh in its own frame.

    Attributes:
        mesh: Warp's hierarchy, on CUDA; 0 on the CPU.
        tree: That of gen_data.generator.renderers.warp.scene.bvh, on the CPU; empty on CUDA.
        faces: Three vertex indices per face, flat.
        box_lows_m, box_highs_m: Corners of boxes that together hold all faces.
        convex: 1 where the mesh is a convex solid: seen from outside it never shades itself.
    """

    mesh: wp.uint64
    tree: wp.array(dtype=wp.float32)
    vertices_m: wp.array(dtype=wp.vec3)
    normals: wp.array(dtype=wp.vec3)
    uvs: wp.array(dtype=wp.vec2)
    faces: wp.array(dtype=wp.int32)
    face_slots: wp.array(dtype=wp.int32)
    box_lows_m: wp.array(dtype=wp.vec3)
    box_highs_m: wp.array(dtype=wp.vec3)
    low_m: wp.vec3
    high_m: wp.vec3
    convex: int


@wp.struct
class BodyRecord:
    """One placed mesh. "mesh" is the frame of the unscaled vertices.

    Attributes:
        geometry: Index into the geometries.
        first_vertex: Where its vertices begin in per-view vertex buffers.
        first_material: Where its slots begin in the materials.
        A_camera_mesh, t_camera_mesh: Mesh to camera, scale included.
        B_mesh_camera: Camera direction to mesh direction, scale included.
        eye_mesh: The camera's centre in the mesh frame.
        R_world_mesh, t_world_mesh: Rotation without scale, and position.
        B_mesh_world, t_mesh_world: World to mesh, scale included.
        low_m, high_m: Box in the world.
        cutouts: HOLES, CLEAR or both, where rays may pass some of its faces; else 0, and no face
            is looked at more closely.
    """

    geometry: int
    first_vertex: int
    first_material: int
    cutouts: int
    scale: float
    A_camera_mesh: wp.mat33
    t_camera_mesh: wp.vec3
    B_mesh_camera: wp.mat33
    eye_mesh: wp.vec3
    R_world_mesh: wp.mat33
    t_world_mesh: wp.vec3
    B_mesh_world: wp.mat33
    t_mesh_world: wp.vec3
    low_m: wp.vec3
    high_m: wp.vec3


@wp.struct
class MaterialRecord:
    """A metallic-roughness material, as gen_data.generator.core.asset_types.Material.

    Attributes:
        texture: Index into the textures; -1 where there is none.
        layered: 1 where there is more to it than colour, roughness and bumps: a coat, light that
            goes through, maps of emission, metal or occlusion, or a mirror; else nothing below
            is read.
        coat, coat_roughness: Weight and perceptual roughness of the clear coat.
        transmission: Share of the light below the specular layer that goes through.
        ior: Refractive index of what transmits.
        thin: 1 for a pane that bends nothing, 0 for a solid that refracts.
        opacity: Share of what is behind that it hides.
    """

    base_color: wp.vec3
    roughness: float
    metallic: float
    specular: float
    texture: int
    texture_scale_m: float
    emission_cd_m2: wp.vec3
    layered: int
    coat: float
    coat_roughness: float
    transmission: float
    ior: float
    thin: int
    opacity: float


@wp.struct
class TextureRecord:
    """Mip chains of one texture, levels one after the other, rows from the top.

    Attributes:
        texels: Albedo as square roots of linear values and roughness factor, 8 bits each
            (red lowest).
        bumps: Tangent-space normals, 8 bits each; empty where there are none.
        shares: Factors on metallic (lowest byte) and occlusion of ambient light; empty where
            there are none.
        glow: Factor on emission as square roots of linear values; empty where there is none.
        cover: Coverage of the finest level; empty where there are no holes.
        offsets: First texel of each level.
    """

    texels: wp.array(dtype=wp.uint32)
    bumps: wp.array(dtype=wp.uint32)
    shares: wp.array(dtype=wp.uint32)
    glow: wp.array(dtype=wp.uint32)
    cover: wp.array(dtype=wp.uint8)
    offsets: wp.array(dtype=wp.int32)
    width: int
    height: int
    levels: int
    has_bumps: int
    has_shares: int
    has_glow: int
    has_cover: int


@wp.struct
class LightRecord:
    """A light. ``kind``: 0 sphere, 1 spot, 2 sun, 3 rectangle, 4 disk; the last two are panels.

    Attributes:
        position_m: Centre (all but sun).
        direction: In which the light travels; a panel's normal, on the side that shines.
        power: Colour times intensity [cd] (all but sun) or illuminance [lx] (sun).
        radiance: Of a panel's front, the same from everywhere [cd/m^2].
        along, across: From a panel's centre to the middles of two of its sides, or to its rim [m];
            they are at right angles to each other and to ``direction``.
        radius: Of the ball or the disk, or of the circle around the rectangle [m], or tangent of
            the sun's angular radius.
        shown: 1 where rays find it: a body before which a panel hangs, a part of a panorama.
        cos_outer, cos_inner: Where a spot has faded to nothing, and where it begins to fade.
        cutoff: Slope below which a dipped headlight lights the road; 0 = no such light.
    """

    kind: int
    position_m: wp.vec3
    direction: wp.vec3
    power: wp.vec3
    radiance: wp.vec3
    along: wp.vec3
    across: wp.vec3
    radius: float
    shown: int
    cos_outer: float
    cos_inner: float
    cutoff: float


@wp.struct
class EnvironmentRecord:
    """Light from all around.

    Attributes:
        irradiance: Nine coefficients of irradiance / pi in the world frame, basis of
            Ramamoorthi and Hanrahan 2001.
        glossy: Radiance convolved with GGX lobes on octahedral maps [level, row, column]; level
            ``k`` has perceptual roughness ``k / (levels - 1)``.
        image: Equirectangular radiance for pixels that see no body.
        rest: The same without what lamps stand for, as is all that lights and is mirrored.
        cos_yaw, sin_yaw: Rotation of the image about world Z.
        visible: Whether such pixels show the image.
    """

    irradiance: wp.array(dtype=wp.vec3)
    glossy: wp.array(dtype=wp.vec3, ndim=3)
    image: wp.array(dtype=wp.vec3, ndim=2)
    rest: wp.array(dtype=wp.vec3, ndim=2)
    luminance: float
    cos_yaw: float
    sin_yaw: float
    visible: int


@wp.struct
class GroundRecord:
    """What weather has left on surfaces.

    Attributes:
        covered: 0 where everything is dry and bare: then nothing else is read.
        wetness, puddles, snow_cover: As in ``gen_data.generator.core.scene.Weather``.
        puddle_level, snow_level: Levels of the noise above which there is water, snow.
        seed: Of the noise.
        exposed: Share of what falls that reaches each point of the lattice, flat.
    """

    covered: int
    wetness: float
    puddles: float
    puddle_level: float
    snow_cover: float
    snow_level: float
    seed: int
    exposed: wp.array(dtype=float)


@wp.func
def pixel_direction(view: View, x_px: float, y_px: float):
    """Direction in the camera frame: before a pinhole with z = 1, else of length 1.

    A ray's parameter, which images of depths hold, is its z-depth before a pinhole, else its range.
    """
    d = wp.vec3((x_px - view.cx) * view.inverse_fx, (y_px - view.cy) * view.inverse_fy, 1.0)
    if view.lens != PINHOLE:
        d = distorted_direction(view, x_px, y_px)
    return d


@wp.func
def distorted_direction(view: View, x_px: float, y_px: float):
    """Unit direction through a point of the image, from those through the centres around it."""
    x = wp.clamp(int(x_px), 0, view.width - 1)
    y = wp.clamp(int(y_px), 0, view.height - 1)
    i = y * view.width + x
    right = x_px - (float(x) + 0.5)
    down = y_px - (float(y) + 0.5)
    d = view.directions[i]
    if right != 0.0 or down != 0.0:
        across = bend_between(view, i, wp.max(x - 1, 0) - x, wp.min(x + 1, view.width - 1) - x, 1)
        below = wp.min(y + 1, view.height - 1) - y
        along = bend_between(view, i, wp.max(y - 1, 0) - y, below, view.width)
        d += across * right + along * down
        return fast_normalize(wp.vec3(d[0], d[1], d[2]))
    return wp.vec3(d[0], d[1], d[2])


@wp.func
def bend_between(view: View, i: int, before: int, after: int, stride: int):
    """Change of direction per pixel at pixel i, from neighbours that show something."""
    first = before
    last = after
    if view.directions[i + first * stride][3] == 0.0:
        first = 0
    if view.directions[i + last * stride][3] == 0.0:
        last = 0
    change = wp.vec4(0.0)
    if last > first:
        change = view.directions[i + last * stride] - view.directions[i + first * stride]
        change = change / float(last - first)
    return change


@wp.func
def is_in_view(view: View, i: int):
    """Whether the lens shows anything at pixel i."""
    seen = bool(True)
    if view.lens != PINHOLE:
        seen = view.directions[i][3] > 0.0
    return seen


@wp.func
def pixel_width(view: View, i: int, depth_m: float):
    """Width of pixel i at what it sees there [m]; depths as ``pixel_direction`` has them."""
    width_m = depth_m * view.pixel_rad
    if view.lens != PINHOLE:
        width_m = depth_m * view.directions[i][3]
    return width_m


@wp.func
def fast_normalize(v: wp.vec3):
    """The unit vector along v; one division where ``wp.normalize`` takes three."""
    return v * (1.0 / wp.sqrt(wp.max(wp.dot(v, v), 1.0e-30)))


@wp.func
def min_of_two(a: float, b: float):
    """The smaller of two numbers; one instruction, where ``wp.min`` also looks for NaN."""
    return wp.where(a < b, a, b)


@wp.func
def max_of_two(a: float, b: float):
    """The larger of two numbers."""
    return wp.where(a > b, a, b)


@wp.func
def componentwise_min(a: wp.vec3, b: wp.vec3):
    """The smaller of each coordinate."""
    return wp.vec3(min_of_two(a[0], b[0]), min_of_two(a[1], b[1]), min_of_two(a[2], b[2]))


@wp.func
def componentwise_max(a: wp.vec3, b: wp.vec3):
    """The larger of each coordinate."""
    return wp.vec3(max_of_two(a[0], b[0]), max_of_two(a[1], b[1]), max_of_two(a[2], b[2]))


@wp.func
def first_weight(weight: wp.vec2):
    """Barycentric weight of a face's second corner, from what images of weights hold.

    They have 2 added to it where the inside of the face is seen: see ``seen_inside``.
    """
    return wp.where(weight[0] > 1.5, weight[0] - 2.0, weight[0])


@wp.func
def is_back_face(weight: wp.vec2):
    """Whether the inside of a face is seen, from what images of weights hold."""
    # Half-way between the largest weight, 1, and the smallest with 2 added to it.
    return weight[0] > 1.5


@wp.func
def floor_int(x: float):
    """The largest integer <= x; ``wp.floor`` is a library call on the plainest processors."""
    i = int(x)
    if float(i) > x:
        i -= 1
    return i


@wp.struct
class World:
    """Everything that is not the camera.

    Attributes:
        tree: Over the bodies' boxes, see gen_data.generator.renderers.warp.scene.bvh; empty on
            CUDA.
        hierarchy: Warp's over the same, on CUDA; 0 on the CPU.
        cutouts: Bodies of which rays may pass some faces.
        cutout_hierarchy: Warp's over their boxes; 0 where there are none.
        lobes: Directional albedo of specular lobes, see brdf.directional_albedo.
    """

    tree: wp.array(dtype=wp.float32)
    hierarchy: wp.uint64
    cutouts: wp.array(dtype=wp.int32)
    cutout_hierarchy: wp.uint64
    geometries: wp.array(dtype=Geometry)
    bodies: wp.array(dtype=BodyRecord)
    surfaces: wp.array(dtype=MaterialRecord)
    textures: wp.array(dtype=TextureRecord)
    lamps: wp.array(dtype=LightRecord)
    lobes: wp.array(dtype=wp.vec2, ndim=2)
    sky: EnvironmentRecord
    ground: GroundRecord


# Functions take a World and an index rather than a BodyRecord or a Geometry: a record that is
# copied costs more than the few of its fields that are read.


@wp.func
def to_mesh_point(world: World, b: int, p_world: wp.vec3):
    """World point to the mesh frame of body b."""
    return world.bodies[b].B_mesh_world @ p_world + world.bodies[b].t_mesh_world


@wp.func
def to_mesh_vector(world: World, b: int, v_world: wp.vec3):
    """World displacement to the mesh frame of body b."""
    return world.bodies[b].B_mesh_world @ v_world


@wp.func
def face_vertices(world: World, g: int, face: int):
    """Vertex indices of one face of geometry g."""
    first = 3 * face
    return wp.vec3i(
        world.geometries[g].faces[first],
        world.geometries[g].faces[first + 1],
        world.geometries[g].faces[first + 2],
    )


@wp.func
def vertex_at(world: World, g: int, i: int):
    """Vertex i of geometry g."""
    return world.geometries[g].vertices_m[i]


@wp.func
def flat_normal(world: World, hit: wp.vec2i):
    """Unit normal of a (body, face) in the world, on the side where its corners turn left."""
    g = world.bodies[hit[0]].geometry
    corner = face_vertices(world, g, hit[1])
    p = vertex_at(world, g, corner[0])
    n = wp.cross(vertex_at(world, g, corner[1]) - p, vertex_at(world, g, corner[2]) - p)
    return world.bodies[hit[0]].R_world_mesh @ wp.normalize(n)


@wp.func
def normal_at(world: World, g: int, i: int):
    """Normal of vertex i of geometry g."""
    return world.geometries[g].normals[i]


@wp.func
def surface_index(world: World, hit: wp.vec2i):
    """The material of a (body, face)."""
    g = world.bodies[hit[0]].geometry
    return world.bodies[hit[0]].first_material + world.geometries[g].face_slots[hit[1]]
