"""Traffic signs: shapes and colours of the Vienna Convention, upright on plates that face +X."""

import numpy as np
import pytest

from gen_data.content.scenery.signs import SIGNS, plate_outline, traffic_sign, traffic_sign_facts
from gen_data.content.scenery.textures import sign_faces

# Which colours a sign must show, by the convention's annex 1, and which it must not.
SHOWS = {
    "speed_limit_50": ("red white black", "blue yellow"),
    "no_entry": ("red white", "blue yellow black"), "no_parking": ("red blue", "yellow black"),
    "stop": ("red white", "blue yellow black"), "yield": ("red white", "blue yellow black"),
    "priority_road": ("yellow white", "blue red"), "keep_right": ("blue white", "red yellow black"),
    "danger": ("red white black", "blue yellow"), "parking": ("blue white", "red yellow black"),
    "pedestrian_crossing": ("blue white black", "red yellow"),
    "one_way": ("blue white", "red yellow black"),
}  # fmt: skip
# Prototype colours [8-bit sRGB]: the middle of the words' meaning.
WORDS = {
    "red": (190, 30, 25), "blue": (10, 85, 140), "yellow": (240, 200, 10),
    "black": (35, 35, 35), "white": (240, 240, 235),
}  # fmt: skip


def shares(name: str) -> dict[str, float]:
    """Share of the plate in each colour, by the nearest prototype."""
    image = sign_faces.traffic_sign(0, name).albedo.astype(float)
    n = len(image)
    at = (np.arange(n) + 0.5) / n - 0.5
    x, y = np.meshgrid(at, -at)
    inside = contains(0.97 * plate_outline(SIGNS[name].shape), x, y)
    words = np.array(list(WORDS.values()))
    nearest = ((image[inside][:, None] - words) ** 2).sum(axis=2).argmin(axis=1)
    return {word: float((nearest == k).mean()) for k, word in enumerate(WORDS)}


def contains(outline: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Whether points lie in a convex counter-clockwise polygon."""
    inside = np.ones_like(x, dtype=bool)
    for (ax, ay), (bx, by) in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        inside &= (bx - ax) * (y - ay) - (by - ay) * (x - ax) >= 0.0
    return inside


@pytest.mark.parametrize("name", SHOWS)
def test_a_sign_has_its_standard_colours_and_no_others(name: str) -> None:
    """More than 3 % of the plate each; other colours stay below 2.5 %."""
    shown, absent = SHOWS[name]
    share = shares(name)

    for word in shown.split():
        assert share[word] > 0.03, (word, share)
    for word in absent.split():
        assert share[word] < 0.025, (word, share)


def test_every_sign_has_a_face_of_its_own() -> None:
    """No two signs are drawn by the same steps."""
    faces = [str(sign.face) for sign in SIGNS.values()]

    assert all(sign.face for sign in SIGNS.values())
    assert len(set(faces)) == len(faces)


def test_plates_have_the_corners_of_their_shapes() -> None:
    """Octagon, triangles one up and one down, a diamond on its tip; all counter-clockwise."""
    assert len(plate_outline("octagon")) == 8
    assert plate_outline("triangle")[:, 1].max() > 0.0
    up, down = plate_outline("triangle"), plate_outline("yield")
    assert up[up[:, 1].argmax(), 0] == pytest.approx(0.0, abs=0.03)
    assert down[down[:, 1].argmin(), 0] == pytest.approx(0.0, abs=0.03)
    for shape in {made.shape for made in SIGNS.values()}:
        x, y = plate_outline(shape).T
        assert (x * np.roll(y, -1) - np.roll(x, -1) * y).sum() > 0.0
        assert np.abs(np.stack([x, y])).max() <= 0.55


@pytest.mark.parametrize("name", SIGNS)
def test_the_face_looks_to_plus_x_and_is_not_mirrored(name: str) -> None:
    """The image's right is the viewer's right, +Y, and its top is up; the plate is 0.6-0.9 m."""
    mesh = traffic_sign(0, name).mesh
    slot = next(k for k, m in enumerate(mesh.materials) if m.role == "sign")
    faces = mesh.faces[mesh.face_slots == slot]
    vertices, uvs = mesh.vertices_m[faces.ravel()], mesh.uvs[faces.ravel()]

    assert (mesh.normals[faces.ravel()][:, 0] > 0.99).all()
    size = float(np.ptp(vertices[:, 1]))
    assert 0.59 <= size <= 0.91
    assert np.corrcoef(uvs[:, 0], vertices[:, 1])[0, 1] > 0.999
    assert np.corrcoef(uvs[:, 1], vertices[:, 2])[0, 1] > 0.999
    assert vertices[:, 2].min() >= 1.95
    assert uvs.min() >= -0.05
    assert uvs.max() <= 1.05


def test_seeds_go_through_all_signs_and_the_label_says_which() -> None:
    """``any`` takes them in turn."""
    names = [traffic_sign_facts(seed, "any").attributes["sign"] for seed in range(len(SIGNS))]

    assert names == list(SIGNS)
    assert traffic_sign_facts(7, "stop").attributes["sign"] == "stop"
    assert traffic_sign_facts(7, "stop").subcategory == "regulatory"
