"""Cars and vans: lower body with hood, glass house, and fittings."""

from dataclasses import dataclass, replace

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.patches import Array, Patch, join_patches
from gen_data.content.procedural.surface_shapes import Point2, block
from gen_data.content.scenery.basic_shapes import make_solid
from gen_data.content.vehicles import body_shell, car_ends, car_fittings, car_interior
from gen_data.content.vehicles.body_shell import (
    BODY_ROWS,
    BodyOutline,
    Row,
    body_rows,
    level_height,
    paint,
)
from gen_data.content.vehicles.car_design import Design
from gen_data.content.vehicles.vehicle_materials import SIDES
from gen_data.content.vehicles.vehicle_materials import VehicleSlot as Slot
from gen_data.core.asset_types import Keypoint, Material

PANES_OPACITY = 0.5
"""Windscreens let at least 70 % of the light through (UN Regulation 43), tinted rear panes a
fifth: half is assumed for all, with the dark tint of the slot."""
_CUT = len(Slot)
"""Slot of triangles that are taken away."""


@dataclass(frozen=True)
class Additions:
    """Additions to the design of a vehicle.

    Attributes:
        image_m: Shares of the length (front, rear) and heights (low, high) of the image on either
            side; None = none.
        parts: Parts that are not mirrored, such as roof signs and beacons.
    """

    image_m: tuple[Point2, Point2] | None = None
    parts: tuple[Patch, ...] = ()


def make_vehicle(
    design: Design,
    steer_deg: float,
    finish: tuple[Material, ...],
    additions: Additions = Additions(),
) -> Solid:
    """The vehicle of a design with steered front wheels."""
    panels = _panels(design, additions)
    half = [*panels, *car_ends.fit_ends(design), *car_fittings.fit_side(design)]
    whole = [
        *car_ends.fit_middle(design),
        *car_fittings.fit_wipers(design),
        *car_fittings.fit_extras(design),
        *car_interior.fit_interior(design),
        *design.axles.wheels(steer_deg),
        *additions.parts,
    ]
    middle = [body_shell.drop_uvs(patch) for patch in whole]
    beyond = [body_shell.drop_uvs(patch) for patch in car_fittings.fit_antenna(design)]

    def both_sides(left: list[Patch], others: list[Patch]) -> list[Patch]:
        return [body_shell.mirror_half(join_patches(left), SIDES), *others]

    body = both_sides(half, middle)
    mirrors = list(car_fittings.fit_mirror(design))
    shown = both_sides([*panels, *mirrors, *half[len(panels) :]], [*middle, *beyond])
    # Only cars have something to see behind their panes.
    clear = tuple(
        replace(m, opacity=PANES_OPACITY) if k == Slot.GLASS else m for k, m in enumerate(finish)
    )
    return make_solid(shown, clear, _collision(design), _keypoints(design), body)


def _panels(design: Design, additions: Additions) -> list[Patch]:
    """Lower body and glass house, left half."""
    ring = body_shell.plan(*design.body_ends, sides=20)
    plain = _lower(design, ring)
    lower, wells = design.axles.wells(_lower_paint(design, ring, plain), design.half_m)
    gaps = _gaps(design, design.axles.wells(plain, design.half_m)[0])
    house = _house(design)
    if design.bed:
        lower, bed = _open_bed(design, lower)
        wells = [*wells, bed]
    if additions.image_m:
        (front, rear), heights_m = additions.image_m
        place = ((design.x(rear), design.x(front)), heights_m)
        lower, house = (
            body_shell.print_side(part, *place, *body_shell.levels(y=(0.5 * design.half_m, None)))
            for part in (lower, house)
        )
    return [lower, *wells, *gaps, house]


def _open_bed(design: Design, lower: Patch) -> tuple[Patch, Patch]:
    """The body with its lid cut open behind the cab, and the left half of a box in the hole."""
    ends = (design.x(0.975), design.x(design.bed))
    half, floor = 0.86 * design.half_m, 0.72 * design.tail_m
    flat = body_shell.paint(lower, _CUT, y=(None, half), x=ends, row=(1.0, None))
    rim = design.tail_m + 0.01
    walls = block((ends[0], -half, floor), (ends[1], half, rim + 0.2), 0.0, Slot.PLASTIC).flipped()
    bed, _, _ = body_shell.split_patch(walls, lambda p: rim - p.corners_m[..., 2])
    left, _, _ = body_shell.split_patch(bed, lambda p: p.corners_m[..., 1])
    return body_shell.take_triangles(flat, flat.slots != _CUT), left


def _collision(design: Design) -> list[Array]:
    x, y, axles = 0.5 * design.length_m, design.half_m, design.axles
    house = 0.5 * (1.0 + design.roof_share) * 0.92 * y
    front, rear = (
        design.x(0.5 * (design.cowl + design.header)),
        design.x(0.5 * (design.roof_end + design.rear_base)),
    )
    return [
        hulls.box((-x, -y, design.clearance_m), (x, y, design.belt_m)),
        hulls.box((rear, -house, design.belt_m), (front, house, design.height_m)),
        hulls.box((axles.rear_m - axles.radius_m, -0.9 * y, 0.0),
                  (axles.front_m + axles.radius_m, 0.9 * y, design.clearance_m)),
    ]  # fmt: skip


def _keypoints(design: Design) -> tuple[Keypoint, ...]:
    return design.axles.keypoints(*car_ends.lamp_points(design))


def _lower(design: Design, ring: BodyOutline) -> Patch:
    x, y = 0.5 * design.length_m, design.half_m
    rows = body_rows(design.rows, x, -x, y)
    floor = level_height(design.clearance_m)
    body = body_shell.stack(ring, rows, floor, design.shoulder(), crown_m=0.055, lid_rows=2)
    # The part under the glass house is hidden.
    hidden = np.all(
        (body.uvs[..., 1] >= 1.0)
        & (body.corners_m[..., 0] < design.x(design.cowl) - 0.35)
        & (body.corners_m[..., 0] > design.x(design.rear_base) + 0.2)
        & (body.corners_m[..., 1] < 0.8 * y),
        axis=1,
    )
    return body_shell.take_triangles(body, ~hidden)


def _lower_paint(design: Design, ring: BodyOutline, patch: Patch) -> Patch:
    """Bumpers, lamps, grille and the gaps around doors and lids."""
    x, floor = 0.5 * design.length_m, design.clearance_m
    sill = floor + (0.15 if design.cladding else 0.07)
    patch = paint(patch, Slot.UNDERBODY, row=(-2.0, 0.0))
    patch = paint(patch, Slot.TRIM, row=(0.0, 2.0), z=(None, sill))
    if design.cladding:
        axles = design.axles
        for x_m in (axles.front_m, axles.rear_m):
            arch = body_shell.round_x_z(x_m, axles.radius_m, axles.arch_m + 0.055, 0.4)
            patch = paint(patch, Slot.TRIM, arch, row=(0.0, 1.0))
    patch = car_ends.paint_ends(design, ring, patch)
    hood = (x - 0.3, design.x(design.cowl) + 0.1)
    return paint(patch, Slot.TRIM, row=(0.975, 0.988), x=hood)


def _gaps(design: Design, plain: Patch) -> list[Patch]:
    return [
        body_shell.gap(plain, design.x(share), 0.009, Slot.TRIM, row=(0.1, 0.99), y=(0.5, None))
        for share in design.seams
    ]


def _house(design: Design) -> Patch:
    ring = body_shell.plan(*design.house_ends, sides=10)
    crown, shoulder = 0.035, design.shoulder()
    wide = design.waist_share * design.half_m
    narrow = design.roof_share * design.half_m
    x = [design.x(s) for s in (design.cowl, design.header, design.roof_end, design.rear_base)]
    rows = [
        Row(rise, x[0] + front * (x[1] - x[0]), x[3] + rear * (x[2] - x[3]),
            wide + lean * (narrow - wide))
        for rise, front, rear, lean in BODY_ROWS[design.house_rows]
    ]  # fmt: skip
    top = design.height_m - crown
    middle = 0.55 * x[1] + 0.45 * x[2]
    roof = body_shell.smooth_height([(x[3], top - 0.05), (x[2], top - 0.035), (middle, top),
                          (x[1], top - 0.03), (x[0], top - 0.06)])  # fmt: skip

    def base(at: Array) -> Array:
        return shoulder(at) - 0.03

    house = body_shell.stack(ring, rows, base, roof, crown_m=crown, lid_rows=2)
    _, house, _ = body_shell.split_patch(house, lambda p: -p.uvs[..., 1])
    return _glaze(design, ring, house)


def _glaze(design: Design, ring: BodyOutline, house: Patch) -> Patch:
    def before_end(p: Patch) -> Array:
        end = design.x(design.windows_to)
        return p.corners_m[..., 0] - end + 0.25 * p.corners_m[..., 2]

    if design.soft_top:
        house = paint(house, Slot.SOFT_TOP, row=(0.02, None), x=(None, design.x(design.header)))
    screen = (-1.0, ring.front(0.83))
    house = paint(house, Slot.GLASS, ring=screen, row=(0.04, 0.91))
    # The black print around the edge of the windscreen.
    house = paint(house, Slot.TRIM, ring=screen, row=(0.04, 0.1))
    if design.rear_window:
        house = paint(house, Slot.GLASS, ring=(ring.rear(0.8), 2.0), row=(0.16, 0.87))
    side, rows = (ring.front(0.92) + 0.035, ring.rear(0.92) - 0.03), (0.09, 0.9)
    house = paint(house, Slot.GLASS, before_end, ring=side, row=rows)
    # Rubber under the side windows.
    house = paint(house, Slot.TRIM, before_end, ring=side, row=(0.075, 0.1))
    for share in design.pillars:
        post = (design.x(share) - 0.035, design.x(share) + 0.035)
        house = paint(house, Slot.TRIM, before_end, x=post, ring=side, row=rows)
    return house
