"""The readers: one line each, with the tolerance that its format or its reader allows."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.readers import detection, records, rigs, sequences, views
from benchmarks.readers.truth import (
    POSES,
    Boxes,
    Cubes,
    Images,
    birdseye,
    city_cubes,
    grasps,
    grey_depth,
    joints,
    measurements,
    millimetres,
    mot_category,
    pose,
    scanned_instances,
    scans,
    scans_and_lenses,
    step_geometry,
    tracks,
    voxels,
)
from gen_data.core.scene import Instance
from gen_data.exporters import cityscapes_classes, label_map
from gen_data.exporters.kitti import official_type
from gen_data.exporters.nuscenes_classes import category_of
from gen_data.exporters.scannet import class_numbers

Read = Callable[[Path], Iterable[views.View]]
"""Views of a folder: of an export by a reader, or of a data set by ``gen_data.open``."""


@dataclass(frozen=True)
class Reader:
    """A reader of one format.

    Attributes:
        package: The distribution that reads.
        format: Name of the exporter, and of its folder.
        read: Yields the content of the export.
        expected: Yields the content of the data set.
        data: Name of the data set (``__main__.DATA``).
        unit: Unit of the numbers, such as ``px`` or ``m``; empty for a reader of lenses only.
        tolerance: Largest difference of a number.
        iou: Smallest overlap of masks; None if it reads none.
        lens: Largest difference of lenses [px, coefficients]; None if it reads none.
        is_partial: Whether the format omits objects by its definition.
        because: Reason of tolerances other than 0 and 1, and of conventions.
        needs: Further distributions that the reader imports, but its package does not require.
    """

    package: str
    format: str
    read: Read
    expected: Read
    data: str = "tabletop"
    unit: str = "px"
    tolerance: float = 0.0
    iou: float | None = None
    lens: float | None = None
    is_partial: bool = False
    because: str = ""
    needs: tuple[str, ...] = ()


ALL, COLOR = Boxes(), Boxes(("color",))
LEFT = ("image_02",)
FLOATS = 1e-4
"""Rounding of 32-bit floats [px]."""
INSET = 0.0201
"""Vertices of polygons lie 0.02 px inside the edges of pixels."""


def but_the_last(read: Read) -> Read:
    """All views but the last: with flow, a frame without a next one is left out."""
    return lambda folder: list(read(folder))[:-1]


def frame(number: str) -> str:
    """Name of a view from the number of the frame."""
    return f"{int(number):09d}_image_02"


def city_class(instance: Instance) -> str:
    """Class of Cityscapes."""
    return cityscapes_classes.city_classes().of_instance(instance).name


def tracked(instance: Instance) -> str:
    """KITTI's type as TrackEval spells it, and the track."""
    kind = official_type(instance).removesuffix("_sitting").lower()
    return f"{kind} {instance.instance_id}"


def nyu40_class(instance: Instance) -> str:
    """Class of ScanNet's images; empty = none."""
    number = class_numbers("nyu40").get(instance.category, 0)
    return ("", *label_map.public_classes("nyu40"))[number]


STEREO = {
    "disparity": lambda r: np.nan_to_num(r.channels["disparity"]),
    "flow": lambda r: np.nan_to_num(r.channels["flow_forward"]),
}
D, S = detection, sequences
READERS: tuple[Reader, ...] = (
    Reader("pycocotools", "coco", D.by_pycocotools, ALL, iou=1, lens=0),
    Reader("pycocotools", "coco", D.by_pycocotools, ALL, "runs", iou=1, lens=0),
    Reader("pycocotools", "bop", D.by_pycocotools_in_bop, COLOR, iou=1, is_partial=True,
           because="rigid objects only"),
    Reader("torchvision", "coco", D.by_torchvision, ALL, tolerance=FLOATS, iou=1,
           because="32-bit floats, enlarged by half and reduced"),
    Reader("transformers", "coco", D.by_detr, ALL, tolerance=FLOATS, iou=1,
           because="32-bit fractions of the image"),
    Reader("sahi", "coco", D.by_sahi, ALL, tolerance=INSET, iou=1,
           because="boxes of the polygons, 0.02 px inside"),
    Reader("supervision", "coco", D.by_supervision, ALL, "runs", iou=1,
           because="run lengths: it rounds polygons (findings/)"),
    Reader("supervision", "yolo", D.by_certificate("yolo"), ALL, tolerance=FLOATS,
           because="32-bit floats"),
    Reader("supervision", "voc", D.by_certificate("voc"), ALL),
    Reader("ultralytics-opencv-headless", "yolo", D.by_ultralytics("detect"), ALL,
           tolerance=FLOATS, because="32-bit floats"),
    Reader("ultralytics-opencv-headless", "yolo", D.by_ultralytics("segment"), ALL,
           tolerance=INSET, iou=0.85,
           because="boxes of the polygons; it draws the lines that join parts of an object"),
    Reader("label-studio-sdk", "label_studio", D.by_label_studio, ALL, tolerance=INSET, iou=1,
           because="boxes of the polygons, 0.02 px inside"),
    Reader("torchvision", "voc", D.by_torchvision_voc, Boxes(shift=(1, 1, 0, 0)), iou=1,
           because="VOC's numbers: pixels from 1"),
    Reader("datumaro", "coco", D.by_datumaro("mmdet_coco"), ALL, iou=1),
    Reader("datumaro", "voc", D.by_datumaro("voc_detection", "VOCdevkit/*"),
           Boxes(shift=(1, 1, 0, 0)), because="it keeps VOC's pixels from 1"),
    Reader("datumaro", "voc", D.by_datumaro("voc_segmentation", "VOCdevkit/*"), ALL, iou=1),
    Reader("datumaro", "yolo", D.by_datumaro("yolo", "detect"), ALL, tolerance=FLOATS,
           because="32-bit floats"),
    Reader("datumaro", "cvat", D.by_datumaro("cvat", "*"), ALL, iou=1),
    Reader("datumaro", "cvat", D.by_datumaro("cvat", "*"), ALL, "runs", tolerance=INSET, iou=1,
           because="boxes of the polygons, 0.02 px inside"),
    Reader("panopticapi-lite", "coco_panoptic", records.by_panopticapi, ALL, iou=1),
    Reader("h5py", "hdf5", records.by_h5py, ALL, iou=1, lens=0),
    Reader("datasets", "huggingface", records.by_datasets, ALL, iou=1, lens=0),
    Reader("datasets", "webdataset", records.by_datasets_webdataset, ALL, iou=1, lens=0),
    Reader("webdataset", "webdataset", D.by_certificate("webdataset"), ALL, iou=1),
    Reader("datasets", "language", records.by_datasets_language, ALL, iou=1),
    Reader("tfrecord", "tfrecord", records.by_tfrecord, ALL, tolerance=FLOATS, iou=1, lens=FLOATS,
           because="32-bit fractions of the image"),
    Reader("mlcroissant", "croissant", records.by_mlcroissant, ALL, lens=0),
    Reader("pysolotools", "solo", records.by_pysolotools, COLOR, lens=1e-6,
           because="nine decimals of a fraction"),
    Reader("rerun-sdk", "rerun", records.by_rerun, ALL, lens=FLOATS,
           because="32-bit floats; pinholes only"),
    Reader("evo", "tum_rgbd", rigs.by_evo, Images(("color",), {"pose": pose}), unit="m",
           tolerance=1e-8, because="nine decimals"),
    Reader("opencv-python-headless", "calibration", rigs.by_opencv, Images(), unit="",
           lens=1e-9, because="decimals"),
    Reader("pycolmap", "calibration", rigs.by_pycolmap, POSES, unit="m", tolerance=1e-9,
           lens=1e-9, because="decimals of quaternions"),
    Reader("usd-core", "usd", rigs.by_usd_core, POSES, unit="m", tolerance=1e-6, lens=FLOATS,
           because="apertures of 32 bits"),
    Reader("mcap", "mcap", rigs.by_mcap, ALL, lens=0),
    Reader("mcap", "mcap", rigs.by_mcap_cubes, Cubes(), unit="m", tolerance=1e-8, is_partial=True,
           because="nine decimals; objects that a camera sees"),
    Reader("mcap", "mcap", rigs.by_mcap, ALL, "rig", lens=0),
    Reader("mcap", "mcap", rigs.by_mcap_cubes, Cubes(), "rig", "m", 1e-8, is_partial=True,
           because="nine decimals; objects that a camera sees"),
    Reader("mcap", "mcap", rigs.by_mcap_points, scans, "rig", "m"),
    Reader("open3d", "pointclouds", rigs.by_open3d, scans, "rig", "m"),
    Reader("nuscenes-devkit", "nuscenes", rigs.by_nuscenes_points, scans, "rig", "m",
           because="turned: nuScenes' scanner has X to the right"),
    Reader("nuscenes-devkit", "nuscenes", rigs.by_nuscenes_devkit,
           Cubes(("image_02", "image_03"), category_of), "rig", "m", 1e-5, lens=1e-9,
           is_partial=True, because="micrometres; objects that a sensor senses"),
    Reader("av2", "argoverse2", rigs.by_av2_points, scans, "rig", "m", 1e-5,
           because="32-bit floats in the frame of the ego"),
    Reader("av2", "argoverse2", rigs.by_av2, city_cubes, "rig", "m", 1e-5, lens=1e-9,
           is_partial=True, because="micrometres; classes of Argoverse"),
    Reader("torchvision", "kitti", rigs.by_torchvision_kitti,
           Cubes(LEFT, official_type, upright=True), "rig", "m", 1e-5, is_partial=True,
           because="micrometres; upright boxes; DontCare is left out"),
    Reader("datumaro", "kitti", D.by_datumaro("kitti3d", "training", frame, "DontCare"),
           Boxes(LEFT, (0, 0, -1, -1), official_type), "rig", is_partial=True,
           because="KITTI's numbers: first and last pixel; DontCare is left out"),
    Reader("pykitti", "kitti_raw", rigs.by_pykitti, scans_and_lenses, "rig", "m", lens=1e-9,
           because="decimals"),
    Reader("datumaro", "motchallenge",
           D.by_datumaro("mot_seq", "rig-train/*", lambda k: frame(str(int(k) - 1))),
           Boxes(LEFT, (1, 1, 1, 1), mot_category), "rig", because="MOT's pixels count from 1"),
    Reader("datumaro", "dota", D.by_datumaro("dota"), Boxes(LEFT, along_heading=True), "rig",
           tolerance=0.15, because="tenths of pixels; boxes around the corners"),
    Reader("torchvision", "cityscapes", records.by_torchvision_cityscapes,
           Boxes(LEFT, name_of=city_class), "rig", iou=1),
    Reader("torchvision", "kitti_stereo", S.by_torchvision_stereo,
           but_the_last(Images(LEFT, STEREO)), "rig", because="frames that have a next one"),
    Reader("trackeval", "kitti_tracking", S.by_trackeval,
           Boxes(LEFT, (0, 0, -1, -1), tracked), "rig", is_partial=True,
           because="KITTI's numbers: first and last pixel; DontCare is left out"),
    Reader("open3d", "semantickitti", S.by_open3d_ml, scanned_instances, "rig", "m",
           needs=("addict",)),
    Reader("pandas", "tables", S.by_pandas_tables, measurements, "rig", "SI", 1e-5,
           because="seven digits of 32-bit floats"),
    Reader("pandas", "birdseye", S.by_pandas_birdseye, birdseye, "rig", "m", 2e-4, iou=1,
           is_partial=True, because="tenths of a millimetre; objects of the map"),
    Reader("numpy", "occupancy", S.by_numpy_voxels, voxels, "rig", "m", iou=1),
    Reader("numpy", "tapvid", S.by_numpy_tracks, tracks, "rig", "m", iou=1, lens=0),
    Reader("opencv-python-headless", "scannet", S.by_opencv_scannet,
           Images(("color",), {"depth": millimetres, "pose": pose}, nyu40_class), unit="px, mm",
           tolerance=0.501, iou=1, lens=1e-6, because="whole millimetres, NYU40's classes"),
    Reader("datasets", "control_clips", S.by_datasets_clips,
           Images(("color",), {"rgb": lambda r: r.rgb, "depth": grey_depth}, lambda _: "instance"),
           unit="px, grey", tolerance=0.501, iou=1, because="whole grey levels"),
    Reader("graspnetAPI", "graspnet", S.by_graspnet, grasps, unit="m", tolerance=1e-6,
           because="32-bit floats"),
    Reader("lerobot", "lerobot", S.by_lerobot, joints, "arm", "rad, grey", FLOATS,
           because="32-bit floats"),
    Reader("tfrecord", "rlds", S.by_tfrecord_episodes, joints, "arm", "rad, grey", FLOATS,
           because="32-bit floats"),
    Reader("lerobot", "lerobot", S.by_lerobot_geometry, step_geometry, "arm", "m, ids, 0.1 mm",
           FLOATS, lens=FLOATS, because="32-bit floats"),
    Reader("tfrecord", "rlds", S.by_tfrecord_geometry, step_geometry, "arm", "m, ids, 0.1 mm",
           FLOATS, lens=FLOATS, because="32-bit floats"),
)  # fmt: skip

WITHOUT_READER = {
    "culane": "its evaluation is in no registry: benchmarks.readers.evaluations",
    "lidar_flow": "judged by av2 and FlowNet3D: benchmarks.readers.evaluations",
    "map_vectors": "its evaluation is in no registry: benchmarks.readers.evaluations",
    "opendrive": "our reader; ASAM's checker requires separate packages (docs/maps.md)",
    "openlane": "its evaluation is in no registry: benchmarks.readers.evaluations",
    "scene_text": "its evaluations are in no registry: benchmarks.readers.evaluations",
}
"""Formats without a row, with the reason; tests/exporters compares them with their formulas."""
