"""Ambient light at a point: from a volume around it, otherwise from the sky.

Source: McTaggart, "Half-Life 2 / Valve Source shading", GDC 2004 (ambient cubes).
"""

import warp as wp

from gen_data.core.scene import VOLUME_REACH_M
from gen_data.renderers.warp.scene.kernels import environment_lighting, records

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

MARGIN_M = wp.constant(VOLUME_REACH_M)


@wp.func
def depth_in_volume(world: records.World, v: int, p: wp.vec3):
    """How deep a point is in a volume: 1 in its middle, 0 or less where it does not reach."""
    low = p - world.volumes[v].low_m
    high = world.volumes[v].high_m - p
    depth = float(1.0)
    for k in range(3):
        half = 0.5 * (low[k] + high[k]) + MARGIN_M
        depth = wp.min(depth, (wp.min(low[k], high[k]) + MARGIN_M) / half)
    return depth


@wp.func
def is_indoors(world: records.World, p: wp.vec3):
    """Whether any volume reaches a point."""
    found = bool(False)
    for v in range(world.volumes.shape[0]):
        found = found or depth_in_volume(world, v, p) > 0.0
    return found


@wp.func
def probe_light(world: records.World, row: int, n: wp.vec3):
    """Irradiance over pi around a direction, by one ambient cube."""
    x = world.probes[row, wp.where(n[0] >= 0.0, 0, 1)] * (n[0] * n[0])
    y = world.probes[row, wp.where(n[1] >= 0.0, 2, 3)] * (n[1] * n[1])
    z = world.probes[row, wp.where(n[2] >= 0.0, 4, 5)] * (n[2] * n[2])
    return x + y + z


@wp.func
def volume_light(world: records.World, v: int, p: wp.vec3, n: wp.vec3):
    """Irradiance over pi in a volume, trilinear between its probes [cd/m^2]."""
    low = world.volumes[v].low_m
    size = world.volumes[v].high_m - low
    counts = world.volumes[v].counts
    total = wp.vec3(0.0)
    at = wp.vec3(0.0)
    base = wp.vec3i(0, 0, 0)
    for k in range(3):
        last = float(counts[k] - 1)
        place = wp.clamp((p[k] - low[k]) / size[k] * float(counts[k]) - 0.5, 0.0, last)
        base[k] = wp.min(records.floor_int(place), wp.max(counts[k] - 2, 0))
        at[k] = place - float(base[k])
    for corner in range(8):
        dx = corner & 1
        dy = (corner >> 1) & 1
        dz = (corner >> 2) & 1
        weight = wp.where(dx == 1, at[0], 1.0 - at[0])
        weight *= wp.where(dy == 1, at[1], 1.0 - at[1])
        weight *= wp.where(dz == 1, at[2], 1.0 - at[2])
        if weight > 0.0:
            row = ((base[0] + dx) * counts[1] + base[1] + dy) * counts[2] + base[2] + dz
            total += probe_light(world, world.volumes[v].first + row, n) * weight
    return total


@wp.func
def light_of_volumes(world: records.World, p: wp.vec3, n: wp.vec3):
    """Irradiance over pi by the volumes that reach a point, and the sum of their weights.

    Weights are squares of depths: light passes evenly from one room to the other within a wall, and
    small volumes such as niches prevail over the large ones that they are in.
    """
    total = wp.vec3(0.0)
    weight = float(0.0)
    for v in range(world.volumes.shape[0]):
        depth = depth_in_volume(world, v, p)
        if depth > 0.0:
            total += volume_light(world, v, p, n) * (depth * depth)
            weight += depth * depth
    if weight > 0.0:
        total = total / weight
    return total, weight


@wp.func
def ambient_irradiance(world: records.World, p: wp.vec3, n: wp.vec3):
    """Irradiance over pi from the hemisphere around a normal [cd/m^2]."""
    light, weight = light_of_volumes(world, p, n)
    if weight == 0.0:
        light = environment_lighting.sky_irradiance(world.sky, n)
    return light


@wp.func
def interreflected_share(open_share: float):
    """Share of a room's light that reaches a point near surfaces that occlude part of the room.

    Occluders reflect the room's light: a white corner is not half as bright as the wall.

    Source: Jimenez et al., "Practical real-time strategies for accurate indirect occlusion",
    SIGGRAPH 2016 course; its polynomial for an albedo of 0.6, a mean of light walls and furniture.
    """
    hidden = (0.8918 * open_share - 2.2354) * open_share + 2.3436
    return wp.max(open_share, hidden * open_share)


@wp.func
def received_ambience(world: records.World, p: wp.vec3, n: wp.vec3, open_share: float):
    """As ``ambient_irradiance``, where surfaces nearby leave a share of the hemisphere open."""
    light, weight = light_of_volumes(world, p, n)
    if weight > 0.0:
        return light * interreflected_share(open_share)
    return environment_lighting.sky_irradiance(world.sky, n) * open_share


@wp.func
def ambient_reflection(world: records.World, p: wp.vec3, d: wp.vec3, roughness: float):
    """Radiance averaged over the lobe of a roughness around a mirrored direction."""
    # Walls are near and even: the light of a hemisphere of them approximates any lobe.
    light, weight = light_of_volumes(world, p, d)
    if weight == 0.0:
        light = environment_lighting.sky_reflection(world.sky, d, roughness)
    return light
