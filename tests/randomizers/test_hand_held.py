"""Objects held in a hand: contact from two sides, no flesh inside, room, and visible sides."""

import math
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull, cKDTree

from gen_data.assets.library import Library
from gen_data.config.distributions import Constant, Uniform
from gen_data.content.procedural import hand_grip
from gen_data.core.errors import ConfigError, LayoutRejected
from gen_data.core.scene import Body, ObjectGroup, Scene, SupportSurface
from gen_data.core.se3 import SE3, Array
from gen_data.randomizers.hand_held import HandHeld
from tests.randomizers.doubles import rng_of

YIELD_M = 0.003
"""Flesh gives way by this much."""
TOUCH_M = 0.0015
CONVEX = ("apple?seed=33", "kiwi?seed=7", "toy_block?seed=15", "carton?seed=3", "book?seed=1")


def table(*things: str) -> Scene:
    surface = SupportSurface("table", "table", SE3((0.0, 0.0, 0.74)), (1.2, 0.8), 1.5)
    hands = ObjectGroup("hands", ("table",), ("hand?seed=2", "hand?seed=9"), 0, "drop")
    held = ObjectGroup("held", ("table",), things, 0, "drop")
    inside = ((-2.5, -2.0, 0.0), (2.5, 2.0, 2.6))
    return Scene("test", surfaces=(surface,), groups=(hands, held), interior_m=inside)


def held_up(thing: str, library: Library, number: int = 0, **fields: object) -> tuple[Body, Body]:
    """The object and the hand."""
    grip = HandHeld(name="hands", **fields)  # type: ignore[arg-type]
    thing_body, hand = grip(table(thing), library, rng_of(thing, number)).bodies
    return thing_body, hand


def surface_of(body: Body, library: Library) -> Array:
    """Vertices and 6,000 points of a body's surface, world [m]."""
    mesh = library.mesh(body.asset)
    solid = trimesh.Trimesh(mesh.vertices_m.astype(np.float64), mesh.faces, process=False)
    spread, _ = trimesh.sample.sample_surface(solid, 6_000, seed=1)
    return body.T_world_body.apply(np.concatenate([solid.vertices, spread]))


@pytest.mark.slow
@pytest.mark.parametrize("thing", CONVEX)
def test_a_hand_touches_what_it_holds_and_does_not_enter_it(thing: str, library: Library) -> None:
    """By points of both surfaces, and the planes of the object's convex hull (Qhull)."""
    body, hand = held_up(thing, library, 1)
    flesh, shell = surface_of(hand, library), surface_of(body, library)
    planes = ConvexHull(shell).equations
    depth_m = -(flesh @ planes[:, :3].T + planes[:, 3]).max(axis=1)
    gap_m, _ = cKDTree(shell).query(flesh)

    assert depth_m.max() < YIELD_M
    assert gap_m.min() < TOUCH_M


@pytest.mark.slow
@pytest.mark.parametrize("thing", CONVEX[:2])
def test_a_grip_closes_from_opposite_sides(thing: str, library: Library) -> None:
    """Some two contacts face each other across the object's middle, as a pinch does."""
    body, hand = held_up(thing, library)
    assert "pose=hold" in hand.asset
    flesh, shell = surface_of(hand, library), surface_of(body, library)
    gap_m, nearest = cKDTree(shell).query(flesh)
    contacts = shell[nearest[gap_m < 0.002]] - shell.mean(axis=0)
    sides = contacts / np.linalg.norm(contacts, axis=1)[:, None]
    sample = sides[:: max(1, len(sides) // 400)]

    assert (sample @ sample.T).min() < math.cos(math.radians(100.0))


@pytest.mark.slow
def test_objects_too_thick_for_a_hand_rest_on_the_palm(library: Library) -> None:
    """A vase of 0.2 m touches the open hand from above."""
    body, hand = held_up("vase?seed=5", library)
    flesh, shell = surface_of(hand, library), surface_of(body, library)
    gap_m, nearest = cKDTree(shell).query(flesh)

    assert "pose=open" in hand.asset
    assert gap_m.min() < TOUCH_M
    assert shell[nearest[gap_m.argmin()], 2] < shell[:, 2].mean()


@pytest.mark.slow
def test_vessels_stay_upright(library: Library) -> None:
    """Their contents are level: no tilt beyond the one asked for."""
    for number in range(3):
        body, _ = held_up("cup?seed=9", library, number, spill_deg=Constant(10.0))
        up = body.T_world_body.rotate(np.array([0.0, 0.0, 1.0]))

        assert math.degrees(math.acos(min(1.0, float(up[2])))) <= 10.0 * math.sqrt(2.0)


@pytest.mark.slow
def test_other_objects_are_tilted_in_any_way(library: Library) -> None:
    """Directions of an axis of a carton lie in most octants."""
    octants = set()
    for number in range(12):
        body, _ = held_up("carton?seed=3", library, number)
        octants.add(tuple((body.T_world_body.rotate(np.array([0.3, 0.2, 1.0])) > 0.0).tolist()))

    assert len(octants) >= 6


@pytest.mark.slow
def test_the_palm_or_the_thumb_is_turned_to_the_viewer(library: Library) -> None:
    """By the joints: the palm's normal from wrist and knuckles, the thumb's side along them."""
    for number in range(6):
        facing = {"viewer_azimuth_deg": Constant(90.0), "elbow_azimuth_deg": Uniform(20.0, 160.0)}
        _, hand = held_up("apple?seed=33", library, number, **facing)
        joints = {p.name: np.array(p.position_m) for p in library.keypoints(hand.asset)}
        index, little = (joints[f"{finger}_1"] - joints["wrist"] for finger in ("index", "little"))
        # Out of the palm of a right hand; left hands are mirror images.
        palm = np.cross(index, little) * (1.0 if index[1] > little[1] else -1.0)
        normal, thumb = (
            hand.T_world_body.rotate(v / np.linalg.norm(v)) for v in (palm, index - little)
        )

        assert max(normal[1], thumb[1] - 0.3) > 0.1


def test_hands_need_room(library: Library) -> None:
    """In a space of 0.3 m there is none for a forearm."""
    scene = table("apple?seed=33")
    small = Scene("test", surfaces=scene.surfaces, groups=scene.groups,
                  interior_m=((-0.15, -0.15, 0.7), (0.15, 0.15, 1.2)))  # fmt: skip
    with pytest.raises(LayoutRejected, match="no free place for a hand"):
        HandHeld(name="hands")(small, library, rng_of())


def test_objects_that_no_hand_can_hold_are_named(library: Library) -> None:
    with pytest.raises(ConfigError, match=r"no hand can hold 'table.*at most 0\.45 m"):
        HandHeld(name="hands")(table("table?size_m=1.2,0.8,0.74"), library, rng_of())


def test_only_hands_with_fingers_hold(library: Library) -> None:
    scene = table("apple?seed=33")
    swapped = replace(scene, groups=(replace(scene.groups[0], assets=("mug?seed=1",)),))
    with pytest.raises(ConfigError, match=r"'mug\?seed=1' has no fingers that close; expected"):
        HandHeld(name="hands").check(swapped, library)


@pytest.mark.parametrize("radius_m", [0.015, 0.03, 0.046])
def test_sections_of_a_cylinder_are_its_circles(radius_m: float) -> None:
    """Whether they come from dense vertices or from the two rings at its ends."""
    turn = 2.0 * math.pi * np.arange(48) / 48
    for levels in (np.array([-0.06, 0.06]), np.linspace(-0.06, 0.06, 31)):
        rings = [[radius_m * math.cos(t), y, radius_m * math.sin(t)] for y in levels for t in turn]
        for section in hand_grip.sections(np.array(rings)):
            assert section == pytest.approx(radius_m, abs=1e-6)


def test_sections_keep_to_one_side_of_a_bend() -> None:
    """A bent tube of 10 mm: between its ends lies nothing, though its hull spans 30 mm there."""
    path, turn = np.linspace(-0.6, 0.6, 41), 2.0 * math.pi * np.arange(16) / 16
    a, t = (grid.ravel() for grid in np.meshgrid(path, turn, indexing="ij"))
    out = 0.12 + 0.01 * np.cos(t)
    bent = np.stack([out * np.cos(a) - 0.12, out * np.sin(a), 0.01 * np.sin(t)], axis=1)
    hull_m = np.ptp(bent[:, 0])
    for section in hand_grip.sections(bent):
        assert section is not None
        assert hull_m > 0.03
        assert section[0] + section[24] < 0.026
