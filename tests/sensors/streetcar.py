"""A world of boxes with a car that carries devices: rays and motion by a few lines of numpy."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from gen_data.core import motion, scene_time, streams
from gen_data.core.capture import Channel, LidarHits, LidarRays, Measurements, SensorReading
from gen_data.core.scene import Body, Camera, Instance, Lane, Lidar, Rig, Scene
from gen_data.core.se3 import SE3, Vec3
from gen_data.sensors.mounting import Instrument
from tests.sensors.scanned import echoes

CAR_M = ((-2.2, -0.9, 0.0), (2.2, 0.9, 1.5))
PERSON_M = ((-0.25, -0.3, 0.0), (0.25, 0.3, 1.8))
WALL_M = ((-0.1, -10.0, 0.0), (0.1, 10.0, 4.0))
CATEGORIES = {"car": 1, "person": 2, "building": 3, "traffic_light": 4, "tree": 5}
KNOT_S = 0.05

Way = Callable[[float], SE3]
Box = tuple[Vec3, Vec3]


def straight(start: tuple[float, float], velocity: tuple[float, float], yaw: float = 0.0) -> Way:
    def pose(t: float) -> SE3:
        return SE3.about_z(yaw, (start[0] + velocity[0] * t, start[1] + velocity[1] * t, 0.0))

    return pose


def circle(radius_m: float, speed_m_s: float) -> Way:
    """A left turn around the origin, from (radius, 0), heading along Y."""

    def pose(t: float) -> SE3:
        a = speed_m_s / radius_m * t
        return SE3.about_z(a + 0.5 * math.pi, (radius_m * math.cos(a), radius_m * math.sin(a), 0.0))

    return pose


def track_of(body: str, pose: Way, seconds: float = 4.0) -> motion.Trajectory:
    count = round(seconds / KNOT_S)
    return motion.Trajectory(body, KNOT_S, tuple(pose(k * KNOT_S) for k in range(count + 1)))


def thing(
    number: int, name: str, category: str, pose: SE3, box_m: Box = CAR_M, **facts: str
) -> tuple[Body, Instance]:
    body = Body(name, f"{category}?", pose, instance_id=number)
    instance = Instance(
        number,
        name,
        category,
        CATEGORIES[category],
        f"{category}?",
        T_world_instance=pose,
        box_min_m=box_m[0],
        box_max_m=box_m[1],
        attributes=tuple(sorted(facts.items())),
    )
    return body, instance


def world(
    ego: Way | None = None,
    others: Sequence[tuple[Body, Instance]] = (),
    tracks: Sequence[motion.Trajectory] = (),
    lanes: Sequence[Lane] = (),
    step_s: float = 0.1,
    seconds: float = 4.0,
) -> Scene:
    """An ego car with a rig at its origin, at 10 m/s along X, and the world around it."""
    ego = ego or straight((0.0, 0.0), (10.0, 0.0))
    things = [thing(1, "ego", "car", ego(0.0)), *others]
    return scene_time.add_twists(
        Scene(
            "test",
            bodies=tuple(body for body, _ in things),
            instances=tuple(instance for _, instance in things),
            tracks=(track_of("ego", ego, seconds), *tracks),
            rigs=(Rig("ego", "ego"),),
            lanes=tuple(lanes),
            step_s=step_s,
        )
    )


def rng(step: int = 0, seed: int = 0, name: str = "sensor/device") -> streams.Rng:
    return streams.Streams(seed, scene=0, view=0, step=step).rng(name)


def reading(sensor: Instrument, scene: Scene, step: int = 0, seed: int = 0) -> Measurements:
    """The reading of a device at one step of a sequence."""
    mounted = scene_time.place_sensors(sensor.mount(scene))
    then = scene_time.add_twists(scene_time.scene_at(mounted, step * scene.step_s))
    return sensor.capture(then, BoxRays(), frozenset(), rng(step, seed))


def readings(sensor: Instrument, scene: Scene, steps: int, seed: int = 0) -> np.ndarray:
    """Rows of the first steps of a sequence, each step made alone."""
    return np.concatenate([reading(sensor, scene, k, seed).rows for k in range(steps)])


class BoxRays:
    """A renderer whose world are the boxes of instances; reflectance 0.5 everywhere."""

    def scan(self, scene: Scene, lidar: Lidar, beams: LidarRays) -> LidarHits:
        best = np.full(len(beams.directions), np.inf)
        ids, categories = np.zeros(len(best), int), np.zeros(len(best), int)
        present = {body.instance_id for body in scene.bodies}
        for thing_ in scene.instances:
            if thing_.instance_id not in present:
                continue
            T = thing_.T_world_instance.inverse() @ lidar.T_world_lidar
            origin, ray = np.array(T.translation_m), T.rotate(beams.directions)
            ray = np.where(np.abs(ray) < 1e-9, 1e-9, ray)
            slabs = (np.stack([thing_.box_min_m, thing_.box_max_m])[:, None] - origin) / ray
            enter, leave = slabs.min(axis=0).max(axis=1), slabs.max(axis=0).min(axis=1)
            hit = (enter < leave) & (enter > 0.0) & (enter < best)
            best[hit], ids[hit] = enter[hit], thing_.instance_id
            categories[hit] = thing_.category_id
        best[best > beams.range_max_m] = np.inf
        ranges_m = np.repeat(best[:, None], beams.subrays, axis=1)
        return echoes(ranges_m, ids=ids[:, None], categories=categories[:, None])

    def render(self, scene: Scene, camera: Camera, channels: frozenset[Channel]) -> SensorReading:
        raise AssertionError("this device does not look at pictures")


def moved(scene: Scene, **changes: object) -> Scene:
    return replace(scene, **changes)  # type: ignore[arg-type]
