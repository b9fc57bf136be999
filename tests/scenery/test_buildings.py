"""Buildings: facades with depth, storeys at real heights, and no way to look in."""

import hashlib
from functools import cache

import numpy as np
import pytest

from gen_data.assets.family import Solid
from gen_data.assets.library import open_library
from gen_data.content.scenery.building_designs import (
    REGIONS,
    STYLES,
    TEXTURE_ALBEDOS,
    building_materials,
    draw_design,
)
from gen_data.content.scenery.buildings import building, building_facts
from gen_data.core.colorimetry import luminance, srgb_decode
from tests.every_value import for_every
from tests.scenery.rays import cast

SEEDS = (0, 1, 5)


@cache
def built_of(key: tuple[str, int]) -> tuple[str, int, Solid]:
    style, seed = key
    return style, seed, building(seed, style)


for_some_of_every_style = for_every([(s, k) for s in STYLES for k in SEEDS], built_of)


def window_faces(solid: Solid) -> np.ndarray:
    slots = [k for k, m in enumerate(solid.mesh.materials) if m.role == "window"]
    return np.isin(solid.mesh.face_slots, slots)


@pytest.mark.slow
@for_some_of_every_style
def test_panes_lie_behind_the_front_wall_by_a_real_recess(built: tuple[str, int, Solid]) -> None:
    """Rays along -X through the front panes meet glass 0.1-0.35 m behind the wall's plane."""
    style, seed, solid = built
    front_x = 0.5 * draw_design(style, seed).depth_m
    corners = solid.mesh.vertices_m[solid.mesh.faces].astype(np.float64)
    pane = window_faces(solid) & (corners[..., 0].min(axis=1) > front_x - 0.5)
    pane &= corners[..., 2].max(axis=1) < draw_design(style, seed).eaves_m
    # Oriels have walls of their own, before the front.
    pane &= corners[..., 0].max(axis=1) < front_x
    centres = corners[pane].mean(axis=1)
    eyes = centres * [0.0, 1.0, 1.0] + [front_x + 6.0, 0.0, 0.0]

    distance, face, _ = cast(solid.mesh, eyes, np.tile([-1.0, 0.0, 0.0], (len(eyes), 1)))
    seen = np.isin(face, np.flatnonzero(pane))
    depth = distance[seen] - 6.0

    assert len(centres) >= 6
    # Balconies, awnings, shutters and railings hide many.
    assert seen.mean() > 0.2
    assert depth.min() > 0.1
    assert depth.max() < 0.36


@pytest.mark.slow
@for_some_of_every_style
def test_windows_have_the_size_and_sills_of_real_ones(built: tuple[str, int, Solid]) -> None:
    """Building practice: 1.0-2.9 m wide, 1.2-2.6 m high, storeys of 2.7-4.7 m; halls to 6.5 m."""
    style, seed, _ = built
    plan = draw_design(style, seed)

    assert 1.0 <= plan.window_m[0] <= 2.95
    assert 1.2 <= plan.window_m[1] <= 2.6
    assert 2.7 <= plan.storey_m <= 3.8
    assert 2.8 <= plan.ground_m <= 6.5
    assert 8.0 <= plan.width_m <= 30.0
    assert 8.0 <= plan.depth_m <= 22.0
    assert 1 <= plan.floors <= 13


@pytest.mark.slow
@for_some_of_every_style
def test_who_looks_at_it_from_outside_never_sees_an_inside(built: tuple[str, int, Solid]) -> None:
    """Rays from all around meet the front of a face first; thin railings excepted."""
    style, seed, solid = built
    plan = draw_design(style, seed)
    turn = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    height = np.linspace(0.4, plan.eaves_m + 1.0, 23)
    eye = np.array([(60 * np.cos(t), 60 * np.sin(t), 1.65) for t in turn for _ in height])
    aim = np.array([(0.0, (k % 5 - 2) * 0.15 * plan.width_m, z) for k, _ in enumerate(turn)
                    for z in height])  # fmt: skip
    direction = aim - eye

    _, face, normal = cast(solid.mesh, eye, direction)

    facing = (normal * direction).sum(axis=1) < 0.0
    assert (face >= 0).mean() > 0.9
    assert facing[face >= 0].mean() > 0.985


@for_some_of_every_style
def test_walls_are_closed_below_and_roofs_above(built: tuple[str, int, Solid]) -> None:
    """A ray up from below the ground meets the floor, a ray down from the sky the roof."""
    style, seed, solid = built
    plan = draw_design(style, seed)
    spread = np.linspace(-0.45, 0.45, 7)
    points = np.array([(a * plan.depth_m, b * plan.width_m) for a in spread for b in spread])
    n = len(points)
    below = np.column_stack([points, np.full(n, -1.0)])
    above = np.column_stack([points, np.full(n, 60.0)])

    floor_m, _, floor = cast(solid.mesh, below, np.tile([0.0, 0.0, 1.0], (n, 1)))
    roof_m, _, roof = cast(solid.mesh, above, np.tile([0.0, 0.0, -1.0], (n, 1)))

    assert np.allclose(floor_m, 1.0, atol=1e-3)
    assert (floor[:, 2] < 0.0).all()
    assert (60.0 - roof_m > plan.eaves_m - 0.05).all()
    assert (roof[:, 2] > 0.0).all()


@for_some_of_every_style
def test_the_front_faces_plus_x(built: tuple[str, int, Solid]) -> None:
    """There is more glass towards +X than towards any other side."""
    solid = built[2]
    corners = solid.mesh.vertices_m[solid.mesh.faces].astype(np.float64)[window_faces(solid)]
    area = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])

    towards = [area[:, 0].clip(0).sum(), -area[:, 0].clip(None, 0).sum()]
    towards += [area[:, 1].clip(0).sum(), -area[:, 1].clip(None, 0).sum()]
    assert np.argmax(towards) == 0


@for_some_of_every_style
def test_walls_have_the_first_material_of_their_design(built: tuple[str, int, Solid]) -> None:
    """The materials by which the variety of designs is counted are built."""
    style, seed, solid = built

    assert solid.mesh.materials[0] == building_materials(draw_design(style, seed), seed)[0]


def test_facts_name_style_and_floors() -> None:
    """Labels agree with the built house."""
    facts = building_facts(3, "old_town")

    assert facts.subcategory == "old_town"
    assert facts.attributes["floors"] == str(draw_design("old_town", 3).floors)
    assert facts.attributes["region"] in REGIONS


@pytest.mark.parametrize("style", STYLES)
def test_no_two_variants_have_the_same_design_and_materials(style: str) -> None:
    """Sixty seeds of a style; wall, roof, joinery and views of rooms are part of it."""
    drawn = [draw_design(style, seed) for seed in range(60)]
    looks = {(plan, building_materials(plan, seed)) for seed, plan in enumerate(drawn)}

    assert len(looks) == 60


@pytest.mark.slow
def test_no_two_of_200_buildings_have_the_same_mesh() -> None:
    digests = {
        hashlib.sha256(building(seed, style).mesh.vertices_m.tobytes()).hexdigest()
        for style in STYLES
        for seed in range(200 // len(STYLES) + 1)
    }

    assert len(digests) == len(STYLES) * (200 // len(STYLES) + 1)


@for_some_of_every_style
def test_front_stays_on_its_plot(built: tuple[str, int, Solid]) -> None:
    """Fences reach at most 3 m beyond the side walls, wings and porches 5 m before the front."""
    style, seed, solid = built
    plan = draw_design(style, seed)
    (x0, y0, _), (x1, y1, _) = solid.mesh.bounds_m()

    assert 0.5 * plan.width_m + 0.7 + plan.gate_m >= max(-y0, y1)
    assert x1 <= 0.5 * plan.depth_m + plan.wing_out_m + 2.5
    assert x0 >= -0.5 * plan.depth_m - 2.0


def test_a_region_changes_colours_but_no_shape() -> None:
    """The same house in the north and in the south."""
    north, south = (building(4, "house", region) for region in ("north", "south"))

    assert (north.mesh.vertices_m == south.mesh.vertices_m).all()
    assert north.mesh.materials != south.mesh.materials


@pytest.mark.parametrize("name", sorted(TEXTURE_ALBEDOS))
def test_palettes_give_the_albedo_of_whole_walls(name: str) -> None:
    """The tint is divided by the texture's mean luminance, within 12 %."""
    kinds = {"concrete": (0, 3)}.get(name, (0, 1, 2))
    library = open_library()
    textures = [library.texture(f"texture/{name}?seed={seed}") for seed in kinds]
    means = [float(luminance(srgb_decode(t.albedo / 255.0)).mean()) for t in textures]

    assert np.mean(means) == pytest.approx(TEXTURE_ALBEDOS[name], rel=0.12)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "cells", "share"), [("home", 4, 0.4), ("office", 4, 0.3)])
def test_windows_are_lit_one_by_one(kind: str, cells: int, share: float) -> None:
    """Of the panes of eight atlases the stated share shines, within three standard errors."""
    library = open_library()
    side = 512 // cells
    lit = []
    for seed in range(8):
        emission = library.texture(f"texture/window_view?seed={seed}&kind={kind}").emission
        assert emission is not None
        panes = emission.reshape(cells, side, cells, side, 3).max(axis=(1, 3, 4))
        lit += list((panes > 0).ravel())

    assert np.mean(lit) == pytest.approx(share, abs=3.0 * np.sqrt(share * (1.0 - share) / len(lit)))
