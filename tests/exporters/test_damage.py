"""Tests of exports notice a wrong fact: one fact of every sample is changed before the export.

The tests of the format then hold the export against the samples as they were. So a row states which
facts a format carries to its readers; ``tests/usd/test_usd_export.py`` damages stages of USD.
"""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gen_data.core.boxes import BoxPx, OrientedBox
from gen_data.core.capture import Channel, Measurements, PointCloud, SensorReading
from gen_data.core.motion import JointTrajectory
from gen_data.core.sample import (
    BirdseyeMap,
    EgoTruth,
    Grasp,
    ObjectTruth,
    Occupancy,
    SensorTracks,
    Utterance,
    WordTruth,
)
from gen_data.core.scene import Camera, Instance, Lane, Scene
from gen_data.core.se3 import SE3
from gen_data.exporters import TABLE
from tests.exporters import (
    test_argoverse2,
    test_birdseye,
    test_bop,
    test_calibration,
    test_cityscapes,
    test_coco,
    test_control_clips,
    test_cvat,
    test_demonstrations,
    test_dota,
    test_graspnet,
    test_hdf5,
    test_kitti,
    test_kitti_raw,
    test_kitti_stereo,
    test_kitti_tracking,
    test_lane_formats,
    test_language,
    test_lerobot,
    test_lidar_flow,
    test_map_vectors,
    test_mcap,
    test_motchallenge,
    test_nuscenes,
    test_nuscenes_expansions,
    test_occupancy,
    test_opendrive_export,
    test_rerun,
    test_rgbd_sequences,
    test_scans,
    test_scene_text,
    test_semantickitti,
    test_solo,
    test_tables,
    test_tapvid,
    test_webdataset,
)
from tests.exporters.datasets import Source, drive, pairs, reach, street
from tests.exporters.drives import drive_info
from tests.exporters.label_readers import opened
from tests.exporters.test_labels import assert_objects
from tests.tiers import sampled
from tests.wheels import needs_rerun

ASIDE = SE3((0.5, -0.3, 0.0))


def everywhere(*kinds: type, **changes: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Change of fields of every value of some types in a sample; of None nothing is made."""

    def change(value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(map(change, value))
        if isinstance(value, Mapping):
            return {key: change(item) for key, item in value.items()}
        if not is_dataclass(value) or isinstance(value, (SE3, type)):
            return value
        found = {f.name: change(getattr(value, f.name)) for f in fields(value) if f.init}
        for name, make in changes.items() if isinstance(value, kinds) else ():
            found[name] = None if found[name] is None else make(found[name])
        return replace(value, **found)

    return change


def pixels(channel: Channel, change: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Change of one channel of every image that has it."""
    return everywhere(
        SensorReading,
        channels=lambda cs: {c: change(a) if c is channel else a for c, a in cs.items()},
    )


def records(
    kind: type, name: str, field: str, change: Callable[[Any], Any]
) -> Callable[[Any], Any]:
    """Change of one field of the records in arrays of a type."""

    def changed(rows: Any) -> Any:
        rows = rows.copy()
        rows[field] = change(rows[field])
        return rows

    return everywhere(kind, **{name: changed})


def shift_centre(k: Any) -> Any:
    """The lens with pixel edges for pixel centres."""
    return replace(k, cx_px=k.cx_px + 0.5, cy_px=k.cy_px + 0.5)


def narrow(size: Any) -> Any:
    """Sides or a corner of a box with its width first."""
    return (size[1], size[0], size[2])


def aside(pose: SE3) -> SE3:
    """Half a metre to the right, and a little higher."""
    return pose @ ASIDE


def raised(knots: Any) -> Any:
    """Joint positions, each by 0.01."""
    return tuple(tuple(v + 0.01 for v in knot) for knot in knots)


def beside(center: Any) -> Any:
    """Points, each 1 cm to the side."""
    return tuple((x + 0.01, y, z) for x, y, z in center)


def moved(box: BoxPx) -> BoxPx:
    return BoxPx(box.x_min + 1, box.y_min, box.x_max + 1, box.y_max)


EXCHANGED = {"car": "crate", "crate": "car", 1: 2, 2: 1}
CHANGES: dict[str, tuple[Callable[[Any], Any], ...]] = {
    "arms": (everywhere(JointTrajectory, knots=raised),),
    "boxes": (everywhere(ObjectTruth, box=moved),),
    "cameras": (everywhere(Camera, T_world_camera=aside, T_rig_camera=aside),),
    "categories": (
        everywhere(
            Instance,
            category=lambda name: EXCHANGED.get(name, name),
            category_id=lambda k: EXCHANGED.get(k, k),
        ),
    ),
    "centres": (everywhere(Camera, intrinsics=shift_centre),),
    "corners": (everywhere(ObjectTruth, oriented_box=lambda c: (*c[1:], c[0])),),
    "depths": (pixels(Channel.Z_DEPTH, lambda a: a * np.float32(1.05)),),
    "disparities": (pixels(Channel.DISPARITY, np.floor),),
    "flow": (pixels(Channel.FLOW_FORWARD, lambda a: np.ascontiguousarray(a[..., ::-1])),),
    "grasps": (everywhere(Grasp, width_m=lambda w: w + 0.02),),
    "ids": (pixels(Channel.INSTANCE, lambda a: np.roll(a, 1, axis=1)),),
    "maps": (everywhere(BirdseyeMap, layers=lambda ls: {k: np.fliplr(v) for k, v in ls.items()}),),
    "masks": (everywhere(ObjectTruth, mask=lambda m: replace(m, pixels=np.fliplr(m.pixels))),),
    "measurements": (records(Measurements, "rows", "force_x_m_s2", np.float32),),
    "normals": (pixels(Channel.NORMALS, np.negative),),
    "photographs": (pixels(Channel.RGB, lambda a: np.ascontiguousarray(a[..., ::-1])),),
    "point ids": (records(PointCloud, "points", "instance_id", lambda ids: np.roll(ids, 9)),),
    "points": (records(PointCloud, "points", "position_m", lambda p: p[:, ::-1]),),
    "poses": (everywhere(ObjectTruth, T_camera_object=aside),),
    "shares": (everywhere(ObjectTruth, visible_fraction=lambda _: 0.0, occlusion=lambda s: 1 - s),),
    "solids": (
        everywhere(Instance, box_min_m=narrow, box_max_m=narrow),
        everywhere(OrientedBox, size_m=narrow),
    ),
    "streets": (everywhere(Lane, center_m=beside),),
    "surroundings": (everywhere(EgoTruth, boxes3d=everywhere(OrientedBox, size_m=narrow)),),
    "texts": (everywhere(Utterance, answer=lambda _: "many"),),
    "times": (everywhere(Scene, PointCloud, SensorReading, time_s=lambda t: 1.5 * t + 0.05),),
    "tracks": (everywhere(SensorTracks, image_px=lambda p: p + 1, position_m=lambda p: -p),),
    "words": (everywhere(WordTruth, quad_px=lambda q: (*q[1:], q[0])),),
    "voxels": (everywhere(Occupancy, instance_id=lambda a: np.roll(a, 1, axis=0)),),
}
"""Changed facts."""


@dataclass(frozen=True)
class Made:
    """An export of changed samples, and the samples that it is held against.

    Attributes:
        kind: Format.
        folder: The data set.
        world: Its exports are the folder, and its samples are as they were.
        samples: As they were.
    """

    kind: str
    folder: Path
    world: Any
    samples: Any


@dataclass(frozen=True)
class Row:
    """How a format is made and tested.

    Attributes:
        samples: Description of the data set and its samples, of a world.
        changes: Facts that the tests notice, separated by commas.
        tests: Tests that take the export under any name, or checks of ``Made`` that find nothing.
        options: Fields of the exporter.
    """

    samples: Source
    changes: str
    tests: tuple[Callable[..., Any], ...]
    options: Mapping[str, Any]


def row(samples: Source, changes: str, *tests: Callable[..., Any], **options: Any) -> Row:
    return Row(samples, changes, tests, options)


def few(world: Any) -> tuple[Any, Any]:
    return world.info(7), [world.samples[0], world.samples[2]]


def scans(world: Any) -> tuple[Any, Any]:
    """The same with a laser scanner, in sequences of two."""
    return world.info(7, lidars=("top",), steps_per_scene=2), world.samples


def bodies(world: Any) -> tuple[Any, Any]:
    """The first two frames, with bodies; the second for tests."""
    first, second = world.with_bodies(world.samples[:2])
    return world.info(2), [first, replace(second, split="test")]


def normals(world: Any) -> tuple[Any, Any]:
    media = {"color": (*world.info(7).media["color"], Channel.NORMALS)}
    return world.info(7, media=media), world.samples


def slips(world: Any) -> tuple[Any, Any]:
    return drive_info(world), test_demonstrations.demonstrated(world)


def graspable(world: Any) -> tuple[Any, Any]:
    return world.info(1), [test_graspnet.with_grasps(world)]


def labels(made: Made) -> None:
    assert_objects(made.kind, made.folder, made.samples)


def solo(made: Made) -> list[str]:
    root = made.folder / "train"
    samples = [sample for sample in made.samples if sample.split == "train"]
    return [*test_solo.problems(root, test_solo.read_json(root), samples)]


ROWS = {
    "argoverse2": row(test_nuscenes_expansions.town, "cameras, centres, points, solids",
        lambda m: test_argoverse2.check_log(m.folder, m.samples)),
    "birdseye": row(street, "maps, surroundings",
        test_birdseye.test_layers_are_images_and_frames_tell_what_is_on_them),
    "bop": row(bodies, "depths, masks, poses",
        lambda m: test_bop.problems(m.folder)),
    "calibration": row(drive, "cameras",
        test_calibration.test_every_photograph_has_its_pose_in_its_model),
    "cityscapes": row(few, "categories, ids",
        lambda m: test_cityscapes.problems(m.folder, m.samples)),
    "coco": row(street, "boxes, cameras, categories, centres, masks, poses, shares, solids",
        labels,
        test_coco.test_boxes_areas_and_visibility_are_those_of_the_decoded_masks,
        test_coco.test_the_pose_and_box_project_onto_the_image_box_by_the_written_camera),
    "coco_panoptic": row(few, "categories, ids", labels),
    "control_clips": row(few, "depths, ids, photographs",
        lambda m: [*test_control_clips.problems(m.folder, m.samples)]),
    "croissant": row(few, "boxes, categories", labels),
    "culane": row(test_lane_formats.road, "photographs",
        lambda m: test_lane_formats.check_photograph(m.folder)),
    "cvat": row(street, "categories, masks, shares",
        labels, lambda m: test_cvat.assert_states(m.folder, m.samples)),
    "dota": row(street, "categories, corners, shares",
        lambda m: test_dota.assert_truth(m.world, m.folder, 0.4)),
    "graspnet": row(graspable, "cameras, grasps",
        lambda m: test_graspnet.assert_rows(m.folder, m.samples[0])),
    "hdf5": row(normals, "cameras, categories, centres, depths, ids, normals, photographs",
        test_hdf5.test_containers_hold_the_street),
    "huggingface": row(few, "boxes, categories, masks", labels),
    "kitti": row(street, "categories, solids",
        test_kitti.test_image_boxes_bound_the_projected_boxes_inside_the_image,
        test_kitti.test_every_frame_has_every_file_with_official_types_and_others_misc, low_px=2),
    "kitti_raw": row(drive, "cameras, categories, photographs, points, solids",
        test_kitti_raw.test_raw_files_hold_the_samples_of_their_frames,
        test_kitti_raw.test_raw_calibration_maps_points_into_their_image,
        test_kitti_raw.test_tracklets_enclose_the_points_of_their_object, image_03="right"),
    "kitti_stereo": row(pairs, "centres, disparities, flow",
        test_kitti_stereo.test_disparities_are_those_of_depth,
        test_kitti_stereo.test_flow_is_there_for_every_frame_that_has_a_next_one,
        test_kitti_stereo.test_points_are_in_the_right_image_at_x_minus_disparity),
    "kitti_tracking": row(drive, "categories, solids",
        test_kitti_tracking.test_tracking_labels_last_and_fall_into_their_boxes_by_the_calibration,
        low_px=4),
    "label_studio": row(few, "categories, masks", labels),
    "language": row(few, "categories, masks, texts",
        labels, lambda m: test_language.assert_said(m.folder, m.samples)),
    "lerobot": row(reach, "arms, photographs",
        lambda m: test_lerobot.faults(m.folder / "train/toys_arm", m.samples[:4])),
    "lidar_flow": row(drive, "categories, point ids, points, times",
        test_lidar_flow.problems),
    "map_vectors": row(test_nuscenes_expansions.town, "streets",
        lambda m: test_map_vectors.check_files(m.folder)),
    "mcap": row(drive,
        "boxes, cameras, categories, centres, photographs, point ids, points, solids, times",
        lambda m: test_mcap.faults(m.folder / "train/street-000000.mcap", m.samples[:4])),
    "motchallenge": row(drive, "boxes, categories, shares",
        test_motchallenge.test_mot_rows_count_from_1_and_sequences_describe_them),
    "nuscenes": row(drive, "cameras, categories, centres, point ids, points, solids",
        test_nuscenes.test_poses_intrinsics_and_scans_are_those_of_the_sensors,
        test_nuscenes.test_boxes_count_the_pulses_that_hit_and_points_are_labelled,
        test_nuscenes.test_boxes_are_in_the_global_frame_with_width_first, key_frame_s=0.1),
    "occupancy": row(test_occupancy.gridded, "voxels, categories",
        lambda m: test_occupancy.problems(m.folder, m.samples)),
    "opendrive": row(test_nuscenes_expansions.town, "streets",
        lambda m: test_opendrive_export.check_files(m.folder)),
    "openlane": row(test_lane_formats.road, "cameras, centres",
        lambda m: test_lane_formats.check_edges(m.folder)),
    "pointclouds": row(scans, "point ids, points, solids",
        test_scans.test_a_ply_file_is_what_its_header_says_and_points_in_boxes),
    "rerun": row(street, "boxes, cameras, categories, centres, solids",
        lambda m: test_rerun.problems(m.folder, m.folder.parent / "shards", m.world),
        samples_per_file=3),
    "rlds": row(slips, "arms, photographs",
        lambda m: test_demonstrations.assert_written(m.folder / "train/toys_arm", m.samples)),
    "scannet": row(drive, "cameras, categories, centres, depths, ids, photographs",
        test_rgbd_sequences.test_scannet_points_lie_on_the_scene,
        test_rgbd_sequences.test_scannet_labels_are_nyu40_of_instances_in_scans_listed_by_split),
    "scene_text": row(test_scene_text.texts, "photographs, words",
        lambda m: test_scene_text.problems(m.folder, m.samples)),
    "semantickitti": row(drive, "categories, points, times",
        test_semantickitti.test_semantic_classes_of_things_that_move,
        test_semantickitti
        .test_semantic_sequences_have_poses_of_the_drive_and_points_that_stay_in_the_world),
    "solo": row(street, "boxes, cameras, masks, solids", solo),
    "tables": row(scans, "measurements",
        test_tables.test_csv_holds_every_digit_that_counts_by_sequence),
    "tapvid": row(test_tapvid.tracked, "cameras, centres, photographs, tracks",
        lambda m: test_tapvid.problems(m.folder, m.samples)),
    "tfrecord": row(few, "boxes, categories, masks", labels, masks="png"),
    "tum_rgbd": row(drive, "cameras, centres, depths, photographs, times",
        test_rgbd_sequences.test_tum_points_lie_on_the_scene_and_are_listed),
    "voc": row(few, "boxes, categories, masks", labels),
    "webdataset": row(scans, "boxes, categories, masks, photographs, points",
        labels, lambda m: test_webdataset.faults(m.folder / "train", m.world)),
    "yolo": row(few, "boxes, categories", labels),
}  # fmt: skip
"""Facts that tests of each format notice."""

CASES = [
    pytest.param(kind, change, marks=[pytest.mark.slow] if number or row % 2 else [])
    for row, (kind, form) in enumerate(ROWS.items())
    for number, change in enumerate(form.changes.split(", "))
]
"""Every fact of each format; one of every second format by default."""


class Copied:
    """The world of a data set, whose exports are finished."""

    def __init__(self, world: Any, folder: Path) -> None:
        self._world, self._folder = world, folder

    def export(self, *_: Any, **__: Any) -> Path:
        return self._folder

    def __getattr__(self, name: str) -> Any:
        return getattr(self._world, name)


def run_tests(made: Made) -> None:
    """Run the tests of a format, whatever they call their arguments."""
    arguments: dict[str, Callable[[], Any]] = {
        "m": lambda: made,
        "made": lambda: made,
        "world": lambda: made.world,
        "samples": lambda: made.samples,
        "exported": lambda: lambda _: made.folder,
        "train": lambda: opened(made.folder / "annotations/instances_train.json"),
    }
    for test in ROWS[made.kind].tests:
        names = inspect.signature(test).parameters
        found = test(**{name: arguments.get(name, lambda: made.folder)() for name in names})
        assert not found


@pytest.fixture(scope="module")
def make(world: Any) -> Callable[..., Made]:
    """Exports a format, of changed samples if there are changes."""
    sources = cache(lambda source: source(world))

    def export(kind: str, root: Path, changes: tuple[Callable[[Any], Any], ...] = ()) -> Made:
        form = ROWS[kind]
        info, samples = sources(form.samples)
        exporter = TABLE.load(kind).model_validate({"type": kind, **form.options})
        changed = samples
        for change in changes:
            changed = list(map(change, changed))
        folder = world.export(exporter, info, changed, root)
        return Made(kind, folder, Copied(world, folder), samples)

    return export


@pytest.mark.parametrize("kind", sampled(ROWS, 2))
def test_unchanged_samples_pass(kind: str, make: Callable[..., Made], tmp_path: Path) -> None:
    """A failure below has no other cause than the change."""
    run_tests(make(kind, tmp_path))


@pytest.mark.parametrize(("kind", "change"), CASES)
def test_every_change_is_seen(
    kind: str, change: str, make: Callable[..., Made], tmp_path: Path
) -> None:
    made = make(kind, tmp_path, CHANGES[change])
    with pytest.raises(AssertionError):
        run_tests(made)


@needs_rerun
def test_every_format_has_a_row() -> None:
    assert {*ROWS, "usd"} == set(TABLE)
