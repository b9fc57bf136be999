"""Hands of bananas: one body in physics, one instance per banana in labels."""

import numpy as np
import pytest

from gen_data.content.procedural import FAMILIES
from gen_data.core.motion import Trajectory
from gen_data.core.scene import Body, Instance, Scene
from gen_data.core.se3 import SE3
from gen_data.pipeline.separate_pieces import separate_pieces

HAND, SINGLE = "banana?seed=4", "banana?seed=0"
POSE = SE3((0.3, -0.2, 0.8), (0.8, 0.6, 0.0, 0.0))


def fruit(*assets: str) -> Scene:
    bodies = tuple(
        Body(f"clutter/{k}", asset, POSE, 1.2, k + 1, group="clutter", mass_kg=0.6)
        for k, asset in enumerate(assets)
    )
    instances = tuple(Instance(b.instance_id, b.name, "banana", 0, b.asset) for b in bodies)
    return Scene("test", bodies=bodies, instances=instances)


def test_a_hand_becomes_as_many_instances_as_bananas() -> None:
    """The variant has six; the first keeps name and id, and a single banana is untouched."""
    made = separate_pieces(fruit(HAND, SINGLE))

    assert len(made.bodies) == len(made.instances) == 6 + 1
    assert {body.instance_id for body in made.bodies} == {i.instance_id for i in made.instances}
    assert len({body.name for body in made.bodies}) == 7
    assert (made.bodies[0].name, made.bodies[0].instance_id) == ("clutter/0", 1)
    assert made.bodies[-1] == fruit(HAND, SINGLE).bodies[1]
    assert {body.group for body in made.bodies} == {"clutter"}
    assert sum(body.mass_kg for body in made.bodies[:6]) == pytest.approx(0.6)


def test_pieces_are_where_the_hand_was() -> None:
    """All vertices of the pieces together are the hand's, within the vertex grid."""
    made = separate_pieces(fruit(HAND))
    whole = FAMILIES["banana"].build(seed=4).mesh.vertices_m.astype(np.float64)
    parts = [
        body.T_world_body.apply(
            body.scale
            * FAMILIES["banana"].build(seed=4, piece=k).mesh.vertices_m.astype(np.float64)
        )
        for k, body in enumerate(made.bodies)
    ]
    sorted_parts, sorted_whole = (
        np.sort(points, axis=0) for points in (np.concatenate(parts), POSE.apply(1.2 * whole))
    )

    assert np.abs(sorted_parts - sorted_whole).max() < 5e-6


def test_what_moves_stays_whole() -> None:
    """An arm carries the hand as one body."""
    track = Trajectory("clutter/0", 0.1, (POSE, POSE))
    scene = Scene("test", fruit(HAND).bodies, fruit(HAND).instances, tracks=(track,))

    assert separate_pieces(scene) is scene
