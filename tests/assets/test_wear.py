"""Wear of household objects: its place is measured on meshes, not on the images."""

from functools import cache

import numpy as np
import pytest

from gen_data.assets.family import Worn
from gen_data.content.procedural import FAMILIES, TEXTURES
from gen_data.content.procedural.textures import printed_matter
from gen_data.content.procedural.wear import Film, draw_wear, dust_share, lay_films
from gen_data.core.asset_types import MeshData, TextureData
from tests.every_value import for_every
from tests.solids import new_and_worn

LABELS = ("label", "front_label", "can_label", "carton", "milk_label", "book_cover")
PRINTS = {"carton": "carton", "book": "book_cover"}
"""Families with edges, and their textures."""
MARKED = sorted(name for name, family in FAMILIES.items() if isinstance(family.build, Worn))
VARIANTS = [(name, seed) for name in MARKED for seed in range(0, FAMILIES[name].variants, 12)]
KINDS = ("vessel", "dish", "metal", "plastic")


@cache
def clean(name: str, seed: int) -> TextureData:
    made: TextureData = getattr(printed_matter, name)(seed)
    return made


@cache
def worn(name: str, seed: int) -> TextureData:
    made: TextureData = TEXTURES[name].build(seed)
    return made


def change(name: str, seed: int) -> np.ndarray:
    """Largest change of a channel per pixel, out of 255."""
    moved = worn(name, seed).albedo.astype(int) - clean(name, seed).albedo
    return np.asarray(np.abs(moved).max(axis=2))


def convex_edges_m(mesh: MeshData) -> np.ndarray:
    """Ends of edges whose faces bend away from each other by more than 25 degrees, [n, 2, 3]."""
    places, inverse = np.unique(np.round(mesh.vertices_m, 6), axis=0, return_inverse=True)
    faces = inverse.reshape(-1)[mesh.faces]
    corners = places[faces].astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    seen: dict[tuple[int, int], list[int]] = {}
    for k, face in enumerate(faces):
        for a, b in zip(face, np.roll(face, -1), strict=True):
            seen.setdefault((min(a, b), max(a, b)), []).append(k)
    found = []
    for (a, b), (i, j) in ((edge, pair) for edge, pair in seen.items() if len(pair) == 2):
        outward = np.dot(normals[i], corners[j].mean(axis=0) - corners[i].mean(axis=0))
        if np.dot(normals[i], normals[j]) < np.cos(np.radians(25.0)) and outward < 0.0:
            found.append((places[a], places[b]))
    return np.array(found, dtype=np.float64)


def surface(mesh: MeshData, slot: int, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points, texture coordinates and face normals at random places of a slot, by area."""
    rng = np.random.default_rng(0)
    faces = mesh.faces[mesh.face_slots == slot]
    corners = mesh.vertices_m[faces].astype(np.float64)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(cross, axis=1)
    chosen = rng.choice(len(faces), count, p=area / area.sum())
    weights = rng.dirichlet((1.0, 1.0, 1.0), count)
    points = np.einsum("nk,nkd->nd", weights, corners[chosen])
    uvs = np.einsum("nk,nkd->nd", weights, mesh.uvs[faces[chosen]].astype(np.float64))
    return points, uvs, cross[chosen] / area[chosen, None]


def sample(image: np.ndarray, uvs: np.ndarray) -> np.ndarray:
    height, width = image.shape[:2]
    rows = np.clip(((1.0 - uvs[:, 1]) * height).astype(int), 0, height - 1)
    return np.asarray(image[rows, np.clip((uvs[:, 0] * width).astype(int), 0, width - 1)])


def distances_m(points: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Distance of points [n, 3] to the nearest of some segments [m, 2, 3]."""
    nearest = np.full(len(points), np.inf)
    for a, b in edges:
        share = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        nearest = np.minimum(nearest, np.linalg.norm(points - a - share[:, None] * (b - a), axis=1))
    return nearest


@pytest.mark.slow
@for_every([(f, s) for f, p in PRINTS.items() for s in range(48) if draw_wear(p, s) > 0.6])
def test_ink_is_rubbed_off_at_convex_edges_of_the_mesh(variant: tuple[str, int]) -> None:
    """Within 1.5 mm of them more changes than beyond 12 mm, dust on upper faces apart."""
    family, seed = variant
    mesh = FAMILIES[family].build(seed=seed).mesh
    points, uvs, normals = surface(mesh, 0, 30_000)
    away = distances_m(points, convex_edges_m(mesh))
    changed = sample(change(PRINTS[family], seed), uvs)
    below = normals[:, 2] < 0.5
    assert changed[below & (away < 0.0015)].mean() > 1.6 * changed[below & (away > 0.012)].mean()


@pytest.mark.slow
def test_new_prints_are_as_printed_and_dust_of_boxes_lies_on_upper_faces() -> None:
    """Parts with the least wear, off the face on which dust falls."""
    for name in ("label", "front_label", "can_label"):
        newest = min(range(48), key=lambda seed: draw_wear(name, seed))
        assert change(name, newest).mean() < 1.5, name
    # By the mesh's normals: unused objects change there only.
    above, beside = [], []
    for seed in (s for s in range(48) if draw_wear("carton", s) < 0.05):
        mesh = FAMILIES["carton"].build(seed=seed).mesh
        _, uvs, normals = surface(mesh, 0, 20_000)
        changed = sample(change("carton", seed), uvs)
        above.append(changed[normals[:, 2] > 0.99].mean())
        beside.append(changed[normals[:, 2] < 0.99].mean())
    assert max(beside) < 1.5
    assert max(above) > 10.0 * max(beside)
    assert np.mean(above) > 3.0 * np.mean(beside)


@pytest.mark.slow
def test_dust_follows_the_cosine_of_the_slope_films_cover_and_tide_lines_are_level() -> None:
    """All of it on level ground, half at 60 degrees, none on walls and from below."""
    upward = np.cos(np.radians([0.0, 60.0, 90.0, 180.0])).astype(np.float32)
    assert dust_share(upward, 0.4) == pytest.approx([0.4, 0.2, 0.0, 0.0], abs=1e-6)
    # A full film hides all below it; half a film is the mean of both.
    grey = np.full((2, 2, 3), 100, np.uint8)
    full, half = np.full((2, 2), 255, np.uint8), np.full((2, 2), 128, np.uint8)
    films = [Film(full, (1.0, 0.0, 0.0)), Film(half, (0.0, 0.0, 1.0))]
    assert lay_films(grey, films)[0, 0].tolist() == pytest.approx([127, 0, 128], abs=1)
    assert (lay_films(grey, [Film(0 * full, (1.0, 1.0, 1.0))]) == 100).all()
    # The image varies more from row to row than along rows.
    rows = TEXTURES["use_marks"].build(11, kind="vessel").albedo[:200, :, 2].astype(np.float64)
    assert rows.mean(axis=1).std() > 2.0 * rows.std(axis=1).mean()


@pytest.mark.slow
@pytest.mark.parametrize("name", LABELS)
def test_most_labels_stay_legible_and_worn_places_are_duller(name: str) -> None:
    """On nine of ten variants at most a tenth of all pixels changes by more than a quarter."""
    hidden = [(change(name, seed) > 64).mean() for seed in range(0, TEXTURES[name].variants, 4)]
    assert np.quantile(hidden, 0.9) < 0.1
    # The roughness factor is 1 where it is dullest, less elsewhere on used objects.
    used = max(range(TEXTURES[name].variants), key=lambda seed: draw_wear(name, seed))
    rough = worn(name, used).roughness
    assert rough is not None
    assert rough.max() > 250 and rough.min() < 180


@pytest.mark.slow
@pytest.mark.parametrize("name", ["label", "front_label"])
def test_pieces_of_some_labels_are_torn_off(name: str) -> None:
    """White fibres over at least 1 % of the image; on few of them."""

    def torn(seed: int) -> bool:
        pale = (worn(name, seed).albedo.min(axis=2) > 190) & (change(name, seed) > 60)
        return bool(pale.mean() > 0.01)

    share = np.mean([torn(seed) for seed in range(0, 75, 2)])

    assert 0.02 < share < 0.3


@pytest.mark.slow
@for_every(VARIANTS)
def test_marks_change_the_look_of_plain_slots_alone(variant: tuple[str, int]) -> None:
    """Shape, prints, glass, contents and lamps are as new; nothing gets smoother."""
    new, used = new_and_worn(*variant)
    assert np.array_equal(new.uvs, used.uvs)
    for before, after in zip(new.materials, used.materials, strict=True):
        assert after.base_color == before.base_color
        assert after.roughness >= before.roughness - 1e-4
        if before.texture or before.printed or before.role or before.transmission:
            assert after == before
        elif after != before and before.metallic > 0.5:
            assert "kind=metal" in after.texture


@pytest.mark.slow
def test_every_family_of_things_to_handle_has_new_and_marked_variants() -> None:
    for name in ("fork", "remote", "mug", "plate", "hammer", "scissors"):
        textures = [
            {m.texture for m in FAMILIES[name].build(seed=seed).mesh.materials}
            for seed in range(FAMILIES[name].variants)
        ]
        marked = np.mean([any("use_marks" in t for t in each) for each in textures])
        assert 0.5 < marked < 0.98, name


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_marks_grow_with_use(kind: str) -> None:
    light, heavy = (TEXTURES["use_marks"].build(step, kind=kind) for step in (2, 11))
    assert light.roughness is not None and heavy.roughness is not None
    assert heavy.albedo.mean() < light.albedo.mean()
    assert np.ptp(heavy.roughness) > np.ptp(light.roughness)
