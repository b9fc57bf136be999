"""Licence plates: what is on them, where they are, who has which."""

from __future__ import annotations

import re

import numpy as np
import pytest

from gen_data.generator.assets.vehicles import FAMILIES, TEXTURES
from gen_data.generator.assets.vehicles.plates import (
    GLYPHS,
    SEEDS,
    plate_id,
    plate_text,
    reseed_plate,
)
from gen_data.generator.core.asset_types import Material
from gen_data.generator.core.scene import Body, ObjectGroup, Scene
from gen_data.randomizers.vehicle_paint import VehiclePaint
from tests.randomizers.doubles import FakeAssets, rng_of
from tests.vehicles.test_vehicle_families import variant


def face(seed: int, rows: int = 1) -> np.ndarray:
    """Whether each pixel is ink."""
    image = TEXTURES["licence_plate"].build(seed=seed, rows=rows).albedo.astype(float)
    ground = image[image.shape[0] // 2, 6 * image.shape[1] // 256 + 8]
    difference: np.ndarray = np.abs(image - ground).sum(axis=2)
    return difference > 150.0


def test_plates_have_five_to_seven_letters_and_digits() -> None:
    """Of those that cannot be taken for another; hardly any two are the same."""
    texts = [plate_text(seed) for seed in range(SEEDS)]

    assert all(re.fullmatch(r"[A-HJ-NPR-Z0-9 ]{7,8}", text) for text in texts)
    assert all(any(c.isdigit() for c in t) and any(c.isalpha() for c in t) for t in texts)
    assert len(set(texts)) > 0.98 * SEEDS


def test_no_two_glyphs_look_the_same() -> None:
    """Every glyph has its own strokes, on the grid of 4 by 6."""
    assert len(set(GLYPHS.values())) == len(GLYPHS) == 33
    points = [p for glyph in GLYPHS.values() for p in re.split("[ ,]", glyph)]
    assert all(re.fullmatch("[0-4][0-6]", point) for point in points)


@pytest.mark.parametrize("seed", range(6))
def test_every_glyph_of_a_text_is_on_the_plate(seed: int) -> None:
    """As many islands of ink between empty columns as there are glyphs."""
    inside = face(seed)[10:-10, 12:-12]
    columns = inside.any(axis=0).astype(int)
    islands = int((np.diff(columns, prepend=0) == 1).sum())

    assert islands == len(plate_text(seed).replace(" ", ""))


def test_plates_of_two_rows_have_the_first_group_above() -> None:
    """An empty row of pixels lies between them."""
    rows = face(3, rows=2)[14:-14, 16:-16].any(axis=1).astype(int)

    assert int((np.diff(rows, prepend=0) == 1).sum()) == 2
    with pytest.raises(ValueError, match="1 or 2 rows, not 3"):
        TEXTURES["licence_plate"].build(seed=0, rows=3)


@pytest.mark.parametrize("name", ["car", "van", "truck", "bus"])
def test_text_on_plates_runs_from_left_to_right_for_who_looks_at_them(name: str) -> None:
    """In front u grows towards +Y, behind towards -Y; v grows upwards, by 0.52 m and 0.11 m."""
    mesh = variant(name, 1).mesh
    slot = next(k for k, m in enumerate(mesh.materials) if m.role == "plate")
    assert mesh.materials[slot].texture.startswith("texture/licence_plate?rows=1&seed=")
    for sign in (1.0, -1.0):
        faces = mesh.faces[mesh.face_slots == slot]
        outward = sign * mesh.normals[faces[:, 0], 0] > 0.99
        ends = sign * mesh.vertices_m[faces[:, 0], 0] > 0.0
        corners = faces[outward & ends].ravel()
        y, z = mesh.vertices_m[corners, 1], mesh.vertices_m[corners, 2]
        u, v = mesh.uvs[corners].T
        assert np.polyfit(y, u, 1)[0] == pytest.approx(sign / 0.52, rel=1e-3)
        assert np.polyfit(z, v, 1)[0] == pytest.approx(1.0 / 0.11, rel=1e-3)


def test_motorcycles_have_plates_of_two_rows() -> None:
    """Square ones, behind."""
    materials = variant("motorcycle", 0).mesh.materials

    assert any("licence_plate?rows=2" in m.texture for m in materials)
    assert "motorcycle" in FAMILIES


def test_every_vehicle_gets_a_plate_of_its_own() -> None:
    """Two of the same model differ; other textures, and plates that are to stay, are left alone."""
    slots = (Material(role="paint"), Material(texture=plate_id(7, rows=1), role="plate"))
    bodies = tuple(
        Body(f"traffic/{k}", "wagon", group="traffic", materials=slots) for k in range(6)
    )
    group = ObjectGroup("traffic", (), ("wagon",), 6, "along", lanes=("driving",))
    scene = Scene("t", bodies=bodies, groups=(group,))

    def plates(**fields: bool) -> list[str]:
        painted = VehiclePaint(name="paint", **fields)(scene, FakeAssets(), rng_of())
        return [m.texture for b in painted.bodies for m in b.materials if m.role == "plate"]

    assert len(set(plates())) >= 5
    assert len(set(plates(plates=False))) == 1
    assert reseed_plate("texture/oak?seed=3", 9) == "texture/oak?seed=3"
    assert reseed_plate(plate_id(4, rows=2), 77) == plate_id(77, rows=2)
