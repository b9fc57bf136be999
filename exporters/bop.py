"""BOP, the benchmark of 6D object poses: models, images, poses, masks and visibility.

::

    models/obj_000001.ply       one model per distinct geometry [mm]; models/models_info.json
    camera.json                 intrinsics of the first image
    objects.json                obj_id: asset, scale, category of each model (an extension)
    dataset_info.md
    test_targets_bop19.json     objects of the test split with a visible fraction of 0.1 or more
    <split>/000004/             one folder per scene, or per thousand samples
        rgb/000001.png  depth/000001.png            16-bit z-depth
        mask/000001_000002.png                      whole silhouette inside the image: 255
        mask_visib/000001_000002.png                its visible part
        scene_camera.json  scene_gt.json  scene_gt_info.json
        scene_gt_coco.json  scene_gt_coco_modal.json

Millimetres everywhere; a depth pixel times ``depth_scale`` is in millimetres. ``p_camera =
cam_R_m2c @ p_model + cam_t_m2c``, camera axes as OpenCV's; matrices are written row by row. A
model's origin is the centre of its bounding box. ``cam_K`` has pixel centres at i + 0.5, as the
renderer of bop_toolkit does.

Where BOP's conventions differ from ours:

* **Boxes** of ``scene_gt_info.json`` are ``[x, y, x_max - x_min, y_max - y_min]`` with the last
  pixel as maximum: a pixel less than COCO's, which the two COCO files have.
* **COCO files** list all models as categories in every folder. Masks and areas are the visible
  ones; ``bbox`` of ``scene_gt_coco.json`` is around the whole silhouette inside the image, by
  which BOP judges detections, of ``scene_gt_coco_modal.json`` around the visible pixels. This is
  the default, and the other choice, of bop_toolkit's ``calc_gt_coco.py`` (June 2026).
* ``px_count_all`` and ``bbox_obj`` count the silhouette outside the image too:
  ``visib_fract`` of a truncated object is below 1. All boxes of an invisible object are -1.
* ``px_count_valid`` counts pixels of the silhouette inside the image with a depth.

Objects are numbered from 1 in the sorted order of their assets and scales. A person's phases of a
walk are several geometries. Symmetries are stated by the assets, or else found on surface
and colours (``symmetry_search``). Articulated robots and ignored objects are left out.

References: Hodan et al., "BOP: Benchmark for 6D Object Pose Estimation", ECCV 2018, and the
documentation of bop_toolkit.
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import PrivateAttr

from gen_data.core import bounded_cache, boxes, capture, se3
from gen_data.core.interfaces import AssetLibrary, DatasetInfo, media_path
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.reported import reported
from gen_data.core.sample import MaskPx, ObjectTruth, Sample
from gen_data.core.serialization import canonical_json
from gen_data.exporters import base, fragments, mask_png, rigid_models, rle, sensor_selection
from gen_data.exporters.conventions import PINHOLE, Conventions
from gen_data.exporters.image_files import link_or_copy, read_pixels
from gen_data.exporters.sequences import check_frame_names, write_bytes, write_json, write_text

TARGET_VISIBILITY = 0.1
"""Visible fraction from which an object is a target of the benchmark of 2019."""

CHUNK = 1000
"""Samples of a folder with ``folders: thousand``, as in BOP's own synthetic training images."""

MODEL_CACHE_BYTES = 64 << 20
"""Memory of a process for models that occur in several shards."""

NO_BOX = [-1, -1, -1, -1]
IMAGES, MODELS = "images", "models"
MASKS = ("mask", "mask_visib")
COCO_FILES = ("scene_gt_coco", "scene_gt_coco_modal")


class Bop(base.AssetExporter):
    """BOP: poses of rigid objects in the images of one camera, with their models.

    Attributes:
        camera: Sensor of the images; empty = the first one, by name, with the rgb channel.
        folders: One folder per ``scene``, with all views and steps, or per ``thousand`` samples.
    """

    type: Literal["bop"] = "bop"
    conventions: ClassVar[Conventions] = Conventions(
        pixel_centre="i + 0.5",
        box="left, top, last - first column, last - first row (one less than COCO's)",
        lens=PINHOLE,
    )
    annotators: ClassVar[frozenset[str]] = frozenset(
        {"instance_masks", "amodal_masks", "boxes2d", "visibility", "poses"}
    )

    image_formats: ClassVar[frozenset[str]] = base.PNG_OR_JPEG
    camera: str = ""
    folders: Literal["scene", "thousand"] = "scene"

    _built: bounded_cache.ByteCache[rigid_models.Model] = PrivateAttr(
        default_factory=lambda: bounded_cache.ByteCache(MODEL_CACHE_BYTES)
    )

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent.

        Raises:
            ConfigError: no such camera, it is not a pinhole or does not write the rgb channel, or
                too many samples for six digits.
        """
        sensor_selection.pinhole_camera(info, self.camera, self.type)
        check_frame_names(info, self.type)

    def with_assets(self, assets: AssetLibrary) -> "Bop":
        """Return the exporter with a library of meshes."""
        bound = super().with_assets(assets)
        bound._built = bounded_cache.ByteCache(MODEL_CACHE_BYTES)
        return bound

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write masks, the models that occur, and a JSON line per image.

        Raises:
            ConfigError: see ``check``.
            AssetError: an asset's symmetries are not a finite group.
        """
        self.check(info)
        camera = sensor_selection.pinhole_camera(info, self.camera, self.type)
        folder = shard_dir / self.type
        models = _ModelFiles(folder / MODELS, self.library, self._built)
        rows = []
        for sample in samples:
            if camera not in sample.truth:
                continue
            pieces = rigid_models.rigid_pieces(sample.scene_of(camera))
            things = [
                thing
                for thing in sample.truth[camera].objects
                if thing.instance.instance_id in pieces and not thing.ignored
            ]
            keys = [models.add(pieces[thing.instance.instance_id], thing) for thing in things]
            depth = _read_depth(info, camera, shard_dir, sample.index)
            rows.append(
                _image_facts(info, sample, camera)
                | {
                    "gt": [_pose(key, t, models) for key, t in zip(keys, things, strict=True)],
                    "info": [_gt_info(thing, depth) for thing in things],
                    "coco": [_coco_mask(thing, sample, camera) for thing in things],
                }
            )
            _write_masks(folder, sample, camera, things)
        fragments.write_fragment(folder, IMAGES, rows)
        fragments.write_fragment(folder, MODELS, models.rows())

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Number the models, link models and images, and write the JSON files of each folder."""
        camera = sensor_selection.pinhole_camera(info, self.camera, self.type)
        ids = _write_models([d / self.type for d in shard_dirs], dataset_dir)
        text = _DATASET_INFO.format(name=info.name, camera=camera, models=len(ids))
        write_text(dataset_dir / "dataset_info.md", text)
        targets: list[dict[str, int]] = []
        rows = fragments.fragment_rows(shard_dirs, self.type, IMAGES)
        size = self._folder_size(info)
        # Rows come in the order of samples: one folder after the other is complete.
        for number, members in groupby(rows, lambda item: int(item[1]["index"]) // size):
            by_split: dict[str, list[tuple[Path, dict[str, Any]]]] = {}
            for shard_dir, row in members:
                by_split.setdefault(row["split"], []).append((shard_dir, row))
            for split, images in by_split.items():
                if not (dataset_dir / "camera.json").exists():
                    write_text(dataset_dir / "camera.json", _camera_json(images[0][1]))
                folder = dataset_dir / split / f"{number:06d}"
                scene = [_numbered(row, size, ids) for _, row in images]
                _write_scene(info, folder, scene, sorted(ids.values()))
                for (shard_dir, _), image in zip(images, scene, strict=True):
                    self._link_image(info, camera, shard_dir, image, folder)
                if split == "test":
                    targets += [t for image in scene for t in _targets(number, image)]
        write_json(dataset_dir / "test_targets_bop19.json", targets)

    def _folder_size(self, info: DatasetInfo) -> int:
        return CHUNK if self.folders == "thousand" else info.views_per_scene * info.steps_per_scene

    def _link_image(
        self,
        info: DatasetInfo,
        camera: str,
        shard_dir: Path,
        image: Mapping[str, Any],
        folder: Path,
    ) -> None:
        """Link the images and masks of one row into the folder of its scene."""
        name = f"{image['im_id']:06d}"
        channels = {"rgb": capture.Channel.RGB, "depth": capture.Channel.Z_DEPTH}
        for kind, channel in channels.items():
            if channel in info.media[camera]:
                source = info.media_path(shard_dir, camera, channel, image["index"])
                link_or_copy(source, folder / kind / f"{name}{source.suffix}")
        for kind in MASKS:
            for k in range(len(image["gt"])):
                source = shard_dir / self.type / kind / f"{image['index']:09d}_{k:06d}.png"
                link_or_copy(source, folder / kind / f"{name}_{k:06d}.png")


class _ModelFiles:
    """Models of a shard; each is built and written at its first use."""

    def __init__(
        self, folder: Path, assets: AssetLibrary, built: bounded_cache.ByteCache[rigid_models.Model]
    ) -> None:
        self._folder, self.library, self._built = folder, assets, built
        self._rows: dict[str, dict[str, Any]] = {}
        self._keys: dict[tuple[rigid_models.Piece, ...], str] = {}

    def add(self, pieces: tuple[rigid_models.Piece, ...], thing: ObjectTruth) -> str:
        """Write the model if it is new, and return its key."""
        if pieces not in self._keys:
            self._keys[pieces] = rigid_models.model_key(pieces)
        key = self._keys[pieces]
        if key not in self._rows:
            model = self._built.get(key, lambda: rigid_models.build_model(pieces, self.library))
            write_bytes(self._folder / f"{key}.ply", rigid_models.ply_bytes(model))
            self._rows[key] = _model_facts(key, pieces, thing, model)
        return key

    def center_m(self, key: str) -> tuple[float, float, float]:
        """Origin of the object frame in the instance frame [m]."""
        x, y, z = self._rows[key]["center_m"]
        return (x, y, z)

    def rows(self) -> list[dict[str, Any]]:
        return [self._rows[key] for key in sorted(self._rows)]


def _model_facts(
    key: str, pieces: Sequence[rigid_models.Piece], thing: ObjectTruth, model: rigid_models.Model
) -> dict[str, Any]:
    instance = thing.instance
    return {
        "key": key,
        "asset": instance.asset if len(pieces) > 1 else pieces[0].asset,
        "scale": pieces[0].scale,
        "category": instance.category,
        "subcategory": instance.subcategory,
        "center_m": list(model.center_m),
        "info": model.info,
    }


def _image_facts(info: DatasetInfo, sample: Sample, camera: str) -> dict[str, Any]:
    seen = sample.truth[camera].camera
    T_camera_world = reported(seen).T_world_camera.inverse()
    return {
        "index": sample.index,
        "split": sample.split,
        "size": [seen.intrinsics.width_px, seen.intrinsics.height_px],
        "suffix": info.encoding(camera, capture.Channel.RGB).suffix,
        "camera": {
            "cam_K": _K(seen.intrinsics),
            "depth_scale": round(info.depth_scale_m * rigid_models.MM_PER_M, 9),
            "cam_R_w2c": _rotation(T_camera_world),
            "cam_t_w2c": _millimetres(T_camera_world.translation_m),
        },
    }


def _K(intrinsics: Intrinsics) -> list[float]:  # noqa: N802
    values: list[float] = np.round(intrinsics.matrix(), 9).ravel().tolist()
    return values


def _rotation(pose: se3.SE3) -> list[float]:
    values: list[float] = (np.round(pose.rotation(), 12) + 0.0).ravel().tolist()
    return values


def _millimetres(position_m: Iterable[float]) -> list[float]:
    return [round(value * rigid_models.MM_PER_M, 6) + 0.0 for value in position_m]


def _pose(key: str, thing: ObjectTruth, models: _ModelFiles) -> dict[str, Any]:
    assert thing.T_camera_object is not None, "the annotation poses is in `needs`"
    T_camera_model = thing.T_camera_object @ se3.SE3(models.center_m(key))
    return {
        "key": key,
        "cam_R_m2c": _rotation(T_camera_model),
        "cam_t_m2c": _millimetres(T_camera_model.translation_m),
    }


def _read_depth(
    info: DatasetInfo, camera: str, shard_dir: Path, index: int
) -> NDArray[np.uint16] | None:
    """The depth image as stored, uint16 [h, w]; None if the camera writes none."""
    if capture.Channel.Z_DEPTH not in info.media[camera]:
        return None
    path = media_path(shard_dir, camera, capture.Channel.Z_DEPTH, index)
    return np.asarray(read_pixels(path), np.uint16)


def _gt_info(thing: ObjectTruth, depth: NDArray[np.uint16] | None) -> dict[str, Any]:
    assert thing.amodal_mask is not None, "the annotation amodal_masks is in `needs`"
    assert thing.truncation is not None, "the annotation visibility is in `needs`"
    mask = thing.amodal_mask
    inside_px = int(np.count_nonzero(mask.pixels))
    # The truncation is a ratio of two pixel counts, of which the mask has one.
    all_px = round(inside_px / (1.0 - thing.truncation)) if inside_px else 0
    height, width = mask.pixels.shape
    valid_px = 0
    if depth is not None:
        crop = depth[mask.y_px : mask.y_px + height, mask.x_px : mask.x_px + width]
        valid_px = int(np.count_nonzero(crop[mask.pixels]))
    return {
        "px_count_all": all_px,
        "px_count_valid": valid_px,
        "px_count_visib": thing.visible_px,
        "visib_fract": round(thing.visible_px / all_px, 9) if all_px else 0.0,
        "bbox_obj": _box(thing.amodal_box) if thing.visible_px else NO_BOX,
        "bbox_visib": _box(thing.box),
    }


def _box(box: boxes.BoxPx | None) -> list[int]:
    if box is None:
        return NO_BOX
    return [box.x_min, box.y_min, box.width_px - 1, box.height_px - 1]


def _coco_mask(thing: ObjectTruth, sample: Sample, camera: str) -> dict[str, Any]:
    """COCO's keys of the visible mask, with both boxes by file; empty for an invisible object."""
    if thing.box is None:
        return {}
    assert thing.mask is not None, "the annotation instance_masks is in `needs`"
    assert thing.amodal_mask is not None, "the annotation amodal_masks is in `needs`"
    size, whole = sample.truth[camera].camera.intrinsics, thing.amodal_mask
    counts = rle.run_lengths(thing.mask, size.height_px, size.width_px)
    around = {
        COCO_FILES[0]: boxes.tight_box(whole.pixels, whole.x_px, whole.y_px) or thing.box,
        COCO_FILES[1]: thing.box,
    }
    return {
        "area": thing.visible_px,
        "boxes": {k: [b.x_min, b.y_min, b.width_px, b.height_px] for k, b in around.items()},
        "segmentation": {"size": [size.height_px, size.width_px], "counts": counts},
    }


def _write_masks(folder: Path, sample: Sample, camera: str, things: Sequence[ObjectTruth]) -> None:
    size = sample.truth[camera].camera.intrinsics
    for kind in MASKS:
        (folder / kind).mkdir(parents=True, exist_ok=True)
    for k, thing in enumerate(things):
        name = f"{sample.index:09d}_{k:06d}.png"
        whole = mask_png.encode_mask(thing.amodal_mask, size.height_px, size.width_px)
        # Both masks of an object that nothing hides are the same.
        same = _are_equal(thing.amodal_mask, thing.mask)
        visible = whole if same else mask_png.encode_mask(thing.mask, size.height_px, size.width_px)
        for kind, png in zip(MASKS, (whole, visible), strict=True):
            (folder / kind / name).write_bytes(png)


def _are_equal(one: MaskPx | None, other: MaskPx | None) -> bool:
    if one is None or other is None:
        return one is other
    same_place = (one.x_px, one.y_px) == (other.x_px, other.y_px)
    return same_place and np.array_equal(one.pixels, other.pixels)


def _write_models(folders: Sequence[Path], dataset_dir: Path) -> dict[str, int]:
    """Link the models of all shards and describe them; return object ids by key."""
    found: dict[str, tuple[Path, dict[str, Any]]] = {}
    for folder in folders:
        for line in fragments.fragment_lines([folder], MODELS):
            row = json.loads(line)
            found.setdefault(row["key"], (folder, row))
    order = sorted(found, key=lambda k: (found[k][1]["asset"], found[k][1]["scale"], k))
    ids = {key: number for number, key in enumerate(order, 1)}
    for key, number in ids.items():
        source = found[key][0] / MODELS / f"{key}.ply"
        link_or_copy(source, dataset_dir / MODELS / f"obj_{number:06d}.ply")
    infos = [(ids[key], found[key][1]["info"]) for key in order]
    write_text(dataset_dir / MODELS / "models_info.json", _numbered_json(infos))
    names = ("asset", "scale", "category", "subcategory")
    facts = [(ids[key], {name: found[key][1][name] for name in names}) for key in order]
    write_text(dataset_dir / "objects.json", _numbered_json(facts))
    return ids


def _numbered(row: Mapping[str, Any], size: int, ids: Mapping[str, int]) -> dict[str, Any]:
    """The row of an image with its number in its folder, and with object ids instead of keys."""
    poses = []
    for pose in row["gt"]:
        known = {name: value for name, value in pose.items() if name != "key"}
        poses.append({**known, "obj_id": ids[pose["key"]]})
    return {**row, "im_id": row["index"] % size, "gt": poses}


def _write_scene(
    info: DatasetInfo, folder: Path, images: Sequence[Mapping[str, Any]], models: Sequence[int]
) -> None:
    for name, key in (("camera", "camera"), ("gt", "gt"), ("gt_info", "info")):
        rows = [(image["im_id"], image[key]) for image in images]
        write_text(folder / f"scene_{name}.json", _numbered_json(rows))
    header = {
        "info": {"description": info.name, "version": "1.0"},
        "licenses": [],
        "categories": [{"id": k, "name": str(k), "supercategory": info.name} for k in models],
        "images": [
            {
                "id": image["im_id"],
                "file_name": f"rgb/{image['im_id']:06d}{image['suffix']}",
                "width": image["size"][0],
                "height": image["size"][1],
            }
            for image in images
        ],
    }
    for name in COCO_FILES:
        # Ids start at 1: COCOeval reads 0 as "no match".
        numbered = [{"id": k, **row} for k, row in enumerate(_coco_rows(images, name), 1)]
        write_json(folder / f"{name}.json", {**header, "annotations": numbered})


def _numbered_json(rows: Iterable[tuple[int, Any]]) -> str:
    """A JSON object with numbers as keys, one line each, in the given order."""
    lines = [f'"{number}":{canonical_json(value)}' for number, value in rows]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _coco_rows(images: Sequence[Mapping[str, Any]], name: str) -> Iterator[dict[str, Any]]:
    """Rows of the COCO file of this name."""
    for image in images:
        for gt, facts, mask in zip(image["gt"], image["info"], image["coco"], strict=True):
            if mask:
                yield {
                    "image_id": image["im_id"],
                    "category_id": gt["obj_id"],
                    "iscrowd": 0,
                    "ignore": facts["visib_fract"] < TARGET_VISIBILITY,
                    "width": image["size"][0],
                    "height": image["size"][1],
                    "area": mask["area"],
                    "bbox": mask["boxes"][name],
                    "segmentation": mask["segmentation"],
                }


def _targets(scene_id: int, image: Mapping[str, Any]) -> list[dict[str, int]]:
    """Numbers of sufficiently visible instances by object."""
    counts: dict[int, int] = {}
    for gt, facts in zip(image["gt"], image["info"], strict=True):
        if facts["visib_fract"] >= TARGET_VISIBILITY:
            counts[gt["obj_id"]] = counts.get(gt["obj_id"], 0) + 1
    return [
        {"im_id": image["im_id"], "inst_count": counts[k], "obj_id": k, "scene_id": scene_id}
        for k in sorted(counts)
    ]


def _camera_json(row: Mapping[str, Any]) -> str:
    fx, _, cx, _, fy, cy, *_ = row["camera"]["cam_K"]
    width, height = row["size"]
    facts = {"fx": fx, "fy": fy, "cx": cx, "cy": cy, "width": width, "height": height}
    return canonical_json({**facts, "depth_scale": row["camera"]["depth_scale"]}) + "\n"


_DATASET_INFO = """\
# {name}

Synthetic images of the camera `{camera}`; {models} models in millimetres.

* `objects.json` maps each obj_id to its asset, scale and category.
* `models_info.json` has symmetries of shape and own materials: as stated by assets, or else found
  in the surface and its colours to within a hundredth of the diameter.
* For meshes of your own, `file_origin_mm` in `models_info.json` is the origin of your file in the
  frame of the model: subtract it to get coordinates of the file, scaled and upright.
* `cam_K` has pixel centres at i + 0.5.
* Vertex colours are the asset's; images may show the object in other materials.
"""
