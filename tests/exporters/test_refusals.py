"""Data sets that a format cannot represent are refused before rendering, with the remedy."""

from typing import Any

import pytest

from gen_data.core import optional_packages
from gen_data.core.capture import Channel
from gen_data.core.errors import ConfigError
from gen_data.core.scene import Scene
from gen_data.exporters import TABLE
from tests.exporters.test_nuscenes_expansions import streets

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

PINHOLES = [*("bop", "cityscapes", "kitti", "kitti_raw", "kitti_tracking", "nuscenes", "openlane"),
            *("scannet", "semantickitti", "solo", "tum_rgbd")]  # fmt: skip
HYPHENS = {"categories": ("toy-block", "toy block")}
SCORES = {"categories": ("toy_block", "toy block")}
ALIKE = "the categories 'toy.block' and 'toy block' are both 'toy.block' in its files"
NO_PHOTOGRAPH = r"no sensor of color writes the rgb channel"
TOO_LONG = "there are 10001; expected at most 40000 samples"
NO_DEPTH = "'color' does not write the channel depth; add it .* leave 'depth' out"
NO_INSTANCES = "'color' does not write the channel instance; add it .* leave 'instances' out"
NO_RANGE = "expected both, with near_m < far_m, or neither"

ROWS: list[tuple[str, dict[str, Any], dict[str, Any], str]] = [
    ("argoverse2", {}, {}, "there is no lidar; add a sensor"),
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
    ("dota", {}, HYPHENS, ALIKE),
    ("hdf5", {}, NO_CAMERA, "no camera writes a channel"),
    ("huggingface", {}, NO_IMAGE, NO_PHOTOGRAPH),
    ("kitti", {}, DEPTH_ONLY, NO_PHOTOGRAPH),
    ("kitti", {}, NO_CAMERA, "no sensor of none writes the rgb channel; add an rgb"),
    ("kitti", {}, {"n": 1_000_001}, "six digits"),
    ("kitti", {"camera": "colour"}, {}, "camera 'colour'.*one of: color.*did you mean 'color'"),
    ("kitti", {"lidar": "tpo"}, SCANNER, "no lidar 'tpo'.*did you mean 'top'"),
    ("kitti", {"types": "category"}, SCORES, ALIKE),
    ("kitti_tracking", {"types": "category"}, DRIVE | SCORES, ALIKE),
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
    ("nuscenes", {"can_bus": True}, DRIVE | {"n": 4 * 8001}, "8000 sequences, .* are 8001"),
    *(
        ("occupancy", {"layouts": ("occ3d", k)}, {}, f"layouts: '{k}' lists scans, but there is no")
        for k in ("semantickitti", "openoccupancy")
    ),
    ("pointclouds", {}, {}, "add a sensor of that type"),
    ("scannet", {}, RGB_ONLY, "camera 'color' does not write the channel depth"),
    ("scene_text", {}, {"media": {"color": (Channel.INSTANCE,)}}, NO_PHOTOGRAPH),
    ("semantickitti", {}, {}, "there is no lidar; add a sensor"),
    ("semantickitti", {}, NO_CAMERA, "there is no camera; add a sensor"),
    ("semantickitti", {"camera": "colour"}, SCANNER, "no camera 'colour'.*color"),
    ("semantickitti", {"lidar": "velo"}, SCANNER, "no lidar 'velo'.*top"),
    ("solo", {}, {"steps_per_scene": 4}, "expected a multiple of 4 samples, not 7"),
    ("tables", {}, {"devices": {}}, r"add a sensor such as .*imu"),
    ("tapvid", {}, DEPTH_ONLY, NO_PHOTOGRAPH),
    ("tapvid", {}, {"lenses": BENT}, "layouts: 'tapvid3d': camera 'color' has a lens"),
    ("tfrecord", {}, NO_IMAGE, NO_PHOTOGRAPH),
    ("tum_rgbd", {}, RGB_ONLY, "camera 'color' does not write the channel depth"),
    ("tum_rgbd", {"imu": "imo"}, DRIVE, "no IMU 'imo'; expected one of: imu"),
    ("voc", {}, HYPHENS, ALIKE),
    *(("voc", {}, {"categories": (k,)}, f"category '{k}': labelmap") for k in ("size: L", "#5")),
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


@pytest.mark.parametrize(
    ("kind", "options"),
    [("coco", {}), ("culane", {}), ("motchallenge", {}), ("tapvid", {"layouts": ("tapvid",)})],
)
def test_formats_of_images_take_any_lens(world: Any, kind: str, options: dict[str, Any]) -> None:
    """Boxes, masks, lines and points are where the lens puts them."""
    assert TABLE.load(kind)(**options).check(world.info(4, lenses=BENT)) is None


NO_STREET, NO_ARM = "no driving lane; add an element", "the scene has no arm; add an elem"
ROOM = {
    **dict.fromkeys(("culane", "map_vectors", "opendrive", "openlane"), NO_STREET),
    **dict.fromkeys(("lerobot", "rlds"), NO_ARM),
}
"""Formats that need more than a bare room, and the message."""


@pytest.mark.parametrize("kind", TABLE.names())
def test_scenes_are_refused_before_anything_is_rendered(kind: str) -> None:
    """A room, by formats of streets and of arms; all others take it."""
    exporter = TABLE.load(kind)()
    if kind not in ROOM:
        assert exporter.check_scene(Scene("room")) is None
        return
    with pytest.raises(ConfigError, match=f"exporter '{kind}'.*: .*{ROOM[kind]}"):
        exporter.check_scene(Scene("room"))


def test_formats_of_streets_take_a_street() -> None:
    """Also the map of nuScenes, which a room does not have."""
    expanded = TABLE.load("nuscenes")(map_expansion=True)
    with pytest.raises(ConfigError, match=r"map_expansion needs a street.*'road'"):
        expanded.check_scene(Scene("room"))
    for exporter in (expanded, *(TABLE.load(k)() for k in ("culane", "opendrive", "openlane"))):
        exporter.check_scene(streets())


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
