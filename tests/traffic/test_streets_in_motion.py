"""Whole streets: random layouts that move, and what labels say of them."""

from functools import cache

import numpy as np
import pytest

from gen_data.assemble.config import Config, load_config
from gen_data.assemble.pipeline_factory import PipelineFactory, pipeline_config, scene_source
from gen_data.core.errors import ConfigError, LayoutRejected
from gen_data.core.sample import Sample
from gen_data.core.scene import Body, ObjectGroup, Scene
from gen_data.core.scene_time import scene_at
from gen_data.core.se3 import SE3
from gen_data.core.serialization import canonical_json
from gen_data.core.streams import Streams
from gen_data.randomizers.free_space import Footprint, Ground
from gen_data.randomizers.traffic_actors import find_drivers
from gen_data.randomizers.traffic_flow import TrafficFlow
from gen_data.traffic import simulation
from gen_data.traffic.lane_routes import LaneGraph
from tests.libraries import library
from tests.streets import thin_street
from tests.traffic.roads import lane

SMALL = (
    "sensors[0].size_px=[64, 32]",
    "sensors[0].channels=[rgb, depth, instance]",
    "shared.district=residential",
    "shared.junction=x",
    "shared.crossing=lines",
    "randomizers.people.count=20",
)
STEPS, STEP_S = 40, 0.1
FLAT = ("tree", "street_light", "traffic_light", "traffic_sign")
"""Things whose bounding boxes reach over the road above what drives there."""


@cache
def spec() -> Config:
    return load_config("street_sequence", overrides=SMALL)


@cache
def factory() -> PipelineFactory:
    """Of its pipelines, for a street with little scenery; it builds the nominal scenes once."""
    return PipelineFactory(thin_street("street_sequence", *SMALL), n=1)


@cache
def row() -> dict[int, Sample]:
    """Steps of one sequence, made one after the other."""
    with factory()() as pipeline:
        return {k: pipeline.sample(k) for k in (0, 5, 8)}


def moving_scene(seed: int, of: Config | None = None) -> Scene:
    """A street that moves: the first attempt that is not refused."""
    for attempt in range(10):
        streams = Streams(seed, 0, attempt=attempt)
        scene, randomizers, _ = scene_source(of or spec(), library())(streams)
        try:
            for randomizer in randomizers:
                scene = randomizer(scene, library(), streams.rng(f"randomizer/{randomizer.name}"))
        except LayoutRejected:
            continue
        return scene
    raise AssertionError("ten attempts were refused")


@cache
def scene_of(seed: int) -> Scene:
    return moving_scene(seed)


def category(body: Body) -> str:
    return library().get(body.asset).category


def footprint(body: Body) -> Footprint:
    """What a body covers; of people, the trunk."""
    low, high = library().bounds_m(body.asset)
    if category(body) == "person":
        low, high = (-0.2, -0.2, 0.0), (0.2, 0.2, 1.0)
    return Footprint.of(body.T_world_body, (low, high), body.scale)


def overlapping(scene: Scene) -> list[str]:
    """Names of moving bodies that cover what something else covers."""
    tracked = {track.body for track in scene.tracks}
    roads = {lane.road for lane in scene.lanes}
    ground, found = Ground(), []
    solid = [b for b in scene.bodies if b.instance_id and b.name.split("/")[0] not in roads]
    solid = [b for b in solid if category(b) not in FLAT]
    for body in sorted(solid, key=lambda body: body.name in tracked):
        if body.name in tracked and not ground.is_free(footprint(body)):
            found.append(body.name)
        ground.add(footprint(body))
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    "seed", [1, 2, *(pytest.param(k, marks=pytest.mark.exhaustive) for k in range(3, 7))]
)
def test_nothing_collides_in_random_streets(seed: int) -> None:
    """Oriented boxes of everything that moves, every 0.1 s for four seconds."""
    scene = scene_of(seed)

    assert len(scene.tracks) >= 2
    for k in range(STEPS):
        assert not overlapping(scene_at(scene, STEP_S * k)), f"at {STEP_S * k:.1f} s"


@pytest.mark.slow
def test_what_moves_stands_on_the_ground() -> None:
    """Vehicles' lowest points are at the height of the lane under them, within the crossfall."""
    scene = scene_at(scene_of(1), 2.0)
    driving = [p for lane in scene.lanes if lane.kind == "driving" for p in lane.center_m]
    points = np.array(driving)
    cars = [b for b in scene.bodies if b.group == "traffic" or b.name == "ego"]

    assert cars
    for body in cars:
        low, _ = library().bounds_m(body.asset)
        x, y, z = body.T_world_body.translation_m
        nearest = points[np.argmin((points[:, 0] - x) ** 2 + (points[:, 1] - y) ** 2)]
        assert z + body.scale * low[2] == pytest.approx(nearest[2], abs=0.03)


@pytest.mark.slow
def test_same_stream_gives_the_same_traffic_and_another_one_another() -> None:
    assert canonical_json(moving_scene(2)) == canonical_json(scene_of(2))
    assert canonical_json(scene_of(3)) != canonical_json(scene_of(2))


@pytest.mark.slow
def test_time_goes_both_ways() -> None:
    """The scene at 1 s is the same from the beginning and from later on."""
    scene = scene_of(1)

    assert canonical_json(scene_at(scene_at(scene, 3.0), 1.0)) == canonical_json(
        scene_at(scene, 1.0)
    )
    assert canonical_json(scene_at(scene_at(scene, 3.0), 0.0)) == canonical_json(
        scene_at(scene_at(scene, 2.0), 0.0)
    )


@pytest.mark.slow
def test_signals_change_and_say_so() -> None:
    """Over a cycle every light is red and green; materials and the attribute go together."""
    scene = scene_of(1)
    changes = [c for c in scene.changes if c.body.startswith("signals/")]
    first = {c.body: dict(c.attributes)["state"] for c in changes if c.time_s == 0.0}

    assert set(first) == {f"signals/{k}" for k in range(4)}
    assert first["signals/0"] == first["signals/1"] or len(set(first.values())) == 2
    for change in changes:
        state = dict(change.attributes)["state"]
        lit = {m.role for m in change.materials if max(m.emission_cd_m2) > 0.0}
        assert (state in ("green",)) == ("lens_green" in lit)
        assert (state in ("red", "red_yellow")) == ("lens_red" in lit)


@pytest.mark.slow
def test_who_slows_down_shows_brake_lights() -> None:
    """Whenever a vehicle brakes by 1 m/s^2 its lamps glow, and its label says so."""
    seen = 0
    for seed in (1, 2, 3):
        scene = scene_of(seed)
        for k in range(2, STEPS - 2, 3):
            now = scene_at(scene, STEP_S * k)
            by_id = {i.instance_id: i for i in now.instances}
            for body in now.bodies:
                facts = dict(by_id[body.instance_id].attributes) if body.instance_id else {}
                if body.group != "traffic" or "brake_lights" not in facts:
                    continue
                twist = by_id[body.instance_id].twist
                ahead = body.T_world_body.rotation()[:, 0]
                slowing = -float(ahead @ np.array(twist.acceleration_m_s2))
                glowing = any(
                    m.role == "brakelight" and max(m.emission_cd_m2) > 0.0 for m in body.materials
                )
                assert glowing == (facts["brake_lights"] == "on")
                if slowing > 1.0:
                    assert glowing
                    seen += 1
    assert seen


@pytest.mark.slow
def test_people_walk_in_step() -> None:
    """A stride is 0.8 of the body's height: as many sixteenths as the way is long.

    A small child that runs takes more of them than the simulation has steps.
    """
    scenes = map(scene_of, range(1, 9))
    walkers = ((s, t) for s in scenes for t in s.tracks if t.body.startswith("people/"))
    checked = 0
    for scene, track in walkers:
        a, b = (np.array(track.pose(t).translation_m[:2]) for t in (0.5, 2.5))
        way = float(np.hypot(*(b - a)))
        body = scene.body(track.body)
        height = float(dict(library().get(body.asset).attributes)["height_m"]) * body.scale
        steps = [
            c for c in scene.changes if c.body == track.body and 0.5 < c.time_s <= 2.5 and c.asset
        ]
        if way < 1.8 or any("pose=stand" in c.asset for c in steps):
            continue
        sixteenths = min(16.0 * way / (0.8 * height), 2.0 / simulation.STEP_S)
        assert len(steps) == pytest.approx(sixteenths, abs=2.5)
        checked += 1
        if checked == 3:
            return
    pytest.fail(f"{checked} people walk in eight scenes, too few to check")


@pytest.mark.slow
def test_a_sample_alone_equals_the_one_in_its_sequence() -> None:
    """Image and scene of the fifth step, made first and made after others."""
    with factory()() as pipeline:
        alone = pipeline.sample(5)

    assert canonical_json(alone.scene) == canonical_json(row()[5].scene)
    one, other = (s.capture.readings["color"] for s in (alone, row()[5]))
    for channel, image in one.channels.items():
        assert (image == other.channels[channel]).all()
    ids = [{i.name: i.instance_id for i in sample.scene.instances} for sample in row().values()]
    assert ids[0] == ids[1] == ids[2]


@pytest.mark.slow
def test_the_camera_rides_on_the_ego_vehicle() -> None:
    """1.65 m over the road, 1.5 m before the rear axle, wherever the vehicle is."""
    scenes = [row()[k].scene for k in (0, 8)]
    for scene in scenes:
        rig, camera = scene.rig_pose("ego"), scene.camera("color").T_world_camera
        local = (rig.inverse() @ camera).translation_m
        assert local == pytest.approx((1.5, 0.0, 1.65), abs=1e-4)
    assert not scenes[1].instance(scenes[1].body("ego").instance_id).annotated


def checked_and_moving(wrong: Config) -> Scene:
    """What a run does first: everything is resolved, then a scene is drawn."""
    pipeline_config(wrong, library(), 1, (), frozenset())
    return moving_scene(1, wrong)


BAD = {
    "duration_s: 3 s is shorter than the sequences": ("flow", "duration_s=3"),
    "there is no vehicle 'ega' on a driving lane": ("flow", "routes={ega: [main/forward0]}"),
    "none lead from 'main/forward0' to 'left/backward0'": (
        "flow", "routes={ego: [main/forward0, left/backward0]}",
    ),
    "there is no driving lane 'main/forwerd0'": ("flow", "routes={ego: [main/forwerd0]}"),
    r"\(-75, 300\) is .* m from the middle": ("flow", "routes={ego: [[-75, 300]]}"),
    "no driving lane on roof": ("ego_on_lane", "roads=[roof]"),
    "no ego vehicle 'ega'": ("ego_on_lane", "ego=ega"),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("message", BAD)
def test_what_cannot_be_is_told_in_one_message(message: str) -> None:
    """Wrong routes, names and durations."""
    name, text = BAD[message]
    names = [randomizer.name for randomizer in spec().probes[0].randomizers]
    wrong = load_config(
        "street_sequence", overrides=[*SMALL, f"randomizers[{names.index(name)}].{text}"]
    )
    with pytest.raises(ConfigError, match=message):
        checked_and_moving(wrong)


@pytest.mark.slow
def test_a_route_through_a_wall_is_refused() -> None:
    """A point of the route lies in a house: the message names the house."""
    scene = scene_of(1)
    house = next(b for b in scene.bodies if b.group == "buildings")
    low, high = library().bounds_m(house.asset)
    middle = [0.5 * (low[k] + high[k]) for k in range(3)]
    x, y, _ = house.T_world_body.apply(np.array(middle)).tolist()
    flow = TrafficFlow(name="flow", routes={"ego": ((x, y),)})
    with pytest.raises(ConfigError, match=rf"is inside '{house.name}'"):
        flow(scene, library(), Streams(1, 0).rng("flow"))


@pytest.mark.slow
def test_a_given_route_is_driven() -> None:
    """Through the junction to the left: the ego vehicle ends on the road it was sent to."""
    names = [randomizer.name for randomizer in spec().probes[0].randomizers]
    route = "[main/forward0, cross/2to1_0, left/forward0]"
    asked = load_config(
        "street_sequence",
        overrides=[
            *SMALL,
            "elements.cross.crossings=none",
            f"randomizers[{names.index('ego_on_lane')}].route={route}",
            f"randomizers[{names.index('traffic')}].count=0",
            f"randomizers[{names.index('people')}].count=0",
            f"randomizers[{names.index('flow')}].routes={{ego: {route}}}",
            f"randomizers[{names.index('flow')}].signals=false",
            f"randomizers[{names.index('flow')}].duration_s=40",
        ],
    )
    scene = moving_scene(1, asked)
    track = scene.track("ego")
    assert track is not None
    left = next(lane for lane in scene.lanes if lane.name == "left/forward0")
    end = np.array(track.knots[-1].translation_m[:2])
    away = np.hypot(*(np.array(left.center_m)[:, :2] - end).T)

    assert away.min() < 1.5


@pytest.mark.slow
def test_what_is_parked_at_the_edge_of_a_lane_does_not_drive() -> None:
    """On one lane: a car is a driver; a parked bicycle, a cone and a tuft of grass are scenery."""
    assets = ("car?seed=0", "parked_bicycle?seed=1", "traffic_cone?seed=0", "grass_tuft?seed=0")
    bodies = tuple(
        Body(asset, asset, SE3((20.0 * k, 0.0, 0.0)), group="things", instance_id=k + 1)
        for k, asset in enumerate(assets)
    )
    group = ObjectGroup("things", (), assets, 0, "lane")
    graph = LaneGraph.of([lane("east", (-50.0, 0.0), (150.0, 0.0))], "driving")

    drivers = find_drivers(Scene("test", bodies, groups=(group,)), graph, library())

    assert [driver.body.name for driver in drivers] == ["car?seed=0"]
