"""Checks of whole samples before they are written: no contradiction reaches a data set.

``consistency_checks`` compares one object with the images when it is annotated. These checks see
the finished sample: pixel values, ids, poses, frames, points and rows, whoever made them.
"""

import math
from collections.abc import Container, Iterable, Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from gen_data.annotations.instance_extents import crop
from gen_data.core import errors, motion, se3
from gen_data.core.asset_types import LAYER_MATERIALS
from gen_data.core.boxes import BoxPx, OrientedBox, tight_box
from gen_data.core.capture import LAYERS, PATHS, Channel, Measurements, PointCloud, SensorReading
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import EgoTruth, ImageTruth, MaskPx, ObjectTruth, Relation, Sample
from gen_data.core.scene import Instance, Scene

UNIT_TOLERANCE = 1e-6
"""Largest deviation of a quaternion's length from 1; R^T R deviates from I by twice as much."""

POSITION_TOLERANCE_M = 1e-4
"""Largest distance between two statements of one position [m]; 0.5 px at the closest range."""

NOT_NEGATIVE = frozenset(
    {
        Channel.Z_DEPTH,
        Channel.RANGE,
        Channel.MEASURED_DEPTH,
        Channel.DISPARITY,
        Channel.DISPARITY_VISIBLE,
        Channel.DEPTH_LAYERS,
    }
)
MAY_BE_INFINITE = frozenset(
    {Channel.Z_DEPTH, Channel.RANGE, Channel.MEASURED_DEPTH, Channel.DEPTH_LAYERS}
)
MAY_BE_NAN = frozenset(
    {
        Channel.FLOW_FORWARD,
        Channel.FLOW_BACKWARD,
        Channel.SCENE_FLOW,
        Channel.MIRRORED_POSITION,
    }
)

Fault = tuple[str, str]
"""Field, and its fault."""


def check_sample(info: DatasetInfo, sample: Sample) -> None:
    """Check that a sample is valid: finite, closed under its ids, and free of contradictions.

    Raises:
        SampleError: it is not; the message names the first wrong field.
    """
    for field, fact in sample_faults(info, sample):
        raise errors.SampleError(f"{field}: {fact}")


def sample_faults(info: DatasetInfo, sample: Sample) -> Iterator[Fault]:
    """All contradictions in a sample; none if it is valid."""
    yield from _scene_faults(sample.scene)
    for name, reading in sample.capture.readings.items():
        yield from _reading_faults(info, name, reading)
    for name, truth in sample.truth.items():
        if name not in sample.capture.readings:
            yield f"truth.{name}", "has annotations, but no reading of that sensor"
            continue
        scene, reading = sample.scene_of(name), sample.capture.readings[name]
        for field, fact in _image_faults(info, scene, reading, truth, sample.capture.clouds):
            yield f"truth.{name}.{field}", fact
    for name in sample.capture.clouds:
        ids = {i.instance_id for i in sample.scene_of(name).instances}
        yield from _cloud_faults(info, name, sample.capture.clouds[name], ids)
    for name in sample.capture.tables:
        yield from _table_faults(name, sample.capture.tables[name])
    if sample.frame is not None:
        yield from _frame_faults(sample, sample.frame)


def _scene_faults(scene: Scene) -> Iterator[Fault]:
    ids = [i.instance_id for i in scene.instances]
    if len(set(ids)) != len(ids) or min(ids, default=1) < 1:
        yield "scene.instances", f"ids are not unique numbers from 1: {sorted(ids)[:20]}"
    known = {0, *ids}
    for body in scene.bodies:
        if body.instance_id not in known:
            yield f"scene.bodies '{body.name}'", f"there is no instance {body.instance_id}"
    poses = {
        **{f"scene.bodies '{b.name}'": b.T_world_body for b in scene.bodies},
        **{f"scene.instances {i.instance_id}": i.T_world_instance for i in scene.instances},
        **{f"scene.cameras '{c.name}'": c.T_world_camera for c in scene.cameras},
        **{f"scene.lidars '{n.name}'": n.T_world_lidar for n in scene.lidars},
    }
    for field, pose in poses.items():
        if not _is_rigid(pose):
            yield field, f"its pose is not rigid: {pose}"


def _is_rigid(pose: se3.SE3) -> bool:
    """Whether a pose is finite and its quaternion has length 1, that is, R^T R = I."""
    w, x, y, z = pose.quaternion_wxyz
    tx, ty, tz = pose.translation_m
    # A NaN makes both comparisons false.
    unit = abs(w * w + x * x + y * y + z * z - 1.0) <= UNIT_TOLERANCE
    return unit and abs(tx) + abs(ty) + abs(tz) < math.inf


def _reading_faults(info: DatasetInfo, name: str, reading: SensorReading) -> Iterator[Fault]:
    size = (reading.camera.intrinsics.height_px, reading.camera.intrinsics.width_px)
    for channel in info.media[name]:
        field = f"{name}.{channel}"
        if channel not in reading.channels:
            yield field, "is missing"
            continue
        image = reading.channels[channel]
        if channel in LAYERS and image.ndim != 3:
            yield field, f"has the shape {image.shape}; expected [height, width, layers]"
        elif image.shape[:2] != size:
            yield field, f"has {image.shape[:2]} pixels (height, width); expected {size}"
        elif image.dtype.kind == "f":
            yield from _value_faults(field, channel, image)
        elif channel is Channel.CATEGORY and int(image.max(initial=0)) > len(info.categories):
            yield field, f"shows category {image.max()} of {len(info.categories)}"
        elif channel is Channel.MATERIAL_LAYERS and image.max(initial=0) >= len(LAYER_MATERIALS):
            yield field, f"shows material {image.max()} of {len(LAYER_MATERIALS) - 1}"


def _value_faults(field: str, channel: Channel, image: NDArray[np.floating]) -> Iterator[Fault]:
    if channel in MAY_BE_NAN:
        low, high = np.fmin.reduce(image, axis=None), np.fmax.reduce(image, axis=None)
        if math.isinf(low) or math.isinf(high):
            yield field, "has an infinite value; expected numbers, or NaN for nothing"
        return
    # The minimum of an image with a NaN is NaN, and no comparison with it is true.
    low, high = float(image.min(initial=0.0)), float(image.max(initial=0.0))
    if math.isnan(low):
        yield field, "has a NaN"
    elif math.isinf(low) or (math.isinf(high) and channel not in MAY_BE_INFINITE):
        yield field, "has an infinite value"
    elif low < 0.0 and channel in NOT_NEGATIVE:
        yield field, f"has a negative value: {low}"


def _image_faults(
    info: DatasetInfo,
    scene: Scene,
    reading: SensorReading,
    truth: ImageTruth,
    clouds: Mapping[str, PointCloud],
) -> Iterator[Fault]:
    if not _is_rigid(truth.camera.T_world_camera):
        yield "camera", f"its pose is not rigid: {truth.camera.T_world_camera}"
        return
    instances = {i.instance_id: i for i in scene.instances}
    counts = {
        channel: _count_ids(reading.channels[channel])
        for channel in (Channel.INSTANCE, Channel.INSTANCE_LAYERS, Channel.SEEN_IN_MIRROR)
        if channel in reading.channels
    }
    for count in counts.values():
        foreign = sorted(set(np.flatnonzero(count).tolist()) - {0, *instances})
        if foreign:
            yield "image", f"shows instance {foreign[0]}, which the scene does not have"
    shown = counts.get(Channel.INSTANCE)
    ids = [item.instance.instance_id for item in truth.objects]
    if ids != sorted(set(ids)):
        yield "objects", f"are not in ascending order of unique instance ids: {ids[:20]}"
    yield from _relation_faults(truth.relations, instances)
    points = {name: np.bincount(cloud.points["instance_id"]) for name, cloud in clouds.items()}
    for number, item in enumerate(truth.objects):
        field = f"objects[{number}] (instance {item.instance.instance_id} '{item.instance.name}')"
        known = instances.get(item.instance.instance_id)
        for part, fact in _identity_faults(info, item.instance, known):
            yield f"{field}.{part}", fact
        if shown is not None:
            for part, fact in _visibility_faults(reading, item, shown):
                yield f"{field}.{part}", fact
        for part, fact in _object_faults(reading, truth, item):
            yield f"{field}.{part}", fact
        for fact in _scan_faults(item, points):
            yield f"{field}.lidar_points", fact


def _scan_faults(item: ObjectTruth, points: Mapping[str, NDArray[np.intp]]) -> Iterator[str]:
    number = item.instance.instance_id
    for name, stated in (item.lidar_points or {}).items():
        if name not in points:
            yield f"names the scanner '{name}', which has no scan"
        elif stated != (count := int(points[name][number]) if number < len(points[name]) else 0):
            yield f"'{name}': {stated} are stated, the scan has {count}"


def _relation_faults(relations: Iterable[Relation] | None, ids: Container[int]) -> Iterator[Fault]:
    """Relations of instances that are not there."""
    for relation in relations or ():
        for number in (relation.subject, relation.object):
            if number not in ids:
                yield "relations", f"{relation} names instance {number}, which does not exist"


def _identity_faults(
    info: DatasetInfo, instance: Instance, known: Instance | None
) -> Iterator[Fault]:
    if known is None:
        yield "instance", "is not in the scene"
    elif (instance.name, instance.category) != (known.name, known.category):
        yield "instance", f"is '{known.name}' ({known.category}) in the scene"
    number = instance.category_id
    if not 1 <= number <= len(info.categories):
        yield "category_id", f"{number} is not in 1 to {len(info.categories)}"
    elif info.categories[number - 1] != instance.category:
        named = info.categories[number - 1]
        yield "category_id", f"{number} is '{named}', but its category is '{instance.category}'"
    if not instance.annotated:
        yield "instance", "is annotated, although its instance is not"


def _count_ids(ids: NDArray[np.uint16]) -> NDArray[np.intp]:
    """Pixels of every id, from the runs of equal ids: few, compared with the pixels."""
    flat = ids.ravel()
    starts = np.flatnonzero(flat[1:] != flat[:-1]) + 1
    ends = np.append(starts, flat.size)
    starts = np.insert(starts, 0, 0)
    return np.bincount(flat[starts], weights=ends - starts).astype(np.intp)


def _visibility_faults(
    reading: SensorReading, item: ObjectTruth, shown: NDArray[np.intp]
) -> Iterator[Fault]:
    """Contradictions with the image of instance ids, whose pixel counts are ``shown``."""
    number = item.instance.instance_id
    pixels = int(shown[number]) if 0 <= number < len(shown) else 0
    if item.visible_px != pixels:
        yield "visible_px", f"{item.visible_px}, but the image shows {pixels}"
    elif item.box is not None:
        visible = crop(reading.channels[Channel.INSTANCE], item.box) == number
        if item.mask is not None:
            # The mask is compared with the box below.
            if visible.shape != item.mask.pixels.shape or (visible != item.mask.pixels).any():
                yield "mask", "is not its pixels in the image"
        elif not _is_tight(visible) or np.count_nonzero(visible) != pixels:
            yield "box", f"{item.box} is not the tight box of its pixels in the image"


def _object_faults(reading: SensorReading, truth: ImageTruth, item: ObjectTruth) -> Iterator[Fault]:
    """Contradictions within the labels of one object, which need no image."""
    camera = reading.camera.intrinsics
    if (item.box is None) != (item.visible_px == 0) or item.visible_px < 0:
        yield "visible_px", f"{item.visible_px}, with the box {item.box}"
    if item.box is not None and item.box.clipped(camera.width_px, camera.height_px) != item.box:
        yield "box", f"{item.box} is empty or not in {camera.width_px} x {camera.height_px} px"
    if item.mask is not None:
        if _mask_box(item.mask) != item.box or (item.box and not _is_tight(item.mask.pixels)):
            tight = tight_box(item.mask.pixels, item.mask.x_px, item.mask.y_px)
            yield "box", f"{item.box}; the tight box of its mask is {tight}"
        if int(np.count_nonzero(item.mask.pixels)) != item.visible_px:
            yield "mask", f"does not have its {item.visible_px} visible pixels"
    yield from _amodal_faults(item, camera.width_px, camera.height_px)
    yield from _share_faults(item)
    yield from _space_faults(truth, item)
    names = tuple(k.name for k in item.instance.keypoints)
    if item.keypoints is not None and tuple(k.name for k in item.keypoints) != names:
        yield "keypoints", f"are not the instance's: {names}"


def _amodal_faults(item: ObjectTruth, width_px: int, height_px: int) -> Iterator[Fault]:
    outer = item.amodal_box
    if outer is not None and (
        outer.is_empty or (item.box is not None and item.box.intersection(outer) != item.box)
    ):
        yield "amodal_box", f"{outer} does not contain the visible box {item.box}"
    mask = item.amodal_mask
    if mask is None or mask.pixels.size == 0:
        return
    filled = _mask_box(mask)
    if filled is None or filled.clipped(width_px, height_px) != filled:
        yield "amodal_mask", f"its box {filled} is not in the image"
    elif not _is_tight(mask.pixels):
        yield "amodal_mask", "is not stored tight"
    elif item.mask is not None and item.box is not None and not _contains(mask, item.mask):
        yield "amodal_mask", "does not contain the visible pixels"


def _mask_box(mask: MaskPx) -> BoxPx | None:
    """The box that a mask fills; None for a mask without pixels."""
    height, width = mask.pixels.shape
    if height == 0 or width == 0:
        return None
    return BoxPx(mask.x_px, mask.y_px, mask.x_px + width, mask.y_px + height)


def _is_tight(mask: NDArray[np.bool_]) -> bool:
    """Whether every side of a mask has a set pixel; [0, 0] has none."""
    if mask.size == 0:
        return False
    return bool(mask[0].any() and mask[-1].any() and mask[:, 0].any() and mask[:, -1].any())


def _contains(outer: MaskPx, inner: MaskPx) -> bool:
    dx, dy = inner.x_px - outer.x_px, inner.y_px - outer.y_px
    height, width = inner.pixels.shape
    if dx < 0 or dy < 0:
        return False
    window = outer.pixels[dy : dy + height, dx : dx + width]
    return window.shape == inner.pixels.shape and not bool((inner.pixels > window).any())


def _share_faults(item: ObjectTruth) -> Iterator[Fault]:
    for name in ("visible_fraction", "occlusion", "truncation"):
        share = getattr(item, name)
        # Written to make NaN a fault.
        if share is not None and not 0.0 <= share <= 1.0:
            yield name, f"{share} is not in [0, 1]"
    if item.detectability is not None and not 0.0 <= item.detectability < math.inf:
        yield "detectability", f"{item.detectability} is not a number from 0"
    if item.visible_fraction is not None and (item.visible_fraction > 0) != (item.visible_px > 0):
        yield "visible_fraction", f"{item.visible_fraction} with {item.visible_px} visible pixels"
    for name, count in (item.part_px or {}).items():
        if name not in item.instance.parts or not 0 <= count <= item.visible_px:
            yield "part_px", f"'{name}': {count} of {item.visible_px} visible pixels"
    for name, count in (item.lidar_points or {}).items():
        if count < 0:
            yield "lidar_points", f"'{name}': {count} is negative"


def _space_faults(truth: ImageTruth, item: ObjectTruth) -> Iterator[Fault]:
    """Contradictions between statements of one pose in several frames."""
    T_world_camera = truth.camera.T_world_camera
    pairs: list[tuple[str, se3.SE3, se3.SE3]] = []
    if item.box3d_world is not None and item.box3d_camera is not None:
        seen = T_world_camera @ item.box3d_camera.T_frame_box
        pairs.append(("box3d_camera", seen, item.box3d_world.T_frame_box))
        if item.box3d_camera.size_m != item.box3d_world.size_m:
            yield "box3d_camera", f"its size differs from box3d_world: {item.box3d_camera.size_m}"
    if item.T_camera_object is not None:
        placed = T_world_camera @ item.T_camera_object
        pairs.append(("T_camera_object", placed, item.instance.T_world_instance))
    for name, box in (("box3d_world", item.box3d_world), ("box3d_camera", item.box3d_camera)):
        if box is not None and not _is_box(box):
            yield name, f"is not a box: {box}"
    for name, one, other in pairs:
        if not _are_equal(one, other):
            yield name, "contradicts the pose of the instance in the world"
    if item.motion is not None:
        for twist in (item.motion.world, item.motion.camera, item.motion.ego):
            if twist is not None and not _is_finite(twist):
                yield "motion", f"is not finite: {twist}"


def _is_box(box: OrientedBox) -> bool:
    sides = box.size_m
    known = all(0 <= side < math.inf for side in sides) and max(sides) > 0
    return known and _is_rigid(box.T_frame_box)


def _are_equal(one: se3.SE3, other: se3.SE3) -> bool:
    """Whether two poses agree; quaternions q and -q are the same rotation."""
    scale = 1.0 + max(abs(v) for v in other.translation_m)
    pairs = zip(one.translation_m, other.translation_m, strict=True)
    near = all(abs(a - b) <= POSITION_TOLERANCE_M * scale for a, b in pairs)
    dot = sum(a * b for a, b in zip(one.quaternion_wxyz, other.quaternion_wxyz, strict=True))
    return near and abs(abs(dot) - 1.0) <= UNIT_TOLERANCE


def _is_finite(twist: motion.Twist) -> bool:
    return all(math.isfinite(v) for v in (*twist.velocity_m_s, *twist.angular_velocity_rad_s))


def _cloud_faults(
    info: DatasetInfo, name: str, cloud: PointCloud, ids: set[int]
) -> Iterator[Fault]:
    points = cloud.points
    if not _is_rigid(cloud.lidar.T_world_lidar):
        yield f"{name}.lidar", f"its pose is not rigid: {cloud.lidar.T_world_lidar}"
    if len(points) == 0:
        return
    for field in ("position_m", "intensity", "time_s"):
        if not np.isfinite(points[field]).all():
            yield f"{name}.{field}", "has a NaN or an infinite value"
    foreign = sorted(set(np.flatnonzero(np.bincount(points["instance_id"])).tolist()) - {0, *ids})
    if foreign:
        yield f"{name}.instance_id", f"{foreign[0]} is not in the scene"
    if int(points["category_id"].max()) > len(info.categories):
        yield f"{name}.category_id", f"{points['category_id'].max()} of {len(info.categories)}"
    yield from _origin_faults(name, cloud, ids)
    if (points["return_number"] > points["return_count"]).any():
        yield f"{name}.return_number", "exceeds the number of returns"


def _origin_faults(name: str, cloud: PointCloud, ids: set[int]) -> Iterator[Fault]:
    origins = cloud.origins
    if origins is None:
        return
    if len(origins) != len(cloud.points):
        yield f"{name}.origins", f"are {len(origins)} of {len(cloud.points)} points"
    if not np.isfinite(origins["true_position_m"]).all():
        yield f"{name}.true_position_m", "has a NaN or an infinite value"
    if not np.isin(origins["true_instance_id"], [0, *ids]).all():
        yield f"{name}.true_instance_id", "has an instance that is not in the scene"
    if (origins["path"] >= len(PATHS)).any():
        yield f"{name}.path", f"is {origins['path'].max()} of {len(PATHS) - 1}"


def _table_faults(name: str, table: Measurements) -> Iterator[Fault]:
    """Rows may have NaN, which means no fix, but no infinite number."""
    for column in table.rows.dtype.names or ():
        values = table.rows[column]
        if values.dtype.kind == "f" and np.isinf(values).any():
            yield f"{name}.{column}", "has an infinite value"


def _frame_faults(sample: Sample, frame: EgoTruth) -> Iterator[Fault]:
    if not _is_rigid(frame.T_world_ego):
        yield "frame.T_world_ego", f"is not rigid: {frame.T_world_ego}"
    if not _is_finite(frame.twist):
        yield "frame.twist", f"is not finite: {frame.twist}"
    for field, fact in _relation_faults(
        frame.relations, {i.instance_id for i in sample.scene.instances}
    ):
        yield f"frame.{field}", fact
    for name, boxes in (frame.boxes3d or {}).items():
        scene = sample.scene_of(name)
        known = {i.instance_id for i in scene.instances if i.annotated}
        for number, box in boxes.items():
            field = f"frame.boxes3d.{name}[{number}]"
            if number not in known:
                yield field, "there is no such annotated instance"
            elif not _is_box(box):
                yield field, f"is not a box: {box}"
