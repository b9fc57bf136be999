"""Traffic lights: lit lenses, their frequency, and never green for both."""

import math
from collections.abc import Callable

import pytest
from scipy.stats import chisquare

from gen_data.assets.library import Library
from gen_data.content.scenery.traffic_lights import (
    PEDESTRIAN_LENSES,
    VEHICLE_LENSES,
    pedestrian_signal,
    traffic_light,
)
from gen_data.core.scene import Body, Instance, Scene
from gen_data.core.se3 import SE3
from gen_data.core.streams import Rng, Streams
from gen_data.randomizers.traffic_lights import COLORS, TrafficLights

Draw = Callable[..., Scene]
WEIGHTS = {"red": 0.46, "green": 0.44, "yellow": 0.06, "red_yellow": 0.04}


@pytest.fixture
def draw(library: Library) -> Draw:
    def drawn(scene: Scene, index: int, **fields: object) -> Scene:
        made = TrafficLights.model_validate({"name": "lights", **fields})
        return made(scene, library, rng(index))

    return drawn


def rng(scene: int) -> Rng:
    return Streams(seed=5, scene=scene).rng("lights")


def scene_of(*signals: tuple[str, float, float, float]) -> Scene:
    bodies, instances = [], []
    for k, (asset, x, y, yaw_deg) in enumerate(signals, 1):
        kind = "pedestrian" if asset.startswith("pedestrian") else "vehicle"
        pose = SE3.about_z(math.radians(yaw_deg), (x, y, 0.0))
        bodies.append(Body(f"signal/{k}", asset, pose, instance_id=k))
        instances.append(Instance(k, f"signal/{k}", "traffic_light", 1, asset, subcategory=kind))
    return Scene("street", bodies=tuple(bodies), instances=tuple(instances))


def states(scene: Scene) -> list[str]:
    return [dict(instance.attributes)["state"] for instance in scene.instances]


def test_states_of_single_signals_come_as_often_as_their_weights_say(draw: Draw) -> None:
    """Chi-square goodness of fit over 2000 scenes."""
    scene = scene_of(("traffic_light?seed=0", 0.0, 0.0, 0.0))
    seen = [states(draw(scene, k))[0] for k in range(2000)]

    counts = [seen.count(state) for state in WEIGHTS]
    assert sum(counts) == 2000
    assert chisquare(counts, [2000 * w for w in WEIGHTS.values()]).pvalue > 0.001


def test_crossing_directions_never_have_green_together(draw: Draw) -> None:
    """A junction of four: opposite signals agree, crossing ones do not conflict."""
    scene = scene_of(
        ("traffic_light?seed=0", 8.0, 6.0, 0.0),
        ("traffic_light?seed=1", -8.0, -6.0, 180.0),
        ("traffic_light?seed=3", -6.0, 8.0, 90.0),
        ("traffic_light?seed=4", 6.0, -8.0, -90.0),
    )
    pairs = set()
    for k in range(300):
        east, west, north, south = states(draw(scene, k))
        assert east == west
        assert north == south
        pairs.add((east, north))

    assert pairs == {
        ("red", "green"), ("green", "red"), ("yellow", "red"), ("red_yellow", "red"),
    }  # fmt: skip


def test_junctions_far_apart_are_independent(draw: Draw) -> None:
    """Two signals 100 m apart disagree in some scenes and agree in others."""
    scene = scene_of(
        ("traffic_light?seed=0", 0.0, 0.0, 0.0), ("traffic_light?seed=0", 100.0, 0.0, 0.0)
    )
    agree = {len(set(states(draw(scene, k)))) for k in range(40)}

    assert agree == {1, 2}


@pytest.mark.parametrize(("state", "lit"), [
    ("red", {"lens_red"}),
    ("red_yellow", {"lens_red", "lens_yellow"}),
    ("yellow", {"lens_yellow"}),
    ("green", {"lens_green"}),
])  # fmt: skip
def test_exactly_the_lenses_of_a_state_emit_light(draw: Draw, state: str, lit: set[str]) -> None:
    """With the luminance that was asked for; everything else is dark."""
    scene = scene_of(("traffic_light?seed=2", 0.0, 0.0, 0.0))
    body = draw(scene, 0, state=state, luminance_cd_m2=6400.0).bodies[0]

    glowing = {m.role: m.emission_cd_m2 for m in body.materials if any(m.emission_cd_m2)}
    assert set(glowing) == lit
    for r, g, b in glowing.values():
        assert 0.2126 * r + 0.7152 * g + 0.0722 * b == pytest.approx(6400.0, rel=0.01)


def test_people_walk_along_with_green_traffic_and_stop_otherwise(draw: Draw) -> None:
    """A pedestrian signal follows the axis that it faces."""
    scene = scene_of(
        ("traffic_light?seed=0", 0.0, 0.0, 0.0), ("pedestrian_signal?seed=0", 3.0, 0.0, 180.0)
    )

    assert states(draw(scene, 0, state="green")) == ["green", "walk"]
    for state in ("red", "yellow", "red_yellow"):
        assert states(draw(scene, 0, state=state)) == [state, "stop"]


@pytest.mark.parametrize("seed", range(8))
def test_red_is_above_yellow_is_above_green_and_all_face_plus_x(seed: int) -> None:
    """By the height of the lowest lens of each colour."""
    mesh = traffic_light(seed, "any").mesh
    heights = []
    for role in VEHICLE_LENSES:
        slot = next(k for k, m in enumerate(mesh.materials) if m.role == role)
        vertices = mesh.faces[mesh.face_slots == slot].ravel()
        heights.append(float(mesh.vertices_m[vertices][:, 2].min()))
        assert mesh.normals[vertices][:, 0].min() > 0.0

    assert heights[0] > heights[1] > heights[2] > 2.1


def test_signals_for_people_have_a_stop_and_a_walk_lens() -> None:
    roles = {m.role for m in pedestrian_signal(1).mesh.materials}

    assert set(PEDESTRIAN_LENSES) <= roles
    assert not roles & set(VEHICLE_LENSES)
    assert set(COLORS) == {*PEDESTRIAN_LENSES, *VEHICLE_LENSES}
