"""Licence plates: texts, places, and vehicles that carry them."""

import re

import numpy as np
import pytest

from gen_data.content.vehicles import FAMILIES, TEXTURES
from gen_data.content.vehicles.plates import (
    FORMATS,
    GLYPHS,
    SEEDS,
    plate_id,
    plate_text,
    reseed_plate,
)
from gen_data.core.asset_types import Material
from gen_data.core.scene import Body, ObjectGroup, Scene
from gen_data.randomizers.vehicle_paint import VehiclePaint
from tests.randomizers.doubles import FakeAssets, rng_of
from tests.solids import variant


def face(seed: int, rows: int = 1, country: str = "gb") -> np.ndarray:
    build = TEXTURES["licence_plate"].build
    image = build(seed=seed, rows=rows, country=country, rear=0).albedo.astype(float)
    ground = image[image.shape[0] // 2, 6 * image.shape[1] // 256 + 8]
    difference: np.ndarray = np.abs(image - ground).sum(axis=2)
    return difference > 150.0


def test_plates_have_six_to_eight_letters_and_digits_all_of_which_differ() -> None:
    """Letters that cannot be mistaken for another; strokes are on the grid of 4 by 6."""
    texts = [plate_text(seed) for seed in range(SEEDS)]

    assert all(re.fullmatch(r"[A-HJ-NPR-Z0-9 -]{7,9}", text) for text in texts)
    assert all(any(c.isdigit() for c in t) and any(c.isalpha() for c in t) for t in texts)
    assert len(set(texts)) > 0.98 * SEEDS

    assert len(set(GLYPHS.values())) == len(GLYPHS) == 33
    points = [p for glyph in GLYPHS.values() for p in re.split("[ ,]", glyph)]
    assert all(re.fullmatch("[0-4][0-6]", point) for point in points)


@pytest.mark.parametrize("seed", range(6))
def test_every_glyph_of_a_text_is_on_the_plate(seed: int) -> None:
    """As many islands of ink between empty columns as there are glyphs."""
    inside = face(seed)[10:-10, 12:-12]
    columns = inside.any(axis=0).astype(int)
    islands = int((np.diff(columns, prepend=0) == 1).sum())

    assert islands == len(plate_text(seed, "gb").replace(" ", ""))


def test_plates_of_two_rows_have_the_first_group_above() -> None:
    """An empty row of pixels lies between them."""
    rows = face(3, rows=2)[14:-14, 16:-16].any(axis=1).astype(int)

    assert int((np.diff(rows, prepend=0) == 1).sum()) == 2
    with pytest.raises(ValueError, match="1 or 2 rows, not 3"):
        TEXTURES["licence_plate"].build(seed=0, rows=3, country="de", rear=0)


@pytest.mark.parametrize("name", ["car", "van", "truck", "bus"])
def test_text_on_plates_runs_from_left_to_right_for_who_looks_at_them(name: str) -> None:
    """In front u grows towards +Y, behind towards -Y; v grows upwards, by 0.52 m and 0.11 m."""
    mesh = variant(name, 1).mesh
    slots = [k for k, m in enumerate(mesh.materials) if m.role == "plate"]
    fronts = [mesh.materials[slot].texture for slot in slots]
    assert fronts[0].startswith("texture/licence_plate?country=any&rear=0&rows=1&seed=")
    # The same text behind, on the ground of rear plates.
    assert fronts[1] == fronts[0].replace("rear=0", "rear=1")
    for sign, slot in zip((1.0, -1.0), slots, strict=True):
        faces = mesh.faces[mesh.face_slots == slot]
        outward = sign * mesh.normals[faces[:, 0], 0] > 0.99
        ends = sign * mesh.vertices_m[faces[:, 0], 0] > 0.0
        corners = faces[outward & ends].ravel()
        y, z = mesh.vertices_m[corners, 1], mesh.vertices_m[corners, 2]
        u, v = mesh.uvs[corners].T
        assert np.polyfit(y, u, 1)[0] == pytest.approx(sign / 0.52, rel=1e-3)
        assert np.polyfit(z, v, 1)[0] == pytest.approx(1.0 / 0.11, rel=1e-3)


def test_motorcycles_have_plates_of_two_rows() -> None:
    materials = variant("motorcycle", 0).mesh.materials

    assert any("rear=1&rows=2" in m.texture for m in materials)
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
    british = plate_id(4, rows=1, country="gb", rear=1)
    assert reseed_plate(british, 7) == plate_id(7, rows=1, country="gb", rear=1)
    assert reseed_plate(british, 7, "fr") == plate_id(7, rows=1, country="fr", rear=1)


_KINDS = {"L": "[A-HJ-NPR-Z]", "C": "[BCDFGHJKLMNPRSTVWXYZ]", "D": "[0-9]", "S": r"\*"}


@pytest.mark.parametrize("country", FORMATS)
def test_texts_have_the_order_of_letters_and_digits_of_their_country(country: str) -> None:
    """Each text fits one of the patterns, and a plate of it can be drawn."""
    patterns = [
        "".join(_KINDS.get(place, re.escape(place)) for place in pattern)
        for pattern in FORMATS[country].patterns
    ]
    texts = [plate_text(seed, country) for seed in range(20)]

    assert all(any(re.fullmatch(p, text) for p in patterns) for text in texts)
    assert len(set(texts)) >= 19


def test_british_plates_are_yellow_behind_and_white_in_front() -> None:
    """German ones are white on both sides, with a blue field at the left border."""
    build = TEXTURES["licence_plate"].build
    front, rear = (
        build(seed=1, rows=1, country="gb", rear=k).albedo[6, 128].astype(int) for k in (0, 1)
    )
    german = build(seed=1, rows=1, country="de", rear=1).albedo.astype(int)

    assert front.min() > 200
    assert rear[0] > 200
    assert rear[2] < 100
    assert german[6, 128].min() > 200
    assert german[50, 10, 2] > german[50, 10, 0] + 80


@pytest.mark.parametrize("country", ["us_ca", "jp", "cn"])
def test_plates_of_other_proportions_stand_in_a_dark_holder(country: str) -> None:
    """As wide as their height and their real proportions demand."""
    image = TEXTURES["licence_plate"].build(seed=2, rows=1, country=country, rear=0).albedo
    wide, high = FORMATS[country].size_mm
    bright = image[32].astype(int).max(axis=1) > 60
    expected = 256 * (wide / high) / (1300 / 275)

    assert np.flatnonzero(bright)[[0, -1]] == pytest.approx(
        [128 - 0.5 * expected, 128 + 0.5 * expected], abs=4
    )


def test_strokes_are_wide_enough_to_be_read() -> None:
    """Upright strokes are at least 3 px wide on the texture: 6 mm on a plate of 520 mm."""
    for seed in range(4):
        inside = face(seed)[10:-10, 12:-12].astype(int)
        edges = np.diff(inside, axis=1, prepend=0, append=0)
        widths = [np.flatnonzero(row == -1) - np.flatnonzero(row == 1) for row in edges]
        assert np.median(np.concatenate(widths)) >= 3
