"""Tests of exports notice a wrong fact: one fact of every sample is changed before the export.

The tests of the format then hold the export against the samples as they were. So a row states which
facts a format carries to its readers; ``tests/usd/test_usd_export.py`` damages stages of USD.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gen_data.core.boxes import BoxPx, OrientedBox
from gen_data.core.capture import Channel
from gen_data.core.sample import Sample
from gen_data.core.scene import Camera
from gen_data.core.se3 import SE3
from gen_data.exporters import TABLE
from gen_data.exporters.voc import YEAR
from tests.exporters import (
    test_birdseye,
    test_bop,
    test_calibration,
    test_cityscapes,
    test_coco,
    test_coco_panoptic,
    test_control_clips,
    test_croissant,
    test_cvat,
    test_demonstrations,
    test_dota,
    test_graspnet,
    test_hdf5,
    test_huggingface,
    test_kitti,
    test_kitti_raw,
    test_kitti_stereo,
    test_kitti_tracking,
    test_label_studio,
    test_language,
    test_lerobot,
    test_mcap,
    test_motchallenge,
    test_nuscenes,
    test_rerun,
    test_rgbd_sequences,
    test_scans,
    test_semantickitti,
    test_solo,
    test_tables,
    test_tfrecord,
    test_voc,
    test_webdataset,
    test_yolo,
)
from tests.exporters.drives import drive_info
from tests.wheels import needs_rerun

# pycocotools' decoder predates numpy 2's __array__(copy=...).
pytestmark = pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")

ASIDE = SE3((0.5, -0.3, 0.0))


def objects(**changes: Callable[[Any], Any]) -> Callable[[Sample], Sample]:
    """Change of fields of every object that has them."""

    def changed(thing: Any) -> Any:
        known = {k: f(v) for k, f in changes.items() if (v := getattr(thing, k)) is not None}
        return replace(thing, **known)

    def change(sample: Sample) -> Sample:
        truth = {
            name: replace(image, objects=tuple(map(changed, image.objects)))
            for name, image in sample.truth.items()
        }
        return replace(sample, truth=truth)

    return change


def cameras(change: Callable[[Camera], Camera]) -> Callable[[Sample], Sample]:
    """Change of every camera, wherever a sample has it."""

    def changed(sample: Sample) -> Sample:
        truth = {k: replace(t, camera=change(t.camera)) for k, t in sample.truth.items()}
        readings = {
            k: replace(r, camera=change(r.camera)) for k, r in sample.capture.readings.items()
        }
        scene = replace(sample.scene, cameras=tuple(map(change, sample.scene.cameras)))
        capture = replace(sample.capture, readings=readings)
        return replace(sample, truth=truth, scene=scene, capture=capture)

    return changed


def pixels(channel: Channel, change: Callable[[Any], Any]) -> Callable[[Sample], Sample]:
    """Change of one channel of every image that has it."""

    def changed(sample: Sample) -> Sample:
        readings = {
            name: replace(
                r, channels={c: change(a) if c is channel else a for c, a in r.channels.items()}
            )
            for name, r in sample.capture.readings.items()
        }
        return replace(sample, capture=replace(sample.capture, readings=readings))

    return changed


def points(change: Callable[[Any], None]) -> Callable[[Sample], Sample]:
    """Change of the records of every scan."""

    def changed(sample: Sample) -> Sample:
        clouds = {}
        for name, cloud in sample.capture.clouds.items():
            records = cloud.points.copy()
            change(records)
            clouds[name] = replace(cloud, points=records)
        return replace(sample, capture=replace(sample.capture, clouds=clouds))

    return changed


def instances(**changes: Callable[[Any], Any]) -> Callable[[Sample], Sample]:
    """Change of fields of every instance, in the scene and in images."""

    def changed(one: Any) -> Any:
        return replace(one, **{k: f(getattr(one, k)) for k, f in changes.items()})

    def change(sample: Sample) -> Sample:
        scene = replace(sample.scene, instances=tuple(map(changed, sample.scene.instances)))
        return replace(objects(instance=changed)(sample), scene=scene)

    return change


def move(camera: Camera) -> Camera:
    """The camera half a metre to the right, and a little higher."""
    return replace(
        camera,
        T_world_camera=camera.T_world_camera @ ASIDE,
        T_rig_camera=camera.T_rig_camera @ ASIDE,
    )


def shift_centre(camera: Camera) -> Camera:
    """The camera with pixel edges for pixel centres."""
    k = camera.intrinsics
    return replace(camera, intrinsics=replace(k, cx_px=k.cx_px + 0.5, cy_px=k.cy_px + 0.5))


def lengthen(box: OrientedBox) -> OrientedBox:
    """The box with its width first."""
    length, width, height = box.size_m
    return replace(box, size_m=(width, length, height))


def swap_sides(corner: Any) -> Any:
    """Corner of a box with its width first."""
    x, y, z = corner
    return (y, x, z)


def turn_solids(sample: Sample) -> Sample:
    """Boxes with their width first: of objects, instances and the ego's surroundings."""
    sample = instances(box_min_m=swap_sides, box_max_m=swap_sides)(sample)
    return objects(box3d_world=lengthen, box3d_camera=lengthen)(sample)


def delay(sample: Sample) -> Sample:
    """The sample later, the more the later it is."""

    def later(one: Any) -> Any:
        return replace(one, time_s=1.5 * one.time_s + 0.05)

    capture = replace(
        sample.capture,
        readings={name: later(reading) for name, reading in sample.capture.readings.items()},
        clouds={name: later(cloud) for name, cloud in sample.capture.clouds.items()},
    )
    return replace(sample, scene=later(sample.scene), capture=capture)


def change_arm(sample: Sample) -> Sample:
    """The arm a hundredth of a radian further on."""
    (arm,) = sample.scene.articulations
    track = arm.joint_track
    assert track is not None
    knots = tuple(tuple(v + 0.01 for v in knot) for knot in track.knots)
    arm = replace(arm, joint_track=replace(track, knots=knots))
    return replace(sample, scene=replace(sample.scene, articulations=(arm,)))


def change_frame(**changes: Callable[[Any], Any]) -> Callable[[Sample], Sample]:
    """Change of fields of what the ego sees around it."""

    def change(sample: Sample) -> Sample:
        frame = sample.frame
        fields = {k: f(getattr(frame, k)) for k, f in changes.items()}
        return replace(sample, frame=replace(frame, **fields))

    return change


def change_texts(sample: Sample) -> Sample:
    """Utterances whose answers are about something else."""
    truth = {
        name: replace(
            image, utterances=tuple(replace(u, answer="many") for u in image.utterances or ())
        )
        for name, image in sample.truth.items()
    }
    return replace(sample, truth=truth)


def round_measurements(sample: Sample) -> Sample:
    """Rows of devices in single precision."""
    tables = {}
    for name, table in sample.capture.tables.items():
        rows = table.rows.copy()
        rows["force_x_m_s2"] = np.float32(rows["force_x_m_s2"])
        tables[name] = replace(table, rows=rows)
    return replace(sample, capture=replace(sample.capture, tables=tables))


CHANGES: dict[str, Callable[[Any], Any]] = {
    "boxes": objects(box=lambda b: BoxPx(b.x_min + 1, b.y_min, b.x_max + 1, b.y_max)),
    "masks": objects(mask=lambda m: replace(m, pixels=np.fliplr(m.pixels))),
    "corners": objects(oriented_box=lambda c: (*c[1:], c[0])),
    "shares": objects(visible_fraction=lambda _: 0.0, occlusion=lambda s: 1.0 - s),
    "poses": objects(T_camera_object=lambda pose: pose @ ASIDE),
    "categories": instances(
        category=lambda name: {"car": "crate", "crate": "car"}.get(name, name),
        category_id=lambda k: {1: 2, 2: 1}.get(k, k),
    ),
    "solids": turn_solids,
    "cameras": cameras(move),
    "centres": cameras(shift_centre),
    "photographs": pixels(Channel.RGB, lambda a: np.ascontiguousarray(a[..., ::-1])),
    "depths": pixels(Channel.Z_DEPTH, lambda a: a * np.float32(1.05)),
    "ids": pixels(Channel.INSTANCE, lambda a: np.roll(a, 1, axis=1)),
    "normals": pixels(Channel.NORMALS, lambda a: -a),
    "disparities": pixels(Channel.DISPARITY, np.floor),
    "flow": pixels(Channel.FLOW_FORWARD, lambda a: np.ascontiguousarray(a[..., ::-1])),
    "points": points(lambda p: p["position_m"].__setitem__(slice(None), p["position_m"][:, ::-1])),
    "point ids": points(
        lambda p: p["instance_id"].__setitem__(slice(None), np.roll(p["instance_id"], 9))
    ),
    "times": delay,
    "arms": change_arm,
    "maps": change_frame(
        birdseye=lambda m: replace(m, layers={k: np.fliplr(v) for k, v in m.layers.items()})
    ),
    "surroundings": change_frame(
        boxes3d=lambda b: {k: {n: lengthen(box) for n, box in v.items()} for k, v in b.items()}
    ),
    "grasps": change_frame(
        grasps=lambda gs: tuple(replace(g, width_m=g.width_m + 0.02) for g in gs)
    ),
    "texts": change_texts,
    "measurements": round_measurements,
}
"""Changed facts."""


@dataclass(frozen=True)
class Made:
    """An export of changed samples, and what it is held against."""

    root: Path
    """Holds the export and COCO's of the samples as they were, by type."""
    folder: Path
    """The data set."""
    world: Any
    """Its exports are the folder, and its samples those as they were."""
    samples: Any


Test = Callable[..., Any]


@dataclass(frozen=True)
class Row:
    """How a format is made and tested.

    Attributes:
        samples: Description of the data set and its samples, of a world.
        tests: Tests that take the export under any name, or checks of ``Made`` that find nothing.
        changes: Facts that the tests notice.
        options: Fields of the exporter.
    """

    samples: Callable[[Any], tuple[Any, Any]]
    tests: tuple[Test, ...]
    changes: tuple[str, ...]
    options: dict[str, Any]


def row(samples: Any, tests: Test | tuple[Test, ...], changes: str, **options: Any) -> Row:
    """A row whose changes are separated by commas."""
    chosen = tests if isinstance(tests, tuple) else (tests,)
    return Row(samples, chosen, tuple(changes.split(", ")), options)


def street(world: Any) -> tuple[Any, Any]:
    """The seven frames."""
    return world.info(7), world.samples


def bodies(world: Any) -> tuple[Any, Any]:
    """The first three frames, with bodies; the second for tests."""
    first, second, third = world.with_bodies(world.samples[:3])
    return world.info(3), [first, replace(second, split="test"), third]


def normals(world: Any) -> tuple[Any, Any]:
    """The seven frames with normals."""
    media = {"color": (*world.info(7).media["color"], Channel.NORMALS)}
    return world.info(7, media=media), world.samples


def scans(world: Any) -> tuple[Any, Any]:
    """The seven frames with a laser scanner."""
    return world.info(7, lidars=("top",)), world.samples


def drive(world: Any) -> tuple[Any, Any]:
    """Two sequences of four steps."""
    return drive_info(world), world.drive()


def pairs(world: Any) -> tuple[Any, Any]:
    """The same with two cameras that have disparities and flow."""
    info, samples = world.pairs()
    return info, samples


def sequences(world: Any) -> tuple[Any, Any]:
    """The seven frames in sequences of two."""
    return world.info(7, steps_per_scene=2), world.samples


def reach(world: Any) -> tuple[Any, Any]:
    """The drive with an arm."""
    return drive_info(world), world.reach()


def demonstrated(world: Any) -> tuple[Any, Any]:
    """The drive with an arm that demonstrates a task."""
    return drive_info(world), test_demonstrations.demonstrated(world)


def graspable(world: Any) -> tuple[Any, Any]:
    """A frame with grasps."""
    return world.info(1), [test_graspnet.with_grasps(world)]


def train(world: Any) -> Any:
    """Samples of the split train."""
    return [sample for sample in world.samples if sample.split == "train"]


ROWS = {
    "birdseye": row(
        street,
        (
            test_birdseye.test_layers_are_images_of_0_and_255,
            test_birdseye.test_frames_tell_where_the_map_is_and_what_is_on_it,
        ),
        "maps, surroundings",
    ),
    "bop": row(
        bodies, lambda m: test_bop.problems(m.folder), "boxes, centres, depths, masks, poses"
    ),
    "calibration": row(
        drive,
        test_calibration.test_every_photograph_has_its_pose_in_the_model_of_its_scene,
        "cameras",
    ),
    "cityscapes": row(
        street, lambda m: test_cityscapes.problems(m.folder, m.root), "categories, ids"
    ),
    "coco": row(
        street,
        (
            test_coco.test_box_and_area_are_those_of_the_decoded_mask,
            test_coco.test_masks_are_the_pixels_of_the_instance_image,
            test_coco.test_the_pose_and_box_project_onto_the_image_box,
            test_coco.test_visibility_and_amodal_shapes_agree_with_the_masks,
            test_coco.test_cameras_are_written_in_full,
        ),
        "boxes, cameras, centres, ids, masks, poses, shares, solids",
    ),
    "coco_panoptic": row(
        street,
        lambda m: test_coco_panoptic.test_things_are_the_instances_of_coco(m.root),
        "categories, ids",
    ),
    "control_clips": row(
        street,
        lambda m: [*test_control_clips.problems(m.folder, m.samples)],
        "depths, ids, photographs",
    ),
    "croissant": row(
        street, test_croissant.test_tables_list_images_and_objects, "boxes, categories"
    ),
    "cvat": row(
        street,
        lambda m: test_cvat.problems(m.folder, m.root, "mask"),
        "categories, masks, shares",
    ),
    "dota": row(
        street,
        lambda m: test_dota.assert_truth(m.world, m.folder, 0.4),
        "categories, corners, shares",
    ),
    "graspnet": row(
        graspable, lambda m: test_graspnet.assert_rows(m.folder, m.samples[0]), "cameras, grasps"
    ),
    "hdf5": row(
        normals,
        test_hdf5.test_containers_hold_the_street,
        "cameras, categories, centres, depths, ids, normals, photographs",
    ),
    "huggingface": row(
        street,
        test_huggingface.test_parquet_files_embed_images,
        "boxes, categories, masks",
        rows_per_file=2,
    ),
    "kitti": row(
        street,
        (
            test_kitti.test_image_boxes_bound_the_projected_boxes_inside_the_image,
            test_kitti.test_official_types_are_used_and_others_are_misc,
        ),
        "categories",
        low_px=2,
    ),
    "kitti_raw": row(
        drive,
        (
            test_kitti_raw.test_raw_files_hold_the_samples_of_their_frames,
            test_kitti_raw.test_raw_calibration_maps_points_into_the_image_they_belong_to,
            test_kitti_raw.test_tracklets_enclose_the_points_of_their_object,
        ),
        "cameras, categories, photographs, points, solids",
        image_03="right",
    ),
    "kitti_stereo": row(
        pairs,
        (
            test_kitti_stereo.test_disparities_are_those_of_depth,
            test_kitti_stereo.test_flow_is_there_for_every_frame_that_has_a_next_one,
            test_kitti_stereo.test_points_are_in_the_right_image_at_x_minus_disparity,
        ),
        "centres, disparities, flow",
    ),
    "kitti_tracking": row(
        drive,
        (
            test_kitti_tracking.test_tracking_labels_have_seventeen_columns_and_lasting_ids,
            test_kitti_tracking.test_tracking_calibration_projects_labels_onto_their_boxes,
        ),
        "categories",
        low_px=4,
    ),
    "label_studio": row(
        street,
        lambda m: test_label_studio.problems(m.folder, m.root, "polygon"),
        "categories, masks",
    ),
    "language": row(street, lambda m: test_language.assert_said(m.folder, m.samples), "texts"),
    "lerobot": row(
        reach,
        lambda m: test_lerobot.faults(m.folder / "train/toys_arm", m.samples[:4]),
        "arms, photographs",
    ),
    "mcap": row(
        drive,
        lambda m: test_mcap.faults(m.folder / "train/street-000000.mcap", m.samples[:4]),
        "boxes, cameras, categories, centres, photographs, point ids, points, solids, times",
    ),
    "motchallenge": row(
        drive, test_motchallenge.test_mot_rows_count_from_one, "boxes, categories, shares"
    ),
    "nuscenes": row(
        drive,
        (
            test_nuscenes.test_poses_and_intrinsics_are_those_of_the_sensors,
            test_nuscenes.test_scans_have_the_axes_of_nuscenes,
            test_nuscenes.test_boxes_count_the_pulses_that_hit_their_object,
            test_nuscenes.test_boxes_are_in_the_global_frame_with_width_first,
            test_nuscenes.test_point_labels_are_those_of_the_objects,
        ),
        "cameras, categories, centres, point ids, points, solids",
        key_frame_s=0.1,
    ),
    "pointclouds": row(
        scans,
        (
            test_scans.test_a_ply_file_is_what_its_header_says,
            test_scans.test_points_lie_in_the_boxes_of_the_lidar_frame,
        ),
        "point ids, points, solids",
    ),
    "rerun": row(
        street,
        lambda m: test_rerun.problems(m.folder, m.folder.parent / "shards", m.world),
        "boxes, cameras, categories, centres, solids",
        samples_per_file=3,
    ),
    "rlds": row(
        demonstrated,
        lambda m: test_demonstrations.assert_written(m.folder / "train/toys_arm", m.samples),
        "arms, photographs",
    ),
    "scannet": row(
        drive,
        (
            test_rgbd_sequences.test_scannet_points_lie_on_the_scene,
            test_rgbd_sequences.test_scannet_labels_are_nyu40_of_the_instances,
            test_rgbd_sequences.test_scannet_scans_are_listed_by_split,
        ),
        "cameras, categories, centres, depths, ids, photographs",
    ),
    "semantickitti": row(
        drive,
        (
            test_semantickitti.test_semantic_sequences_are_views_and_poses_those_of_the_drive,
            test_semantickitti.test_semantic_classes_of_things_that_move,
            test_semantickitti.test_semantic_points_of_what_stands_stay_in_the_world,
        ),
        "categories, points, times",
    ),
    "solo": row(
        street,
        lambda m: [
            *test_solo.problems(
                m.folder / "train", test_solo.read_json(m.folder / "train"), train(m.world)
            )
        ],
        "boxes, cameras, masks, solids",
    ),
    "tables": row(sequences, test_tables.test_csv_holds_every_digit_that_matters, "measurements"),
    "tfrecord": row(
        street,
        lambda m: test_tfrecord.faults(m.folder, m.world),
        "boxes, categories, masks",
        rows_per_file=2,
        masks="png",
    ),
    "tum_rgbd": row(
        drive,
        (
            test_rgbd_sequences.test_tum_points_lie_on_the_scene,
            test_rgbd_sequences.test_tum_lists_every_image,
        ),
        "cameras, centres, depths, photographs, times",
    ),
    "voc": row(
        street,
        lambda m: test_voc.check(m.folder / YEAR, m.root),
        "boxes, categories, masks",
    ),
    "webdataset": row(
        scans,
        lambda m: test_webdataset.faults(m.folder / "train", m.world),
        "masks, points",
        samples_per_tar=2,
    ),
    "yolo": row(
        street,
        lambda m: test_yolo.problems(m.folder / "detect", m.root),
        "boxes, categories",
    ),
}
"""Facts that tests of each format notice."""

CASES = [(name, change) for name, form in ROWS.items() for change in form.changes]


class Copied:
    """The world of a data set, whose exports are finished."""

    def __init__(self, world: Any, folder: Path) -> None:
        self._world, self._folder = world, folder

    def export(self, *_: Any, **__: Any) -> Path:
        """Return the finished export."""
        return self._folder

    def __getattr__(self, name: str) -> Any:
        """Return everything else that the world has."""
        return getattr(self._world, name)


def run_tests(form: Row, made: Made) -> None:
    """Run the tests of a format, whatever they call their arguments."""
    arguments: dict[str, Callable[[], Any]] = {
        "m": lambda: made,
        "world": lambda: made.world,
        "samples": lambda: made.samples,
        "exported": lambda: lambda _: made.folder,
        "train": lambda: test_coco.opened(made.folder / "annotations/instances_train.json"),
    }
    for test in form.tests:
        names = inspect.signature(test).parameters
        found = test(**{name: arguments.get(name, lambda: made.folder)() for name in names})
        assert not found


@pytest.fixture(scope="module")
def coco(world: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """COCO's export of the seven frames as they are."""
    folder = tmp_path_factory.mktemp("coco")
    world.export(TABLE.load("coco")(), *street(world), folder)
    return folder


@pytest.fixture(scope="module")
def make(world: Any, coco: Path) -> Callable[..., Made]:
    """Exports a format, of changed samples if there is a change."""
    sources = cache(lambda source: source(world))

    def export(name: str, root: Path, change: Callable[[Any], Any] = lambda s: s) -> Made:
        form = ROWS[name]
        info, samples = sources(form.samples)
        exporter = TABLE.load(name).model_validate({"type": name, **form.options})
        folder = world.export(exporter, info, [change(s) for s in samples], root / name)
        if name != "coco":
            (root / "coco").symlink_to(coco)
        return Made(root, folder, Copied(world, folder), samples)

    return export


@pytest.mark.parametrize("name", ROWS)
def test_an_export_of_unchanged_samples_passes(
    name: str, make: Callable[..., Made], tmp_path: Path
) -> None:
    """A failure below has no other cause than the change."""
    run_tests(ROWS[name], make(name, tmp_path))


@pytest.mark.parametrize(("name", "change"), CASES)
def test_a_changed_fact_is_noticed(
    name: str, change: str, make: Callable[..., Made], tmp_path: Path
) -> None:
    """A comparison fails."""
    made = make(name, tmp_path, CHANGES[change])

    with pytest.raises(AssertionError):
        run_tests(ROWS[name], made)


@needs_rerun
def test_every_format_has_a_row() -> None:
    """A new one, too."""
    assert {*ROWS, "usd"} == set(TABLE)
