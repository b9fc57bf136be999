"""City buses of 12 m; dimensions after Directive 96/53/EC and common low-floor models."""

from __future__ import annotations

import numpy as np

from generator.assets.procedural import hulls
from generator.assets.procedural.draw import between, chance, pick, rng_of
from generator.assets.procedural.family import Facts, Solid
from generator.assets.procedural.materials import linear
from generator.assets.procedural.mesh import Patch, joined
from generator.assets.procedural.shapes import block
from generator.assets.scenery.forms import solid
from generator.assets.vehicles import shell
from generator.assets.vehicles.materials import SIDES, Slot, materials
from generator.assets.vehicles.shell import Row, above, below, painted_where
from generator.assets.vehicles.wheels import Axles

_LIVERIES = (
    ("#e9e8e3", "#2458a6"), ("#f2c318", "#33383c"), ("#c3221f", "#e9e8e3"), ("#2f7d4a", "#e9e8e3"),
    ("#1f4f91", "#e9e8e3"), ("#e9e8e3", "#c3221f"),
)  # fmt: skip
_FLOOR_M = 0.26
_HALF_M = 1.275
# Share of the height, how far front and rear stand back [m], share of the half width.
_ROWS = (
    (0.0, 0.1, 0.1, 0.97), (0.03, 0.02, 0.02, 0.995), (0.1, 0.0, 0.0, 1.0), (0.2, 0.0, 0.0, 1.0),
    (0.32, 0.01, 0.0, 1.0), (0.6, 0.06, 0.01, 1.0), (0.84, 0.12, 0.03, 0.995),
    (0.94, 0.16, 0.05, 0.985), (0.98, 0.22, 0.1, 0.95), (1.0, 0.32, 0.2, 0.86),
)  # fmt: skip


def bus(seed: int) -> Solid:
    """A city bus with its doors on the right. Slots and keypoints as every vehicle's."""
    rng = rng_of("bus", seed)
    x, top = 0.5 * between(11.2, 12.2, rng), between(2.95, 3.08, rng)
    axles = Axles(x - 2.72, -x + 3.35, 1.08, 0.48, 0.29, 0.56, 0)
    livery = pick(_LIVERIES, rng)
    body = _body(x, top, axles, striped=chance(0.6, rng))
    body = _doors(body, (x - 0.55, x - 6.0, *((x - 9.6,) if chance(0.5, rng) else ())), top)
    parts = [body, *(shell.unmapped(p) for p in [*axles.wheels(0.0), *_fitted(x, top)])]
    colors = [linear(code) for code in livery]
    hull = [
        hulls.box((-x, -_HALF_M, _FLOOR_M), (x, _HALF_M, top)),
        hulls.box((axles.rear_m - 0.48, -1.1, 0.0), (axles.front_m + 0.48, 1.1, _FLOOR_M)),
    ]
    points = axles.keypoints((x - 0.1, 0.95, 0.72), (-x + 0.06, 1.1, 1.1))
    return solid([joined(parts)], materials(rng, colors[0], colors[1]), hull, points)


def bus_facts(**_: object) -> Facts:
    """Its kind."""
    return Facts("city_bus")


def _body(x: float, top: float, axles: Axles, *, striped: bool) -> Patch:
    ring = shell.plan((40.0, 3.6), (60.0, 7.0), sides=16)
    rows = [Row(rise, x - front, -x + rear, share * _HALF_M) for rise, front, rear, share in _ROWS]

    def level(height_m: float) -> shell.Curve:
        return lambda at: np.full_like(at, height_m)

    half = shell.stack(ring, rows, level(_FLOOR_M), level(top - 0.04), crown_m=0.04, lid_rows=2)
    half = painted_where(half, Slot.UNDERBODY, *shell.rows_between(-2.0, 0.0))
    half = _painted(half, ring, top, striped=striped)
    around = [hub + 0.28 * k for hub in (axles.front_m, axles.rear_m) for k in (-2, -1, 0, 1, 2)]
    near = (half.corners_m[..., 2].min(axis=1) < 1.1) & (half.corners_m[..., 1].max(axis=1) > 0.9)
    low = shell.refined(shell.taken(half, near), "x", around)
    low, wells = axles.wells(low, _HALF_M)
    return shell.whole(joined([shell.taken(half, ~near), low, *wells]), SIDES)


def _painted(half: Patch, ring: shell.Plan, top: float, *, striped: bool) -> Patch:
    """Stripe, windows, lamps."""
    if striped:
        half = painted_where(half, Slot.SECOND_PAINT, *shell.between("z", 0.55, 0.95))
    half = painted_where(half, Slot.TRIM, *shell.rows_between(0.0, 0.5), below("z", 0.36))
    corner, tail = ring.front(0.92), ring.rear(0.92)
    front = (*shell.along(-1.0, corner), above("x", 0.0))
    half = painted_where(half, Slot.GLASS, *front, *shell.between("z", 0.98, top - 0.12))
    rear = (*shell.along(ring.rear(0.84), 2.0), below("x", 0.0))
    half = painted_where(half, Slot.GLASS, *rear, *shell.between("z", 1.75, top - 0.45))
    side = (*shell.along(corner + 0.004, tail - 0.003), *shell.between("z", 1.12, top - 0.38))
    half = painted_where(half, Slot.GLASS, *side)
    lamp = (*shell.along(ring.front(0.6), corner), *shell.between("z", 0.62, 0.82), above("x", 0.0))
    half = painted_where(half, Slot.HEADLIGHT, *lamp)
    wink = (*shell.along(ring.front(0.84), corner), *shell.between("z", 0.82, 0.88), above("x", 0))
    half = painted_where(half, Slot.INDICATOR_LEFT, *wink)
    for slot, low, high in (
        (Slot.TAILLIGHT, 1.0, 1.18),
        (Slot.BRAKELIGHT, 1.18, 1.32),
        (Slot.INDICATOR_LEFT, 1.32, 1.44),
    ):
        lens = (*shell.along(tail, ring.rear(0.78)), *shell.between("z", low, high), below("x", 0))
        half = painted_where(half, slot, *lens)
    return half


def _doors(body: Patch, fronts_m: tuple[float, ...], top: float) -> Patch:
    """Glazed double doors on the right side."""
    for front in fronts_m:
        for k in (0, 1):
            leaf = shell.between("x", front - 0.62 * (k + 1) + 0.03, front - 0.62 * k - 0.02)
            body = painted_where(
                body, Slot.GLASS, below("y", -0.9), *leaf, *shell.between("z", 0.4, top - 0.45)
            )
    return body


def _fitted(x: float, top: float) -> list[Patch]:
    """Pillars, display, mirrors, plates, cooling unit."""
    parts = [
        block((x - 0.35, -0.75, top - 0.37), (x - 0.105, 0.75, top - 0.15), 0.0, Slot.TRIM),
        block((x - 0.03, -0.26, 0.42), (x + 0.006, 0.26, 0.53), 0.0, Slot.PLATE),
        block((-x - 0.006, -0.26, 0.62), (-x + 0.05, 0.26, 0.73), 0.0, Slot.PLATE),
        block((-1.6, -0.85, top - 0.05), (1.2, 0.85, top + 0.12), 0.05, Slot.PAINT),
    ]
    for sign in (1.0, -1.0):
        y = sign * 1.36
        parts.append(block((x + 0.02, y - 0.11, 1.75), (x + 0.14, y + 0.11, 2.2), 0.04, Slot.TRIM))
        arm = sorted((sign * 1.1, y))
        parts.append(block((x - 0.3, arm[0], 2.2), (x + 0.1, arm[1], 2.25), 0.0, Slot.TRIM))
        for k in range(1, 7):
            at, edge = x - 0.9 - 1.45 * k, sorted((sign * 1.2, sign * (_HALF_M + 0.003)))
            parts.append(block((at - 0.03, edge[0], 1.13), (at + 0.03, edge[1], top - 0.39), 0.0,
                               Slot.TRIM))  # fmt: skip
    return parts
