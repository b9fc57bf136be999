"""Collision parts: inside the hull, around the shape, few and small."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from gen_data.assets.convex_decomposition import convex_parts, hull_vertices
from gen_data.assets.triangle_soup import TriangleSoup, box, join_soups, sphere
from gen_data.core.errors import AssetError


def moved(corners: np.ndarray, by: tuple[float, float, float]) -> np.ndarray:
    return corners + np.array(by)


def tray() -> TriangleSoup:
    """A floor and four walls in one group, 0.4 x 0.4 x 0.1 m, 0.02 m thick."""
    parts = [box((0.4, 0.4, 0.02)), moved(box((0.02, 0.4, 0.1)), (-0.19, 0, 0.05)),
             moved(box((0.02, 0.4, 0.1)), (0.19, 0, 0.05)),
             moved(box((0.4, 0.02, 0.1)), (0, -0.19, 0.05)),
             moved(box((0.4, 0.02, 0.1)), (0, 0.19, 0.05))]  # fmt: skip
    return TriangleSoup.of(np.concatenate(parts))


def test_a_convex_solid_is_one_part_with_its_corners_and_groups_of_a_file_stay_parts() -> None:
    """A box is its eight corners. A decomposition made elsewhere is taken as it is."""
    (part,) = convex_parts(TriangleSoup.of(box((0.1, 0.2, 0.3))), "box").parts_m
    assert sorted(map(tuple, part.tolist())) == sorted(
        (x, y, z) for x in (-0.05, 0.05) for y in (-0.1, 0.1) for z in (-0.15, 0.15)
    )
    two = join_soups(
        [TriangleSoup.of(box((1, 1, 1))), TriangleSoup.of(moved(box((1, 1, 1)), (3, 0, 0)))]
    )
    parts = convex_parts(two, "two").parts_m
    assert [len(part) for part in parts] == [8, 8]


def test_a_hollow_thing_stays_hollow_and_its_parts_cover_its_surface_every_time() -> None:
    """A tray's parts leave its middle free for objects."""
    parts = convex_parts(tray(), "tray", max_parts=16).parts_m
    assert len(parts) > 4
    middle = np.array([0.0, 0.0, 0.06])
    for part in parts:
        equations = ConvexHull(part).equations
        assert (equations[:, :3] @ middle + equations[:, 3]).max() > 0.0
    # Every vertex of the solid lies in some part.
    soup = tray()
    hulls = [ConvexHull(part).equations for part in convex_parts(soup, "tray", 16).parts_m]
    points = soup.corners.reshape(-1, 3)
    outside = np.stack([(points @ e[:, :3].T + e[:, 3]).max(axis=1) for e in hulls]).min(axis=0)
    assert outside.max() < 1e-6
    one, two = (convex_parts(tray(), "tray").parts_m for _ in range(2))
    assert [p.tobytes() for p in one] == [p.tobytes() for p in two]


@pytest.mark.parametrize("limit", [8, 16, 64])
def test_large_hulls_are_simplified_from_inside(limit: int) -> None:
    """A subset of the points that fills most of the hull; more points fill more."""
    points = sphere(0.1).reshape(-1, 3)
    part = hull_vertices(points, "ball", limit)
    assert len(part) <= max(limit, 26)
    assert {tuple(p) for p in part.round(9)} <= {tuple(p) for p in points.round(9)}
    share = ConvexHull(part).volume / ConvexHull(points).volume
    assert share > {8: 0.6, 16: 0.6, 64: 0.85}[limit]


def test_a_sheet_of_paper_gets_a_thickness_and_points_on_a_line_are_refused() -> None:
    """Flat meshes collide, too: 2 % of their extent thick."""
    sheet = np.array(
        [[[0.0, 0, 0], [0.2, 0, 0], [0, 0.3, 0]], [[0.2, 0, 0], [0.2, 0.3, 0], [0, 0.3, 0]]]
    )
    (part,) = convex_parts(TriangleSoup.of(sheet), "sheet").parts_m
    assert part[:, 2].max() - part[:, 2].min() == pytest.approx(0.02 * 0.3)
    line = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0], [4, 0, 0]])
    with pytest.raises(AssetError, match=r"line: .*collision"):
        hull_vertices(line, "line")
