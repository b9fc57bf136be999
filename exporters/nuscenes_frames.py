"""Rows of one instant of a nuScenes data set: readings with their poses, and boxes of objects."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from gen_data.core import errors, intrinsics, motion, scene_time
from gen_data.core.boxes import OrientedBox
from gen_data.core.reported import delayed_s
from gen_data.core.sample import ObjectTruth, Sample
from gen_data.core.scene import Body, Instance, Scene
from gen_data.core.se3 import SE3, Vec3
from gen_data.exporters.nuscenes_classes import category_of
from gen_data.exporters.nuscenes_files import quarter_turns, turned_pose
from gen_data.exporters.sensor_selection import instant_s, stamp_error_s
from gen_data.exporters.sequences import (
    Mount,
    camera_mount,
    device_mount,
    lidar_mount,
    relative_pose,
)

Modality = Literal["camera", "lidar", "radar"]
INSTANCES_MAX = 999
"""Instances of one category that panoptic labels can tell apart."""
AZIMUTH_BINS = 64
"""Sectors in which all pulses of a sweep count as simultaneous."""
VISIBILITY_LIMITS = (0.4, 0.6, 0.8)
"""Visible fractions between the levels 1 to 4."""


@dataclass(frozen=True, slots=True)
class Channel:
    """A sensor of the data set, and its name in nuScenes."""

    sensor: str
    name: str
    modality: Modality


def channel_mount(scene: Scene, channel: Channel) -> Mount:
    """Mount of the sensor of a channel."""
    find = {"camera": camera_mount, "lidar": lidar_mount, "radar": device_mount}
    return find[channel.modality](scene, channel.sensor)


def rig_pose_at(scene: Scene, rig: str, time_s: float) -> SE3:
    """``T_world_rig`` at an instant, by the trajectory of the body that carries the rig."""
    if rig.startswith("/"):
        return scene.camera(rig[1:]).T_world_camera @ scene_time.RIG_AXES
    track = scene.track(scene.rig(rig).body)
    if track is None or time_s == scene.time_s:
        return scene.rig_pose(rig)
    return track.pose(time_s).rounded() @ scene.rig(rig).T_body_rig


def reading_row(
    sample: Sample, channel: Channel, ego: str, time_s: float, T_global_world: SE3
) -> dict[str, Any]:
    """Row of a reading: instant, pose of the ego, pose and size of the sensor.

    With a wrong clock, the row has ``stamp_s``, the reported time, and the ego's pose at that time.

    Args:
        sample: Sample with the reading.
        channel: Channel of the sensor.
        ego: Rig that is the ego vehicle.
        time_s: True instant of the reading.
        T_global_world: Pose of the world in the global frame.
    """
    scene = sample.scene
    mount = channel_mount(scene, channel)
    T_ego_sensor = relative_pose(scene, Mount(ego, SE3()), mount)
    if channel.modality == "lidar":
        T_ego_sensor = turned_pose(T_ego_sensor, quarter_turns(T_ego_sensor)).rounded(9)
    stamp_s = delayed_s(time_s, stamp_error_s(sample, channel.sensor))
    row = {
        "sensor": channel.sensor,
        "modality": channel.modality,
        "time_s": time_s,
        **({"stamp_s": stamp_s} if stamp_s != time_s else {}),
        "ego": pose_row(T_global_world @ rig_pose_at(scene, ego, stamp_s)),
        "mount": pose_row(T_ego_sensor),
        "intrinsic": [],
        "size_px": [0, 0],
    }
    if channel.modality == "camera":
        camera = scene.camera(channel.sensor).intrinsics
        row |= {"intrinsic": intrinsic_rows(camera), "size_px": [camera.width_px, camera.height_px]}
    return row


def pose_row(pose: SE3) -> dict[str, list[float]]:
    """Translation [m] and quaternion ``w x y z`` as tables have them."""
    pose = pose.rounded(9)
    return {"translation": list(pose.translation_m), "rotation": list(pose.quaternion_wxyz)}


def intrinsic_rows(camera: intrinsics.Intrinsics) -> list[list[float]]:
    """``camera_intrinsic``, 3 x 3; pixel centres are whole numbers."""
    K = camera.matrix()
    K[:2, 2] -= 0.5
    return [[round(float(v), 9) for v in row] for row in K]


@dataclass(frozen=True, eq=False, slots=True)
class Thing:
    """An annotated object of a sample.

    Attributes:
        instance: The object at the sample's instant.
        category: Its category in nuScenes.
        number: Number among the objects of its category, from 1.
        body: The body whose frame it has; None if there is none.
        track: Trajectory of that body; None if it does not move.
    """

    instance: Instance
    category: str
    number: int
    body: Body | None
    track: motion.Trajectory | None

    def box(self, time_s: float | None, margin_m: float) -> OrientedBox:
        """Its box in the world at an instant (None = the sample's), with a margin on all sides."""
        instance = self.instance
        if self.track is not None and time_s is not None:
            instance = replace(instance, T_world_instance=self.track.pose(time_s))
        length, width, height = (side + 2.0 * margin_m for side in instance.box3d.size_m)
        return OrientedBox(instance.box3d.T_frame_box, (length, width, height))


def annotated_things(sample: Sample) -> dict[int, Thing]:
    """Annotated objects of a sample by instance id, without those ignored in all their images.

    Raises:
        ConfigError: a category has more objects than panoptic labels can tell apart.
    """
    scene = sample.scene
    shown = [t for truth in sample.truth.values() for t in truth.objects if t.box is not None]
    ignored = {t.instance.instance_id for t in shown if t.ignored}
    ignored -= {t.instance.instance_id for t in shown if not t.ignored}
    bodies: dict[int, Body] = {}
    for body in scene.bodies:
        bodies.setdefault(body.instance_id, body)
    robots = {arm.instance_id for arm in scene.articulations}
    tracks = {track.body: track for track in scene.tracks}
    numbers: dict[str, int] = {}
    things: dict[int, Thing] = {}
    for instance in sorted(scene.instances, key=lambda i: i.instance_id):
        if not instance.annotated:
            continue
        category, key = category_of(instance), instance.instance_id
        numbers[category] = numbers.get(category, 0) + 1
        if numbers[category] > INSTANCES_MAX:
            raise errors.ConfigError(
                f"exporter 'nuscenes': sample {sample.index} has more than {INSTANCES_MAX} objects "
                f"of the category {category}; place fewer objects"
            )
        own = bodies.get(key)
        track = tracks.get(own.name) if own is not None and key not in robots else None
        if key not in ignored:
            things[key] = Thing(instance, category, numbers[category], own, track)
    return things


@dataclass(frozen=True, slots=True)
class Points:
    """Numbers of points on an object, of all sensors of a modality."""

    lidar: int = 0
    radar: int = 0


@dataclass(frozen=True, slots=True)
class PulseTimes:
    """Mean instants of the pulses of a sweep, from its start.

    Attributes:
        middle_s: Instant of the middle of the sweep.
        sweep_s: Duration of the sweep.
        by_instance: Mean of the pulses that hit an instance, by instance id.
        by_sector: Mean of the pulses of a sector, by its number.
    """

    middle_s: float
    sweep_s: float
    by_instance: Mapping[int, float]
    by_sector: Mapping[int, float]

    @classmethod
    def measure(cls, points: NDArray[np.void], middle_s: float, sweep_s: float) -> "PulseTimes":
        """Average the pulses of a sweep; ``points`` are records of ``POINT`` [n]."""
        x, y = points["position_m"][:, 0], points["position_m"][:, 1]
        times_s = points["time_s"]
        return cls(
            middle_s,
            sweep_s,
            _means(points["instance_id"], times_s),
            _means(_sectors(x, y), times_s),
        )

    def instant_s(self, instance_id: int, center_m: Vec3) -> float:
        """When pulses hit an object, or else when they leave in its direction.

        Args:
            instance_id: Instance id of the object.
            center_m: Its centre in the lidar frame.
        """
        found = self.by_instance.get(instance_id)
        if found is None:
            x, y = (np.array([v]) for v in center_m[:2])
            found = self.by_sector.get(int(_sectors(x, y)[0]))
        start_s = self.middle_s - 0.5 * self.sweep_s
        return self.middle_s if found is None else round(start_s + found, 9)


def _sectors(x: NDArray[np.floating], y: NDArray[np.floating]) -> NDArray[np.int64]:
    """Number of the sector of each direction; the first one begins behind the scanner."""
    angle = np.arctan2(y.astype(np.float64), x.astype(np.float64))
    # The last bits of angles depend on the processor.
    turn = np.round(angle / (2.0 * np.pi) + 0.5, 9)
    sectors: NDArray[np.int64] = (turn * AZIMUTH_BINS).astype(np.int64) % AZIMUTH_BINS
    return sectors


def _means(keys: NDArray[np.integer], values: NDArray[np.floating]) -> dict[int, float]:
    """Mean value by key."""
    counts = np.bincount(keys)
    sums = np.bincount(keys, weights=values)
    return {int(k): float(sums[k] / counts[k]) for k in np.flatnonzero(counts)}


def views_by_instance(sample: Sample) -> dict[int, list[ObjectTruth]]:
    """Annotations of the images that show an object, by instance id."""
    views: dict[int, list[ObjectTruth]] = {}
    for _, truth in sorted(sample.truth.items()):
        for thing in truth.objects:
            if thing.box is not None:
                views.setdefault(thing.instance.instance_id, []).append(thing)
    return views


def visibility_level(views: Sequence[ObjectTruth]) -> str:
    """Token of the visibility of an object in all images together.

    The visible fraction counts the parts inside the images that nothing hides, times the
    fraction of the silhouette inside the images.
    """
    if not views:
        return "1"
    inside_px = inside = 0.0
    for view in views:
        assert view.occlusion is not None, "the annotation visibility is in `needs`"
        assert view.truncation is not None, "the annotation visibility is in `needs`"
        inside_px += view.visible_px / (1.0 - view.occlusion)
        inside += 1.0 - view.truncation
    visible = sum(view.visible_px for view in views) / inside_px * min(inside, 1.0)
    return str(1 + sum(visible > limit for limit in VISIBILITY_LIMITS))


def box_row(
    thing: Thing, box: OrientedBox, attribute: str, views: Sequence[ObjectTruth], points: Points
) -> dict[str, Any]:
    """Row of an object at one instant.

    Args:
        thing: The object.
        box: Its box in the global frame.
        attribute: Result of ``attribute_of``.
        views: Annotations of the images that show it.
        points: Numbers of points on it.
    """
    length, width, height = (round(v, 6) for v in box.size_m)
    return {
        "id": thing.instance.instance_id,
        "category": thing.category,
        "attribute": attribute,
        "visibility": visibility_level(views),
        "seen": bool(views) or points.lidar > 0 or points.radar > 0,
        "lidar": points.lidar,
        "radar": points.radar,
        "size": [width, length, height],
        **pose_row(box.T_frame_box),
    }


def reading_time_s(sample: Sample, channel: Channel, offset_s: float) -> float:
    """Instant of a reading; of devices, by their delay after the sample's instant."""
    if channel.modality == "radar":
        return round(sample.scene.time_s + offset_s, 9)
    return instant_s(sample, channel.sensor)
