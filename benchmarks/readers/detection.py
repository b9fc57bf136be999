"""Readers of labelled images: each opens the folder of an export and yields its views."""

import json
import os
import shutil
import tempfile
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.readers.truth import image_name
from benchmarks.readers.views import View, from_corner, thing
from gen_data.lab.certificate.readers import READERS


def annotation_files(root: Path) -> list[Path]:
    """COCO's files of all splits."""
    return sorted((root / "annotations").glob("instances_*.json"))


def folder_of(path: Path) -> Path:
    """Folder with the images of COCO's file of a split."""
    return path.parents[1] / path.stem.removeprefix("instances_")


def decode(runs: Mapping[str, Any]) -> Any:
    """Pixels of COCO's runs."""
    from pycocotools import mask as coco_mask

    return coco_mask.decode(dict(runs))


def by_pycocotools(root: Path) -> Iterator[View]:
    """COCO: the reference reader."""
    yield from coco_views(*annotation_files(root))


def by_pycocotools_in_bop(root: Path) -> Iterator[View]:
    """BOP's annotations in COCO's format; images are counted in each split."""
    known = json.loads((root / "objects.json").read_bytes())
    names = {int(number): row["category"] for number, row in known.items()}
    paths = [
        p for s in ("train", "val") for p in sorted(root.glob(f"{s}/*/scene_gt_coco_modal.json"))
    ]
    for index, view in enumerate(coco_views(*paths, names=names)):
        yield View(f"{index:09d}_color", view.things)


def coco_views(*paths: Path, names: Mapping[int, str] | None = None) -> Iterator[View]:
    """Views of COCO's files; ``names`` of categories, if the files have no proper ones."""
    from pycocotools.coco import COCO

    for path in paths:
        coco = COCO(str(path))
        known = names or {row["id"]: row["name"] for row in coco.loadCats(coco.getCatIds())}
        for row in coco.loadImgs(sorted(coco.getImgIds())):
            things = tuple(
                from_corner(known[one["category_id"]], one["bbox"], coco.annToMask(one))
                for one in coco.loadAnns(coco.getAnnIds([row["id"]]))
            )
            bent = row.get("lens", {}).get("distortion", ())
            lens = matrix_lens(row["K"], bent) if "K" in row else None
            yield View(Path(row["file_name"]).stem, things, lens)


def matrix_lens(K: Any, coefficients: Any = (), shift: float = 0.0) -> tuple[float, ...]:
    """A lens, as in ``View``; ``shift`` is 0.5 where pixel i has its centre at i."""
    (fx, _, cx), (_, fy, cy), _ = np.asarray(K, float).reshape(3, 3)
    return (fx, fy, cx + shift, cy + shift, *map(float, coefficients))


def by_torchvision(root: Path) -> Iterator[View]:
    """COCO in torchvision's wrapper; boxes and masks were enlarged twice and reduced again."""
    import_torchvision()
    from torchvision.datasets import CocoDetection, wrap_dataset_for_transforms_v2
    from torchvision.transforms import v2

    for path in annotation_files(root):
        data = CocoDetection(str(folder_of(path)), str(path))
        names = {c["id"]: c["name"] for c in data.coco.loadCats(data.coco.getCatIds())}
        wrapped = wrap_dataset_for_transforms_v2(data, target_keys="all")
        for k, number in enumerate(data.ids):
            image, target = wrapped[k]
            (row,) = data.coco.loadImgs(number)
            # Half as large again: boxes of whole numbers would be cut.
            _, moved = v2.Resize((row["height"] * 3 // 2, row["width"] * 3 // 2))(image, target)
            masks = target["masks"].numpy() if "masks" in target else ()
            columns = (moved["boxes"].numpy() / 1.5, target["labels"].tolist(), masks)
            things = [thing(names[c], box, m) for box, c, m in zip(*columns, strict=True)]
            yield View(Path(row["file_name"]).stem, tuple(things))


def import_torchvision() -> None:
    """Import torchvision, also with a build of torch without CUDA.

    The operators of PyPI's wheel do not load there; no reader needs them, and once they are
    declared, all else can be imported.
    """
    import torch

    try:
        import torchvision  # noqa: F401
    except RuntimeError:
        library = torch.library.Library("torchvision", "DEF")
        for arguments in (
            "nms(Tensor dets, Tensor scores, float iou_threshold)",
            "qnms(Tensor dets, Tensor scores, float iou_threshold)",
            "roi_align(Tensor input, Tensor rois, float spatial_scale, SymInt pooled_height,"
            " SymInt pooled_width, int sampling_ratio, bool aligned)",
        ):
            library.define(f"{arguments} -> Tensor")
        DECLARED.append(library)


DECLARED: list[Any] = []
"""Operators are declared as long as their library is kept."""


def by_detr(root: Path) -> Iterator[View]:
    """COCO through the image processor of DETR; boxes are its fractions of the image."""
    import_torchvision()
    from PIL import Image
    from pycocotools.coco import COCO
    from transformers import DetrImageProcessor

    processor = DetrImageProcessor(do_resize=False, do_pad=False)
    for path in annotation_files(root):
        coco = COCO(str(path))
        names = {row["id"]: row["name"] for row in coco.loadCats(coco.getCatIds())}
        for row in coco.loadImgs(coco.getImgIds()):
            with Image.open(folder_of(path) / row["file_name"]) as image:
                picture = image.convert("RGB")
            found = coco.loadAnns(coco.getAnnIds([row["id"]]))
            given = {"image_id": row["id"], "annotations": found}
            (label,) = processor(
                picture, annotations=given, return_segmentation_masks=True, return_tensors="pt"
            )["labels"]
            boxes = label["boxes"].numpy() * [*picture.size, *picture.size]
            columns = (boxes, label["class_labels"].tolist(), label["masks"].numpy())
            things = (thing(names[c], sides(box), m) for box, c, m in zip(*columns, strict=True))
            yield View(Path(row["file_name"]).stem, tuple(things))


def sides(box: Any) -> Any:
    """Left, top, right and bottom of a box that is centre and size."""
    return np.concatenate([box[:2] - box[2:] / 2, box[:2] + box[2:] / 2])


def by_sahi(root: Path) -> Iterator[View]:
    """COCO as sliced by SAHI; masks are drawn by SAHI."""
    from sahi.annotation import ObjectAnnotation
    from sahi.utils.coco import Coco

    for path in annotation_files(root):
        coco = Coco.from_coco_dict_or_path(str(path))
        for image in coco.images:
            things = []
            for one in image.annotations:
                drawn = ObjectAnnotation.from_coco_annotation_dict(
                    one.json, [image.height, image.width], one.category_name
                )
                mask = drawn.mask.bool_mask if drawn.mask is not None else None
                things.append(from_corner(one.category_name, one.bbox, mask))
            yield View(Path(image.file_name).stem, tuple(things))


def by_supervision(root: Path) -> Iterator[View]:
    """COCO with masks."""
    from supervision import DetectionDataset

    for path in annotation_files(root):
        data = DetectionDataset.from_coco(str(folder_of(path)), str(path), force_masks=True)
        for file, _, found in data:
            columns = (found.class_id, found.xyxy, found.mask)
            things = (thing(data.classes[c], box, m) for c, box, m in zip(*columns, strict=True))
            yield View(Path(file).stem, tuple(things))


def by_certificate(format_: str) -> Callable[[Path], Iterator[View]]:
    """Boxes and masks as a reader of ``gen-data certify`` finds them."""

    def read(root: Path) -> Iterator[View]:
        for image in READERS[format_].load()(root, None).images or ():  # type: ignore[arg-type]
            things = (thing(o.category, o.box, o.mask and decode(o.mask)) for o in image.objects)
            yield View(image_name(image.index, image.camera), tuple(things))

    return read


def by_ultralytics(task: str) -> Callable[[Path], Iterator[View]]:
    """YOLO with the data loader that trains on it; masks are drawn by its function."""

    def read(root: Path) -> Iterator[View]:
        scratch = tempfile.mkdtemp()
        os.environ |= {"YOLO_CONFIG_DIR": scratch, "YOLO_OFFLINE": "true"}
        import_torchvision()
        from ultralytics.data import utils
        from ultralytics.data.dataset import YOLODataset

        utils.check_font = lambda *_: None  # no download
        # It writes caches next to the labels.
        folder = shutil.copytree(root / task, f"{scratch}/yolo")
        data = utils.check_det_dataset(f"{folder}/data.yaml", autodownload=False)
        for split in ("train", "val"):
            for label in YOLODataset(img_path=data[split], data=data, task=task).labels:
                h, w = label["shape"]
                lines = label["segments"] or [None] * len(label["cls"])
                columns = (label["cls"][:, 0], label["bboxes"] * [w, h, w, h], lines)
                things = (
                    thing(
                        data["names"][int(number)],
                        sides(box),
                        None if line is None else utils.polygon2mask((h, w), [line * (w, h)]),
                    )
                    for number, box, line in zip(*columns, strict=True)
                )
                yield View(Path(label["im_file"]).stem, tuple(things))

    return read


def by_label_studio(root: Path) -> Iterator[View]:
    """Label Studio's own converter to COCO, read by pycocotools."""
    from label_studio_sdk.converter.converter import Converter

    scratch = Path(tempfile.mkdtemp())
    converter = Converter(str(root / "label_config.xml"), str(root), download_resources=False)
    for split in sorted(path.parent.name for path in root.glob("*/tasks.json")):
        out = scratch / f"label-studio-{split}"
        converter.convert_to_coco(str(root / split / "tasks.json"), str(out), is_dir=False)
        yield from coco_views(out / "result.json")


def by_torchvision_voc(root: Path) -> Iterator[View]:
    """Pascal VOC; the pixels of the k-th box have the k-th colour of the image of objects."""
    import_torchvision()
    from PIL import Image
    from torchvision.datasets import VOCDetection

    for split in ("train", "val"):
        for _, target in VOCDetection(str(root), year="2012", image_set=split):
            label, things = target["annotation"], []
            (folder,) = (root / "VOCdevkit").iterdir()
            stem = Path(label["filename"]).stem
            with Image.open(folder / f"SegmentationObject/{stem}.png") as image:
                numbers = np.array(image)
            for k, item in enumerate(label.get("object", ())):
                box = [float(item["bndbox"][side]) for side in SIDES]
                things.append(thing(item["name"], box, numbers == k + 1))
            yield View(stem, tuple(things))


SIDES = ("xmin", "ymin", "xmax", "ymax")


def by_datumaro(
    format_: str, folders: str = "", name_of: Callable[[str], str] = str, without: str = ""
) -> Callable[[Path], Iterator[View]]:
    """Any format that datumaro reads; annotations of one group are one object.

    Args:
        format_: Its name for the format.
        folders: Pattern of the folders to read, below the export's folder; empty = this folder.
        name_of: Name of a view from the name of an item.
        without: Class to leave out.
    """

    def read(root: Path) -> Iterator[View]:
        import datumaro
        from datumaro.components.annotation import AnnotationType

        for folder in sorted(root.glob(folders)) if folders else [root]:
            data = datumaro.Dataset.import_from(str(folder), format_)
            names = data.categories()[AnnotationType.label]
            for item in data:
                groups: dict[Any, list[Any]] = defaultdict(list)
                for k, one in enumerate(item.annotations):
                    if one.type.name in DATUMARO and names[one.label].name != without:
                        groups[one.group or -k].append(one)
                size, things = item.media.size, []
                for group in groups.values():
                    kind = min((one.type.name for one in group), key=DATUMARO.index)
                    corners = np.array([one.get_bbox() for one in group if one.type.name == kind])
                    low, high = corners[:, :2].min(0), (corners[:, :2] + corners[:, 2:]).max(0)
                    mask = _datumaro_mask(group, *size)
                    things.append(thing(names[group[0].label].name, (*low, *high), mask))
                yield View(name_of(item.id), tuple(things))

    return read


DATUMARO = ("bbox", "rotated_bbox", "mask", "polygon")
"""Annotations with boxes; only annotations of the first kind that an object has."""


def _datumaro_mask(group: Sequence[Any], height: int, width: int) -> Any:
    """Mask of the annotations of an object; None without one."""
    from pycocotools import mask as coco_mask

    polygons = [list(one.points) for one in group if one.type.name == "polygon"]
    if polygons:
        return coco_mask.decode(coco_mask.merge(coco_mask.frPyObjects(polygons, height, width)))
    return next((one.image for one in group if one.type.name == "mask"), None)
