"""Objects in images as exports state them, read by the libraries of each format or by hand."""

import contextlib
import csv
import gc
import io
import json
import re
import warnings
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import pyarrow
import pyarrow.parquet
import webdataset
import yaml
from numpy.typing import NDArray
from PIL import Image
from pycocotools import mask as coco_mask
from pycocotools.coco import COCO
from tfrecord import example_pb2
from tfrecord.reader import tfrecord_iterator

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Found:
    """An object in an image; None for facts that a format does not have.

    Attributes:
        category: Name.
        box: Left, top, right and bottom [px].
        mask: Visible pixels, [height, width].
        number: Instance id.
        ignored: Whether scores leave it out.
    """

    category: str
    box: tuple[float, ...] | None = None
    mask: Mask | None = None
    number: int | None = None
    ignored: bool = False


Images = Iterator[tuple[str, str, list[Found]]]
"""Split, name without ending and objects of each image."""


def sides(box: Any) -> tuple[float, ...]:
    x, y, width, height = map(float, box)
    return (x, y, x + width, y + height)


def pixels(path: Path, mode: str | None = None) -> NDArray[Any]:
    with Image.open(path) as image:
        assert mode in (None, image.mode)
        return np.asarray(image)


def drawn(polygons: list[list[float]], height: int, width: int) -> Mask:
    shapes = coco_mask.frPyObjects(polygons, height, width)
    return np.asarray(coco_mask.decode(coco_mask.merge(shapes)), bool)


def opened(path: Path) -> COCO:
    with contextlib.redirect_stdout(io.StringIO()):
        return COCO(str(path))


def in_coco(folder: Path) -> Images:
    for path in folder.glob("annotations/instances_*.json"):
        coco = opened(path)
        assert len(coco.anns) == len(coco.dataset["annotations"])
        for number, image in coco.imgs.items():
            rows = [
                Found(
                    coco.cats[row["category_id"]]["name"],
                    sides(row["bbox"]),
                    coco.annToMask(row).astype(bool),
                    row["instance_id"],
                    bool(row["iscrowd"]),
                )
                for row in coco.imgToAnns[number]
            ]
            yield path.stem.split("_")[1], Path(image["file_name"]).stem, rows


def segments_of(path: Path) -> NDArray[np.int64]:
    r, g, b = np.moveaxis(pixels(path, "RGB").astype(np.int64), -1, 0)
    return r + 256 * g + 65_536 * b


def in_panoptic(folder: Path) -> Images:
    for path in folder.glob("annotations/panoptic_*.json"):
        truth = json.loads(path.read_text())
        names = {c["id"]: c["name"] for c in truth["categories"] if c["isthing"]}
        for annotation in truth["annotations"]:
            ids = segments_of(path.with_suffix("") / annotation["file_name"])
            rows = [
                Found(names[s["category_id"]], sides(s["bbox"]), ids == s["id"], s["instance_id"])
                for s in annotation["segments_info"]
                if s["category_id"] in names
            ]
            yield path.stem.split("_")[1], Path(annotation["file_name"]).stem, rows


def in_cvat(folder: Path) -> Images:
    """Shapes of an object have its number as their group; images are numbered from 0."""
    for path in folder.glob("*/annotations.xml"):
        images = list(ET.parse(path).iter("image"))
        assert [node.get("id") for node in images] == [str(k) for k in range(len(images))]
        for node in images:
            height, width = (int(node.attrib[key]) for key in ("height", "width"))
            groups: dict[str, list[ET.Element]] = {}
            for element in node:
                groups.setdefault(element.attrib["group_id"], []).append(element)
            rows = [
                _cvat_object(int(number), elements, height, width)
                for number, elements in groups.items()
            ]
            yield path.parent.name, Path(node.attrib["name"]).stem, rows


def _cvat_object(number: int, elements: list[ET.Element], height: int, width: int) -> Found:
    (category,) = {element.attrib["label"] for element in elements}
    facts, kind = elements[0].attrib, elements[0].tag
    if kind == "box":
        box = tuple(float(facts[name]) for name in ("xtl", "ytl", "xbr", "ybr"))
        return Found(category, box, number=number)
    if kind == "polygon":
        polygons = [
            [float(v) for pair in e.attrib["points"].split(";") for v in pair.split(",")]
            for e in elements
        ]
        return Found(category, mask=drawn(polygons, height, width), number=number)
    lengths = [int(value) for value in facts["rle"].split(",")]
    values = np.arange(len(lengths)) % 2 == 1
    w, h, x, y = (int(facts[name]) for name in ("width", "height", "left", "top"))
    mask = np.zeros((height, width), bool)
    mask[y : y + h, x : x + w] = np.repeat(values, lengths).reshape(h, w)
    return Found(category, (x, y, x + w, y + h), mask, number)


def unpack(rle: list[int]) -> NDArray[np.uint8]:
    """Values of rle-pack: 32 bits of their number, 5 of their size, four sizes of run lengths."""
    bits = "".join(f"{byte:08b}" for byte in rle)
    place = 0

    def read(count: int) -> int:
        nonlocal place
        place += count
        return int(bits[place - count : place], 2)

    number, word, sizes = read(32), read(5) + 1, [read(4) + 1 for _ in range(4)]
    parts: list[NDArray[np.uint8]] = []
    while sum(map(len, parts)) < number:
        is_run = read(1)
        length = read(sizes[read(2)]) + 1
        values = [read(word)] * length if is_run else [read(word) for _ in range(length)]
        parts.append(np.array(values, np.uint8))
    return np.concatenate(parts)


def in_label_studio(folder: Path) -> Images:
    """One region of an object, with the labels of its control in the interface."""
    controls = list(ET.parse(folder / "label_config.xml").getroot())
    known = {c.get("name"): {label.get("value") for label in c} for c in controls}
    for path in folder.glob("*/tasks.json"):
        for task in json.loads(path.read_text()):
            name = unquote(task["data"]["image"]).partition("=label_studio/")[2]
            assert (folder / name).is_file()
            regions = task["annotations"][0]["result"]
            for region in regions:
                assert set(region["value"][region["type"]]) <= known[region["from_name"]]
            rows = [_region(r) for r in regions if r["type"] != "keypointlabels"]
            yield path.parent.name, Path(name).stem, rows


def _region(region: dict[str, Any]) -> Found:
    """An object; lengths are percentages of the image."""
    width, height = region["original_width"], region["original_height"]
    value, number = region["value"], int(region["id"])
    (category,) = value[region["type"]]
    if region["type"] == "brushlabels":
        mask = unpack(value["rle"]).reshape(height, width, 4)[..., 3] == 255
        return Found(category, mask=mask, number=number)
    if region["type"] == "polygonlabels":
        points = np.array(value["points"]) * (width / 100, height / 100)
        return Found(category, mask=drawn([points.ravel().tolist()], height, width), number=number)
    scale = np.array([width, height, width, height]) / 100
    box = np.round([value[name] for name in ("x", "y", "width", "height")] * scale, 6)
    return Found(category, sides(box), number=number)


def voc_objects(path: Path) -> list[dict[str, Any]]:
    """Objects of an XML file; boxes include their last pixel and count from 1."""
    found = []
    for node in ET.parse(path).getroot().iter("object"):
        left, top, right, bottom = (
            int(node.findtext(f"bndbox/{name}", "")) for name in ("xmin", "ymin", "xmax", "ymax")
        )
        states = {k: node.findtext(k) for k in ("difficult", "truncated", "occluded")}
        box = (left - 1, top - 1, right, bottom)
        found.append({"name": node.findtext("name"), "box": box, **states})
    return found


def in_voc(folder: Path) -> Images:
    """Label images count objects in their order, and classes in the order of the label map."""
    (root,) = folder.glob("VOCdevkit/*")
    names = [row.split(":")[0] for row in (root / "labelmap.txt").read_text().splitlines()[1:]]
    for split in ("train", "val"):
        path = root / f"ImageSets/Main/{split}.txt"
        for stem in path.read_text().split() if path.exists() else ():
            assert (root / f"JPEGImages/{stem}.jpg").is_file()
            classes, objects = (
                pixels(root / f"Segmentation{kind}/{stem}.png", "P") for kind in ("Class", "Object")
            )
            rows = [
                Found(row["name"], row["box"], objects == k, ignored=row["difficult"] == "1")
                for k, row in enumerate(voc_objects(root / f"Annotations/{stem}.xml"), 1)
            ]
            for row in (r for r in rows if not r.ignored):
                assert {names[k] for k in np.unique(classes[row.mask])} == {row.category}
            assert ((classes > 0) == (objects > 0)).all()
            yield split, stem, rows


def in_yolo(folder: Path) -> Images:
    data = yaml.safe_load((folder / "detect/data.yaml").read_text())
    for split in ("train", "val"):
        images = folder / "detect" / data[split]
        labels = Path(str(images).replace("/images/", "/labels/"))
        assert {p.stem for p in images.iterdir()} == {p.stem for p in labels.iterdir()}
        for path in images.iterdir():
            height, width = pixels(path).shape[:2]
            rows = []
            for line in (labels / f"{path.stem}.txt").read_text().splitlines():
                number, *box = line.split()
                x, y, w, h = np.array(box, float) * [width, height, width, height]
                ends = np.round([x - w / 2, y - h / 2, x + w / 2, y + h / 2], 2)
                rows.append(Found(data["names"][int(number)], tuple(ends.tolist())))
            yield split, path.stem, rows


def csv_rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def in_croissant(folder: Path) -> Images:
    objects = csv_rows(folder / "objects.csv")
    for image in csv_rows(folder / "images.csv"):
        rows = [
            Found(row["category"], sides(row[k] for k in ("x", "y", "width", "height")))
            for row in objects
            if row["image_id"] == image["image_id"]
        ]
        (path,) = folder.glob(f"images/*/{int(image['sample']):09d}_color.png")
        yield path.parent.name, path.stem, rows


def parquet(path: Path) -> pyarrow.Table:
    with pyarrow.parquet.ParquetFile(path) as file:
        return file.read()


def in_parquet(folder: Path) -> Images:
    for path in folder.glob("data/*.parquet"):
        table = parquet(path)
        features = json.loads(table.schema.metadata[b"huggingface"])["info"]["features"]
        names = features["objects"]["category"]["feature"]["names"]
        for row in table.to_pylist():
            listed, size = row["objects"], [row["height"], row["width"]]
            masks = [coco_mask.decode({"size": size, "counts": c}) for c in listed["rle"]]
            assert listed["area"] == [mask.sum() for mask in masks]
            assert len(set(listed["id"])) == len(masks)
            rows = [
                Found(names[k], sides(box), mask.astype(bool), ignored=crowd)
                for k, box, mask, crowd in zip(
                    listed["category"], listed["bbox"], masks, listed["iscrowd"], strict=True
                )
            ]
            yield path.name.split("-")[0], Path(row["image"]["path"]).stem, rows


Features = dict[str, tuple[str, list[Any]]]


def features(data: bytes) -> Features:
    """Kind and values of an example by key, parsed by protobuf."""
    example = example_pb2.Example.FromString(data)
    return {
        key: (kind, list(getattr(feature, kind).value))
        for key, feature in example.features.feature.items()
        if (kind := feature.WhichOneof("kind"))
    }


def records(path: Path) -> list[Features]:
    """Features of all records of a file; the reader has one buffer for all of them."""
    return [features(bytes(record)) for record in tfrecord_iterator(str(path))]


def in_records(folder: Path) -> Images:
    """Sides as shares of the image, labels of the map as text too, masks as PNG files."""
    known = re.findall(r'name: "(.*)"', (folder / "label_map.pbtxt").read_text())
    for path in folder.glob("*.tfrecord"):
        for record in records(path):
            values = {key: found for key, (_, found) in record.items()}
            (height,), (width,) = values["image/height"], values["image/width"]
            names = [name.decode() for name in values["image/object/class/text"]]
            assert names == [known[k - 1] for k in values["image/object/class/label"]]
            boxes = np.array(
                [values[f"image/object/bbox/{k}"] for k in ("xmin", "ymin", "xmax", "ymax")]
            )
            boxes = np.round(boxes.T * [width, height, width, height], 3)
            masks = [np.asarray(Image.open(io.BytesIO(m))) for m in values["image/object/mask"]]
            rows = [
                Found(name, tuple(box), mask == 1, ignored=bool(crowd))
                for name, box, mask, crowd in zip(
                    names, boxes.tolist(), masks, values["image/object/is_crowd"], strict=True
                )
            ]
            name = values["image/filename"][0].decode()
            yield path.name.split("-")[0], Path(name).stem, rows


def tar_samples(folder: Path) -> list[dict[str, Any]]:
    """Decoded samples of all tar files of a split, as a user reads them."""
    urls = sorted(str(path) for path in folder.glob("*.tar"))
    with warnings.catch_warnings():
        # The reader leaves closing of its files to the garbage collector.
        warnings.simplefilter("ignore", ResourceWarning)
        loaded = webdataset.WebDataset(urls, shardshuffle=False, nodesplitter=None)
        samples = list(loaded.decode("pil"))
        del loaded
        gc.collect()
    return samples


def in_tar(folder: Path) -> Images:
    """Labels of each camera in the JSON member of a sample."""
    for split in folder.iterdir():
        for sample in tar_samples(split):
            listed = sample["json"]["cameras"]["color"]["annotations"]
            assert len({row["id"] for row in listed}) == len(listed)
            rows = [
                Found(
                    row["category"],
                    sides(row["bbox"]),
                    coco_mask.decode(row["segmentation"]).astype(bool),
                    row["instance_id"],
                    bool(row["iscrowd"]),
                )
                for row in listed
            ]
            yield split.name, f"{sample['__key__']}_color", rows


def json_lines(path: Path) -> list[Any]:
    return [json.loads(line) for line in path.read_text("utf-8").splitlines()]


def in_lines(folder: Path) -> Images:
    for path in folder.glob("*_images.jsonl"):
        for image in json_lines(path):
            rows = [
                Found(
                    row["category"],
                    mask=coco_mask.decode(row["segmentation"]).astype(bool),
                    number=row["object_id"],
                )
                for row in image["objects"]
            ]
            yield path.stem.split("_")[0], Path(image["file_name"]).stem, rows


READERS: dict[str, Callable[[Path], Images]] = {
    "coco": in_coco,
    "coco_panoptic": in_panoptic,
    "croissant": in_croissant,
    "cvat": in_cvat,
    "huggingface": in_parquet,
    "label_studio": in_label_studio,
    "language": in_lines,
    "tfrecord": in_records,
    "voc": in_voc,
    "webdataset": in_tar,
    "yolo": in_yolo,
}
