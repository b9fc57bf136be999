"""Physics confirms that furnished rooms are at rest.

Bullet simulates them with exact triangle meshes of fixed objects, and the convex hulls of others.
"""

import math
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from gen_data.assets.families import declared
from gen_data.assets.library import open_library
from gen_data.core.interfaces import AssetLibrary
from gen_data.core.scene import Body, Scene
from gen_data.core.se3 import SE3, Array
from gen_data.rooms.resting import turn_to_rest
from gen_data.rooms.rules import room_types
from tests.rooms.test_layouts import KINDS, family, furnished, library

HUNG = {
    "bathroom_cabinet", "ceiling_lamp", "coat_hooks", "curtain", "draped_clothes",
    "hanging_clothes", "light_switch", "mirror", "notice_board", "parts_bins", "pegboard",
    "picture", "radiator", "range_hood", "roll_holder", "socket", "timber", "towel", "tube_lamp",
    "utensil_rail", "wall_calendar", "wall_clock", "wall_shelf", "wall_unit", "whiteboard",
}  # fmt: skip
"""On walls, ceilings, rails and the backs of chairs, or leaning against walls."""
FIXED = {
    "bathtub", "cooker", "kitchen_sink", "kitchen_unit", "shower", "toilet", "vise", "wash_basin",
}  # fmt: skip
"""Screwed to walls, floors and benches."""
HOLLOW = {
    "armchair", "bed", "bedside_table", "bookcase", "chair", "coffee_table", "desk", "dining_table",
    "dresser", "filing_cabinet", "meeting_table", "office_chair", "pallet_rack", "refrigerator",
    "side_table", "sofa", "steel_rack", "tool_cabinet", "trolley", "tv_stand", "wardrobe",
    "washing_machine", "workbench",
}  # fmt: skip
"""They may carry or contain others, for which a convex hull has no room; simulated by itself."""
SOFT = {"rug"}
"""Gives way to the feet of furniture."""
PACKS = Path(os.environ.get("GEN_DATA_TEST_ASSETS", "missing"), "packs")
NEEDS_CATALOGUE = pytest.mark.skipif(
    not (PACKS / "catalogue").is_dir(),
    reason="GEN_DATA_TEST_ASSETS names no folder with the catalogue pack",
)
SHELL = {"blind", "ceiling", "door_frame", "door_leaf", "floor", "wall", "window"}
STEP_S = 1.0 / 240.0
MOVE_M, TURN_DEG = 0.01, 8.0
"""More is a fall; feet of bins, speakers and dogs are some tenths of a millimetre apart."""
SCALE = 20.0
"""Of the simulated world: Bullet keeps hulls 1 to 2 mm apart, on which small objects would roll."""
DENSITY_KG_M3 = 300.0


def mesh_of(bodies: Sequence[Body], assets: AssetLibrary) -> trimesh.Trimesh:
    parts = []
    for body in bodies:
        mesh = assets.mesh(body.asset)
        corners = body.T_world_body.apply(mesh.vertices_m.astype(np.float64))
        parts.append(trimesh.Trimesh(corners, mesh.faces, process=False))
    return trimesh.util.concatenate(parts)


class Bullet:
    def __init__(self, client: int) -> None:
        self.pb = pytest.importorskip("pybullet")
        self.here = {"physicsClientId": client}
        self.starts: dict[int, tuple[str, Array]] = {}

    def fix(self, mesh: trimesh.Trimesh) -> None:
        """Add triangles that do not move; their inner edges push nothing aside."""
        shape = self.pb.createCollisionShape(
            self.pb.GEOM_MESH,
            vertices=(SCALE * mesh.vertices).tolist(),
            indices=mesh.faces.ravel().tolist(),
            flags=self.pb.GEOM_FORCE_CONCAVE_TRIMESH | self.pb.GEOM_CONCAVE_INTERNAL_EDGE,
            **self.here,
        )
        self.pb.createMultiBody(0, shape, **self.here)

    def drop(self, name: str, mesh: trimesh.Trimesh) -> None:
        """Add a convex hull that is free to move; wood and plastic slide and roll like this."""
        hull = mesh.convex_hull
        center, points = SCALE * hull.center_mass, SCALE * hull.vertices
        # Bullet takes few vertices: the outermost ones, and all of the base.
        ways = np.random.default_rng(0).normal(size=(400, 3))
        base = np.flatnonzero(points[:, 2] < points[:, 2].min() + 3e-3 * SCALE)
        few = points[sorted({*np.argmax(points @ ways.T, axis=0), *base})]
        shape = self.pb.createCollisionShape(
            self.pb.GEOM_MESH, vertices=(few - center).tolist(), **self.here
        )
        mass_kg = DENSITY_KG_M3 * max(hull.volume, 1e-6) * SCALE**3
        number = self.pb.createMultiBody(mass_kg, shape, basePosition=center.tolist(), **self.here)
        self.pb.changeDynamics(
            number,
            -1,
            lateralFriction=0.5,
            rollingFriction=5e-4 * SCALE,
            restitution=0.0,
            **self.here,
        )
        self.starts[number] = name, center

    def fallen(self, seconds: float = 2.0) -> dict[str, tuple[float, float]]:
        """How far [m] and by how much [deg] objects have moved that were not at rest."""
        for _ in range(round(seconds / STEP_S)):
            self.pb.stepSimulation(**self.here)
        found = {}
        for number, (name, start) in self.starts.items():
            position, turn = self.pb.getBasePositionAndOrientation(number, **self.here)
            moved_m = float(np.linalg.norm(np.array(position) - start)) / SCALE
            turned_deg = math.degrees(2.0 * math.acos(min(1.0, abs(turn[3]))))
            if moved_m > MOVE_M or turned_deg > TURN_DEG:
                found[name] = moved_m, turned_deg
        return found


@contextmanager
def bullet() -> Iterator[Bullet]:
    pb = pytest.importorskip("pybullet")
    client = pb.connect(pb.DIRECT)
    pb.setGravity(0.0, 0.0, -9.81 * SCALE, physicsClientId=client)
    # With fewer, objects creep by millimetres a second on level boards.
    pb.setPhysicsEngineParameter(numSolverIterations=200, physicsClientId=client)
    try:
        yield Bullet(client)
    finally:
        pb.disconnect(client)


def kind_of(body: Body, assets: AssetLibrary) -> str:
    """Family of a body's asset; of a model of a pack, its category with an underscore."""
    if "?" in body.asset or "/" not in body.asset:
        return family(body)
    return assets.get(body.asset).category.replace(" ", "_")


def settle(scene: Scene, assets: AssetLibrary) -> tuple[int, dict[str, tuple[float, float]]]:
    """Number of objects in a room that could fall, and all fallen ones."""
    instances: dict[int, list[Body]] = {}
    for body in scene.bodies:
        if body.collides and kind_of(body, assets) not in SOFT:
            instances.setdefault(body.instance_id, []).append(body)
    with bullet() as world:
        for bodies in instances.values():
            if kind_of(bodies[0], assets) in HUNG | FIXED | HOLLOW | SHELL:
                world.fix(mesh_of(bodies, assets))
            else:
                world.drop(bodies[0].name, mesh_of(bodies, assets))
        return len(world.starts), world.fallen()


@pytest.mark.slow
@NEEDS_CATALOGUE
@pytest.mark.parametrize("kind", KINDS)
def test_nothing_falls_in_five_rooms_with_furniture_of_packs(kind: str) -> None:
    """Models of the catalogue stand, and carry the objects on them."""
    assets = open_library((), packs=PACKS)
    results = [settle(furnished(kind, seed, assets), assets) for seed in range(5)]
    assert sum(number for number, _ in results) > 10
    assert [fallen for _, fallen in results if fallen] == []


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", [
    pytest.param(0, marks=pytest.mark.slow),
    *(pytest.param(k, marks=pytest.mark.exhaustive) for k in (1, 2)),
])  # fmt: skip
def test_nothing_falls_in_a_room_of_each_type(kind: str, seed: int) -> None:
    """Two seconds of simulation: tables, shelves and floors carry the objects on them."""
    number, fallen = settle(furnished(kind, seed), library())
    assert number > 5
    assert fallen == {}


def standing_families() -> list[str]:
    """Families that rooms place on floors and surfaces, as they are."""
    places = {"wall", "corner", "free", "front", "beside", "around", "on", "across"}
    rules = [rule for kind in room_types().values() for rule in kind.pieces]
    placed = {f for rule in rules if rule.place in places for f in rule.assets}
    things = {f for rule in rules for f in rule.things}
    loose = {name for name in placed | things if declared(name, "loose", False)}
    return sorted((placed | things) - loose - HUNG - FIXED - SOFT)


@pytest.mark.slow
def test_what_is_placed_as_it_is_stands_as_it_is() -> None:
    """Two variants of each family, even if ``settle`` does not let it fall; more plants."""
    families = standing_families()
    assert set(families) > HOLLOW
    with bullet() as world:
        world.fix(trimesh.creation.box((900.0, 200.0, 0.2)).apply_translation((0.0, 0.0, -0.1)))
        for k, name in enumerate(families):
            for seed in range(12 if name == "house_plant" else 2):
                at_m = (4.0 * k - 2.0 * len(families), 4.0 * seed - 16.0, 0.0)
                low_m = library().bounds_m(f"{name}?seed={seed}")[0][2]
                body = Body(name, f"{name}?seed={seed}", SE3((*at_m[:2], -low_m)))
                world.drop(f"{name} {seed}", mesh_of([body], library()))
        assert world.fallen() == {}


clouds = arrays(np.float64, (12, 3), elements=st.floats(-1.0, 1.0, width=32))


@settings(max_examples=60)
@given(clouds)
def test_the_centre_of_mass_is_above_the_base_after_the_turn(points_m: Array) -> None:
    """By trimesh's centre of mass, and the convex hull of the lowest points."""
    if np.linalg.matrix_rank(points_m - points_m.mean(axis=0), tol=0.05) < 3:
        return
    turn = turn_to_rest(points_m)
    if turn is None:
        return
    turned_m = SE3(quaternion_wxyz=turn).apply(points_m)
    hull = trimesh.convex.convex_hull(turned_m)
    base = turned_m[turned_m[:, 2] < turned_m[:, 2].min() + 1e-6]
    assert len(base) >= 3
    outline = cv2.convexHull(base[:, :2].astype(np.float32))
    x, y, _ = hull.center_mass.tolist()
    assert cv2.pointPolygonTest(outline, (x, y), measureDist=True) > -1e-5
