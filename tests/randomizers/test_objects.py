"""Which objects a group gets, and where they start."""

import math
from collections import Counter
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from gen_data.config.distributions import Constant, Count, Flag, Uniform, UniformInteger
from gen_data.core.errors import ConfigError, LayoutRejected
from gen_data.core.scene import Body, Instance, Scene
from gen_data.core.se3 import SE3, Vec3
from gen_data.randomizers.distractors import Distractors
from gen_data.randomizers.objects import Objects
from tests.randomizers.doubles import (
    THINGS,
    FakeAssets,
    corners_of,
    deepest_overlap_m,
    overlap_m,
    rng_of,
    surface_scene,
)

PLACEMENTS = ("drop", "scatter", "grid", "stack", "row", "pile")
KEEP_OUT: tuple[Vec3, ...] = ((0.0, 0.0, 0.15),)


def drawn(
    scene: Scene, count: Count, scene_index: int = 0, *, upright: Flag | None = None
) -> Scene:
    given = {} if upright is None else {"upright": upright}
    objects = Objects(name="clutter", count=count, **given)  # type: ignore[arg-type]
    return objects(scene, FakeAssets(), rng_of("objects", scene_index, index=scene_index))


def bodies_of(scene: Scene) -> list[Body]:
    return [body for body in scene.bodies if body.group == "clutter"]


@pytest.mark.parametrize("placement", PLACEMENTS)
@pytest.mark.parametrize(
    ("count", "upright", "keep_out"), [(9, True, ()), (9, False, ()), (6, None, KEEP_OUT)]
)
def test_objects_start_apart_over_their_surface_and_where_nothing_keeps_them_out(
    placement: str, count: int, upright: bool | None, keep_out: tuple[Vec3, ...]
) -> None:
    """By the boxes, however they are turned: corners, edges seen from above, and overlaps."""
    given = None if upright is None else Constant(upright)
    for scene_index in range(12):
        scene = surface_scene((1.4, 1.0), placement=placement, keep_out=keep_out)
        scene = drawn(scene, Constant(count), scene_index, upright=given)
        bodies = bodies_of(scene)
        corners = np.stack([corners_of(body) for body in bodies])
        here = scene.surface("s0").T_world_surface.inverse().apply(corners.reshape(-1, 3))
        along = np.linspace(0.0, 1.0, 9).reshape(9, 1, 1, 1, 1)
        edges = along * corners[:, :, None, :2] + (1.0 - along) * corners[:, None, :, :2]

        assert deepest_overlap_m(bodies) < 1e-6
        assert (np.abs(here[:, :2]) <= np.array([0.7, 0.5]) + 1e-6).all()
        assert (here[:, 2] > 0.0).all()
        for x_m, y_m, radius_m in keep_out:
            assert np.hypot(edges[..., 0] - x_m, edges[..., 1] - y_m).min() > radius_m - 1e-6


def test_objects_in_a_row_touch() -> None:
    """Neighbours of a row are 6 mm apart at most along the surface, fronts or not."""
    for scene_index in range(12):
        scene = surface_scene((3.0, 0.3), placement="row", assets=("brick", "can?seed=0"))
        spans = sorted(
            (corners[:, 0].min(), corners[:, 0].max())
            for corners in map(corners_of, bodies_of(drawn(scene, Constant(5), scene_index)))
        )
        rows = sum(b - a for (_, a), (b, _) in pairwise(spans) if b > a)

        assert 0.0 <= rows <= 4 * 0.006


def test_rows_under_a_board_stand_at_its_front() -> None:
    """The shelf is open towards -Y; 15 % of the free depth is behind its edge."""
    for scene_index in range(12):
        scene = surface_scene((0.9, 0.5), placement="row", assets=("can?seed=0",), clearance_m=0.3)
        bodies = bodies_of(drawn(scene, Constant(4), scene_index))
        front_m = min(corners_of(body)[:, 1].min() for body in bodies)
        front_m -= scene.surface("s0").T_world_surface.translation_m[1]

        assert -0.25 <= front_m <= -0.25 + 0.15 * 0.5


def test_piles_are_narrower_than_dropped_objects() -> None:
    """Median distance from the middle of all, 8 objects on 4 m x 4 m."""
    away: dict[str, list[float]] = {"pile": [], "drop": []}
    for placement, distances in away.items():
        for scene_index in range(10):
            scene = surface_scene((4.0, 4.0), placement=placement, assets=("brick", "can?seed=1"))
            bodies = bodies_of(drawn(scene, Constant(8), scene_index))
            places = np.array([body.T_world_body.translation_m[:2] for body in bodies])
            distances.extend(np.linalg.norm(places - places.mean(axis=0), axis=1).tolist())

    assert np.median(away["pile"]) < 0.15
    assert np.median(away["drop"]) > 1.0


@pytest.mark.parametrize("kinds", [1, 2])
def test_kinds_limit_the_categories_of_a_scene(kinds: int) -> None:
    """Scenes differ in the categories, and all occur."""
    seen: Counter[str] = Counter()
    for scene_index in range(30):
        scene = surface_scene((4.0, 4.0))
        objects = Objects(name="clutter", count=Constant(8), kinds=Constant(kinds))
        made = objects(scene, FakeAssets(), rng_of("objects", scene_index, index=scene_index))
        found = {THINGS[body.asset].category for body in bodies_of(made)}
        seen.update(found)

        assert len(found) <= kinds
    assert len(seen) > 2


def test_standing_objects_rest_on_the_surface() -> None:
    """Scattered objects need no fall: their lowest point is within a millimetre."""
    scene = drawn(surface_scene(placement="scatter"), Constant(6))
    for body in bodies_of(scene):
        lowest_m = corners_of(body)[:, 2].min() - 1.0

        assert 0.0 < lowest_m < 0.001


def test_dropped_objects_fall_a_few_centimetres_at_most_onto_a_bare_surface() -> None:
    """A single object starts low: physics need not wait for it, and it does not bounce away."""
    for scene_index in range(20):
        (body,) = bodies_of(drawn(surface_scene(), Constant(1), scene_index))
        half_m = 0.5 * np.linalg.norm(THINGS[body.asset].size_m)

        assert body.T_world_body.translation_m[2] - 1.0 <= half_m + 0.05 + 1e-6


def test_towers_are_of_stackable_things_only() -> None:
    """Raised objects, and the ones below them, are flat above and below."""
    scene = surface_scene(placement="stack", assets=("bottle", "brick", "can?seed=0"))
    raised = 0
    for scene_index in range(8):
        bodies = bodies_of(drawn(scene, Constant(7), scene_index))
        for body in bodies:
            lowest_m = corners_of(body)[:, 2].min()
            if lowest_m < 1.001:
                continue
            raised += 1
            sunk = replace(body, T_world_body=SE3((0.0, 0.0, -0.004)) @ body.T_world_body)
            below = [other for other in bodies if other != body and overlap_m(sunk, other) > 0.0]

            assert THINGS[body.asset].stackable
            assert len(below) == 1
            assert THINGS[below[0].asset].stackable
    assert raised > 5


def test_shelves_are_filled_on_every_board_and_below_the_next() -> None:
    """Three boards 0.3 m apart: all are used, and nothing reaches through the next one."""
    used: set[int] = set()
    for placement in ("scatter", "drop"):
        scene = surface_scene((0.9, 0.5), placement=placement, clearance_m=0.28, levels=3)
        for scene_index in range(10):
            for body in bodies_of(drawn(scene, Constant(5), scene_index)):
                height_m = corners_of(body)[:, 2] - 1.0
                level = math.floor(height_m.min() / 0.28)
                used.add(level)

                assert height_m.max() < (level + 1) * 0.28
    assert used == {0, 1, 2}


def test_things_higher_than_the_space_are_refused_with_a_reason() -> None:
    """A bottle of 26 cm under a board at 20 cm."""
    scene = surface_scene(assets=("bottle",), clearance_m=0.2)
    with pytest.raises(LayoutRejected, match="higher than the space"):
        drawn(scene, Constant(1))


@pytest.mark.parametrize("placement", ["scatter", "grid", "stack"])
def test_too_many_to_stand_apart_are_refused_with_a_remedy(placement: str) -> None:
    """Ninety bottles on a small table: bounded tries, then the field to change."""
    scene = surface_scene((0.4, 0.3), placement=placement, assets=("bottle",))
    with pytest.raises(LayoutRejected) as refused:
        drawn(scene, Constant(90))
    assert "randomizers.clutter.count" in refused.value.rejection.remedy


def test_counts_are_those_that_were_asked_for() -> None:
    """All of 2..5 occur, and nothing else."""
    seen = {len(bodies_of(drawn(surface_scene(), UniformInteger(2, 5), k))) for k in range(40)}

    assert seen == {2, 3, 4, 5}


def test_categories_are_equally_likely_however_many_variants_they_have() -> None:
    """Two cans, one bottle, one brick: each category gets a third of 600 draws (3.9 sigma)."""
    counts: Counter[str] = Counter()
    for scene_index in range(60):
        scene = drawn(surface_scene((3.0, 3.0)), Constant(10), scene_index)
        counts.update(instance.category for instance in scene.instances)

    assert set(counts) == {"bottle", "brick", "can"}
    assert all(abs(n - 200) < 45 for n in counts.values())


def test_weights_change_how_often_a_category_is_drawn() -> None:
    """Weight 0 never comes; weight 3 comes three times as often as 1."""
    objects = Objects(name="clutter", count=Constant(10), weights={"bottle": 0.0, "can": 3.0})
    counts: Counter[str] = Counter()
    for scene_index in range(40):
        scene = objects(surface_scene((3.0, 3.0)), FakeAssets(), rng_of("w", scene_index))
        counts.update(instance.category for instance in scene.instances)

    assert "bottle" not in counts
    assert abs(counts["can"] - 300) < 35


def test_scale_changes_size_and_mass_together() -> None:
    """Mass goes with the cube of the scale."""
    objects = Objects(name="clutter", count=Constant(6), scale=Uniform(0.5, 2.0))
    for body in bodies_of(objects(surface_scene((3.0, 3.0)), FakeAssets(), rng_of())):
        assert 0.5 <= body.scale <= 2.0
        assert body.mass_kg == pytest.approx(THINGS[body.asset].mass_kg * body.scale**3, abs=1e-6)


def test_objects_are_labelled_bodies_that_fall() -> None:
    """Names count from 0 within the group; each has an instance of its asset's category."""
    scene = drawn(surface_scene(), Constant(4))

    assert [body.name for body in scene.bodies] == [f"clutter/{k}" for k in range(4)]
    for body in scene.bodies:
        instance = scene.instance(body.instance_id)
        assert (body.motion, body.collides) == ("dynamic", True)
        assert (instance.name, instance.asset) == (body.name, body.asset)
        assert instance.category == THINGS[body.asset].category
        assert instance.annotated


def test_instance_ids_are_the_smallest_that_are_free() -> None:
    """Ids 1 and 4 belong to others; three objects get 2, 3 and 5, again and again."""
    others = tuple(Instance(k, f"other/{k}", "thing", 0, "brick") for k in (1, 4))
    scene = replace(surface_scene(), instances=others)
    for scene_index in range(3):
        scene = drawn(scene, Constant(3), scene_index)

        assert [body.instance_id for body in bodies_of(scene)] == [2, 3, 5]
        assert scene.instances[:2] == others


def test_objects_keep_clear_of_other_groups() -> None:
    """A second group sees the first."""
    for scene_index in range(10):
        scene = drawn(surface_scene(), Constant(5), scene_index)
        more = replace(scene.groups[0], name="more")
        scene = replace(scene, groups=(*scene.groups, more))
        both = Objects(name="more", count=Constant(5))(
            scene, FakeAssets(), rng_of("m", scene_index)
        )

        assert len(both.bodies) == 10
        assert deepest_overlap_m(both.bodies) < 1e-6


def test_distractors_have_ids_but_no_annotations() -> None:
    """They follow their group's ``annotated``."""
    scene = surface_scene(assets=("odd",))
    group = replace(scene.groups[0], name="distractors", annotated=False)
    scene = replace(scene, groups=(group,))
    scene = Distractors(count=Constant(3))(scene, FakeAssets(), rng_of())

    assert [instance.annotated for instance in scene.instances] == [False] * 3
    assert [instance.instance_id for instance in scene.instances] == [1, 2, 3]


def test_unknown_group_and_category_are_named_with_the_nearest_that_exist() -> None:
    with pytest.raises(ConfigError, match=r"no object group 'cluter'.*did you mean 'clutter'"):
        Objects(name="cluter")(surface_scene(), FakeAssets(), rng_of())
    with pytest.raises(ConfigError, match=r"no category 'botle'.*did you mean 'bottle'"):
        Objects(name="clutter", weights={"botle": 1})(surface_scene(), FakeAssets(), rng_of())
    with pytest.raises(ConfigError, match="every weight is 0"):
        Objects(name="clutter", weights={"bottle": 0, "brick": 0, "can": 0})(
            surface_scene(), FakeAssets(), rng_of()
        )
