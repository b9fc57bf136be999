"""Damaged copies of exported data sets: the tests of each format must notice every one.

Formats whose own test files damage copies mark these tests with ``damage(format)``. The others are
listed here: each copy goes through the tests of its format that accept a folder.
"""

from __future__ import annotations

import importlib
import inspect
import json
import re
import shutil
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from gen_data.exporters import TABLE
from gen_data.exporters.birdseye import Birdseye
from gen_data.exporters.coco import Coco
from gen_data.exporters.kitti import Kitti
from gen_data.exporters.kitti_raw import KittiRaw
from gen_data.exporters.kitti_stereo import KittiStereo
from gen_data.exporters.kitti_tracking import KittiTracking
from gen_data.exporters.measurement_tables import Tables
from gen_data.exporters.motchallenge import MotChallenge
from gen_data.exporters.pointclouds import PointClouds
from gen_data.exporters.scannet import ScanNet
from gen_data.exporters.semantickitti import SemanticKitti
from gen_data.exporters.tum_rgbd import TumRgbd
from tests.exporters import (
    test_birdseye,
    test_coco,
    test_kitti,
    test_kitti_raw,
    test_kitti_stereo,
    test_kitti_tracking,
    test_motchallenge,
    test_rgbd_sequences,
    test_scans,
    test_semantickitti,
    test_tables,
)
from tests.exporters.drives import DRIVE, drive_info
from tests.wheels import needs_rerun

# pycocotools' decoder predates numpy 2's __array__(copy=...).
pytestmark = pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")

DAMAGES_MIN = 40
"""Over all formats; and of each format at least two."""

Damage = Callable[[Path], object]


def edit_text(pattern: str, old: str, new: Any) -> Damage:
    """Damage that replaces a regular expression in every file of a pattern."""

    def damage(folder: Path) -> None:
        paths = sorted(folder.glob(pattern))
        texts = [path.read_text("utf-8") for path in paths]
        changed = [re.sub(old, new, text, flags=re.MULTILINE) for text in texts]
        assert changed != texts, f"nothing in {pattern} is replaced"
        for path, text in zip(paths, changed, strict=True):
            path.write_text(text, "utf-8")

    return damage


def edit_columns(pattern: str, change: Callable[[list[str]], object], separator: str) -> Damage:
    """Damage that changes the columns of every line of some files."""

    def changed(match: re.Match[str]) -> str:
        columns = match[0].split(separator)
        change(columns)
        return separator.join(columns)

    return edit_text(pattern, r"^.+$", changed)


def edit_json(pattern: str, change: Callable[[Any], object]) -> Damage:
    """Damage that changes JSON values: of each line of ``.jsonl``, else of each file."""

    def changed(match: re.Match[str]) -> str:
        value = json.loads(match[0])
        change(value)
        return json.dumps(value)

    lines = pattern.endswith("l")
    return edit_text(pattern, r"^.+$" if lines else r"(?s)\A.+\Z", changed)


def edit_array(pattern: str, kind: str, width: int, change: Callable[[Any], object]) -> Damage:
    """Damage that changes binary files of ``width`` numbers of a kind per row, in place."""

    def damage(folder: Path) -> None:
        for path in sorted(folder.glob(pattern)):
            rows = np.fromfile(path, kind).reshape(-1, width)
            change(rows)
            rows.tofile(path)

    return damage


def edit_image(pattern: str, change: Callable[[Any], Any]) -> Damage:
    """Damage that changes the pixels of images."""

    def damage(folder: Path) -> None:
        for path in sorted(folder.glob(pattern)):
            cv2.imwrite(str(path), change(cv2.imread(str(path), cv2.IMREAD_UNCHANGED)))

    return damage


def edit_bytes(name: str, old: bytes, new: bytes) -> Damage:
    """Damage that replaces bytes of one file."""
    return lambda folder: (folder / name).write_bytes(
        (folder / name).read_bytes().replace(old, new, 1)
    )


def remove(pattern: str) -> Damage:
    """Damage that removes the first file of a pattern."""
    return lambda folder: sorted(folder.glob(pattern))[0].unlink()


def each_row(section: str, change: Callable[[dict[str, Any]], object]) -> Callable[[Any], object]:
    """Change of every row of a section."""
    return lambda value: [change(row) for row in value[section]]


def corners(x: float, y: float, width: float, height: float) -> list[float]:
    """Left, top, right and bottom."""
    return [x, y, x + width, y + height]


def swap(values: Any, i: int, j: int) -> None:
    """Exchange two items."""
    values[i], values[j] = values[j], values[i]


def add(values: list[str], column: int, offset: float) -> None:
    """Add to the number in a column."""
    values[column] = f"{float(values[column]) + offset:g}"


def swap_halves(rows: Any) -> None:
    """Class and instance id of 32-bit labels, exchanged."""
    rows[:] = (rows >> 16) | (rows << 16)


@dataclass(frozen=True)
class Format:
    """How a format is made, tested and damaged.

    Attributes:
        exporter: The exporter with its fields.
        samples: Description of the data set and its samples.
        tests: Tests that accept the folder of the result.
        damages: By what is wrong.
    """

    exporter: Any
    samples: Callable[[Any], tuple[Any, Any]]
    tests: tuple[Callable[..., object], ...]
    damages: dict[str, Damage]


def street(world: Any) -> tuple[Any, Any]:
    """The seven frames."""
    return world.info(7), world.samples


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


def columns_of_a_row(match: re.Match[str]) -> str:
    """Rows of a matrix [3, 4] become its columns."""
    values = np.array(match[2].split()).reshape(3, 4)
    values[:, :3] = values[:, :3].T.copy()
    return f"{match[1]} {' '.join(values.ravel())}"


def matrix_lines(matrix: Any) -> str:
    """A row per line."""
    return "".join(" ".join(f"{v:.9f}" for v in row) + "\n" for row in matrix.tolist())


FORMATS = {
    "birdseye": Format(
        Birdseye(),
        street,
        (
            test_birdseye.test_layers_are_images_of_0_and_255,
            test_birdseye.test_frames_tell_where_the_map_is_and_what_is_on_it,
        ),
        {
            "columns mirrored": edit_image("drivable/*.png", np.fliplr),
            "values 0 and 1": edit_image("drivable/*.png", lambda pixels: pixels // 255),
            "a layer is missing": remove("drivable/*.png"),
            "boxes at their foot": edit_json(
                "frames.jsonl",
                lambda row: [
                    b["center_m"].__setitem__(2, b["center_m"][2] - 0.5 * b["size_m"][2])
                    for b in row["boxes3d"]["ego"]
                ],
            ),
        },
    ),
    "coco": Format(
        Coco(),
        street,
        (
            test_coco.test_box_and_area_are_those_of_the_decoded_mask,
            test_coco.test_masks_are_the_pixels_of_the_instance_image,
            test_coco.test_ids_are_positive_and_unique_over_all_splits,
            test_coco.test_empty_images_stay_and_every_image_on_disk_is_listed,
        ),
        {
            "boxes by their corners": edit_json(
                "annotations/instances_train.json",
                each_row("annotations", lambda r: r.update(bbox=corners(*r["bbox"]))),
            ),
            "areas of boxes": edit_json(
                "annotations/instances_train.json",
                each_row("annotations", lambda r: r.update(area=r["bbox"][2] * r["bbox"][3])),
            ),
            "categories from 0": edit_json(
                "annotations/*.json", each_row("categories", lambda r: r.update(id=r["id"] - 1))
            ),
            "masks of the next object": edit_json(
                "annotations/instances_train.json",
                lambda value: swap_values(value["annotations"], "instance_id"),
            ),
            "one annotation id twice": edit_json(
                "annotations/instances_train.json",
                lambda v: v["annotations"][1].update(id=v["annotations"][0]["id"]),
            ),
            "an image is missing": remove("train/*.png"),
        },
    ),
    "kitti": Format(
        Kitti(low_px=2),
        street,
        (
            test_kitti.test_every_frame_has_every_file,
            test_kitti.test_image_boxes_bound_the_projected_boxes_inside_the_image,
            test_kitti.test_official_types_are_used_and_others_are_misc,
        ),
        {
            "length first": edit_columns(
                "training/label_2/*.txt", lambda c: swap(c, 8, 10), " "
            ),
            "boxes at their centre": edit_columns(
                "training/label_2/*.txt", lambda c: add(c, 12, -0.5), " "
            ),
            "angle about the vertical": edit_columns(
                "training/label_2/*.txt", lambda c: add(c, 14, 0.2), " "
            ),
            "principal point at pixel edges": edit_text(
                "training/calib/*.txt",
                r"^(P2: \S+ \S+) (\S+)",
                lambda m: f"{m[1]} {float(m[2]) + 0.5}",
            ),
            "a label file is missing": remove("training/label_2/*.txt"),
            "categories as types": edit_text("training/label_2/*.txt", r"^Car", "car"),
        },
    ),
    "kitti_raw": Format(
        KittiRaw(image_03="right"),
        drive,
        (
            test_kitti_raw.test_a_raw_drive_has_a_file_of_every_sensor_per_step,
            test_kitti_raw.test_raw_files_hold_the_samples_of_their_frames,
            test_kitti_raw.test_raw_calibration_maps_points_into_the_image_they_belong_to,
            test_kitti_raw.test_raw_stereo_baseline_is_that_of_the_rig,
            test_kitti_raw.test_tracklets_enclose_the_points_of_their_object,
        ),
        {
            "tracklets at their centre": edit_text(
                "*/*/tracklet_labels.xml", r"<tz>([^<]+)", lambda m: f"<tz>{float(m[1]) + 0.7}"
            ),
            "tracklets a frame late": edit_text(
                "*/*/tracklet_labels.xml", r"<first_frame>0", "<first_frame>1"
            ),
            "mount from the camera": edit_text(
                "*/calib_velo_to_cam.txt",
                r"^T: (\S+) (\S+) (\S+)",
                lambda m: "T: " + " ".join(str(-float(v)) for v in m.groups()),
            ),
            "baseline to the wrong side": edit_text(
                "*/calib_cam_to_cam.txt",
                r"^(P_rect_03: \S+ \S+ \S+) (\S+)",
                lambda m: f"{m[1]} {-float(m[2])}",
            ),
            "a scan is missing": remove(f"{DRIVE.format(1)}/velodyne_points/data/*.bin"),
            "points with y forward": edit_array(
                "*/*/velodyne_points/data/*.bin",
                "<f4",
                4,
                lambda rows: rows.__setitem__((slice(None), [0, 1]), rows[:, [1, 0]]),
            ),
        },
    ),
    "kitti_stereo": Format(
        KittiStereo(),
        pairs,
        (
            test_kitti_stereo.test_disparities_are_those_of_depth,
            test_kitti_stereo.test_flow_is_there_for_every_frame_that_has_a_next_one,
            test_kitti_stereo.test_points_are_in_the_right_image_at_x_minus_disparity,
            test_kitti_stereo.test_every_frame_has_both_images_and_those_of_the_next_step,
        ),
        {
            "disparities in whole pixels": edit_image(
                "training/disp_occ_0/*.png", lambda d: d // 256 * 256
            ),
            "flow with its channels reversed": edit_image(
                "training/flow_occ/*.png", lambda f: f[..., ::-1]
            ),
            "principal point at pixel edges": edit_text(
                "training/calib_cam_to_cam/*.txt",
                r"^(P_rect_02: \S+ \S+) (\S+)",
                lambda m: f"{m[1]} {float(m[2]) + 0.5}",
            ),
            "a next image is missing": remove("training/image_3/*_11.png"),
        },
    ),
    "kitti_tracking": Format(
        KittiTracking(low_px=4),
        drive,
        (
            test_kitti_tracking.test_tracking_labels_have_seventeen_columns_and_lasting_ids,
            test_kitti_tracking.test_tracking_calibration_projects_labels_onto_their_boxes,
        ),
        {
            "frames from 1": edit_columns(
                "training/label_02/*.txt", lambda c: add(c, 0, 1), " "
            ),
            "ids that change": edit_columns(
                "training/label_02/*.txt", lambda c: add(c, 1, 10 * int(c[0])), " "
            ),
            "truncation as a share": edit_columns(
                "training/label_02/*.txt", lambda c: add(c, 3, 0.5), " "
            ),
            "a column too many": edit_columns(
                "training/label_02/*.txt", lambda c: c.append("1"), " "
            ),
            "boxes far to the left": edit_columns(
                "training/label_02/*.txt", lambda c: add(c, 13, -5), " "
            ),
        },
    ),
    "motchallenge": Format(
        MotChallenge(),
        drive,
        (
            test_motchallenge.test_mot_rows_count_from_one,
            test_motchallenge.test_mot_sequences_describe_themselves,
        ),
        {
            "pixels from 0": edit_columns("*/*/gt/gt.txt", lambda c: add(c, 2, -1), ","),
            "frames from 0": edit_columns("*/*/gt/gt.txt", lambda c: add(c, 0, -1), ","),
            "boxes by their corners": edit_columns(
                "*/*/gt/gt.txt", lambda c: add(c, 4, float(c[2])), ","
            ),
            "every class a pedestrian": edit_columns(
                "*/*/gt/gt.txt", lambda c: c.__setitem__(7, "1"), ","
            ),
            "length of another sequence": edit_text(
                "*/*/seqinfo.ini", "(?i)seqlength=4", "seqLength=5"
            ),
            "an image is missing": remove("street-val/*/img1/*"),
        },
    ),
    "pointclouds": Format(
        PointClouds(),
        scans,
        (
            test_scans.test_a_ply_file_is_what_its_header_says,
            test_scans.test_points_lie_in_the_boxes_of_the_lidar_frame,
        ),
        {
            "half sizes": edit_json(
                "top/poses.jsonl",
                lambda row: [b.update(size_m=[0.5 * v for v in b["size_m"]]) for b in row["boxes"]],
            ),
            "scalar last": edit_json(
                "top/poses.jsonl",
                lambda row: [
                    b.update(quaternion_wxyz=[*b["quaternion_wxyz"][1:], b["quaternion_wxyz"][0]])
                    for b in row["boxes"]
                ],
            ),
            "instances as categories": edit_bytes(
                "top/000000000.ply",
                b" instance\nproperty uint16 category\n",
                b" category\nproperty uint16 instance\n",
            ),
            "a field renamed": edit_bytes("top/000000000.ply", b" ring\n", b" beam\n"),
        },
    ),
    "scannet": Format(
        ScanNet(),
        drive,
        (
            test_rgbd_sequences.test_scannet_points_lie_on_the_scene,
            test_rgbd_sequences.test_scannet_labels_are_nyu40_of_the_instances,
            test_rgbd_sequences.test_scannet_scans_are_listed_by_split,
        ),
        {
            "poses of the world in the camera": edit_text(
                "scans/*/pose/*.txt",
                r"(?s)\A.+\Z",
                lambda m: matrix_lines(np.linalg.inv(np.array(m[0].split(), float).reshape(4, 4))),
            ),
            "depth of TUM": edit_image("scans/*/depth/*.png", lambda d: 5 * d),
            "classes from 0": edit_image(
                "scans/*/label-filt/*.png", lambda v: np.where(v > 0, v - 1, 0).astype(np.uint16)
            ),
            "instances of the next class": edit_image(
                "scans/*/instance-filt/*.png", lambda v: v + (v > 0).astype(np.uint16)
            ),
            "a photograph is missing": remove("scans/*/color/*.jpg"),
        },
    ),
    "semantickitti": Format(
        SemanticKitti(),
        drive,
        (
            test_semantickitti.test_semantic_sequences_are_views_and_poses_those_of_the_drive,
            test_semantickitti.test_semantic_classes_of_things_that_move,
            test_semantickitti.test_semantic_points_of_what_stands_stay_in_the_world,
        ),
        {
            "mount transposed": edit_text("*/*/calib.txt", r"^(Tr:) (.+)$", columns_of_a_row),
            "poses of the next scan": edit_text("*/*/poses.txt", r"(?s)\A(.*?\n)(.+)\Z", r"\2\1"),
            "times in milliseconds": edit_columns(
                "*/*/times.txt", lambda c: c.__setitem__(0, str(1000 * float(c[0]))), " "
            ),
            "halves of labels exchanged": edit_array("*/*/labels/*.label", "<u4", 1, swap_halves),
            "nothing moves": edit_array(
                "*/*/labels/*.label", "<u4", 1, lambda v: np.putmask(v, v & 0xFFFF == 252, 10)
            ),
        },
    ),
    "tables": Format(
        Tables(),
        sequences,
        (
            test_tables.test_csv_holds_every_digit_that_matters,
            test_tables.test_sequences_have_a_file_each_also_across_shards,
        ),
        {
            "single precision": edit_text(
                "imu/*.csv", r"0\.333333\d+", lambda m: str(np.float32(m[0]))
            ),
            "samples of the next row": edit_text(
                "imu/*.csv", r"^(\d+),", lambda m: f"{int(m[1]) + 1},"
            ),
            "columns in another order": edit_columns("imu/*.csv", lambda c: swap(c, 2, 3), ","),
            "a sequence is missing": remove("imu/*.csv"),
        },
    ),
    "tum_rgbd": Format(
        TumRgbd(),
        drive,
        (
            test_rgbd_sequences.test_tum_points_lie_on_the_scene,
            test_rgbd_sequences.test_tum_lists_every_image,
        ),
        {
            "scalar first": edit_columns(
                "*/*/groundtruth.txt", lambda c: c.insert(4, c.pop()), " "
            ),
            "depth in millimetres": edit_image("*/*/depth/*.png", lambda d: d // 5),
            "principal point at pixel edges": edit_columns(
                "*/*/calibration.txt", lambda c: add(c, 3, 0.5), " "
            ),
            "times of the next frame": edit_text(
                "*/*/depth.txt", r"^0\.([012])", lambda m: f"0.{int(m[1]) + 1}"
            ),
            "a depth image is missing": remove("*/*/depth/*.png"),
        },
    ),
}  # fmt: skip
"""Formats whose damages are listed here."""

CASES = [(name, damage) for name, form in FORMATS.items() for damage in form.damages]


def swap_values(rows: list[dict[str, Any]], key: str) -> None:
    """Exchange a value between the first two rows."""
    rows[0][key], rows[1][key] = rows[1][key], rows[0][key]


@dataclass(frozen=True)
class Made:
    """An exported data set, its description and what it was made of."""

    folder: Path
    info: Any
    samples: Any


class Copied:
    """The world of a data set, whose exports are a finished copy."""

    def __init__(self, world: Any, made: Made, folder: Path) -> None:
        self._world, self._made, self._folder = world, made, folder

    def export(self, *_: Any, **__: Any) -> Path:
        """Return the copy."""
        return self._folder

    def pairs(self) -> tuple[Any, Any]:
        """Return the samples of ``kitti_stereo`` without making them again."""
        return self._made.info, self._made.samples

    def __getattr__(self, name: str) -> Any:
        """Return everything else that the world has."""
        return getattr(self._world, name)


def run_tests(form: Format, world: Any, made: Made, folder: Path) -> None:
    """Run the tests of a format on a folder, whatever they call their arguments."""
    arguments: dict[str, Callable[[], Any]] = {
        "world": lambda: Copied(world, made, folder),
        "samples": lambda: made.samples,
        "exported": lambda: lambda _: folder,
        "train": lambda: test_coco.opened(folder / "annotations/instances_train.json"),
    }
    for test in form.tests:
        names = inspect.signature(test).parameters
        test(**{name: arguments.get(name, lambda: folder)() for name in names})


@pytest.fixture(scope="module")
def made(world: Any, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Made]:
    """Exports a format once."""
    samples = cache(lambda source: source(world))

    @cache
    def make(name: str) -> Made:
        form = FORMATS[name]
        info, chosen = samples(form.samples)
        folder = world.export(form.exporter, info, chosen, tmp_path_factory.mktemp(name))
        return Made(folder, info, chosen)

    return make


@pytest.mark.parametrize("name", FORMATS)
def test_undamaged_copies_pass(
    name: str, made: Callable[[str], Made], world: Any, tmp_path: Path
) -> None:
    """So that a failure below has no other cause than the damage."""
    shutil.copytree(made(name).folder, tmp_path / "copy")

    run_tests(FORMATS[name], world, made(name), tmp_path / "copy")


@pytest.mark.parametrize(("name", "damage"), CASES)
def test_damage_is_noticed(
    name: str, damage: str, made: Callable[[str], Made], world: Any, tmp_path: Path
) -> None:
    """A comparison fails, or a file is missing."""
    copy = tmp_path / "copy"
    shutil.copytree(made(name).folder, copy)
    FORMATS[name].damages[damage](copy)

    with pytest.raises((AssertionError, FileNotFoundError)):
        run_tests(FORMATS[name], world, made(name), copy)


def marked_damages() -> Iterator[tuple[str, int]]:
    """Format and number of the damages of each marked test, also of slow ones."""
    root = Path(__file__).parents[2]
    for path in sorted(root.glob("tests/*/test_*.py")):
        if "mark.damage(" not in path.read_text("utf-8"):
            continue
        module = importlib.import_module(".".join(path.relative_to(root).with_suffix("").parts))
        for test in vars(module).values():
            if not inspect.isfunction(test):
                continue
            marks = {mark.name: mark for mark in getattr(test, "pytestmark", ())}
            if "damage" in marks:
                yield marks["damage"].args[0], len(list(marks["parametrize"].args[1]))


@needs_rerun
def test_every_format_is_damaged() -> None:
    """At least twice each, and often enough in total; a new format is damaged, too."""
    counts = Counter(name for name, _ in CASES)
    for name, number in marked_damages():
        counts[name] += number

    assert set(counts) == set(TABLE)
    assert {name: n for name, n in counts.items() if n < 2} == {}
    assert counts.total() >= DAMAGES_MIN
