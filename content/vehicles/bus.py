"""City buses of 12 m.

At most 2.55 m wide (Directive 96/53/EC as amended by 2002/7/EC, by Parliament's summary); floors
and doors of common low-floor models, assumed, 10 %.
"""

from gen_data.assets.family import Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.material_presets import hex_to_linear
from gen_data.content.procedural.patches import Patch, join_patches
from gen_data.content.procedural.surface_shapes import block
from gen_data.content.scenery.basic_shapes import make_solid
from gen_data.content.vehicles.body_shell import (
    BodyOutline,
    body_rows,
    drop_uvs,
    level_height,
    mirror_half,
    paint,
    plan,
    refine_patch,
    stack,
    take_triangles,
)
from gen_data.content.vehicles.vehicle_materials import COLORS, SIDES, materials
from gen_data.content.vehicles.vehicle_materials import VehicleSlot as Slot
from gen_data.content.vehicles.wheels import Axles
from gen_data.core.variant_rng import VariantRng

_FLOOR_M = 0.26
_HALF_M = 1.275


def bus(rng: VariantRng) -> Solid:
    """A city bus with its doors on the right. Slots and keypoints as for all vehicles."""
    x, top = 0.5 * rng.between(11.2, 12.2, "depth_m"), rng.between(2.95, 3.08, "top_m")
    axles = Axles(x - 2.72, -x + 3.35, 1.08, 0.48, 0.29, 0.56, "truck")
    livery = rng.choose(COLORS["liveries"]).split()
    body = _body(x, top, axles, striped=rng.chance(0.6, "striped"))
    body = _doors(body, (x - 0.55, x - 6.0, *((x - 9.6,) if rng.chance(0.5) else ())), top)
    shell = [body, *(drop_uvs(p) for p in axles.wheels(0.0))]
    parts = [*shell, *_fittings(x, top, mirrors=True)]
    colors = [hex_to_linear(code) for code in livery]
    hull = [
        hulls.box((-x, -_HALF_M, _FLOOR_M), (x, _HALF_M, top)),
        hulls.box((axles.rear_m - 0.48, -1.1, 0.0), (axles.front_m + 0.48, 1.1, _FLOOR_M)),
    ]
    points = axles.keypoints((x - 0.1, 0.95, 0.72), (-x + 0.06, 1.1, 1.1))
    finish, bare = materials(rng, colors[0], colors[1]), _fittings(x, top, mirrors=False)
    return make_solid(parts, finish, hull, points, [*shell, *bare])


def _body(x: float, top: float, axles: Axles, *, striped: bool) -> Patch:
    ring = plan((40.0, 3.6), (60.0, 7.0), sides=16)
    rows = body_rows("bus", x, -x, _HALF_M)
    low, high = level_height(_FLOOR_M), level_height(top - 0.04)
    half = stack(ring, rows, low, high, crown_m=0.04, lid_rows=2)
    half = paint(half, Slot.UNDERBODY, row=(-2.0, 0.0))
    half = _paint_body(half, ring, top, striped=striped)
    around = [hub + 0.28 * k for hub in (axles.front_m, axles.rear_m) for k in (-2, -1, 0, 1, 2)]
    near = (half.corners_m[..., 2].min(axis=1) < 1.1) & (half.corners_m[..., 1].max(axis=1) > 0.9)
    cut, wells = axles.wells(refine_patch(take_triangles(half, near), "x", around), _HALF_M)
    return mirror_half(join_patches([take_triangles(half, ~near), cut, *wells]), SIDES)


def _paint_body(half: Patch, ring: BodyOutline, top: float, *, striped: bool) -> Patch:
    if striped:
        half = paint(half, Slot.SECOND_PAINT, z=(0.55, 0.95))
    half = paint(half, Slot.TRIM, row=(0.0, 0.5), z=(None, 0.36))
    corner, tail, front, rear = ring.front(0.92), ring.rear(0.92), (0.0, None), (None, 0.0)
    half = paint(half, Slot.GLASS, ring=(-1.0, corner), x=front, z=(0.98, top - 0.12))
    half = paint(half, Slot.GLASS, ring=(ring.rear(0.84), 2.0), x=rear, z=(1.75, top - 0.45))
    half = paint(half, Slot.GLASS, ring=(corner + 0.004, tail - 0.003), z=(1.12, top - 0.38))
    half = paint(half, Slot.HEADLIGHT, ring=(ring.front(0.6), corner), z=(0.62, 0.82), x=front)
    wink = (ring.front(0.84), corner)
    half = paint(half, Slot.INDICATOR_LEFT, ring=wink, z=(0.82, 0.88), x=front)
    for slot, *z in (
        (Slot.TAILLIGHT, 1.0, 1.18),
        (Slot.BRAKELIGHT, 1.18, 1.32),
        (Slot.INDICATOR_LEFT, 1.32, 1.44),
    ):
        half = paint(half, slot, ring=(tail, ring.rear(0.78)), z=(z[0], z[1]), x=rear)
    return half


def _doors(body: Patch, fronts_m: tuple[float, ...], top: float) -> Patch:
    for front in fronts_m:
        for k in (0, 1):
            leaf = (front - 0.62 * (k + 1) + 0.03, front - 0.62 * k - 0.02)
            body = paint(body, Slot.GLASS, y=(None, -0.9), x=leaf, z=(0.4, top - 0.45))
    return body


def _fittings(x: float, top: float, *, mirrors: bool) -> list[Patch]:
    parts = [
        block((x - 0.35, -0.75, top - 0.37), (x - 0.105, 0.75, top - 0.15), 0.0, Slot.TRIM),
        block((x - 0.03, -0.26, 0.42), (x + 0.006, 0.26, 0.53), 0.0, Slot.PLATE),
        block((-x - 0.006, -0.26, 0.62), (-x + 0.05, 0.26, 0.73), 0.0, Slot.REAR_PLATE),
        block((-1.6, -0.85, top - 0.05), (1.2, 0.85, top + 0.12), 0.05, Slot.PAINT),
    ]
    for sign in (1.0, -1.0):
        parts += _mirror(x, sign) if mirrors else []
        for k in range(1, 7):
            at, edge = x - 0.9 - 1.45 * k, sorted((sign * 1.2, sign * (_HALF_M + 0.003)))
            parts.append(block((at - 0.03, edge[0], 1.13), (at + 0.03, edge[1], top - 0.39), 0.0,
                               Slot.TRIM))  # fmt: skip
    return [drop_uvs(part) for part in parts]


def _mirror(x: float, sign: float) -> list[Patch]:
    """The exterior mirror of the left (1) or right (-1) side, and its arm."""
    y = sign * 1.36
    arm = sorted((sign * 1.1, y))
    return [
        block((x + 0.02, y - 0.11, 1.75), (x + 0.14, y + 0.11, 2.2), 0.04, Slot.TRIM),
        block((x - 0.3, arm[0], 2.2), (x + 0.1, arm[1], 2.25), 0.0, Slot.TRIM),
    ]
