"""Garments and their textures."""

import numpy as np
import pytest

from gen_data.content.people.analytic_body import simple_body
from gen_data.content.people.garment_layout import (
    BACK_M,
    FRONT_M,
    LIMB_M,
    LIMB_WIDTH_M,
    TILE_M,
    lay_out,
)
from gen_data.content.people.garment_textures import hi_vis, printed_jersey
from gen_data.content.people.person import draw_person
from gen_data.content.people.person_mesh import simple_person
from gen_data.core.asset_types import Material

SIZE_PX = 512


def test_front_and_back_lie_on_their_own_fields_unmirrored() -> None:
    """The left side of the body is to the right as seen from ahead, to the left from behind."""
    front_left, front_right = (0.12, 0.05, 0.3), (0.12, -0.05, 0.3)
    back_left, back_right, back = (-0.1, 0.05, 0.3), (-0.1, -0.05, 0.3), (-0.1, 0.0, 0.1)
    ahead = (0.12, 0.0, 0.1)
    points = np.array([front_left, front_right, ahead, back_left, back_right, back])
    faces = np.array([[0, 1, 2], [3, 5, 4]])

    corners, _, uvs = lay_out(points, faces, ("torso",), np.zeros(2, np.int64))

    u = {int(c): float(u) * TILE_M for c, u in zip(corners, uvs[:, 0], strict=True)}
    assert u[0] > FRONT_M > u[1]
    assert u[4] > BACK_M > u[3]
    assert u[2] == pytest.approx(FRONT_M) and u[5] == pytest.approx(BACK_M)


def test_limbs_keep_to_their_field_and_no_triangle_crosses_fields() -> None:
    """A triangle with corners in two fields would show everything between them."""
    body = simple_body()
    zones = ("torso", "sleeves", "hips", "thighs", "shins")
    parts = [(k, body.faces[zone]) for k, zone in enumerate(zones)]
    faces = np.concatenate([part for _, part in parts])
    slots = np.concatenate([np.full(len(part), k) for k, part in parts])

    corners, corner_faces, uvs = lay_out(body.points_m, faces, zones, slots)

    np.testing.assert_array_equal(corners[corner_faces], faces)
    u_m = uvs[corner_faces][:, :, 0] * TILE_M
    limbs = np.isin(slots, [1, 3, 4])
    assert u_m[limbs].min() >= LIMB_M - 1e-9
    assert u_m[limbs].max() <= LIMB_M + LIMB_WIDTH_M + 1e-9
    assert np.ptp(u_m, axis=1).max() < 0.35


def test_warning_clothes_have_bands_of_their_width_around_the_chest() -> None:
    """EN ISO 20471, class 2: at least 5 cm."""
    column = hi_vis(0).albedo[:, round(FRONT_M / TILE_M * SIZE_PX)].astype(np.int64)
    silver = np.abs(column[:, 0] - column[:, 2]) < 40
    edges = np.flatnonzero(np.diff(silver.astype(np.int64)))
    widths_m = np.diff(edges)[::2] * TILE_M / SIZE_PX
    np.testing.assert_allclose(widths_m, 0.05, atol=0.004)
    assert len(widths_m) == 2


def test_prints_are_on_the_chest() -> None:
    """The middle of the chest differs from plain cloth, sleeves do not."""
    image = printed_jersey(0).albedo.astype(np.float64)
    rows = slice(round(0.2 / TILE_M * SIZE_PX), round(0.42 / TILE_M * SIZE_PX))

    def spread(left_m: float, right_m: float) -> float:
        columns = slice(round(left_m / TILE_M * SIZE_PX), round(right_m / TILE_M * SIZE_PX))
        return float(image[rows, columns].std())

    assert spread(FRONT_M - 0.06, FRONT_M + 0.06) > 2.0 * spread(LIMB_M, LIMB_M + LIMB_WIDTH_M)


def test_textured_garments_have_coordinates_and_skin_has_none() -> None:
    """Corners of a garment span several decimetres of its texture."""
    mesh = simple_person(3, "stand", 0.0).mesh
    mapped = [k for k, m in enumerate(mesh.materials) if m.texture and m.texture_scale_m == 0.0]
    assert mapped
    for slot in mapped:
        corners = mesh.uvs[np.unique(mesh.faces[mesh.face_slots == slot])]
        assert np.ptp(corners[:, 1]) * TILE_M > 0.1


def test_most_clothes_are_plain_and_dark() -> None:
    """Two tops in three are of one colour; half of all outer clothes reflect less than a tenth."""
    outfits = [draw_person(seed).outfit for seed in range(300)]
    plain = ("jersey", "jacket_cloth", "quilted")
    tops = [o.top_material for o in outfits]
    assert sum(t.texture.split("/")[1].startswith(plain) for t in tops) > 0.66 * len(tops)

    def luminance(material: Material) -> float:
        r, g, b = material.base_color
        return 0.2126 * r + 0.7152 * g + 0.0722 * b

    outer = [o.top_material for o in outfits if o.top in ("jacket", "coat")]
    assert np.median([luminance(m) for m in outer]) < 0.1
