"""Medians, lanes for those who turn across, and worn surfaces of junctions."""

import numpy as np
import pytest

from gen_data.content.roads import FAMILIES
from gen_data.core.asset_types import MeshData
from gen_data.core.errors import ConfigError
from gen_data.core.scene import Scene
from gen_data.roads.cross_section import RoadShape, height_m
from gen_data.roads.junction_shape import JunctionShape, make_fan
from gen_data.scene_templates.builder import build_scene
from gen_data.scene_templates.element import Element
from gen_data.scene_templates.junction import Junction
from gen_data.scene_templates.road import Road
from gen_data.scene_templates.signals import Signals
from tests.libraries import library

MEDIAN = {"median_m": 3.0, "length_m": 60.0}


def built(*elements: Element) -> Scene:
    return build_scene("test", elements, library())


def crossing(arms_deg: tuple[float, ...] = (0.0, 90.0, 180.0, 270.0), **road: object) -> Scene:
    """A road with a lane for those who turn left, and the junction that it leads to."""
    main = Road(name="main", turn_m=(0.0, 30.0), **{**MEDIAN, **road})  # type: ignore[arg-type]
    cross = Junction(
        name="cross", after="main", arms_deg=arms_deg, median_m=3.0, turn_lane=True,
        traffic=main.traffic,
    )  # fmt: skip
    parts = [
        Road(name=f"arm{k}", after=f"cross/{k}", traffic=main.traffic, **MEDIAN)  # type: ignore[arg-type]
        for k, arm in enumerate(arms_deg)
        if arm != 180.0
    ]
    return built(main, cross, *parts, Signals(name="signals", junction="cross"))


@pytest.mark.parametrize("traffic", ["right", "left"])
def test_those_who_turn_across_have_a_lane_of_their_own(traffic: str) -> None:
    """It leads to the road across; the lane beside it leads everywhere else."""
    scene = crossing(traffic=traffic)
    lanes = {lane.name: lane for lane in scene.lanes}
    across = "arm1" if traffic == "right" else "arm3"

    (path,) = lanes["main/turn_forward"].successors
    assert [name.partition("/")[0] for name in lanes[path].successors] == [across]
    ways = [lanes[name].successors[0] for name in lanes["main/forward0"].successors]
    assert {way.partition("/")[0] for way in ways} == {"arm0", "arm1", "arm3"} - {across}


def test_lanes_do_not_overlap() -> None:
    """3 m of median between lanes of 3.5 m; one signal per road."""
    scene = crossing()
    lanes = {lane.name: lane for lane in scene.lanes}
    middles = {
        name: float(np.mean([y for _, y, _ in lanes[f"main/{name}"].center_m]))
        for name in ("turn_forward", "forward0", "backward0")
    }

    assert lanes["main/turn_forward"].width_m == 3.0
    assert middles == pytest.approx({"turn_forward": 0.0, "forward0": -3.25, "backward0": 3.25})
    assert lanes["main/turn_forward"].center_m[0][0] == pytest.approx(30.0)
    assert sum(body.name.startswith("signals/") for body in scene.bodies) == 4


def test_arms_without_a_road_across_have_no_such_lane() -> None:
    """At a T, those from the east cannot turn left."""
    shape = JunctionShape((0.0, 90.0, 180.0, -1.0), median_m=3.0, turn_lane=1.0)

    assert [shape.has_turn_lane(k) for k in range(3)] == [False, True, True]
    assert not JunctionShape(median_m=3.0).has_turn_lane(0)


def test_mouths_have_the_cross_section_of_roads_with_medians() -> None:
    """Heights over the whole width agree within the sagitta of the mesh."""
    shape = JunctionShape(median_m=3.0, lanes=2)
    road = RoadShape(median_m=3.0, lanes=(2.0, 2.0))
    t = np.linspace(-8.4, 8.4, 9)
    mouth = np.stack([np.full(9, shape.reach_m() - 1e-6), t], axis=1)

    assert make_fan(shape).height_m(mouth) == pytest.approx(height_m(road, t), abs=0.03)
    assert shape.half_m == road.carriageway_m(1)


@pytest.mark.parametrize(
    ("changed", "field"),
    [
        ({"median_m": 2.0}, "turn_m: lanes for turning vehicles need median_m"),
        ({"median_kerb_m": 0.12}, "turn_m: lanes for turning vehicles need median_m"),
        ({"length_m": 20.0}, "turn_m: expected two lengths of together at most 20 m"),
    ],
)
def test_impossible_turn_lanes_are_refused(changed: dict[str, float], field: str) -> None:
    """By the name of the field."""
    with pytest.raises(ConfigError, match=f"elements.main.{field}"):
        built(Road(name="main", turn_m=(0.0, 30.0), **{**MEDIAN, **changed}))  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match=r"elements.cross.median_m: 0 m"):
        built(Junction(name="cross", turn_lane=True))


def junction_mesh(**changed: object) -> MeshData:
    family = FAMILIES["junction"]
    mesh: MeshData = family.build(**{**family.parameters, **changed}).mesh
    return mesh


def plan_m2(mesh: MeshData, texture: str) -> float:
    """Area from above of all slots with a texture whose id contains a text; ``tar`` has none."""
    slots = [
        k
        for k, m in enumerate(mesh.materials)
        if (texture in m.texture if texture != "tar" else m.base_color[0] == 0.022)
    ]
    corners = mesh.vertices_m.astype(np.float64)[mesh.faces[np.isin(mesh.face_slots, slots)]]
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return 0.5 * float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum())


def test_lanes_run_through_a_junction_and_along_its_other_arms() -> None:
    """34 m through, and twice the 6.5 m beyond the corners' curves, 7 m wide."""
    mesh = junction_mesh(wear=0.0)

    assert plan_m2(mesh, "asphalt_lane") == pytest.approx((34.0 + 2 * 6.5) * 7.0, rel=1e-6)
    assert plan_m2(mesh, "tar") == 0.0


def test_worn_junctions_have_mended_patches_on_their_surface() -> None:
    """Seams and cracks, within millimetres of the carriageway and nowhere beside it."""
    mesh, shape = junction_mesh(wear=0.9, crossings="none", seed=3), JunctionShape()
    tar = [k for k, m in enumerate(mesh.materials) if m.base_color[0] == 0.022]
    points = mesh.vertices_m[np.unique(mesh.faces[np.isin(mesh.face_slots, tar)])].astype(float)
    above = points[:, 2] - make_fan(shape).height_m(points[:, :2])

    assert plan_m2(mesh, "tar") > 5.0
    assert above.min() > 0.0005
    assert above.max() < 0.003
    assert np.abs(points[:, :2]).min(axis=1).max() <= 3.5 + 7.0
