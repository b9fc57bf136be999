"""Every contradiction in a sample is found before the sample is written."""

import math
import random
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gen_data.annotations.sample_checks import check_sample, sample_faults
from gen_data.core.boxes import BoxPx, OrientedBox
from gen_data.core.capture import (
    LAYERS,
    MIRRORED,
    ORIGIN,
    POINT,
    Capture,
    Channel,
    Measurements,
    PointCloud,
    SensorReading,
)
from gen_data.core.errors import SampleError
from gen_data.core.interfaces import DatasetInfo, Modality, SensorInfo
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.motion import Twist
from gen_data.core.sample import (
    EgoTruth,
    ImageTruth,
    KeypointTruth,
    MaskPx,
    MotionTruth,
    ObjectTruth,
    Sample,
)
from gen_data.core.scene import Body, Camera, Device, Instance, Lidar, Scene
from gen_data.core.se3 import SE3, look_at

WIDTH_PX, HEIGHT_PX = 640, 480
CATEGORIES = ("book", "bowl", "mug")
CHANNELS = (
    Channel.RGB, Channel.Z_DEPTH, Channel.INSTANCE, Channel.NORMALS, Channel.FLOW_FORWARD,
    *LAYERS, *MIRRORED,
)  # fmt: skip
NAN, INF = math.nan, math.inf


def make_info() -> DatasetInfo:
    sensors = (
        SensorInfo("color", Modality.CAMERA, channels=CHANNELS),
        SensorInfo("imu", Modality.DEVICE, "imu"),
        SensorInfo("top", Modality.LIDAR),
    )
    return DatasetInfo("test", 0, 1, 1, CATEGORIES, sensors)


def make_sample() -> Sample:
    """Twenty objects in a grid, with every annotation; written from the definitions alone."""
    T_world_camera = look_at((0.0, -3.0, 2.0), (0.0, 0.0, 0.0))
    intrinsics = Intrinsics(WIDTH_PX, HEIGHT_PX, 500.0, 500.0, WIDTH_PX / 2, HEIGHT_PX / 2)
    camera = Camera("color", T_world_camera, intrinsics)
    ids = np.zeros((HEIGHT_PX, WIDTH_PX), np.uint16)
    instances, objects, bodies = [], [], []
    for k in range(20):
        number = k + 1
        pose = SE3.about_z(0.3 * k, (0.1 * k, 0.05 * k, 0.0))
        category = k % 3
        instance = Instance(
            number, f"object-{k}", CATEGORIES[category], category + 1, "asset", parts=("lid",),
            T_world_instance=pose, box_min_m=(-0.1, -0.1, -0.1), box_max_m=(0.1, 0.1, 0.1),
        )  # fmt: skip
        x, y = 20 + 100 * (k % 5), 20 + 90 * (k // 5)
        pixels = np.ones((40, 60), bool)
        pixels[10:20, 5:30] = False
        ids[y : y + 40, x : x + 60][pixels] = number
        box = BoxPx(x, y, x + 60, y + 40)
        whole = OrientedBox(pose, (0.2, 0.2, 0.2))
        visible = int(pixels.sum())
        objects.append(
            ObjectTruth(
                instance, visible, box, amodal_box=BoxPx(x - 2, y, x + 60, y + 41),
                box3d_world=whole, box3d_camera=whole.seen_from(T_world_camera.inverse()),
                T_camera_object=T_world_camera.inverse() @ pose, mask=MaskPx(x, y, pixels),
                amodal_mask=MaskPx(x, y, np.ones((41, 60), bool)), visible_fraction=0.9,
                occlusion=0.1, truncation=0.0, part_px={"lid": 10}, keypoints=(),
                lidar_points={"top": 3}, motion=MotionTruth(Twist(), Twist()),
            )
        )  # fmt: skip
        instances.append(instance)
        bodies.append(Body(f"body-{k}", "asset", pose, instance_id=number))
    lidar, device = Lidar("top", "VLP-16", "", T_world_lidar=SE3()), Device("imu", "imu", "")
    scene = Scene(
        "test", bodies=tuple(bodies), instances=tuple(instances), cameras=(camera,),
        lidars=(lidar,), devices=(device,),
    )  # fmt: skip
    points = np.zeros(63, POINT)
    points["instance_id"], points["return_count"] = np.arange(63) % 21, 1
    points["return_number"] = 1
    rows = np.zeros(5, [("time_s", "<f8"), ("acceleration_m_s2", "<f4", (3,))])
    flow = np.zeros((HEIGHT_PX, WIDTH_PX, 2), np.float32)
    flow[:3] = NAN
    images: dict[Channel, Any] = {
        Channel.RGB: np.zeros((HEIGHT_PX, WIDTH_PX, 3), np.uint8),
        Channel.Z_DEPTH: np.where(ids > 0, 2.5, INF).astype(np.float32),
        Channel.INSTANCE: ids,
        Channel.NORMALS: np.zeros((HEIGHT_PX, WIDTH_PX, 3), np.float32),
        Channel.FLOW_FORWARD: flow,
        Channel.DEPTH_LAYERS: np.stack([np.where(ids > 0, 2.5, INF)] * 2, -1).astype(np.float32),
        Channel.INSTANCE_LAYERS: np.stack([ids, 0 * ids], axis=-1),
        Channel.SEEN_IN_MIRROR: 0 * ids,
        Channel.MIRRORED_POSITION: np.full((HEIGHT_PX, WIDTH_PX, 3), NAN, np.float32),
        Channel.MATERIAL_LAYERS: np.stack([ids > 0, 0 * ids], axis=-1).astype(np.uint16),
    }
    boxes = {"ego": {item.instance.instance_id: item.box3d_world for item in objects}}
    return Sample(
        index=0, scene_index=0, view_index=0, split="train", scene=scene,
        capture=Capture(
            {"color": SensorReading("color", camera, images)},
            {"top": PointCloud("top", lidar, points, origins=np.zeros(63, ORIGIN))},
            {"imu": Measurements("imu", device, rows)},
        ),
        truth={"color": ImageTruth(camera, tuple(objects))},
        frame=EgoTruth("ego", SE3(), boxes3d=boxes),  # type: ignore[arg-type]
    )  # fmt: skip


Mutation = Callable[[random.Random], Sample]


def change_object(**fields: Any) -> Mutation:
    """Change fields of a random object; callables receive the object."""

    def mutate(rng: random.Random) -> Sample:
        sample = make_sample()
        image = sample.truth["color"]
        objects = list(image.objects)
        k = rng.randrange(len(objects))
        values = {n: v(objects[k]) if callable(v) else v for n, v in fields.items()}
        objects[k] = replace(objects[k], **values)
        return replace(sample, truth={"color": replace(image, objects=tuple(objects))})

    return mutate


def change_instance(**fields: Any) -> Mutation:
    """Change fields of the instance of a random object, not in the scene."""
    return change_object(instance=lambda item: replace(item.instance, **fields))


def change_value(find: Callable[[Sample], Any], value: float, axes: int = 1) -> Mutation:
    """Change a random element of an array of the sample; later axes are changed as a whole."""

    def mutate(rng: random.Random) -> Sample:
        sample = make_sample()
        array = find(sample)
        array[tuple(rng.randrange(size) for size in array.shape[:axes])] = value
        return sample

    return mutate


def change_pixel(channel: Channel, value: float) -> Mutation:
    return change_value(lambda s: s.capture.readings["color"].channels[channel], value, 2)


def change_points(field: str, value: float) -> Mutation:
    return change_value(lambda s: s.capture.clouds["top"].points[field], value)


def change_origins(field: str, value: float) -> Mutation:
    return change_value(lambda s: s.capture.clouds["top"].origins[field], value)  # type: ignore[index]


def change_images(change: Callable[[Any], Any]) -> Mutation:
    def mutate(rng: random.Random) -> Sample:
        sample = make_sample()
        change(sample.capture.readings["color"].channels)
        return sample

    return mutate


def change_part(name: str, **fields: Any) -> Mutation:
    """Change fields of the scene or the frame; callables receive it."""

    def mutate(rng: random.Random) -> Sample:
        sample = make_sample()
        part = getattr(sample, name)
        values = {n: v(part) if callable(v) else v for n, v in fields.items()}
        return replace(sample, **{name: replace(part, **values)})

    return mutate


def shifted(box: BoxPx, by_px: int) -> BoxPx:
    return BoxPx(box.x_min + by_px, box.y_min, box.x_max + by_px, box.y_max)


def moved(pose: SE3, by_m: float) -> SE3:
    x, y, z = pose.translation_m
    return replace(pose, translation_m=(x + by_m, y, z))


def moved_box(box: OrientedBox, by_m: float) -> OrientedBox:
    return replace(box, T_frame_box=moved(box.T_frame_box, by_m))


def reverse_objects(truth: Any) -> Any:
    return {"color": replace(truth["color"], objects=truth["color"].objects[::-1])}


def scale_body(scene: Scene) -> tuple[Body, ...]:
    bent = replace(scene.bodies[3], T_world_body=SE3((0, 0, 0), (1.001, 0.0, 0.0, 0.0)))
    return (*scene.bodies[:3], bent, *scene.bodies[4:])


def flipped(mask: MaskPx) -> MaskPx:
    return MaskPx(mask.x_px, mask.y_px, mask.pixels[::-1].copy())


MUTATIONS: dict[str, Mutation] = {
    "box shifted": change_object(box=lambda o: shifted(o.box, 1)),
    "box outside": change_object(box=lambda o: shifted(o.box, 2000)),
    "box empty": change_object(box=lambda o: replace(o.box, x_max=o.box.x_min)),
    "box lost": change_object(box=None),
    "count": change_object(visible_px=lambda o: o.visible_px + 1),
    "count 0": change_object(visible_px=0),
    "count negative": change_object(visible_px=-1),
    "mask upside down": change_object(mask=lambda o: flipped(o.mask)),
    "mask shifted": change_object(mask=lambda o: replace(o.mask, x_px=o.mask.x_px + 1)),
    "mask full": change_object(mask=lambda o: replace(o.mask, pixels=np.ones((40, 60), bool))),
    "amodal box inside": change_object(amodal_box=lambda o: replace(o.box, x_min=o.box.x_min + 5)),
    "amodal mask away": change_object(amodal_mask=lambda o: replace(o.amodal_mask, x_px=0, y_px=0)),
    "amodal mask outside": change_object(amodal_mask=lambda o: replace(o.amodal_mask, x_px=-9)),
    "amodal mask loose": change_object(
        amodal_mask=lambda o: replace(o.amodal_mask, pixels=np.pad(o.amodal_mask.pixels, (0, 1)))
    ),
    "fraction above 1": change_object(visible_fraction=1.5),
    "fraction NaN": change_object(visible_fraction=NAN),
    "fraction 0": change_object(visible_fraction=0.0),
    "occlusion negative": change_object(occlusion=-0.1),
    "truncation infinite": change_object(truncation=INF),
    "pose moved": change_object(T_camera_object=lambda o: moved(o.T_camera_object, 0.01)),
    "pose NaN": change_object(T_camera_object=lambda o: moved(o.T_camera_object, NAN)),
    "pose scaled": change_object(T_camera_object=SE3((0, 0, 0), (0.9, 0.0, 0.0, 0.0))),
    "box3d moved": change_object(box3d_world=lambda o: moved_box(o.box3d_world, 0.01)),
    "box3d in camera": change_object(box3d_camera=lambda o: moved_box(o.box3d_camera, 0.01)),
    "box3d NaN": change_object(box3d_camera=lambda o: moved_box(o.box3d_camera, NAN)),
    "box3d size": change_object(box3d_world=lambda o: replace(o.box3d_world, size_m=(1, 1, 1))),
    "box3d flat": change_object(box3d_world=lambda o: replace(o.box3d_world, size_m=(0, 0, 0))),
    "parts too many": change_object(part_px={"lid": 10**6}),
    "part unknown": change_object(part_px={"lids": 10}),
    "keypoint unknown": change_object(keypoints=(KeypointTruth("tip", (0.0, 0.0, 1.0)),)),
    "lidar unknown": change_object(lidar_points={"roof": 1}),
    "lidar miscounted": change_object(lidar_points={"top": 4}),
    "lidar negative": change_object(lidar_points={"top": -1}),
    "motion NaN": change_object(motion=MotionTruth(Twist((NAN, 0.0, 0.0)), Twist())),
    "category 0": change_instance(category_id=0),
    "category too large": change_instance(category_id=4),
    "category of another": change_instance(category="book", category_id=3),
    "id unknown": change_instance(instance_id=77),
    "name of another": change_instance(name="other"),
    "not annotated": change_instance(annotated=False),
    "order of objects": lambda rng: replace(s := make_sample(), truth=reverse_objects(s.truth)),
    "instance lost": change_part("scene", instances=lambda scene: scene.instances[:-1]),
    "body scaled": change_part("scene", bodies=scale_body),
    "channel lost": change_images(lambda images: images.pop(Channel.RGB)),
    "channel cropped": change_images(lambda i: i.update({Channel.RGB: i[Channel.RGB][1:]})),
    "rows infinite": change_value(
        lambda s: s.capture.tables["imu"].rows["acceleration_m_s2"], INF, 2
    ),
    "frame box of nothing": change_part(
        "frame", boxes3d={"ego": {999: OrientedBox(SE3(), (1.0, 1.0, 1.0))}}
    ),
    "ego pose NaN": change_part("frame", T_world_ego=SE3((NAN, 0.0, 0.0))),
    "depth NaN": change_pixel(Channel.Z_DEPTH, NAN),
    "depth negative": change_pixel(Channel.Z_DEPTH, -1.0),
    "normal NaN": change_pixel(Channel.NORMALS, NAN),
    "normal infinite": change_pixel(Channel.NORMALS, INF),
    "flow infinite": change_pixel(Channel.FLOW_FORWARD, INF),
    "id of nothing": change_pixel(Channel.INSTANCE, 99),
    "layer NaN": change_pixel(Channel.DEPTH_LAYERS, NAN),
    "layer negative": change_pixel(Channel.DEPTH_LAYERS, -1.0),
    "layer of nothing": change_pixel(Channel.INSTANCE_LAYERS, 99),
    "material of nothing": change_pixel(Channel.MATERIAL_LAYERS, 99),
    "mirrored instance unknown": change_pixel(Channel.SEEN_IN_MIRROR, 99),
    "mirrored position infinite": change_pixel(Channel.MIRRORED_POSITION, INF),
    "origin NaN": change_origins("true_position_m", NAN),
    "origin of nothing": change_origins("true_instance_id", 99),
    "path unknown": change_origins("path", 3),
    "points NaN": change_points("intensity", NAN),
    "points far": change_points("position_m", INF),
    "points of nothing": change_points("instance_id", 99),
    "category of points": change_points("category_id", 9),
    "returns": change_points("return_number", 2),
}  # fmt: skip


def test_a_valid_sample_passes() -> None:
    assert list(sample_faults(make_info(), make_sample())) == []


@pytest.mark.parametrize("name", MUTATIONS)
def test_a_contradiction_is_refused(name: str) -> None:
    """Three seeded places each; the message names a field."""
    for seed in range(3):
        with pytest.raises(SampleError, match=r"^[\w.' \[\]()-]+: "):
            check_sample(make_info(), MUTATIONS[name](random.Random(seed)))
