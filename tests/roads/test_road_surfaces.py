"""Meshes of roads: sizes, areas, heights and markings against hand-made sums."""

import math

import numpy as np
import pytest

from gen_data.content.roads import FAMILIES, TEXTURES
from gen_data.content.roads.lane_textures import asphalt_color, asphalt_lane
from gen_data.content.roads.markings import stripes
from gen_data.content.roads.painted_signs import ARROWS, arrow, letter_polygons
from gen_data.core.asset_types import MeshData
from gen_data.core.errors import AssetError
from gen_data.roads.cross_section import RoadShape, height_m
from gen_data.roads.junction_shape import JunctionShape, make_fan
from gen_data.roads.roundabout_shape import RoundaboutShape
from tests.tiers import sampled

SLOTS = ("asphalt", "asphalt_new", "marking", "kerb", "pavement", "verge", "ground")


def mesh_of(name: str, **parameters: object) -> MeshData:
    family = FAMILIES[name]
    mesh: MeshData = family.build(**{**family.parameters, **parameters}).mesh
    return mesh


def area_m2(mesh: MeshData, slot: str) -> float:
    """Area of a slot's triangles, seen from above; those that face down count as negative.

    ``lane`` and ``paint`` are all driven lanes, and all slots with the role of markings.
    """
    if slot == "lane":
        slots = [k for k, m in enumerate(mesh.materials) if "_lane" in m.texture]
    elif slot == "paint":
        slots = [k for k, m in enumerate(mesh.materials) if m.role == "marking"]
    else:
        slots = [SLOTS.index(slot)]
    corners = mesh.vertices_m.astype(np.float64)[mesh.faces[np.isin(mesh.face_slots, slots)]]
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return 0.5 * float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum())


def test_straight_road_has_the_area_of_its_plan() -> None:
    """Length times width, for asphalt and sidewalks."""
    mesh = mesh_of("road", length_m=100.0, wear=0.0)

    assert area_m2(mesh, "lane") == pytest.approx(100.0 * 7.0, rel=1e-6)
    assert area_m2(mesh, "pavement") == pytest.approx(100.0 * 5.0, rel=1e-6)
    assert area_m2(mesh, "kerb") == pytest.approx(100.0 * 0.3, rel=1e-5)


@pytest.mark.parametrize("curvature", [0.02, -0.05])
def test_bent_road_has_the_area_of_its_ring(curvature: float) -> None:
    """An annulus' share: middle length times width, whatever the bend."""
    mesh = mesh_of("road", length_m=40.0, wear=0.0, curvature_per_m=curvature)

    assert area_m2(mesh, "lane") == pytest.approx(40.0 * 7.0, rel=2e-3)


def test_crown_and_kerb_have_their_heights() -> None:
    """2 % of 3.5 m in the middle, 0.12 m at the kerb, 2.5 % over the sidewalk."""
    vertices = mesh_of("road", length_m=20.0, wear=0.0, apron_m=0.0).vertices_m
    of_asphalt = vertices[np.abs(vertices[:, 1]) < 1e-4]

    assert of_asphalt[:, 2].min() == pytest.approx(0.0875, abs=1e-5)
    assert vertices[:, 2].max() == pytest.approx(0.12 + 0.025 * 2.5, abs=1e-5)


def test_dashes_are_three_metres_with_gaps_of_six() -> None:
    """Ten dashes of 3 m x 0.12 m on 90 m."""
    mesh = mesh_of("road", length_m=90.0, wear=0.0, kerb_m=0.0)

    assert area_m2(mesh, "paint") == pytest.approx(10 * 3.0 * 0.12, rel=1e-4)


def test_motorway_has_edge_lines_and_broken_lines_between_lanes() -> None:
    """Three lanes: two broken lines of 0.15 m; broad lines of 0.25 m at both edges."""
    shape = RoadShape(lanes=(0.0, 3.0), lane_width_m=3.75, shoulder_m=(0.0, 2.5), kerb_m=0.0,
                      sidewalk_m=(0.0, 0.0), median_m=4.0)  # fmt: skip
    lines = stripes(shape, "dashed", "solid", (6.0, 12.0), 0.15)
    solid = [line for line in lines if line.gap_m == 0.0]
    broken = sorted(line.t_m for line in lines if line.gap_m > 0.0)

    assert broken == [-9.5, -5.75]
    assert sorted(line.width_m for line in solid) == [0.25, 0.25]
    assert min(line.t_m for line in solid) == pytest.approx(-13.25)


def test_markings_lie_on_the_road() -> None:
    """Over the crowned, rutted surface by millimetres, never below it."""
    mesh = mesh_of("road", length_m=60.0, wear=1.0, markings="double", edge_lines="solid")
    painted = [k for k, m in enumerate(mesh.materials) if m.role == "marking"]
    faces = mesh.faces[np.isin(mesh.face_slots, painted)]
    points = mesh.vertices_m[np.unique(faces)]
    crown = 0.025 * (3.5 - np.abs(points[:, 1]))

    assert (points[:, 2] - crown > -0.007).all()
    assert (points[:, 2] - crown < 0.004).all()


def test_long_road_stays_within_its_budget() -> None:
    """160 m with everything on it, worn out, straight and bent."""
    everything = {"parking_m": (2.2, 2.2), "verge_m": (1.5, 1.5), "bicycle_m": (1.6, 1.6),
                  "length_m": 160.0, "wear": 1.0, "rails": (1.0, 1.0)}  # fmt: skip
    assert len(mesh_of("road", **everything).faces) < 15_000
    assert len(mesh_of("road", **everything, curvature_per_m=0.02).faces) < 20_000


def test_junction_mouths_meet_the_roads() -> None:
    """The fan's outline has the crowned profile of a road at every arm's end."""
    shape = JunctionShape()
    fan = make_fan(shape)
    reach = shape.reach_m()
    at = np.array([[reach, 0.0], [0.0, reach], [reach, 1.75], [-reach, -3.5 + 1e-9]])

    assert fan.height_m(at) == pytest.approx([0.0875, 0.0875, 0.04375, 0.0], abs=1e-6)
    assert reach == pytest.approx(3.5 + 7.0 + 6.5)


def test_junction_has_the_area_of_its_plan() -> None:
    """Two crossing streets and four corners, each a square less a quarter of a disc."""
    mesh = mesh_of("junction")
    streets = 7.0 * 2 * 17.0 * 2 - 49.0
    corners = 4 * (1.0 - math.pi / 4.0) * 49.0

    assert area_m2(mesh, "asphalt") == pytest.approx(streets + corners, rel=2e-3)


@pytest.mark.parametrize(
    ("name", "changed"),
    [
        *((name, {}) for name in sorted(set(FAMILIES) - {"ground"})),
        ("junction", {"arms_deg": (90.0, 180.0, 270.0, -1.0)}),
        ("junction", {"arms_deg": (0.0, 140.0, 220.0, -1.0)}),
        ("roundabout", {"arms_deg": (0.0, 120.0, 240.0, -1.0), "traffic": "left"}),
        ("road", {"curvature_per_m": -0.03, "traffic": "left", "rails": (0.0, 1.0)}),
    ],
)
def test_surfaces_are_always_the_same_and_face_up(name: str, changed: dict[str, object]) -> None:
    """Equal bytes; no slot is seen from below. Wires are closed tubes, no surfaces."""
    a, b = mesh_of(name, **changed), mesh_of(name, **changed)

    assert a.vertices_m.tobytes() == b.vertices_m.tobytes()
    assert a.faces.tobytes() == b.faces.tobytes()
    is_surface = name != "contact_wires"
    for slot in (SLOTS[k] for k in np.unique(a.face_slots) if is_surface and k < len(SLOTS)):
        assert area_m2(a, slot) > 0.0
    assert np.isfinite(a.uvs).all()


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(TEXTURES))
def test_textures_tile_and_repeat_exactly(name: str) -> None:
    """No seam at the border; equal seeds, equal bytes."""
    build = TEXTURES[name].build
    texture = build(1)
    albedo = texture.albedo.astype(np.float64)

    assert texture.albedo.tobytes() == build(1).albedo.tobytes()
    for axis in (0, 1):
        steps = np.abs(albedo - np.roll(albedo, 1, axis)).mean(axis=(1 - axis, 2))
        assert steps[0] <= max(2.0 * np.quantile(steps[1:], 0.9), 1.1 * steps[1:].max())


@pytest.mark.parametrize(("name", "low", "high"), sampled([
    ("asphalt", 0.05, 0.16), ("grass", 0.08, 0.24), ("paving", 0.15, 0.42),
    ("road_paint", 0.4, 0.8), ("asphalt_lane", 0.05, 0.16), ("concrete_lane", 0.25, 0.4),
], 3))  # fmt: skip
def test_albedo_is_that_of_the_real_thing(name: str, low: float, high: float) -> None:
    """Mean linear albedo within published ranges (LBNL-43442; grass about 0.2 at most)."""
    srgb = TEXTURES[name].build(0).albedo.astype(np.float64) / 255.0
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)

    assert low < float((linear @ np.array([0.2126, 0.7152, 0.0722])).mean()) < high


@pytest.mark.parametrize("seed", range(4))
def test_asphalt_turns_grey_with_age(seed: int) -> None:
    """Albedo 0.04 to 0.06 when new; 0.09 to 0.17 after five years, 0.12 in the mean (LBNL)."""

    def albedo(age_years: float) -> float:
        srgb = asphalt_color(seed, age_years)
        return float((((srgb + 0.055) / 1.055) ** 2.4) @ np.array([0.2126, 0.7152, 0.0722]))

    assert 0.04 < albedo(0.0) < 0.06
    assert 0.09 < albedo(5.0) < 0.17
    assert albedo(2.0) < albedo(10.0)


@pytest.mark.slow
def test_tiles_of_any_damage_meet_without_a_seam() -> None:
    """Both ends of a damaged tile equal those of the undamaged one of the same seed."""
    plain = asphalt_lane(2).albedo
    for damage in ("cracks", "alligator", "stains"):
        worn = asphalt_lane(2, damage=damage).albedo
        assert (worn[[0, -1]] == plain[[0, -1]]).all()
        assert (worn != plain).any()


@pytest.mark.parametrize("word", ARROWS)
def test_arrows_stay_in_their_lane_and_face_up(word: str) -> None:
    """5 m long, at most 2.6 m wide; every polygon is convex and counter-clockwise."""
    polygons = arrow(word)
    points = np.concatenate(polygons)

    assert points[:, 0].min() >= -0.1
    assert points[:, 0].max() <= 5.001
    assert np.abs(points[:, 1]).max() < 1.3
    for polygon in polygons:
        steps = np.roll(polygon, -1, axis=0) - polygon
        after = np.roll(steps, -1, axis=0)
        assert (steps[:, 0] * after[:, 1] - steps[:, 1] * after[:, 0] > -1e-9).all()


def test_arrows_lie_before_the_end_that_they_lead_to() -> None:
    """On the forward lane only: its last 13 m to 8 m, and 33 m to 28 m before the end."""
    plain = mesh_of("road", wear=0.0, markings="none", length_m=60.0)
    mesh = mesh_of("road", wear=0.0, markings="none", length_m=60.0, arrows=(0.0, 1.0))
    painted = [k for k, m in enumerate(mesh.materials) if m.role == "marking"]
    points = mesh.vertices_m[np.unique(mesh.faces[np.isin(mesh.face_slots, painted)])]

    assert area_m2(plain, "paint") == 0.0
    assert area_m2(mesh, "paint") > 1.5
    assert (points[:, 1] < -0.8).all()
    assert points[:, 0].min() == pytest.approx(60.0 - 33.0, abs=0.01)
    assert points[:, 0].max() == pytest.approx(60.0 - 8.0, abs=0.01)


def test_words_need_known_letters() -> None:
    """A letter that has no shape is refused; a word fits its lane."""
    points = np.concatenate([p for strokes in letter_polygons("SCHOOL", 2.5) for p in strokes])

    assert np.ptp(points[:, 1]) < 2.5
    assert np.ptp(points[:, 0]) == pytest.approx(2.4, abs=0.35)
    with pytest.raises(AssetError, match="text"):
        letter_polygons("STÖP", 2.5)


@pytest.mark.parametrize("carriageway", ["concrete", "cobbles", "gravel", "earth"])
def test_every_driven_surface_is_a_carriageway(carriageway: str) -> None:
    """Lanes have the role that labels know roads by; unpaved ones have no paint."""
    mesh = mesh_of("road", carriageway=carriageway, markings="solid", length_m=30.0)
    at = mesh.vertices_m[mesh.faces].mean(axis=1)
    lanes = mesh.face_slots[(np.abs(at[:, 1]) < 2.9) & (at[:, 2] < 0.2)]
    roles = {mesh.materials[k].role for k in np.unique(lanes)}

    assert "asphalt" in roles
    assert roles <= {"asphalt", "marking", ""}
    assert ("marking" in roles) == (carriageway in ("concrete", "cobbles"))


def test_kerbed_median_stands_above_the_lanes() -> None:
    """0.12 m above the edge of the lanes beside it."""
    shape = RoadShape(median_m=3.0, median_kerb_m=0.12)
    heights = height_m(shape, np.array([0.0, 1.3, 1.5, 5.0]))

    assert heights[0] == heights[1] == pytest.approx(heights[2] + 0.12)
    assert (heights[2], heights[3]) == (pytest.approx(0.025 * 3.5), pytest.approx(0.0))


def test_roundabout_has_the_area_of_its_plan() -> None:
    """Its ring without apron and island, and what arms and corners add; the island stands above."""
    mesh = mesh_of("roundabout", crossings="none", splitter=0.0)
    shape = RoundaboutShape()
    line = shape.outline()
    after = np.roll(line, -1, axis=0)
    whole = 0.5 * float((line[:, 0] * after[:, 1] - line[:, 1] * after[:, 0]).sum())
    inner = 0.5 * 104 * 9.6**2 * math.sin(math.tau / 104)

    assert area_m2(mesh, "asphalt") == pytest.approx(whole - inner, rel=5e-3)
    assert whole > math.pi * 15.0**2 + 4 * 7.0 * (shape.reach_m() - 15.0) - 4.0
    assert mesh.vertices_m[:, 2].max() == pytest.approx(0.175 + 0.14 + 0.7, abs=0.01)


def test_land_between_close_arms_stays_between_them() -> None:
    """Arms 40 degrees apart: nothing reaches beyond the square of arms and aprons."""
    mesh = mesh_of("junction", arms_deg=(0.0, 140.0, 180.0, -1.0))
    reach = JunctionShape((0.0, 140.0, 180.0, -1.0)).reach_m()

    assert -mesh.vertices_m[:, 0].min() < reach + 0.01
    assert area_m2(mesh, "ground") > 0.0
