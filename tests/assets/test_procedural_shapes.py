"""Shape generators against formulas of solid geometry."""

import math

import numpy as np
import pytest

from gen_data.content.procedural import surface_shapes
from gen_data.content.procedural.patches import CREASE_DEG, Patch, finish_mesh, join_patches
from gen_data.core.asset_types import Material


def test_cylinders_helices_and_rings_have_the_volumes_of_their_formulas() -> None:
    """Of a regular polygon with as many sides, exactly."""
    radius, height, sides = 0.03, 0.1, 24
    area = 0.5 * sides * radius**2 * math.sin(2 * math.pi / sides)
    assert _volume(surface_shapes.cone((radius, 0.0), (radius, height), sides)) == pytest.approx(
        area * height
    )
    t = np.linspace(0.0, 4 * math.pi, 80)
    path = np.stack([np.cos(t), np.sin(t), 0.2 * t], axis=1)
    tube = surface_shapes.sweep(path, surface_shapes.circle(0.1, 12))
    assert _volume(tube) == pytest.approx(
        math.pi * 0.01 * 4 * math.pi * math.hypot(1, 0.2), rel=0.06
    )
    # Holes are holes, however many and however they are wound.
    outer, hole = surface_shapes.circle(0.05, 40), surface_shapes.circle(0.01, 16)
    holes = [hole, hole[::-1] + np.array([0.03, 0.0]),
             surface_shapes.circle(0.006, 12, (-0.02, 0.025))]  # fmt: skip
    area = _area(outer) - 2 * _area(hole) - _area(holes[2])
    assert _volume(surface_shapes.extrude(outer, 0.02, holes=holes)) == pytest.approx(area * 0.02)
    cylinder = surface_shapes.cone((0.1, 0.0), (0.05, 0.3), 16)
    both = join_patches([cylinder, cylinder.rotated("x", 0.7).moved(1.0, 2.0, 3.0).painted(1)])
    assert _volume(both) == pytest.approx(2 * _volume(cylinder))
    assert set(both.slots.tolist()) == {0, 1}
    assert _volume(cylinder.flipped()) == pytest.approx(-_volume(cylinder))


def test_a_lathe_puts_the_middle_of_the_image_at_plus_x_and_grain_along_boards() -> None:
    """U = 1/2 at +X, and grows towards +Y: to the right of a viewer who looks at -X."""
    patch = surface_shapes.lathe([(1.0, 0.0), (1.0, 1.0)], 32)
    points, uvs = patch.corners_m.reshape(-1, 3), patch.uvs.reshape(-1, 2)
    front = points[np.abs(uvs[:, 0] - 0.5) < 1e-9]
    assert np.allclose(front[:, :2], (1.0, 0.0))
    right = points[np.abs(uvs[:, 0] - 0.75) < 1e-9]
    assert np.allclose(right[:, :2], (0.0, 1.0), atol=1e-9)
    assert np.allclose(points[:, 2], uvs[:, 1])
    # A board along Y and one along Z have u along their length, in repeats of twice 0.5 m.
    for size in ((0.1, 1.0, 0.02), (0.1, 0.02, 1.0)):
        patch = surface_shapes.map_along_grain(surface_shapes.block((0.0, 0.0, 0.0), size), 0.5)
        axis = int(np.argmax(size))
        long = np.ptp(patch.corners_m[:, :, axis], axis=1) > 0.5
        du = np.ptp(patch.uvs[long, :, 0], axis=1)
        assert np.allclose(du, 1.0)


def test_rounded_boxes_lose_their_corners_and_fillets_touch_both_sides() -> None:
    """Volume by Steiner's formula for a box with rounded edges."""
    a, b, c, r = 0.06, 0.04, 0.02, 0.005
    x, y, z = a - 2 * r, b - 2 * r, c - 2 * r
    steiner = x * y * z + 2 * r * (x * y + y * z + z * x) + math.pi * r**2 * (x + y + z)
    steiner += 4 / 3 * math.pi * r**3
    patch = surface_shapes.rounded_box((a, b, c), r, 6)
    low, high = patch.bounds_m()
    assert np.allclose(high - low, (a, b, c))
    assert _volume(patch) == pytest.approx(steiner, rel=0.003)
    with pytest.raises(ValueError, match="outside"):
        surface_shapes.triangulate(
            surface_shapes.circle(1.0, 8), [surface_shapes.circle(0.2, 8, (3.0, 0.0))[::-1]]
        )
    # The arc's points are at the radius from the centre of the rounded corner.
    line = surface_shapes.fillet([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)], [0.0, 0.25, 0.0], 8)
    arc = np.array(line[1:-1])
    assert np.allclose(np.hypot(arc[:, 0] - 0.75, arc[:, 1] - 0.25), 0.25)
    assert np.allclose(arc[0], (0.75, 0.0))
    assert np.allclose(arc[-1], (1.0, 0.25))
    points = [(0.0, 0.0), (1.0, 2.0), (2.0, -1.0), (3.0, 0.5)]
    assert np.allclose(surface_shapes.spline(points, 31)[::10], points)


def test_meshes_have_creases_at_edges_only_and_no_degenerate_triangles() -> None:
    """Their normals lean by less than two degrees, or large faces would look like pillows."""
    mesh = finish_mesh(
        surface_shapes.block((0.0, 0.0, 0.0), (1.0, 0.6, 0.03), 0.003), [Material()], CREASE_DEG
    )
    top = mesh.normals[(mesh.vertices_m[:, 2] > 0.0299) & (mesh.normals[:, 2] > 0.8)]
    assert len(top)
    assert math.degrees(math.acos(float(top[:, 2].min()))) < 2.0
    # Creases have one normal per face; smooth surfaces one per vertex.
    box = finish_mesh(surface_shapes.block((0, 0, 0), (1, 1, 1)), [Material()], CREASE_DEG)
    sphere = finish_mesh(surface_shapes.ball(lambda d: d, 12, 24), [Material()], CREASE_DEG)
    assert len(box.vertices_m) == 24
    assert {tuple(n) for n in np.abs(box.normals).tolist()} == {(1, 0, 0), (0, 1, 0), (0, 0, 1)}
    assert np.allclose((sphere.normals * sphere.vertices_m).sum(axis=1), 1.0, atol=0.01)
    # Vertices on both sides of the seam have one normal.
    mesh = finish_mesh(surface_shapes.lathe([(0.1, 0.0), (0.1, 0.2)], 24), [Material()], CREASE_DEG)
    seam = (mesh.vertices_m[:, 0] < -0.0999) & (mesh.vertices_m[:, 2] < 1e-6)
    assert seam.sum() == 2
    assert np.allclose(mesh.normals[seam], (-1.0, 0.0, 0.0), atol=1e-5)
    rings, segments = 6, 12
    mesh = finish_mesh(surface_shapes.ball(lambda d: d, rings, segments), [Material()], CREASE_DEG)
    assert len(mesh.faces) == 2 * segments * (rings - 1)


@pytest.mark.parametrize("teeth", [5, 9, 16])
def test_triangles_of_a_star_cover_it_exactly(teeth: int) -> None:
    """All wound alike, and their areas add up to the polygon's."""
    turn = np.pi * np.arange(2 * teeth) / teeth
    reach = np.where(np.arange(2 * teeth) % 2 == 0, 1.0, 0.45)
    star = np.stack([reach * np.cos(turn), reach * np.sin(turn)], axis=1)
    triangles = surface_shapes.triangulate(star, [surface_shapes.circle(0.2, 7)[::-1]])
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    areas = 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    assert (areas > 0).all()
    assert areas.sum() == pytest.approx(_area(star) - _area(surface_shapes.circle(0.2, 7)))


def _volume(patch: Patch) -> float:
    a, b, c = (patch.corners_m[:, i] for i in range(3))
    return float((a * np.cross(b, c)).sum() / 6.0)


def _area(loop: np.ndarray) -> float:
    x, y = loop[:, 0], loop[:, 1]
    return abs(0.5 * float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum()))
