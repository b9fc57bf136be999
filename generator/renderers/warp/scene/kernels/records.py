"""Records that the host passes to kernels, and functions on them."""

import warp as wp

NOTHING = wp.constant(-1)
# Smoother surfaces show reflections of the scene; for rougher ones the environment suffices.
MIRROR_ROUGHNESS = wp.constant(0.1)
PINHOLE = wp.constant(0)
BROWN_CONRADY = wp.constant(1)
KANNALA_BRANDT = wp.constant(2)
EQUIRECTANGULAR = wp.constant(3)
# Flags of cut-outs: bits that rays compare with the kinds of surface that they may pass.
HOLES = wp.constant(1)
CLEAR = wp.constant(2)
# Flag of bodies that move, which rays may pass as a whole.
MOVES = wp.constant(4)
# Cut-outs of a body that light passes everywhere: shadow rays need no test of its faces.
UNSHADED = wp.constant(8)

Coefficients = wp.types.vector(length=8, dtype=wp.float32)


@wp.struct
class View:
    """A camera; pixel centres are at i + 0.5.

    Attributes:
        inverse_fx, inverse_fy: Reciprocal focal lengths [1/px].
        lens: PINHOLE, or one of the models of gen_data.core.lens.
        coefficients: Distortion coefficients of the lens.
        directions: Unit directions in the camera frame through every pixel centre; the fourth
            component is the pixel's angle [rad], 0 outside the lens's field. Empty for a pinhole.
        R_world_camera: Camera X right, Y down, Z forward.
        eye_m: Camera centre in the world.
        pixel_rad: Angle of a pixel at the image centre [rad].
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
    directions: wp.array[wp.vec4]
    R_world_camera: wp.mat33
    eye_m: wp.vec3
    pixel_rad: float


@wp.struct
class Geometry:
    """One mesh in its own frame.

    Attributes:
        tree: Hierarchy of its faces, see gen_data.renderers.warp.scene.bvh.
        faces: Three vertex indices per face, flat.
        boxes: Boxes that together bound all faces, see box_groups.
        convex: 1 for a convex solid, which never shadows itself when seen from outside.
    """

    tree: wp.array[wp.float32]
    vertices_m: wp.array[wp.vec3]
    normals: wp.array[wp.vec3]
    uvs: wp.array[wp.vec2]
    faces: wp.array[wp.int32]
    face_slots: wp.array[wp.int32]
    boxes: wp.array[wp.float32]
    low_m: wp.vec3
    high_m: wp.vec3
    convex: int


@wp.struct
class BodyRecord:
    """One placed mesh. "mesh" is the frame of the unscaled vertices.

    Attributes:
        geometry: Index into the geometries.
        first_vertex: First of its vertices in per-view vertex buffers.
        first_material: First of its slots in the materials.
        A_camera_mesh, t_camera_mesh: Mesh to camera, scale included.
        B_mesh_camera: Camera direction to mesh direction, scale included.
        eye_mesh: The camera's centre in the mesh frame.
        R_world_mesh, t_world_mesh: Rotation without scale, and position.
        B_mesh_world, t_mesh_world: World to mesh, scale included.
        low_m, high_m: Box in the world.
        cutouts: HOLES, CLEAR or both if rays may pass some of its faces; neither needs no test per
            face. MOVES if it does not stay where it is; UNSHADED if all of its faces are CLEAR.
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
    """A metallic-roughness material, as gen_data.core.asset_types.Material.

    Attributes:
        texture: Index into the textures; -1 where there is none.
        translucency: Diffuse transmittance over diffuse reflectance, ``base_color``; 0 for opaque
            surfaces.
        layered: 1 for a coat, transmission, maps of emission, metal or occlusion, or a mirror; for
            0 the fields below are unused.
        coat, coat_roughness: Weight and perceptual roughness of the clear coat.
        transmission: Share of the light below the specular layer that is transmitted.
        ior: Refractive index of a transmitting material.
        thin: 1 for a pane that does not refract, 0 for a solid that does.
        opacity: Share of the background that it hides.
        soaks: 1 for soil and turf, where rain seeps away; 0 for all else.
        one_sided: 1 if the texture is on the front only; the back has its mean colour.
    """

    base_color: wp.vec3
    roughness: float
    metallic: float
    specular: float
    texture: int
    texture_scale_m: float
    emission_cd_m2: wp.vec3
    translucency: wp.vec3
    layered: int
    coat: float
    coat_roughness: float
    transmission: float
    ior: float
    thin: int
    opacity: float
    soaks: float
    one_sided: int


@wp.struct
class TextureRecord:
    """Mip chains of one texture, levels concatenated, rows from the top.

    Attributes:
        texels: Albedo as square roots of linear values and roughness factor, 8 bits each (red
            lowest).
        bumps: Tangent-space normals, 8 bits each; empty where there are none.
        shares: Factors on metallic (lowest byte) and occlusion of ambient light; empty where there
            are none.
        glow: Factor on emission as square roots of linear values; empty where there is none.
        cover: Coverage of the finest level; empty where there are no holes.
        offsets: First texel of each level.
    """

    texels: wp.array[wp.uint32]
    bumps: wp.array[wp.uint32]
    shares: wp.array[wp.uint32]
    glow: wp.array[wp.uint32]
    cover: wp.array[wp.uint8]
    offsets: wp.array[wp.int32]
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
        direction: Direction of the light's travel; a panel's normal on its emitting side.
        power: Colour times intensity [cd] (all but sun) or illuminance [lx] (sun).
        radiance: Radiance of a panel's front [cd/m^2], independent of direction.
        along, across: From a panel's centre to the middles of two of its sides, or to its rim [m];
            they are at right angles to each other and to ``direction``.
        radius: Radius of the sphere, the disk or the rectangle's circumscribed circle [m], or
            tangent of the sun's angular radius.
        shown: 1 if rays hit a visible counterpart: a body behind a panel, a part of a panorama.
        cos_outer, cos_inner: Cosines at which a spot's intensity reaches zero and begins to fall.
        cutoff: Slope of a dipped headlight's cut-off; 0 for other lamps.
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
    """Environment lighting.

    Attributes:
        irradiance: Nine coefficients of irradiance / pi in the world frame, basis of Ramamoorthi
            and Hanrahan 2001.
        glossy: Radiance convolved with GGX lobes on octahedral maps [level, row, column]; level
            ``k`` has perceptual roughness ``k / (levels - 1)``.
        image: Equirectangular radiance, for pixels without a body.
        rest: The same without the parts that lamps represent, as are irradiance and reflections.
        cos_yaw, sin_yaw: Rotation of the image about world Z.
        visible: Whether pixels without a body show the image.
    """

    irradiance: wp.array[wp.vec3]
    glossy: wp.array3d[wp.vec3]
    image: wp.array2d[wp.vec3]
    rest: wp.array2d[wp.vec3]
    luminance: float
    cos_yaw: float
    sin_yaw: float
    visible: int


@wp.struct
class VolumeRecord:
    """A box with separate ambient light.

    Attributes:
        low_m, high_m: Corners.
        counts: Numbers of probes along X, Y and Z.
        first: Row of its first probe.
    """

    low_m: wp.vec3
    high_m: wp.vec3
    counts: wp.vec3i
    first: int


@wp.struct
class GBufferRecord:
    """G-buffer at every pixel centre, flat; fields as in gbuffer.GBuffer."""

    hits: wp.array[wp.vec2i]
    z_m: wp.array[float]
    weights: wp.array[wp.vec2]
    normals: wp.array[wp.vec3]


@wp.struct
class GroundRecord:
    """Wetness and snow on surfaces.

    Attributes:
        covered: 0 if everything is dry and bare; the other fields are then unused.
        wetness, puddles, snow_cover: As in ``gen_data.core.scene.Weather``.
        puddle_level, snow_level: Thresholds of the noise above which there is water or snow.
        seed: Seed of the noise.
        exposed: Exposure of each lattice point to precipitation, [0, 1], flat.
    """

    covered: int
    wetness: float
    puddles: float
    puddle_level: float
    snow_cover: float
    snow_level: float
    seed: int
    exposed: wp.array[float]


@wp.func
def pixel_direction(view: View, x_px: float, y_px: float):
    """Direction in the camera frame: with z = 1 for a pinhole, else of unit length.

    The parameter along a ray, which depth images hold, is therefore z-depth for a pinhole, else
    range.
    """
    d = wp.vec3((x_px - view.cx) * view.inverse_fx, (y_px - view.cy) * view.inverse_fy, 1.0)
    if view.lens != PINHOLE:
        d = distorted_direction(view, x_px, y_px)
    return d


@wp.func
def pixel_ray(view: View, i: int):
    """Direction in the world through the centre of pixel i, as long as by ``pixel_direction``."""
    x = float(i % view.width) + 0.5
    y = float(i / view.width) + 0.5
    return view.R_world_camera @ pixel_direction(view, x, y)


@wp.func
def distorted_direction(view: View, x_px: float, y_px: float):
    """Unit direction through a point of the image, interpolated from pixel centres."""
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
    """Width of pixel i at the depth of its surface [m]; depth as of ``pixel_direction``."""
    width_m = depth_m * view.pixel_rad
    if view.lens != PINHOLE:
        width_m = depth_m * view.directions[i][3]
    return width_m


@wp.func
def fast_normalize(v: wp.vec3):
    """Unit vector along v, with one division instead of three of ``wp.normalize``."""
    # The floor leaves the zero vector zero instead of NaN.
    return v * (1.0 / wp.sqrt(wp.max(wp.dot(v, v), 1.0e-30)))


@wp.func
def min_of_two(a: float, b: float):
    """The smaller of two numbers; one instruction, while ``wp.min`` also handles NaN."""
    return wp.where(a < b, a, b)


@wp.func
def max_of_two(a: float, b: float):
    """The larger of two numbers; as ``min_of_two``."""
    return wp.where(a > b, a, b)


@wp.func
def componentwise_min(a: wp.vec3, b: wp.vec3):
    """Componentwise minimum."""
    return wp.vec3(min_of_two(a[0], b[0]), min_of_two(a[1], b[1]), min_of_two(a[2], b[2]))


@wp.func
def componentwise_max(a: wp.vec3, b: wp.vec3):
    """Componentwise maximum."""
    return wp.vec3(max_of_two(a[0], b[0]), max_of_two(a[1], b[1]), max_of_two(a[2], b[2]))


@wp.func
def reciprocals(way: wp.vec3):
    """Componentwise reciprocals; zeros become tiny numbers, whose sign does not matter."""
    # 0 / 0 would be NaN for a ray in a box's face; a large number is as good as infinity.
    x = wp.where(wp.abs(way[0]) < 1.0e-20, 1.0e-20, way[0])
    y = wp.where(wp.abs(way[1]) < 1.0e-20, 1.0e-20, way[1])
    z = wp.where(wp.abs(way[2]) < 1.0e-20, 1.0e-20, way[2])
    return wp.vec3(1.0 / x, 1.0 / y, 1.0 / z)


@wp.func
def slab_interval(low: wp.vec3, high: wp.vec3, inverse: wp.vec3):
    """Parameters at which a ray enters and leaves a box; it misses if it would leave first.

    Args:
        low, high: Corners relative to the ray's origin.
        inverse: ``reciprocals`` of its direction.
    """
    a = wp.cw_mul(low, inverse)
    c = wp.cw_mul(high, inverse)
    enter = max_of_two(min_of_two(a[0], c[0]), min_of_two(a[1], c[1]))
    leave = min_of_two(max_of_two(a[0], c[0]), max_of_two(a[1], c[1]))
    return max_of_two(enter, min_of_two(a[2], c[2])), min_of_two(leave, max_of_two(a[2], c[2]))


@wp.func
def first_weight(weight: wp.vec2):
    """Barycentric weight of a face's second corner, from a stored weight.

    Stored weights have 2 added where the back of the face is visible: see ``is_back_face``.
    """
    return wp.where(weight[0] > 1.5, weight[0] - 2.0, weight[0])


@wp.func
def is_back_face(weight: wp.vec2):
    """Whether a stored weight marks the back of a face."""
    # Half-way between 1, the largest weight, and 2, the smallest with the mark.
    return weight[0] > 1.5


@wp.func
def floor_int(x: float):
    """The largest integer <= x; ``wp.floor`` is a library call on baseline x86-64."""
    i = int(x)
    if float(i) > x:
        i -= 1
    return i


@wp.struct
class World:
    """The scene without the camera.

    Attributes:
        boxes: The bodies' boxes in the world, see box_groups.
        tree: Hierarchy over the bodies' boxes, see gen_data.renderers.warp.scene.bvh.
        cutouts: Numbers of the bodies with HOLES, or with CLEAR faces among others.
        cutout_hierarchy: Warp's hierarchy over their boxes; 0 without any.
        cutout_flags: HOLES, CLEAR or both: the flags that any of them has.
        lobes: Directional albedo of specular lobes, see brdf.directional_albedo.
        volumes: Boxes in which ``probes`` replace the sky's ambient light.
        probes: Irradiance over pi from around +X, -X, +Y, -Y, +Z and -Z, [probes, 6].
    """

    boxes: wp.array[wp.float32]
    tree: wp.array[wp.float32]
    cutouts: wp.array[wp.int32]
    cutout_hierarchy: wp.uint64
    cutout_flags: int
    geometries: wp.array[Geometry]
    bodies: wp.array[BodyRecord]
    surfaces: wp.array[MaterialRecord]
    textures: wp.array[TextureRecord]
    lamps: wp.array[LightRecord]
    lobes: wp.array2d[wp.vec2]
    sky: EnvironmentRecord
    ground: GroundRecord
    volumes: wp.array[VolumeRecord]
    probes: wp.array2d[wp.vec3]


# Functions take a World and an index rather than a BodyRecord or a Geometry: copying a record costs
# more than reading the few fields that are needed.


@wp.func
def mesh_point(world: World, hit: wp.vec2i, weight: wp.vec2):
    """Point of a (body, face) in the mesh frame, from stored barycentric weights."""
    u = first_weight(weight)
    v = weight[1]
    g = world.bodies[hit[0]].geometry
    corner = face_vertices(world, g, hit[1])
    p = vertex_at(world, g, corner[0]) * (1.0 - u - v)
    return p + vertex_at(world, g, corner[1]) * u + vertex_at(world, g, corner[2]) * v


@wp.func
def to_mesh_point(world: World, b: int, p_world: wp.vec3):
    """Transform a world point to the mesh frame of body b."""
    return world.bodies[b].B_mesh_world @ p_world + world.bodies[b].t_mesh_world


@wp.func
def to_mesh_vector(world: World, b: int, v_world: wp.vec3):
    """Transform a world displacement to the mesh frame of body b."""
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
    """Unit geometric normal of a (body, face) in the world, on its front."""
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
    """Index of the material of a (body, face)."""
    g = world.bodies[hit[0]].geometry
    return world.bodies[hit[0]].first_material + world.geometries[g].face_slots[hit[1]]
