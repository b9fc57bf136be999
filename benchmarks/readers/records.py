"""Readers of records: tables and containers with images, labels and lenses."""

import io
import json
import os
import tempfile
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.readers.detection import SIDES, decode, import_torchvision, matrix_lens
from benchmarks.readers.truth import image_name
from benchmarks.readers.views import Thing, View, from_corner, of_pixels, thing


def by_h5py(root: Path) -> Iterator[View]:
    """BlenderProc's containers: pixels of each listed instance."""
    import h5py

    names = {int(k): v for k, v in json.loads((root / "categories.json").read_bytes()).items()}
    for path in sorted(root.glob("*/*.hdf5")):
        with h5py.File(path) as file:
            arrays = {key: file[key][()] for key in file}
        ids = arrays["instance_segmaps"]
        rows = json.loads(arrays["instance_attribute_maps"])[1:]
        seen = [row for row in rows if (ids == row["idx"]).any()]
        things = [of_pixels(names[row["category_id"]], ids == row["idx"]) for row in seen]
        bent = json.loads(arrays.get("lens", "{}")).get("distortion", ())
        yield View(path.stem, tuple(things), matrix_lens(arrays["K"], bent, 0.5))


def by_datasets(root: Path) -> Iterator[View]:
    """Hugging Face's own format, by its card."""
    for split in load_dataset(str(root)).values():
        names = split.features["objects"]["category"].feature.names
        for row in split:
            found, size = row["objects"], [row["height"], row["width"]]
            columns = (found["category"], found["bbox"], found["rle"])
            things = [
                from_corner(names[c], box, decode({"size": size, "counts": runs}))
                for c, box, runs in zip(*columns, strict=True)
            ]
            lens = matrix_lens(row["K"], (row["lens"] or {}).get("distortion", ()))
            yield View(image_name(row["sample"], row["sensor"]), tuple(things), lens)


def load_dataset(path: str, **files: Any) -> Any:
    """A data set of the package datasets, with all splits."""
    os.environ |= {"HF_HUB_OFFLINE": "1", "HF_DATASETS_OFFLINE": "1"}
    import datasets

    datasets.disable_progress_bars()
    return datasets.load_dataset(path, cache_dir=tempfile.mkdtemp(), **files)


def by_datasets_webdataset(root: Path) -> Iterator[View]:
    """WebDataset in the package datasets."""
    files = {path.name: str(path / "*.tar") for path in sorted(root.iterdir())}
    rows = (
        row["json"]
        for split in load_dataset("webdataset", data_files=files).values()
        for row in split
    )
    for labels in rows:
        for camera, row in labels["cameras"].items():
            things = tuple(map(_labelled, row["annotations"]))
            lens = matrix_lens(row["K"], (row.get("lens") or {}).get("distortion") or ())
            yield View(image_name(labels["index"], camera), things, lens)


def _labelled(row: Mapping[str, Any]) -> Thing:
    return from_corner(row["category"], row["bbox"], decode(row["segmentation"]))


def by_datasets_language(root: Path) -> Iterator[View]:
    """Objects of referring expressions; furniture has no box."""
    files = {path.name.split("_")[0]: str(path) for path in sorted(root.glob("*_images.jsonl"))}
    for split in load_dataset("json", data_files=files).values():
        for row in split:
            things = (_labelled(one) for one in row["objects"] if one.get("bbox"))
            yield View(Path(row["file_name"]).stem, tuple(things))


def examples(root: Path, pattern: str) -> Iterator[dict[str, list[Any]]]:
    """Lists by key of all records of the files, in order."""
    from tfrecord import example_pb2
    from tfrecord.reader import tfrecord_iterator

    for record in (r for p in sorted(root.glob(pattern)) for r in tfrecord_iterator(str(p))):
        example = example_pb2.Example.FromString(bytes(record))
        yield {
            key: list(getattr(value, value.WhichOneof("kind") or "bytes_list").value)
            for key, value in example.features.feature.items()
        }


def by_tfrecord(root: Path) -> Iterator[View]:
    """Records of the Object Detection API; boxes are fractions in 32 bits."""
    from PIL import Image

    for row in examples(root, "*.tfrecord"):
        size = [row["image/width"][0], row["image/height"][0]] * 2
        names = [name.decode() for name in row["image/object/class/text"]]
        sides = np.transpose([row[f"image/object/bbox/{side}"] for side in SIDES]) * size
        masks = [np.array(Image.open(io.BytesIO(png))) for png in row["image/object/mask"]]
        things = [thing(*one) for one in zip(names, sides, masks, strict=True)]
        lens = matrix_lens(row["image/intrinsics"], row.get("image/lens/distortion", ()))
        name = image_name(row["image/sample"][0], row["image/sensor"][0].decode())
        yield View(name, tuple(things), lens)


def by_mlcroissant(root: Path) -> Iterator[View]:
    """Tables of images and objects."""
    import mlcroissant

    data = mlcroissant.Dataset(jsonld=str(root / "croissant.json"))
    objects: dict[int, list[Thing]] = defaultdict(list)
    for row in _records(data.records("objects")):
        x, y, width, height = (row[key] for key in ("x", "y", "width", "height"))
        objects[row["image_id"]].append(
            from_corner(row["category"].decode(), (x, y, width, height))
        )
    for row in _records(data.records("images")):
        bent = (row.get("distortion") or b"").decode().split()
        lens = (*(row[key] for key in ("fx", "fy", "cx", "cy")), *map(float, bent))
        name = image_name(row["sample"], row["sensor"].decode())
        yield View(name, tuple(objects[row["image_id"]]), lens)


def _records(rows: Iterable[Mapping[str, Any]]) -> Iterator[dict[str, Any]]:
    for row in rows:
        yield {key.rpartition("/")[2]: value for key, value in row.items()}


def by_pysolotools(root: Path) -> Iterator[View]:
    """Unity's SOLO; frames are counted in each split."""
    from pysolotools.consumers import Solo

    splits = (root / name for name in ("train", "val"))
    for index, frame in enumerate(f for split in splits for f in Solo(str(split)).frames()):
        for capture in frame.captures:
            labels = {type(one).__name__: one for one in capture.annotations}
            boxes = labels["BoundingBox2DAnnotation"].values
            things = [from_corner(b.labelName, (*b.origin, *b.dimension)) for b in boxes]
            # Unity's projection: axes from -1 to 1, Y up.
            (sx, _, ox), (_, sy, oy), _ = np.array(capture.matrix).reshape(3, 3)
            (w, h) = np.array(capture.dimension) / 2
            lens = (sx * w, sy * h, w * (1 - ox), h * (1 + oy))
            yield View(image_name(index, capture.id), tuple(things), lens)


def by_rerun(root: Path) -> Iterator[View]:
    """Recordings of Rerun: boxes and K of each camera, by sample."""
    import rerun.chunk

    rows: dict[tuple[int, str], dict[str, Any]] = defaultdict(dict)
    names: dict[int, str] = {}
    for path in sorted(root.glob("*/*.rrd")):
        for chunk in rerun.chunk.RrdReader(str(path)).store().stream():
            batch = chunk.to_record_batch().to_pydict()
            for key, column in batch.items():
                if key == "AnnotationContext:context":
                    found = (info["class_description"]["info"] for info in column[0][0])
                    names |= {info["id"]: info["label"] for info in found}
                parts = chunk.entity_path.split("/")
                if ":" in key and "sample" in batch and parts[2] == "cameras":
                    for sample, value in zip(batch["sample"], column, strict=True):
                        rows[sample, parts[3]][key] = value
    for (sample, camera), row in rows.items():
        columns = (row[f"Boxes2D:{key}"] for key in ("class_ids", "centers", "half_sizes"))
        things = [
            thing(names[number], (*np.subtract(middle, half), *np.add(middle, half)))
            for number, middle, half in zip(*columns, strict=True)
        ]
        K = row.get("Pinhole:image_from_camera")
        lens = None if K is None else matrix_lens(np.reshape(K, (3, 3)).T)
        yield View(image_name(sample, camera), tuple(things), lens)


def by_torchvision_cityscapes(root: Path) -> Iterator[View]:
    """Cityscapes' images of instances: 1000 times the class and a number."""
    import_torchvision()
    from torchvision.datasets import Cityscapes

    names = {one.id: one.name for one in Cityscapes.classes}
    data = Cityscapes(str(root), split="train", mode="fine", target_type="instance")
    for path, (_, image) in zip(data.images, data, strict=True):
        ids = np.array(image)
        numbers = [number for number in np.unique(ids) if number >= 1000]
        things = [of_pixels(names[number // 1000], ids == number) for number in numbers]
        number = int(Path(path).stem.split("_")[2])
        yield View(image_name(number, "image_02"), tuple(things))


def by_panopticapi(root: Path) -> Iterator[View]:
    """Segments of COCO panoptic: pixels of each id."""
    from panopticapi.utils import rgb2id
    from PIL import Image

    for path in sorted((root / "annotations").glob("panoptic_*.json")):
        data = json.loads(path.read_bytes())
        things_of = {row["id"]: row["name"] for row in data["categories"] if row["isthing"]}
        for row in data["annotations"]:
            with Image.open(path.with_suffix("") / row["file_name"]) as image:
                ids = rgb2id(np.array(image.convert("RGB")))
            found = [s for s in row["segments_info"] if s["category_id"] in things_of]
            things = [
                from_corner(things_of[s["category_id"]], s["bbox"], ids == s["id"]) for s in found
            ]
            yield View(Path(row["file_name"]).stem, tuple(things))
