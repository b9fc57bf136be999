"""Relations between objects, held against distances, rays and hulls of others."""

from dataclasses import dataclass, replace
from functools import cache
from itertools import combinations
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull
from trimesh.collision import CollisionManager

from gen_data.annotations.annotate import Thresholds, annotate_ego, annotate_reading
from gen_data.annotations.instance_masks import InstanceMasks
from gen_data.annotations.relations import Relations
from gen_data.annotations.surface_contacts import are_within, find_contacts, hits_by_rays
from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.core.capture import Channel
from gen_data.core.interfaces import AssetLibrary
from gen_data.core.sample import ImageTruth, Relation
from gen_data.core.scene import Scene
from tests.embree import RayCaster, placed
from tests.tiers import cases, slow
from tests.wheels import INSTALLED

SAMPLING_M = 0.001
"""Points on surfaces are so dense that the true distance is at most this much smaller."""


def box(size_m: tuple[float, float, float], at_m: tuple[float, float, float]) -> Any:
    made = trimesh.creation.box(size_m).apply_translation(at_m)
    return np.asarray(made.triangles, np.float64)


@pytest.mark.parametrize(
    ("lift_m", "touches"), [(0.0, True), (0.0019, True), (0.0021, False), (-0.0019, True)]
)
def test_contacts_reach_as_far_as_the_tolerance(lift_m: float, touches: bool) -> None:
    """A cube over a table: the normals of its contacts point up into it."""
    table, cube = box((2, 2, 0.1), (0, 0, -0.05)), box((0.1, 0.1, 0.1), (0.3, 0.1, 0.05 + lift_m))
    contacts = find_contacts(cube, table, 0.002)

    assert bool(len(contacts.gaps_m)) == touches
    assert np.allclose(contacts.normals, [0, 0, 1])
    assert np.allclose(contacts.gaps_m, lift_m)
    assert np.allclose(np.abs(contacts.points_m - [0.3, 0.1, lift_m]).max(1), 0.05)


def test_crossed_rods_touch_at_a_point() -> None:
    """No corner is near: two edges meet, and the normal is across both."""
    along = (
        box((1, 0.02, 0.02), (0, 0, 0))
        @ np.array(trimesh.transformations.rotation_matrix(np.pi / 4, [1, 0, 0]))[:3, :3].T
    )
    across = (
        box((0.02, 1, 0.02), (0, 0, 0))
        @ np.array(trimesh.transformations.rotation_matrix(np.pi / 4, [0, 1, 0]))[:3, :3].T
    )
    upper = across + np.array([0, 0, 0.02 * 2**0.5 + 0.001])
    contacts = find_contacts(upper, along, 0.0015)

    assert np.allclose(contacts.normals, [0, 0, 1])
    assert np.allclose(contacts.gaps_m, 0.001)
    assert np.allclose(contacts.points_m[:, :2], 0.0)


def test_side_by_side_is_not_above() -> None:
    """A taller box next to a lower one touches its side: no contact carries it."""
    low, tall = box((0.1, 0.1, 0.1), (0, 0, 0.05)), box((0.1, 0.1, 0.102), (0.101, 0, 0.051))
    contacts = find_contacts(tall, low, 0.002)

    assert len(contacts.gaps_m)
    assert np.allclose(contacts.normals, [1, 0, 0])


@pytest.mark.parametrize(("gap_m", "near"), [(0.0, True), (0.299, True), (0.301, False)])
def test_distances_between_faces_are_exact(gap_m: float, near: bool) -> None:
    """Large triangles, whose corners are all farther apart."""
    plate, tip = box((8, 8, 0.1), (0, 0, -0.05)), box((0.2, 0.2, 0.2), (1, 1, 0.1 + gap_m))

    assert (are_within(plate, tip, 0.3), are_within(tip, plate, 0.3)) == (near, near)


def test_rays_hit_what_is_before_them() -> None:
    wall = box((0.1, 4, 4), (2, 0, 0))

    hits = hits_by_rays(np.zeros((3, 3)), np.eye(3), wall)

    assert hits.min(axis=1).tolist() == pytest.approx([1.95, np.inf, np.inf])
    assert np.isfinite(hits[0]).sum() >= 2  # the near and the far side
    assert np.isinf(hits_by_rays(np.zeros((3, 3)), -np.eye(3), wall)).all()


@dataclass(frozen=True)
class Settled:
    """A scene after physics: its truth, and the mesh of each instance in the world."""

    scene: Scene
    image: ImageTruth
    relations: tuple[Relation, ...]
    meshes: dict[int, trimesh.Trimesh]

    def pairs(self, predicate: str) -> set[tuple[int, int]]:
        """Subject and object of all relations of a kind in space."""
        return {(r.subject, r.object) for r in self.relations if r.predicate == predicate}


@cache
def settled(config: str, index: int, engine: str = INSTALLED[0]) -> Settled:
    """Sample of a shipped configuration, settled by physics."""
    small = ["sensors[0].size_px=[320, 240]", "exporters=[]", "annotations=[]"]
    small.append(f"physics.engine={engine}")
    with open_pipeline(load_config(config, overrides=small), frozenset({Channel.INSTANCE})) as made:
        sample = made.sample(index)
        reading = next(iter(sample.capture.readings.values()))
        annotators = [InstanceMasks(), Relations()]
        image = annotate_reading(sample.scene, reading, annotators, Thresholds(), made.assets)
        frame = annotate_ego({"": sample.scene}, [Relations()], made.assets)
        assert frame is not None and frame.relations is not None
        meshes = instance_meshes(sample.scene, made.assets)
        return Settled(sample.scene, image, frame.relations, meshes)


def instance_meshes(scene: Scene, assets: AssetLibrary) -> dict[int, trimesh.Trimesh]:
    """Meshes in the world by instance."""
    parts: dict[int, list[trimesh.Trimesh]] = {}
    for body in scene.bodies:
        parts.setdefault(body.instance_id, []).append(trimesh.Trimesh(*placed(body, assets)))
    return {number: trimesh.util.concatenate(parts[number]) for number in parts if number}


def distance_m(one: trimesh.Trimesh, other: trimesh.Trimesh) -> float:
    """Distance of two meshes, by the Flexible Collision Library."""
    parts = [CollisionManager(), CollisionManager()]
    for part, mesh in zip(parts, (one, other), strict=True):
        part.add_object("mesh", mesh)
    return float(parts[0].min_distance_other(parts[1]))


WORLDS = [("tabletop", 0, INSTALLED[0]), ("tabletop", 10, INSTALLED[0])]
BINS = [("bin_picking", 0, engine) for engine in INSTALLED]
each = pytest.mark.parametrize(("config", "index", "engine"), cases([*WORLDS, *BINS], WORLDS[:1]))


@pytest.mark.slow
@each
def test_things_touch_what_supports_them_from_above(config: str, index: int, engine: str) -> None:
    """Rays straight down from points of the subject, and up from its support, find the other."""
    world = settled(config, index, engine)
    assert world.pairs("supported_by")
    for subject, support in world.pairs("supported_by"):
        one, other = world.meshes[subject], world.meshes[support]
        gaps = []
        for source, target, down in ((one, other, -1.0), (other, one, 1.0)):
            points = np.concatenate([source.sample(60_000, seed=0), source.vertices])
            # From a little behind the surface: resting objects overlap by rounding.
            points[:, 2] -= down * 0.003
            hits = RayCaster((target.vertices, target.faces)).cast(points, (0.0, 0.0, down))
            gaps.append(hits.distance.min() - 0.003)
        assert min(gaps) < 0.002 / 0.5 + SAMPLING_M, (subject, support)


@each
def test_all_at_rest_is_supported_down_to_furniture(config: str, index: int, engine: str) -> None:
    """Physics stability: nothing floats. Chains of supports end at static bodies."""
    world = settled(config, index, engine)
    below: dict[int, set[int]] = {}
    for subject, support in world.pairs("supported_by") | world.pairs("held_by"):
        below.setdefault(subject, set()).add(support)
    loose = {b.instance_id for b in world.scene.bodies if b.motion == "dynamic"}
    annotated = {i.instance_id for i in world.scene.instances if i.annotated}
    for number in loose & annotated:
        reached, frontier = set(), {number}
        while frontier:
            reached |= frontier
            frontier = {s for f in frontier for s in below.get(f, ())} - reached
        assert reached - loose, f"nothing carries {world.scene.instance(number).name}"


@each
def test_no_two_things_carry_each_other(config: str, index: int, engine: str) -> None:
    pairs = settled(config, index, engine).pairs("supported_by")

    assert not {(a, b) for a, b in pairs if (b, a) in pairs}


@pytest.mark.slow
@each
def test_near_things_are_nearer_than_half_the_smaller(config: str, index: int, engine: str) -> None:
    """And all others are farther; pairs that touch, hold or contain each other are left out."""
    world = settled(config, index, engine)
    annotated = sorted(i.instance_id for i in world.scene.instances if i.annotated)
    related = {frozenset((r.subject, r.object)) for r in world.relations if r.predicate != "near"}
    near = world.pairs("near")
    sides = {
        i.instance_id: max(np.subtract(i.box_max_m, i.box_min_m)) for i in world.scene.instances
    }
    for a, b in combinations(annotated, 2):
        if frozenset((a, b)) in related:
            continue
        limit_m = 0.5 * min(sides[a], sides[b])
        apart_m = distance_m(world.meshes[a], world.meshes[b])
        assert ((a, b) in near) == (apart_m <= limit_m), (a, b)


@slow
def test_parts_in_a_bin_are_inside_it_and_things_on_a_table_are_not() -> None:
    """Points of their surfaces are counted in the bin's convex hull, by Qhull."""
    bin_world, table_world = settled("bin_picking", 0), settled("tabletop", 0)
    (bin_id,) = (i.instance_id for i in bin_world.scene.instances if i.category == "bin")
    sides = ConvexHull(bin_world.meshes[bin_id].vertices).equations
    for instance in bin_world.scene.instances:
        if not instance.annotated or instance.instance_id == bin_id:
            continue
        points = bin_world.meshes[instance.instance_id].sample(4000, seed=0)
        inside = (points @ sides[:, :3].T + sides[:, 3] <= 0.0).all(axis=1).mean()
        assert ((instance.instance_id, bin_id) in bin_world.pairs("inside")) == (inside > 0.5)
    assert not table_world.pairs("inside")
    assert table_world.pairs("on") <= table_world.pairs("supported_by")


@pytest.mark.slow
def test_what_the_hand_holds_is_held_and_on_nothing() -> None:
    """The arm's goal in this scene is to hold an object; its pads touch it."""
    world = settled("tabletop", 0)
    (arm,) = world.scene.articulations
    assert arm.goal is not None and arm.goal.kind == "hold"
    held = world.scene.body(arm.goal.grasped_object).instance_id

    assert world.pairs("held_by") == {(held, arm.instance_id)}
    assert held not in {subject for subject, _ in world.pairs("on")}


@slow
def test_furniture_stands_on_the_floor_and_things_on_furniture_below_them() -> None:
    """In a furnished room: no wall, ceiling or floor is carried, nothing by its neighbour."""
    world = settled("rooms", 31)
    category = {i.instance_id: i.category for i in world.scene.instances}
    low_m = {k: float(mesh.vertices[:, 2].min()) for k, mesh in world.meshes.items()}
    carried: dict[int, set[int]] = {}
    for subject, below in world.pairs("supported_by"):
        carried.setdefault(subject, set()).add(below)
    shell = {k for k, name in category.items() if name in ("floor", "wall", "ceiling")}
    (floor,) = (k for k in shell if category[k] == "floor")
    standing = [k for k in low_m if abs(low_m[k]) < 1e-4 and k not in shell]

    assert len(shell) == 6
    assert not carried.keys() & shell
    assert len(standing) > 5
    assert {k: carried.get(k) for k in standing} == {k: {floor} for k in standing}
    raised = {k: below for k, below in carried.items() if k not in standing}
    assert len(raised) > 5
    assert all(low_m[k] > low_m[b] for k, below in raised.items() for b in below)


@each
def test_views_follow_from_boxes_and_depths(config: str, index: int, engine: str) -> None:
    """Left and right by columns; before and behind, for shared columns, by distance."""
    world = settled(config, index, engine)
    boxes = {t.instance.instance_id: t.box for t in world.image.objects if t.box}
    stated = {(r.subject, r.predicate, r.object) for r in world.image.relations or ()}
    pose = world.image.camera.T_world_camera
    x, y, _ = pose.rotation()[:, 0]
    away = np.array([-y, x, 0.0]) / np.hypot(x, y)
    assert (pose.rotation()[:, 2] - pose.rotation()[:, 1]) @ away > 0.0
    for a, b in combinations(boxes, 2):
        for one, other in ((a, b), (b, a)):
            left = boxes[one].x_max <= boxes[other].x_min
            apart = left or boxes[other].x_max <= boxes[one].x_min
            nearer = (world.meshes[one].vertices @ away).max() <= (
                world.meshes[other].vertices @ away
            ).min()
            assert ((one, "left_of", other) in stated) == left
            assert ((one, "in_front_of", other) in stated) == (nearer and not apart)


@pytest.mark.slow
def test_images_tell_only_of_what_they_show() -> None:
    """An object without visible pixels is in the scene's graph and in no image's."""
    world = settled("bin_picking", 0)
    shown = {t.instance.instance_id for t in world.image.objects}
    furniture = {i.instance_id for i in world.scene.instances if not i.annotated}
    named = {n for r in world.image.relations or () for n in (r.subject, r.object)}

    assert named <= shown | furniture
    assert replace(world.image, relations=None).relations is None
