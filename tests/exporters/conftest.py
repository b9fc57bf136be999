"""A small data set: boxes and ellipsoids on a ground plane, ray-cast with numpy.

Independent of every renderer of the project: geometry, against which exports are held.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data import annotations
from gen_data.annotations.annotate import Thresholds, annotate_objects
from gen_data.annotations.language import Language
from gen_data.core import asset_types
from gen_data.core.boxes import BoxPx, tight_box
from gen_data.core.capture import (
    POINT,
    Capture,
    Channel,
    Measurements,
    PointCloud,
    SensorReading,
    Silhouette,
)
from gen_data.core.interfaces import DatasetInfo, Exporter, Modality, SensorInfo
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lane_geometry import LaneBorder
from gen_data.core.lens import LensModel
from gen_data.core.measurement_dtypes import table_rows
from gen_data.core.motion import JointTrajectory, Trajectory
from gen_data.core.sample import BirdseyeMap, EgoTruth, ImageTruth, ObjectTruth, Sample
from gen_data.core.scene import (
    ArmGoal,
    Articulation,
    Body,
    Camera,
    Device,
    Instance,
    Lidar,
    Rig,
    Scene,
)
from gen_data.core.scene_time import RIG_AXES, add_twists, place_sensors, scene_at
from gen_data.core.se3 import SE3, Array, look_at
from gen_data.exporters.image_files import write_media
from gen_data.runner.shard import drop_pixels
from gen_data.sensors import TABLE as SENSORS
from gen_data.sensors.navigation.imu import Imu
from tests.exporters.datasets import imaging, in_scene
from tests.exporters.drives import drive_info
from tests.wheels import NO_RERUN

CATEGORIES = ("car", "crate", "pedestrian")
MEDIA = (Channel.RGB, Channel.Z_DEPTH, Channel.INSTANCE, Channel.CATEGORY)
SIZES_M = {"car": (4.0, 1.8, 1.5), "pedestrian": (0.5, 0.6, 1.8), "crate": (1.0, 1.4, 0.9)}


def _keypoints(category: str, names: str) -> tuple[asset_types.Keypoint, ...]:
    """At left front and right rear edges of a box by turns, from the ground up, 1 cm inside."""
    listed = names.split()
    length, width, height = SIZES_M[category]
    x_m, y_m = 0.5 * length - 0.01, 0.5 * width - 0.01
    return tuple(
        asset_types.Keypoint(name, (side * x_m, side * y_m, height * (k + 0.5) / len(listed)))
        for k, name in enumerate(listed)
        for side in (1 - 2 * (k % 2),)
    )


KEYPOINTS = {
    "car": _keypoints("car", "wheel_front_left wheel_front_right headlight_left headlight_right"),
    "pedestrian": _keypoints(
        "pedestrian",
        "nose left_eye right_eye left_ear right_ear left_shoulder right_shoulder left_elbow "
        "right_elbow left_wrist right_wrist left_hip right_hip left_knee right_knee left_ankle "
        "right_ankle",
    ),
}
"""Half of a car's, all of a person's; crates have none."""


def instance(
    number: int, category: str, x_m: float, y_m: float, yaw_rad: float, shape: str = "box"
) -> Instance:
    """An object on the ground at (x, y); ``shape`` is ``box`` or ``ellipsoid``."""
    length, width, height = SIZES_M[category]
    return Instance(
        instance_id=number,
        name=f"{category}/{number}",
        category=category,
        category_id=CATEGORIES.index(category) + 1,
        asset=f"primitive/{shape}",
        T_world_instance=SE3.about_z(yaw_rad, (x_m, y_m, 0.0)),
        box_min_m=(-0.5 * length, -0.5 * width, 0.0),
        box_max_m=(0.5 * length, 0.5 * width, height),
        keypoints=KEYPOINTS.get(category, ()),
    )


def level_camera(name: str = "color", size_px: tuple[int, int] = (160, 120)) -> Camera:
    """A camera 1.6 m above the origin that looks along world X, level."""
    intrinsics = Intrinsics.from_hfov(*size_px, hfov_rad=1.2)
    return Camera(name, look_at((0.0, 0.0, 1.6), (10.0, 0.0, 1.6)), intrinsics)


def cast(scene: Scene, rays: Array, camera: Camera) -> tuple[Array, Array, Array, dict[int, Array]]:
    """Depth, instance and category along rays; by instance, the depth without all others."""
    depth = _ground_depth(rays, camera)
    ids, categories = (np.zeros(depth.shape, np.uint16) for _ in range(2))
    hits = {thing.instance_id: _hit(rays, thing, camera) for thing in scene.instances}
    for thing in scene.instances:
        nearer = hits[thing.instance_id] < depth
        depth = np.where(nearer, hits[thing.instance_id], depth)
        ids[nearer], categories[nearer] = thing.instance_id, thing.category_id
    return depth, ids, categories, hits


def ray_cast(scene: Scene, camera: Camera) -> SensorReading:
    """Every channel, and silhouettes on a canvas three images wide and high."""
    k = camera.intrinsics
    w, h = k.width_px, k.height_px
    u = (np.arange(-w, 2 * w) + 0.5 - k.cx_px) / k.fx_px
    v = (np.arange(-h, 2 * h) + 0.5 - k.cy_px) / k.fy_px
    rays = np.stack([*np.meshgrid(u, v), np.ones((3 * h, 3 * w))], axis=-1)
    return read_rays(scene, camera, rays, (w, h))


def read_rays(
    scene: Scene, camera: Camera, rays: Array, margin_px: tuple[int, int] = (0, 0)
) -> SensorReading:
    """Images of rays, and silhouettes that reach into a margin of the rays around the images."""
    x, y = margin_px
    height, width = rays.shape[:2]
    inside = (slice(y, height - y), slice(x, width - x))
    *images, hits = cast(scene, rays, camera)
    depth, ids, categories = (image[inside] for image in images)
    silhouettes = {k: _silhouette(k, np.isfinite(hit), x, y) for k, hit in hits.items()}
    shade = np.where(np.isfinite(depth), 255.0 / (1.0 + 0.1 * depth), 0.0)
    rgb = np.stack([shade, 20.0 * ids, 60.0 * categories], axis=-1).astype(np.uint8)
    channels: dict[Channel, NDArray[Any]] = {
        Channel.RGB: rgb,
        Channel.Z_DEPTH: depth.astype(np.float32),
        Channel.RANGE: (depth * np.linalg.norm(rays[inside], axis=-1)).astype(np.float32),
        Channel.NORMALS: _normals(depth[..., None] * rays[inside]),
        Channel.INSTANCE: ids,
        Channel.CATEGORY: categories,
        Channel.PART: np.zeros_like(ids),
    }
    return SensorReading(camera.name, camera, channels, silhouettes)


def _normals(points: Array) -> NDArray[np.float32]:
    """Of the surface through neighbouring points, to the camera; 0 where there is none."""
    finite = np.where(np.isfinite(points), points, 0.0)
    normals = np.cross(np.gradient(finite, axis=1), np.gradient(finite, axis=0))
    normals *= -np.sign((normals * finite).sum(axis=-1, keepdims=True))
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    return np.divide(normals, length, where=length > 0, out=np.zeros_like(normals)).astype("f4")


def _ground_depth(rays: Array, camera: Camera) -> Array:
    down = camera.T_world_camera.rotate(rays)[..., 2]
    height_m = camera.T_world_camera.translation_m[2]
    return np.where(down < -1e-9, height_m / np.maximum(-down, 1e-9), np.inf)


def _hit(rays: Array, thing: Instance, camera: Camera) -> Array:
    """Depth at which each ray enters the object; inf where it misses."""
    low, high = np.array(thing.box_min_m), np.array(thing.box_max_m)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    T_instance_camera = thing.T_world_instance.inverse() @ camera.T_world_camera
    origin = (np.array(T_instance_camera.translation_m) - middle) / half
    direction = T_instance_camera.rotate(rays) / half
    if thing.asset.endswith("ellipsoid"):
        a = (direction**2).sum(-1)
        b = (direction * origin).sum(-1)
        discriminant = b * b - a * ((origin**2).sum() - 1.0)
        near = (-b - np.sqrt(np.maximum(discriminant, 0.0))) / a
        return np.where((discriminant > 0) & (near > 0), near, np.inf)
    direction = np.where(np.abs(direction) < 1e-12, 1e-12, direction)
    slabs = np.stack([(-1.0 - origin) / direction, (1.0 - origin) / direction])
    enter, leave = slabs.min(0).max(-1), slabs.max(0).min(-1)
    return np.where((enter < leave) & (enter > 0), enter, np.inf)


def _silhouette(number: int, canvas: NDArray[np.bool_], w: int, h: int) -> Silhouette:
    box = tight_box(canvas)
    if box is None:
        return Silhouette(number, 0, 0, np.zeros((0, 0), dtype=bool))
    mask = canvas[box.window()]
    return Silhouette(number, box.x_min - w, box.y_min - h, mask)


def street(index: int) -> tuple[Instance, ...]:
    """Objects of frame ``index``; every fourth frame is empty."""
    if index % 4 == 3:
        return ()
    turn = 0.7 * index
    return (
        instance(1, "car", 14.0, 3.0 - 0.4 * index, turn),
        instance(2, "pedestrian", 9.0, -2.0, 1.0 + turn),
        instance(3, "crate", 8.0, 1.6, -turn, shape="ellipsoid"),
        instance(4, "crate", 12.0, 2.2, 0.3),
        instance(7, "pedestrian", 7.0, -4.6 + 0.1 * index, turn),
    )


def make_sample(
    index: int,
    instances: Sequence[Instance],
    cameras: Sequence[Camera],
    split: str = "train",
    thresholds: Thresholds | None = None,
) -> Sample:
    scene = Scene("street", instances=tuple(instances), cameras=tuple(cameras))
    readings = {camera.name: ray_cast(scene, camera) for camera in cameras}
    truth = annotated(scene, readings, thresholds or Thresholds())
    lidar = Lidar("top", cameras[0].name, T_world_lidar=SE3((0.0, 0.0, 1.73)), model="VLP-16")
    imu = Device("imu", "imu", "ego", T_world_device=SE3((0.0, 0.0, 0.5)), model="RT3003")
    scene = replace(scene, lidars=(lidar,), devices=(imu,))
    clouds = {"top": PointCloud("top", lidar, scan(scene, lidar))}
    tables = {"imu": Measurements("imu", imu, imu_rows(index))}
    capture, frame = Capture(readings, clouds, tables), frame_of(scene)
    return Sample(index, index, 0, split, scene, capture, truth, frame=frame)


def imu_rows(index: int) -> NDArray[Any]:
    """Three readings; the second has a figure of many digits."""
    times_s = 0.1 * index + 0.01 * np.arange(3)
    force = np.array([0.0, 1.0 / 3.0, -2.5e-7])
    return table_rows(Imu.columns, 3, time_s=times_s, force_x_m_s2=force, force_z_m_s2=9.80665)


def annotated(
    scene: Scene, readings: Mapping[str, SensorReading], thresholds: Thresholds
) -> dict[str, ImageTruth]:
    """Every annotation of every object, and texts about the images, without relations."""
    annotators = [annotations.TABLE.load(name)() for name in annotations.TABLE]
    language = Language(min_visible_px=thresholds.min_visible_px, min_visible_fraction=0.1)
    truth = {}
    for name, reading in readings.items():
        objects = annotate_objects(scene, reading, annotators, thresholds)
        unrelated = replace(objects, relations=())
        said = language.annotate_image(scene, Props(), reading, unrelated).utterances
        truth[name] = replace(objects, utterances=said)
    return truth


SPEED_M_S, TURN_RAD_S, STEP_S = 10.0, 0.2, 0.1
"""Of the ego vehicle of a drive: a circle to the left."""


def ego_pose(time_s: float) -> SE3:
    """Pose of the ego vehicle after a time: on its circle, headed along it."""
    angle, radius_m = TURN_RAD_S * time_s, SPEED_M_S / TURN_RAD_S
    place = (radius_m * math.sin(angle), radius_m * (1.0 - math.cos(angle)), 0.0)
    return SE3.about_z(angle, place)


def driving_scene() -> Scene:
    """A rig with two cameras and a scanner; a car ahead, a crossing pedestrian, a crate."""
    things = (instance(1, "car", 16.0, 0.5, 0.05), instance(2, "pedestrian", 12.0, -4.0, 1.5),
              instance(4, "crate", 14.0, 4.0, 0.3))  # fmt: skip
    bodies = tuple(Body(t.name, t.asset, t.T_world_instance, 1.0, t.instance_id) for t in things)
    times_s = [STEP_S * k for k in range(-2, 9)]
    ways = {
        "ego": [ego_pose(t) for t in times_s],
        "car/1": [things[0].T_world_instance @ SE3((8.0 * t, 0.0, 0.0)) for t in times_s],
        "pedestrian/2": [things[1].T_world_instance @ SE3((1.5 * t, 0.0, 0.0)) for t in times_s],
    }
    level = level_camera("left")
    cameras = tuple(
        replace(level, name=name, rig="ego", T_rig_camera=SE3((0.3, y_m, 1.6)) @ RIG_AXES.inverse())
        for name, y_m in (("left", 0.0), ("right", -0.54))
    )
    scene = Scene(
        "street",
        bodies=(*bodies, Body("ego", "car")),
        instances=things,
        cameras=cameras,
        lidars=(Lidar("top", "", SE3((0.0, 0.0, 1.73)), model="VLP-16", rig="ego"),),
        rigs=(Rig("ego", "ego"),),
        tracks=tuple(Trajectory(name, STEP_S, tuple(way), -0.2) for name, way in ways.items()),
    )
    return add_twists(place_sensors(scene))


def make_drive(strides: Mapping[str, int] | None = None) -> list[Sample]:
    """Two sequences of four steps, the first for training; sensors read at every stride-th step."""
    return list(_drive(tuple(sorted((strides or {}).items()))))


@cache
def _drive(strides: tuple[tuple[str, int], ...]) -> tuple[Sample, ...]:
    """A drive, cast and annotated once for all tests."""
    samples = []
    for index in range(8):
        sequence, step = divmod(index, 4)
        scene = scene_at(driving_scene(), STEP_S * step)
        reads = [n for n in ("left", "right", "top") if step % dict(strides).get(n, 1) == 0]
        readings = {
            camera.name: replace(ray_cast(scene, camera), time_s=scene.time_s)
            for camera in scene.cameras
            if camera.name in reads
        }
        (lidar,) = scene.lidars
        cloud = PointCloud("top", lidar, scan(scene, lidar), scene.time_s)
        capture = Capture(readings, {"top": cloud} if "top" in reads else {})
        truth = annotated(scene, readings, Thresholds())
        split, names = ("train", "val")[sequence], ("left", "right")
        samples.append(
            Sample(index, sequence, 0, split, scene, capture, truth, step_index=step, cameras=names)
        )
    return tuple(samples)


def make_pairs() -> tuple[DatasetInfo, list[Sample]]:
    """The drive with disparities and flow of its left camera.

    Disparities of even columns are not hidden; flow of every third row is.
    """
    samples = []
    for sample in make_drive():
        left = sample.capture.readings["left"]
        focal_px = left.camera.intrinsics.fx_px
        disparity = (focal_px * 0.54 / left.channels[Channel.Z_DEPTH]).astype(np.float32)
        # Every point moves by its own row and column; rows above the tenth have no flow.
        v, u = np.mgrid[:120, :160].astype(np.float32)
        flow = np.stack([0.25 * u - 10.0, 0.125 * v], axis=-1)
        flow[:10] = np.nan
        images = {
            Channel.FLOW_FORWARD: flow,
            Channel.FLOW_OCCLUDED_FORWARD: (v % 3 == 0).astype(np.uint8),
            Channel.DISPARITY: disparity,
            Channel.DISPARITY_VISIBLE: np.where(np.arange(160) % 2, 0.0, disparity),
        }
        samples.append(imaging(sample, "left", images))
    media = {
        "left": (Channel.RGB, Channel.DISPARITY, Channel.DISPARITY_VISIBLE, Channel.FLOW_FORWARD,
                 Channel.FLOW_OCCLUDED_FORWARD),
        "right": (Channel.RGB,),
    }  # fmt: skip
    names = ("left", "right")
    return make_info(8, names, ("top",), media=media, steps_per_scene=4), samples


ARM_JOINTS = ("shoulder", "elbow")


def make_reach() -> list[Sample]:
    """The drive with an arm of two joints that carries the crate for three steps, then rests."""
    track = JointTrajectory(STEP_S, ((0.0, 0.5), (0.1, 0.4), (0.2, 0.3), (0.3, 0.2)))
    goals = (ArmGoal("grasp", objects=("crate/4",)), ArmGoal("place"))
    arm = Articulation("arm", "toys/arm", 9, SE3(), (0.0, 0.5), task=goals, joint_track=track)
    samples = []
    for sample in make_drive():
        positions = track.positions(sample.scene.time_s)
        carried = Trajectory("crate/4", STEP_S, (SE3(), SE3((0.0, 0.0, 0.1))))
        moved = replace(arm, joint_positions=positions)
        samples.append(in_scene(sample, articulations=(moved,), tracks=(carried,)))
    return samples


def frame_of(scene: Scene) -> EgoTruth:
    """A map of 40 m in which half of the ground is drivable, and boxes."""
    drivable = np.zeros((80, 80), bool)
    drivable[:, 40:] = True
    return EgoTruth(
        "ego",
        boxes3d={"ego": {i.instance_id: i.box3d for i in scene.instances}},
        borders=(LaneBorder("lane:left", "road", ((-90.0, 0.0, 0.0), (90.0, 0.0, 0.0))),),
        birdseye=BirdseyeMap(SE3(), 0.5, {"drivable": drivable, "vehicles": ~drivable}),
    )


def scan(scene: Scene, lidar: Lidar) -> NDArray[Any]:
    """A coarse sweep over the objects and the ground."""
    elevation, azimuth = np.meshgrid(np.radians(np.arange(2, -24, -1)), np.radians(range(180)))
    level = np.cos(elevation)
    rays = np.stack(
        [level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)], -1
    ).reshape(-1, 3)
    rays[:, 1] = np.where(np.arange(len(rays)) % 2, rays[:, 1], -rays[:, 1])
    eye = Camera("eye", lidar.T_world_lidar, level_camera().intrinsics)
    nearest, ids, categories, _ = cast(scene, rays, eye)
    near = nearest < 100.0
    points = np.zeros(int(near.sum()), POINT)
    points["position_m"] = rays[near] * nearest[near, None]
    points["intensity"] = 1.0 / (1.0 + nearest[near])
    points["instance_id"], points["category_id"] = ids[near], categories[near]
    points["surface"] = np.where(ids[near] > 0, 0, asset_types.SURFACES.index("asphalt"))
    points["return_number"] = points["return_count"] = 1
    return points


def make_info(
    n: int,
    cameras: Sequence[str] = ("color",),
    lidars: Sequence[str] = (),
    *,
    media: Mapping[str, tuple[Channel, ...]] | None = None,
    devices: Mapping[str, str] | None = None,
    lenses: Mapping[str, LensModel] | None = None,
    **changes: Any,
) -> DatasetInfo:
    """A data set of ``n`` samples whose cameras write ``MEDIA`` and have pinholes."""
    channels, models = media or dict.fromkeys(cameras, MEDIA), lenses or {}
    kinds = {"imu": "imu"} if devices is None else devices
    sensors = [
        SensorInfo(name, Modality.CAMERA, channels=channels[name], lens=models.get(name, "pinhole"))
        for name in cameras
    ]
    sensors += [SensorInfo(name, Modality.LIDAR) for name in lidars]
    sensors += [
        SensorInfo(name, Modality.DEVICE, kind, columns=SENSORS.load(kind).columns)
        for name, kind in kinds.items()
    ]
    info = DatasetInfo(
        name="street",
        seed=7,
        n=n,
        views_per_scene=1,
        categories=CATEGORIES,
        sensors=tuple(sensors),
        depth_scale_m=0.001,
    )
    return replace(info, **changes)


def with_bodies(samples: Sequence[Sample]) -> list[Sample]:
    """The samples with a body per instance, whose asset names its shape and category."""
    embodied = []
    for sample in samples:
        bodies = tuple(
            Body(t.name, f"{t.asset}/{t.category}", t.T_world_instance, instance_id=t.instance_id)
            for t in sample.scene.instances
        )
        embodied.append(in_scene(sample, bodies=bodies))
    return embodied


def with_objects(
    sample: Sample, change: Callable[[tuple[ObjectTruth, ...]], tuple[ObjectTruth, ...]]
) -> Sample:
    truth = {
        name: replace(image, objects=change(image.objects)) for name, image in sample.truth.items()
    }
    return replace(sample, truth=truth)


def ignoring(sample: Sample) -> Sample:
    """The sample whose first object of each image is to be ignored."""
    return with_objects(sample, lambda ts: (replace(ts[0], ignored=True), *ts[1:]))


class Props:
    """A library of light, of one arm and of the meshes of ``with_bodies``."""

    def robot(self, asset_id: str) -> asset_types.RobotModel:
        links = ("base", *(f"{name}_link" for name in ARM_JOINTS))
        joints = tuple(
            asset_types.Joint(
                name, "revolute", links[k], links[k + 1], SE3(), (0.0, 0.0, 1.0), -3.0, 3.0
            )
            for k, name in enumerate(ARM_JOINTS)
        )
        return asset_types.RobotModel(links, joints, {}, {}, (0.0, 0.0), None, frozenset())

    def get(self, asset_id: str) -> asset_types.Asset:
        """Crates look the same after half a turn about Z, and ellipsoids about X too."""
        if asset_id.count("/") != 2:
            licence = "CC0-1.0" if asset_id.startswith("environment/") else "Apache-2.0"
            return asset_types.Asset(asset_id, "object", "", (), licence, "nobody", "nowhere", "")
        _, shape, category = asset_id.split("/")
        middle = (0.0, 0.0, 0.5 * SIZES_M[category][2])
        turns = [asset_types.Symmetry((0.0, 0.0, 1.0), 2)] if category == "crate" else []
        turns += [asset_types.Symmetry((1.0, 0.0, 0.0), 2, middle)] if shape == "ellipsoid" else []
        facts = asset_types.AssetFacts(symmetries=tuple(turns))
        nobody = ("CC0-1.0", "", "", "")
        return asset_types.Asset(asset_id, "object", category, (), *nobody, facts=lambda: facts)

    def mesh(self, asset_id: str) -> asset_types.MeshData:
        import trimesh

        _, shape, category = asset_id.split("/")
        length, width, height = SIZES_M[category]
        box = shape == "box"
        solid = trimesh.creation.box() if box else trimesh.creation.icosphere(4, radius=0.5)
        vertices = (solid.vertices + np.array([0.0, 0.0, 0.5])) * (length, width, height)
        return asset_types.MeshData(
            np.asarray(vertices, np.float32),
            np.asarray(solid.faces, np.int32),
            np.asarray(solid.vertex_normals, np.float32),
            np.zeros((len(vertices), 2), np.float32),
            np.zeros(len(solid.faces), np.int32),
            (asset_types.Material(),),
        )

    def bounds_m(self, asset_id: str) -> tuple[Array, Array]:
        size_m = np.array(SIZES_M[asset_id.rpartition("/")[2]])
        return size_m * (-0.5, -0.5, 0.0), size_m * (0.5, 0.5, 1.0)

    def materials(self, asset_id: str) -> tuple[asset_types.Material, ...]:
        return ()

    def environment(self, environment_id: str) -> NDArray[np.float32]:
        return np.ones((8, 16, 3), np.float32)


def export(
    exporter: Exporter,
    info: DatasetInfo,
    samples: Sequence[Sample],
    folder: Path,
    *,
    shard_size: int = 3,
    backwards: bool = False,
    keep_arrays: bool = False,
    assets: Any = None,
) -> Path:
    if exporter.type == "rerun":
        pytest.importorskip("rerun", reason=NO_RERUN)
    exporter = exporter.with_assets(assets or Props())
    shards = [list(samples[i : i + shard_size]) for i in range(0, len(samples), shard_size)]
    shard_dirs = [folder / f"shards/{k:06d}" for k in range(len(shards))]
    work = list(zip(shards, shard_dirs, strict=True))
    for shard, shard_dir in reversed(work) if backwards else work:
        for sample in shard:
            write_media(info, sample, shard_dir)
        exporter.write_shard(info, shard if keep_arrays else map(drop_pixels, shard), shard_dir)
    exporter.finalize(info, shard_dirs, folder / "dataset")
    return folder / "dataset"


class World:
    categories = CATEGORIES
    box = BoxPx
    instance = staticmethod(instance)
    camera = staticmethod(level_camera)
    info = staticmethod(make_info)
    sample = staticmethod(make_sample)
    export = staticmethod(export)
    ego_pose = staticmethod(ego_pose)
    drive = staticmethod(make_drive)
    reach = staticmethod(make_reach)
    pairs = staticmethod(make_pairs)
    with_bodies = staticmethod(with_bodies)
    with_objects = staticmethod(with_objects)
    ignoring = staticmethod(ignoring)

    def __init__(self) -> None:
        splits = ("train", "train", "val", "train", "val", "train", "train")
        self.samples = [
            make_sample(i, street(i), [level_camera()], split) for i, split in enumerate(splits)
        ]


@pytest.fixture(scope="session")
def world() -> World:
    """Seven frames of a street in three shards; two splits; frame 3 is empty."""
    return World()


@pytest.fixture(scope="session")
def samples(world: Any) -> Any:
    """Two sequences of four steps in three shards: both are cut."""
    return world.drive()


@pytest.fixture(scope="session")
def slow(world: Any) -> Any:
    """The same; the right camera and the scanner read at every second step."""
    return world.drive({"right": 2, "top": 2})


@pytest.fixture(scope="session")
def exported(world: Any, samples: Any, tmp_path_factory: pytest.TempPathFactory) -> Any:
    folders: dict[str, Path] = {}

    def export(exporter: Any) -> Path:
        key = repr(exporter)
        if key not in folders:
            folder = tmp_path_factory.mktemp(exporter.type)
            folders[key] = world.export(exporter, drive_info(world), samples, folder)
        return folders[key]

    return export
