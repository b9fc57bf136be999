"""Data sets that a format cannot represent are refused before rendering, with the remedy."""

from typing import Any

import pytest

from gen_data.core import optional_packages
from gen_data.core.capture import Channel
from gen_data.core.errors import ConfigError
from gen_data.exporters import TABLE

BENT = {"color": "kannala_brandt"}
RGB_ONLY = {"media": {"color": (Channel.RGB,)}}
DEPTH_ONLY = {"media": {"color": (Channel.Z_DEPTH,)}}
NO_IDS = {"media": {"color": (Channel.RGB, Channel.Z_DEPTH)}}
NO_IMAGE = {"media": {"color": ()}}
NO_CAMERA = {"cameras": (), "lidars": ("top",)}
SCANNER = {"lidars": ("top",)}
DRIVE = {"n": 8, "cameras": ("left", "right"), "lidars": ("top",), "steps_per_scene": 4}
LONG = DRIVE | {"n": 40_001}
TRAFFIC = DRIVE | {"categories": ("bench", "mug")}

PINHOLES = [*("bop", "cityscapes", "kitti", "kitti_raw", "kitti_tracking", "nuscenes", "scannet"),
            *("semantickitti", "solo", "tum_rgbd")]  # fmt: skip
NO_PHOTOGRAPH = r"no sensor of color writes the rgb channel"
TOO_LONG = "there are 10001; expected at most 40000 samples"
NO_DEPTH = "'color' does not write the channel depth; add it .* leave 'depth' out"
NO_INSTANCES = "'color' does not write the channel instance; add it .* leave 'instances' out"
NO_RANGE = "expected both, with near_m < far_m, or neither"

ROWS: list[tuple[str, dict[str, Any], dict[str, Any], str]] = [
    ("calibration", {}, {"lenses": {"color": "equirectangular"}}, "no camera has a calibration"),
    ("cityscapes", {}, RGB_ONLY, "does not write the channel instance; add it"),
    ("cityscapes", {"right": "other"}, {}, "does not write the channel disparity"),
    ("coco", {}, DEPTH_ONLY, NO_PHOTOGRAPH),
    ("coco_panoptic", {}, RGB_ONLY, "'color' does not write the channel instance; add it"),
    ("control_clips", {}, DRIVE, "depth of a sequence needs a fixed range"),
    ("control_clips", {"near_m": 5.0}, {}, NO_RANGE),
    ("control_clips", {"near_m": 5.0, "far_m": 5.0}, {}, NO_RANGE),
    ("control_clips", {"segmentation": "instance"}, NO_IDS, "not write the channel instance"),
    ("control_clips", {"segmentation": "category"}, NO_IDS, "not write the channel category"),
    ("control_clips", {}, RGB_ONLY, "does not write the channel depth"),
    ("croissant", {}, NO_IMAGE, NO_PHOTOGRAPH),
    ("hdf5", {}, NO_CAMERA, "no camera writes a channel"),
    ("huggingface", {}, NO_IMAGE, NO_PHOTOGRAPH),
    ("kitti", {}, DEPTH_ONLY, NO_PHOTOGRAPH),
    ("kitti", {}, NO_CAMERA, "no sensor of none writes the rgb channel; add an rgb"),
    ("kitti", {}, {"n": 1_000_001}, "six digits"),
    ("kitti", {"camera": "colour"}, {}, "camera 'colour'.*one of: color.*did you mean 'color'"),
    ("kitti", {"lidar": "tpo"}, SCANNER, "no lidar 'tpo'.*did you mean 'top'"),
    ("kitti_raw", {}, DRIVE | {"lidars": ()}, "no lidar; add a sensor"),
    ("kitti_raw", {}, LONG, TOO_LONG),
    ("kitti_raw", {"image_02": "lefd"}, DRIVE, "camera 'lefd'.*did you mean 'left'"),
    ("kitti_raw", {"lidar": "velo"}, DRIVE, "no lidar 'velo'.*top"),
    ("kitti_raw", {"oxts": "gps"}, DRIVE, "no device 'gps'.*imu"),
    ("kitti_stereo", {}, {}, r"no camera writes .*disparity"),
    ("kitti_tracking", {}, LONG, TOO_LONG),
    ("kitti_tracking", {"camera": "middle"}, DRIVE, "camera 'middle'.*left, right"),
    ("kitti_tracking", {"lidar": "velo"}, DRIVE, "no lidar 'velo'"),
    ("lerobot", {}, {}, "steps_per_scene is 1; set steps_per_scene"),
    ("lerobot", {"geometry": ("depth",)}, RGB_ONLY | {"steps_per_scene": 4}, NO_DEPTH),
    ("rlds", {"geometry": ("instances",)}, RGB_ONLY | {"steps_per_scene": 4}, NO_INSTANCES),
    ("mcap", {}, {"cameras": ()}, "neither camera nor lidar"),
    ("motchallenge", {}, TRAFFIC, r"no category .* has a class.*pedestrian"),
    ("motchallenge", {}, LONG, TOO_LONG),
    ("motchallenge", {"camera": "middle"}, DRIVE, "camera 'middle'.*left, right"),
    ("nuscenes", {}, DRIVE | {"lidars": ()}, r"there is no lidar; add .*LIDAR_TOP"),
    ("nuscenes", {}, TRAFFIC, r"no category of the data set has a class .* car, van"),
    ("argoverse2", {}, TRAFFIC, r"no category of the data set has a class .* car, van"),
    ("cityscapes", {"camera": "left"}, TRAFFIC, r"no category of the data set has a class .* car"),
    ("nuscenes", {}, DRIVE | {"cameras": ("CAM_LEFT", "left")}, "'CAM_LEFT' and 'left' both"),
    ("pointclouds", {}, {}, "add a sensor of that type"),
    ("scannet", {}, RGB_ONLY, "camera 'color' does not write the channel depth"),
    ("semantickitti", {}, {}, "there is no lidar; add a sensor"),
    ("semantickitti", {}, NO_CAMERA, "there is no camera; add a sensor"),
    ("semantickitti", {"camera": "colour"}, SCANNER, "no camera 'colour'.*color"),
    ("semantickitti", {"lidar": "velo"}, SCANNER, "no lidar 'velo'.*top"),
    ("solo", {}, {"steps_per_scene": 4}, "expected a multiple of 4 samples, not 7"),
    ("tables", {}, {"devices": {}}, r"add a sensor such as .*imu"),
    ("tfrecord", {}, NO_IMAGE, NO_PHOTOGRAPH),
    ("tum_rgbd", {}, RGB_ONLY, "camera 'color' does not write the channel depth"),
    ("tum_rgbd", {"imu": "imo"}, DRIVE, "no IMU 'imo'; expected one of: imu"),
    ("voc", {}, {"categories": ("c",) * 255}, "room for 254 categories, but there are 255"),
    ("webdataset", {}, {"cameras": ("color", "Color")}, r"'color' and 'Color' differ in case"),
    ("yolo", {"pose_category": "cars"}, {}, r"pose_category: there is no category 'cars'.*car"),
    *((k, {}, SCANNER | {"lenses": BENT}, "'color' has a lens of the") for k in PINHOLES),
]


@pytest.mark.parametrize(("kind", "options", "facts", "message"), ROWS)
def test_the_text_names_what_is_missing(
    kind: str, options: dict[str, Any], facts: dict[str, Any], message: str, world: Any
) -> None:
    """And the field to change, the known names or the nearest one."""
    exporter = TABLE.load(kind).model_validate({"type": kind, **options})
    with pytest.raises(ConfigError, match=f"exporter '{kind}'.*{message}"):
        exporter.check(world.info(**{"n": 7, **facts}))


@pytest.mark.parametrize("kind", ["coco", "motchallenge"])
def test_formats_of_image_boxes_take_any_lens(world: Any, kind: str) -> None:
    """Boxes and masks are where the lens puts them."""
    assert TABLE.load(kind)().check(world.info(4, lenses=BENT)) is None


@pytest.mark.parametrize(
    ("kind", "package"),
    [("hdf5", "h5py"), ("mcap", "foxglove-schemas-protobuf"), ("tfrecord", "google-crc32c")],
)
def test_a_missing_package_is_named(
    world: Any, monkeypatch: pytest.MonkeyPatch, kind: str, package: str
) -> None:
    """With the command that installs it; NumPy's archives need none."""
    monkeypatch.setattr(optional_packages, "find_spec", lambda name: None)
    with pytest.raises(ConfigError, match=rf"{package}.*: pip install .*\[formats\]'"):
        TABLE.load(kind)().check(world.info(7))
    TABLE.load("hdf5")(container="npz").check(world.info(7))
