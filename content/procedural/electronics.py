"""Telephones, remote controls, mice and keyboards, lying as they are used, along X.

Sizes of common devices (assumed, within 8 %).
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.material_presets import (
    ALUMINIUM,
    PLASTICS,
    draw_linear,
    metal_material,
    painted_material,
    plastic_material,
    printed_material,
)
from gen_data.content.procedural.patches import Array, Patch, join_patches, make_centred_solid
from gen_data.core import asset_types, se3
from gen_data.core.variant_rng import VariantRng

_GREYS = ("#1d1d1f", "#26282b", "#3a3c40", "#0f1012")
_BODIES = ("#1d1d1f", "#26282b", "#e6e6e4", "#c9ccd0", "#2f3f55", "#b8a9c9", "#a9c0b0", "#d9c2b0")
# Columns and rows of the letters on keys, as textures.device_faces.key_legends lays them out.
KEY_CELLS = 8


def cell_phone(rng: VariantRng) -> Solid:
    """A telephone with its screen up. Slots: body, screen, back, lenses, buttons."""
    length, width = rng.between(0.138, 0.166, "length_m"), rng.between(0.067, 0.078, "width_m")
    thick, corner = rng.between(0.0072, 0.0092, "thickness_m"), rng.between(0.005, 0.0125)
    has_case = rng.chance(0.4, "has_case")
    grow = 0.0016 if has_case else 0.0
    outline = rounded_rectangle(length + 2 * grow, width + 2 * grow, corner + grow)
    body = shapes.extrude(outline, thick + grow, 0.0016 + 0.4 * grow)
    bezel = rng.choose((0.0012, 0.0016, 0.003), "bezel_m")
    glass = rounded_rectangle(length - 2 * bezel, width - 2 * bezel, corner - bezel)
    top = thick + grow
    screen = shapes.extrude(glass, 0.0003, 0.0001, slot=1).moved(z=top - 0.0001)
    island, lenses = _camera_island(length, width, rng)
    buttons = [
        shapes.block(
            (x, 0.5 * width + grow - 0.0005, 0.4 * top),
            (x + w, 0.5 * width + grow + 0.0006, 0.6 * top),
            0.0004,
            4,
        )
        for x, w in ((0.02, 0.012), (0.036, 0.02))
    ]
    frame = metal_material(
        draw_linear(("#8a8d91", "#c9ccd0", "#5a5d62", "#c2a98a"), 0.05, rng), 0.3
    )
    back = plastic_material(rng, _BODIES)
    if has_case:
        frame = replace(
            plastic_material(rng, (*PLASTICS, *_GREYS, *_GREYS, *_BODIES)), roughness=0.6
        )
        back = frame
    materials = (
        frame,
        _screen_material(rng.seed, rng),
        back,
        asset_types.Material((0.01, 0.01, 0.012), 0.06, printed=True),
        frame,
    )
    half = (0.5 * length + grow, 0.5 * width + grow)
    parts = [hulls.box((-half[0], -half[1], 0.0), (half[0], half[1], top + 0.0002)),
             hulls.extreme(island.corners_m, 24)]  # fmt: skip
    return make_centred_solid(
        [body, screen, island.painted(2), *lenses, *buttons], materials, parts
    )


def _screen_material(seed: int, rng: VariantRng) -> asset_types.Material:
    """A dark screen with fingerprints, or a lit one of 100 to 500 cd/m^2 (data sheets)."""
    if rng.chance(0.5):
        return replace(
            printed_material(f"texture/phone_screen?kind=off&seed={seed}", 0.3), specular=0.6
        )
    lit = rng.between(100.0, 500.0)
    texture = f"texture/phone_screen?kind=lit&seed={seed}"
    return replace(printed_material(texture, 0.08), emission_cd_m2=(lit, lit, lit))


def _camera_island(length: float, width: float, rng: VariantRng) -> tuple[Patch, list[Patch]]:
    """A raised plate with lenses below a corner of the back."""
    count = rng.choose((1, 2, 2, 3), "count")
    wide, long = rng.choose(((0.022, 0.042), (0.032, 0.032), (0.02, 0.02)))
    centre = (-0.5 * length + 0.5 * long + 0.008, 0.5 * width - 0.5 * wide - 0.007)
    outline = rounded_rectangle(long, wide, 0.005) + np.array(centre)
    island = shapes.extrude(outline, 0.0024, 0.0004).moved(z=-0.0018)
    lenses = []
    for i in range(count):
        x = centre[0] + (i - 0.5 * (count - 1)) * min(0.013, 0.6 * long / count)
        y = centre[1] + (0.004 if count == 3 and i == 1 else 0.0)
        lens = shapes.cone((0.0052, -0.0023), (0.0052, -0.0015), 18, 3)
        lenses.append(lens.moved(x, y))
    return island, lenses


def rounded_rectangle(length: float, width: float, radius: float, steps: int = 5) -> Array:
    """Counter-clockwise outline about the origin, shape [n, 2]."""
    made = []
    for i, (sx, sy) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        turn = 0.5 * math.pi * (i + np.arange(steps + 1) / steps)
        centre = np.array([sx * (0.5 * length - radius), sy * (0.5 * width - radius)])
        made.append(centre + radius * np.stack([np.cos(turn), np.sin(turn)], axis=1))
    return np.concatenate(made)


def remote(rng: VariantRng) -> Solid:
    """A remote control, keys up, its transmitter at +X. Slots: body, keys, others, window."""
    slim = rng.chance(0.35, "slim")
    length = rng.between(0.13, 0.165, "length_m") if slim else rng.between(0.165, 0.225, "length_m")
    width = rng.between(0.034, 0.04, "width_m") if slim else rng.between(0.042, 0.055, "width_m")
    thick = rng.between(0.012, 0.022, "thickness_m")
    corner = min(rng.choose((0.005, 0.01, 0.017)), 0.45 * width)
    bevel = min(rng.choose((0.002, 0.004, 0.0055)), 0.6 * corner)
    body = shapes.extrude(rounded_rectangle(length, width, corner), thick, bevel)
    # The underside tapers, and the body is thinner at the end of the hand.
    corners = body.corners_m.copy()
    sink = 1.0 - rng.between(0.0, 0.25) * (0.5 - corners[..., 0] / length)
    corners[..., 2] = thick - (thick - corners[..., 2]) * sink
    keys = _remote_keys(length, width, slim, rng)
    rise = rng.between(0.0008, 0.0022, "rise_m")
    patches = [Patch(corners, body.uvs, body.slots)]
    for x, y, rx, ry, slot in keys:
        outline = shapes.circle(1.0, 10) * np.array([rx, ry])
        cap = shapes.extrude(outline, rise + 0.001, 0.0005, slot=slot)
        patches.append(cap.moved(x, y, thick - 0.001))
    window = shapes.block((0.5 * length - 0.001, -0.3 * width, 0.45 * thick),
                          (0.5 * length + 0.0006, 0.3 * width, 0.8 * thick), 0.0004, 3)  # fmt: skip
    materials = (
        plastic_material(rng, (*_GREYS, *_GREYS, "#d9dadb", "#8a8d91")),
        replace(plastic_material(rng, ("#4a4c50", "#8a8d91", "#d9dadb", "#2a2c30")), roughness=0.7),
        replace(plastic_material(rng, ("#c3121f", "#d9652a", "#1f6fb5", "#2e9e4f")), roughness=0.6),
        asset_types.Material((0.03, 0.005, 0.01), 0.1, printed=True),
    )
    low = float(corners[..., 2].min())
    hull = hulls.extreme(np.concatenate([patches[0].corners_m.reshape(-1, 3)]), 48)
    top = hulls.box((-0.46 * length, -0.36 * width, low + 0.6 * thick),
                    (0.46 * length, 0.36 * width, thick + rise))  # fmt: skip
    return make_centred_solid([*patches, window], materials, [hull, top])


def _remote_keys(
    length: float, width: float, slim: bool, rng: VariantRng
) -> list[tuple[float, float, float, float, int]]:
    """Centre, half axes [m] and slot of every key."""
    columns = 3 if slim or rng.chance(0.6) else 4
    pitch_y = 0.84 * width / columns
    rows = rng.whole(6, 8, "rows") if slim else rng.whole(10, 14, "rows")
    pitch_x = 0.86 * length / rows
    ring_row = int(rng.between(2, rows - 2))
    size = min(0.38 * pitch_x, 0.4 * pitch_y) * rng.between(0.85, 1.0)
    keys: list[tuple[float, float, float, float, int]] = [
        (0.44 * length, 0.3 * width, 0.8 * size, 0.8 * size, 2)
    ]
    ring = min(0.33 * width, 1.25 * pitch_x)
    x_ring = 0.36 * length - ring_row * pitch_x
    keys += [(x_ring, 0.0, 0.45 * ring, 0.45 * ring, 1)]
    for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        keys.append((x_ring + 0.78 * ring * dx, 0.78 * ring * dy, 0.24 * ring, 0.24 * ring, 1))
    for row in range(rows):
        x = 0.36 * length - row * pitch_x
        if abs(x - x_ring) < ring + size or x < -0.45 * length:
            continue
        colored = row == ring_row + 3
        for i in range(columns):
            y = (i - 0.5 * (columns - 1)) * pitch_y
            keys.append((x, y, size, 1.15 * size, 2 if colored and i == 1 else 1))
    return keys


def mouse(rng: VariantRng) -> Solid:
    """A computer mouse, its keys towards +X. Slots: shell, seams, wheel."""
    length, width = rng.between(0.096, 0.124, "length_m"), rng.between(0.056, 0.068, "width_m")
    height, flat = rng.between(0.03, 0.041, "height_m"), rng.choose((0.55, 0.7, 0.85), "flat")
    peak, waist = rng.between(-0.25, 0.1), rng.between(0.0, 0.12, "waist_m")

    def shape(d: Array) -> Array:
        x = np.sign(d[..., 0]) * np.abs(d[..., 0]) ** flat
        y = np.sign(d[..., 1]) * np.abs(d[..., 1]) ** flat
        z = np.maximum(d[..., 2], -0.22)
        crown = 1.0 - 0.35 * (x - peak) ** 2
        side = 1.0 - waist * np.exp(-((x / 0.35) ** 2))
        return np.stack([0.5 * length * x, 0.5 * width * side * y, height * z * crown], axis=2)

    shell = shapes.ball(shape, 22, 40)
    points = shell.corners_m.reshape(-1, 3)
    seam = _line_on(points, 0.0, (0.02 * length, 0.46 * length))
    wheel = shapes.cone((0.011, -0.0035), (0.011, 0.0035), 20).rotated("x", 0.5 * math.pi)
    at = seam[len(seam) // 2]
    wheel = wheel.moved(float(at[0]), 0.0, float(at[2]) - 0.0075)
    strip = np.array([[-0.0004, -0.0004], [0.0007, -0.0004], [0.0007, 0.0004], [-0.0004, 0.0004]])
    groove = shapes.sweep(seam, strip)
    patches = [shell, groove.painted(1), wheel.painted(2)]
    materials = (
        plastic_material(
            rng, (*_GREYS, *_GREYS, "#e6e6e4", "#c9ccd0", "#a8252f", "#2f4f7a", "#d9b8c0")
        ),
        painted_material("#0b0b0c", 0.6),
        replace(plastic_material(rng, _GREYS), roughness=0.75),
    )
    return make_centred_solid(patches, materials, [hulls.extreme(points)])


def _line_on(points: Array, y: float, span: tuple[float, float]) -> Array:
    """A line over the top of a shell at one y, from one x to another, shape [13, 3]."""
    near = points[(np.abs(points[:, 1] - y) < 0.004) & (points[:, 2] > 0.0)]
    order = near[np.argsort(near[:, 0], kind="stable")]
    x = np.linspace(*span, 13)
    z = np.array([float(order[np.argsort(np.abs(order[:, 0] - v))[:6], 2].max()) for v in x])
    smooth = np.convolve(np.pad(z, 1, mode="edge"), [0.25, 0.5, 0.25], mode="valid")
    return np.stack([x, np.full_like(x, y), smooth], axis=1)


@dataclass(frozen=True, slots=True)
class _Layout:
    """Keys of a keyboard: columns of the main block, and whether a block of digits follows."""

    columns: int
    rows: int
    digits: bool


def keyboard(rng: VariantRng) -> Solid:
    """A computer keyboard; its user sits at +X. Slots: case, keys, others."""
    layout = _Layout(15, rng.choose((5, 6, 6)), rng.chance(0.5))
    pitch = rng.between(0.0182, 0.0192, "pitch_m")
    columns = layout.columns + (4.4 if layout.digits else 0.0)
    margin, flat = rng.between(0.004, 0.012), rng.chance(0.45, "flat")
    width, depth = columns * pitch + 2 * margin, layout.rows * pitch + 2 * margin
    thick = (
        rng.between(0.005, 0.008, "thickness_m")
        if flat
        else rng.between(0.014, 0.022, "thickness_m")
    )
    outline = rounded_rectangle(depth, width, rng.choose((0.003, 0.007, 0.012), "radius_m"))
    case = shapes.extrude(outline, thick, 0.0015)
    caps = _key_caps(layout, pitch, 0.0022 if flat else rng.between(0.006, 0.009, "height_m"), rng)
    keys = caps.moved(-0.5 * depth + margin, -0.5 * width + margin, thick - 0.0008)
    slope = rng.between(0.0, 0.09, "slope")
    patches = [patch.rotated("y", slope) for patch in (case, keys)]
    dark = rng.chance(0.65)
    codes = _GREYS if dark else ("#e6e6e4", "#d9dadb", "#c9ccd0")
    body = plastic_material(rng, codes)
    if rng.chance(0.2):
        body = metal_material(ALUMINIUM, 0.35)
    shade = "dark" if dark else "light"
    legends = printed_material(f"texture/key_legends?kind={shade}&seed={rng.seed}", 0.5)
    accent = replace(
        body, metallic=0.0, base_color=draw_linear(PLASTICS if rng.chance(0.2) else codes, 0.1, rng)
    )
    parts = [hulls.extreme(patch.corners_m, 40) for patch in patches]
    return make_centred_solid(patches, (body, legends, accent), parts)


def _key_caps(layout: _Layout, pitch: float, height: float, rng: VariantRng) -> Patch:
    """Tapered caps from the far left corner, rows along +X, columns along +Y."""
    taper, gap = rng.between(0.82, 0.94, "taper"), rng.between(0.0012, 0.0022, "gap_m")
    made, letter = [], 0
    for row in range(layout.rows):
        y = 0.0
        for wide in _row_of_keys(row, layout):
            low = (row * pitch + gap / 2, y * pitch + gap / 2, 0.0)
            size = (pitch - gap, wide * pitch - gap, height)
            if wide > 0.0:
                made.append(_key_cap(low, size, taper, letter % (KEY_CELLS * KEY_CELLS)))
                letter += 1
            y += abs(wide)
    return join_patches(made).painted(1)


def _row_of_keys(row: int, layout: _Layout) -> tuple[float, ...]:
    """Widths of the keys of a row in pitches; negative = a gap."""
    last = row == layout.rows - 1
    main: tuple[float, ...] = (1.0,) * 13 + (2.0,)
    if last:
        main = (1.25, 1.25, 1.25, 6.25, 1.25, 1.25, 1.25, 1.25)
    elif row == layout.rows - 2:
        main = (2.25, *(1.0,) * 10, 1.75, 1.0)
    elif row == layout.rows - 3:
        main = (1.75, *(1.0,) * 11, 2.25)
    elif row == layout.rows - 4:
        main = (1.5, *(1.0,) * 12, 1.5)
    block = (-0.4, 1.0, 1.0, 1.0, 1.0) if layout.digits else ()
    return (*main, *block)


def _key_cap(low: se3.Vec3, size: se3.Vec3, taper: float, letter: int) -> Patch:
    """A truncated pyramid; its top shows the cell of one letter, its sides the cell's corner."""
    x0, y0, z0 = low
    dx, dy, dz = size
    inset = 0.5 * (1.0 - taper) * dx
    foot = np.array([(x0, y0, z0), (x0 + dx, y0, z0), (x0 + dx, y0 + dy, z0), (x0, y0 + dy, z0)])
    move = np.array([(inset, inset, dz), (-inset, inset, dz), (-inset, -inset, dz),
                     (inset, -inset, dz)])  # fmt: skip
    top = foot + move
    quads = [(top[0], top[1], top[2], top[3]), (foot[3], foot[2], foot[1], foot[0])]
    for i in range(4):
        j = (i + 1) % 4
        quads.append((foot[i], foot[j], top[j], top[i]))
    corners = np.array([[(a, b, c), (a, c, d)] for a, b, c, d in quads]).reshape(-1, 3, 3)
    u, v = letter % KEY_CELLS / KEY_CELLS, 1.0 - (letter // KEY_CELLS + 1) / KEY_CELLS
    side = 1.0 / KEY_CELLS
    plain = np.broadcast_to(np.array([u + 0.04 * side, v + 0.04 * side]), (12, 3, 2)).copy()
    # The letter stands upright for a user at +X: image up is -X, image right is +Y.
    placed = {0: (0.0, 1.0), 1: (0.0, 0.0), 2: (1.0, 0.0), 3: (1.0, 1.0)}
    for t, triangle in enumerate(((0, 1, 2), (0, 2, 3))):
        for k, i in enumerate(triangle):
            plain[t, k] = (u + side * placed[i][0], v + side * placed[i][1])
    return Patch(corners, plain, np.zeros(12, dtype=np.int64))
