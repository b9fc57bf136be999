"""COCO panoptic: every pixel belongs to at most one segment, a thing or stuff.

::

    annotations/panoptic_<split>.json                       none for a split without images
    annotations/panoptic_<split>/000000012_color.png        RGB; id = R + 256 G + 65536 B, 0 = void
    <split>/000000012_color.png                             images{file_name}, as in ``coco``

* **Things** are the annotated objects with a visible pixel: one segment each, with the categories
  of ``coco``; ``instance_id`` and ``annotation_id`` name its annotation there.
* **Stuff** is one segment per category and image: scenery that has an instance and no annotation
  (``building``, ``tree``, ``table``, ...), by its category; where images of depth are written, also
  ``road``, ``pavement``, ``grass`` and ``sky`` (see ``background_surfaces``). Categories of stuff
  that occur in the data set are listed, with ids after the other categories, with gaps: they
  are numbered among all categories of the program's families, because readers match a training
  and a test set by id, and the two seldom have the same scenery. Other categories (own assets)
  come last, in alphabetical order, if they occur.
* **Void** are pixels of neither: ignored and dropped objects, annotated ones below the thresholds,
  and unannotated objects of a category of things (the hood of the ego vehicle): evaluation
  ignores predictions there.

Ids of segments are numbers within an image, scattered over all colours: things count from 1 by
instance, stuff follows 65536. Box and area refer to the segment's pixels.

References: https://cocodataset.org/#format-data; Kirillov et al., "Panoptic Segmentation", CVPR
2019; panopticapi.
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from gen_data.core.capture import Channel
from gen_data.core.interfaces import AssetLibrary, DatasetInfo
from gen_data.core.sample import Sample
from gen_data.core.serialization import canonical_json
from gen_data.exporters import base, fragments, label_colors, label_png, label_regions
from gen_data.exporters.background_surfaces import SURFACES, UInt16, read_surfaces
from gen_data.exporters.coco import box_xywh, dataset_header, image_name, write_dataset
from gen_data.exporters.conventions import ANY_LENS, EDGES, Conventions
from gen_data.exporters.image_files import link_or_copy, link_photograph
from gen_data.exporters.sensor_selection import check_channels, photographs
from gen_data.exporters.sequences import write_bytes

UInt32 = NDArray[np.uint32]

STUFF_OF_SURFACE = {
    "asphalt": "road",
    "marking": "road",
    "pavement": "pavement",
    "kerb": "pavement",
    "grass": "grass",
    "sky": "sky",
}
"""Names of stuff by surface of the background."""
FIRST_STUFF = 65_536
"""Number of an image's first segment of stuff; things have instance ids, of 16 bits."""
_SCATTER = 0x9E3779B1
"""Odd: multiplication modulo 2^24 gives every number one id, and only 0 the id 0."""


class CocoPanoptic(base.AssetExporter):
    """COCO panoptic segmentation of all cameras with the channels rgb and instance."""

    type: Literal["coco_panoptic"] = "coco_panoptic"
    conventions: ClassVar[Conventions] = Conventions(
        pixel_centre="i + 0.5", box=EDGES, lens=ANY_LENS
    )

    image_formats: ClassVar[frozenset[str]] = base.ANY_FORMAT

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent.

        Raises:
            ConfigError: no camera writes the rgb channel, or one writes no instance channel.
        """
        check_channels(info, (Channel.INSTANCE,), self.type)

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write an id image and a JSON line per image, and the names of stuff.

        Raises:
            ConfigError: see ``check``.
            StorageError: an image is missing.
        """
        self.check(info)
        rows: dict[str, list[dict[str, Any]]] = {}
        for sample, sensor in photographs(info, samples):
            row = _write_segments(info, sample, sensor, shard_dir, self.library)
            rows.setdefault(f"{sample.split}.images", []).append(row)
        listed = (s["category"] for lines in rows.values() for line in lines for s in line["stuff"])
        stuff = [{"name": name} for name in sorted(set(listed))]
        fragments.write_fragments(shard_dir / self.type, {**rows, "stuff": stuff})

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Number the categories of stuff, join the lines of all shards, and link the images."""
        folders = [shard_dir / self.type for shard_dir in shard_dirs]
        names = {json.loads(line)["name"] for line in fragments.fragment_lines(folders, "stuff")}
        categories = _categories(info.categories, sorted(names))
        ids = {category["name"]: category["id"] for category in categories}
        splits = fragments.image_splits(folders)
        (dataset_dir / "annotations").mkdir(parents=True, exist_ok=True)
        for split in splits:
            stem = f"{split}.images"
            path = dataset_dir / f"annotations/panoptic_{split}.json"
            write_dataset(
                path,
                dataset_header(info, categories, self.conventions),
                map(_image_line, fragments.fragment_lines(folders, stem)),
                _annotation_lines(fragments.fragment_lines(folders, stem), ids),
            )
            for shard_dir, row in fragments.fragment_rows(shard_dirs, self.type, stem):
                name = row["file_name"]
                link_or_copy(shard_dir / self.type / name, path.with_suffix("") / name)
                link_photograph(info, shard_dir, row, dataset_dir / split / row["photograph"])


def _write_segments(
    info: DatasetInfo, sample: Sample, sensor: str, shard_dir: Path, assets: AssetLibrary
) -> dict[str, Any]:
    """Write the id image of one camera, and return its line."""
    labels, ids, stuff = find_segments(info, sample, sensor, shard_dir, assets)
    name = image_name(sample.index, sensor)
    # The bytes of a little-endian id are red, green, blue and 0.
    colors = ids.astype("<u4").view(np.uint8).reshape(-1, 4)[:, :3]
    write_bytes(shard_dir / f"coco_panoptic/{name}", label_png.encode_label_png(labels, colors))
    return {
        "id": sample.image_id(sensor),
        "file_name": name,
        "photograph": image_name(sample.index, sensor, info.encoding(sensor, Channel.RGB).suffix),
        "width": labels.shape[1],
        "height": labels.shape[0],
        "sensor": sensor,
        "sample": sample.index,
        "things": [
            {
                "id": segment_id(thing.instance.instance_id),
                "instance_id": thing.instance.instance_id,
                "annotation_id": sample.annotation_id(sensor, thing.instance.instance_id),
                "category_id": thing.instance.category_id,
                "area": thing.visible_px,
                "bbox": box_xywh(thing.box),
                "iscrowd": 0,
            }
            for thing in sample.truth[sensor].objects
            if thing.box is not None and not thing.ignored
        ],
        "stuff": _stuff_facts(labels, ids, stuff),
    }


def find_segments(
    info: DatasetInfo, sample: Sample, sensor: str, shard_dir: Path, assets: AssetLibrary
) -> tuple[UInt16, UInt32, list[str]]:
    """Find the segment of every pixel.

    Returns:
        Labels, uint16 [h, w]. The id of the segment of each label, uint32 [n]: ``segment_id`` of
        the instance ids of things, and of ``FIRST_STUFF + k`` for the k-th name of stuff; 0 = void.
        Names of stuff, sorted.

    Raises:
        StorageError: an image is missing.
    """
    instances, surfaces = read_surfaces(info, sample, sensor, shard_dir, assets)
    shown = np.flatnonzero(np.bincount(instances.ravel()))
    ignored = {t.instance.instance_id for t in sample.truth[sensor].objects if t.ignored}
    listed = {
        i.instance_id: i for i in sample.scene_of(sensor).instances if i.instance_id not in ignored
    }
    stuff_of = {
        number: listed[number].category
        for number in shown.tolist()
        if number in listed and not listed[number].annotated
    }
    seen = np.flatnonzero(np.bincount(surfaces.ravel()))
    ground = {k: STUFF_OF_SURFACE[SURFACES[k]] for k in seen.tolist() if k}
    things = {*info.categories, *info.own_categories}
    known = sorted({*stuff_of.values(), *ground.values()} - things)
    ids = {name: segment_id(FIRST_STUFF + k) for k, name in enumerate(known)}
    # Labels are instance ids, then surfaces; a surface has no instance.
    count = len(shown) and int(shown[-1]) + 1
    of_label = np.zeros(count + len(SURFACES), np.uint32)
    for thing in sample.truth[sensor].objects:
        if thing.box is not None and not thing.ignored:
            number = thing.instance.instance_id
            of_label[number] = segment_id(number)
    for number, name in stuff_of.items():
        of_label[number] = ids.get(name, 0)
    for k, name in ground.items():
        of_label[count + k] = ids.get(name, 0)
    labels = np.where(surfaces > 0, surfaces + np.uint16(count), instances) if ground else instances
    return labels, of_label, known


def segment_id(number: int) -> int:
    """Id of a segment, below 2^24, by its number; 0 = void."""
    return number * _SCATTER & 0xFFFFFF


def _stuff_facts(labels: UInt16, ids: UInt32, names: Sequence[str]) -> list[dict[str, Any]]:
    """Facts of the segments of stuff; their categories have ids when all names are known."""
    numbers = {segment_id(FIRST_STUFF + k): k + 1 for k in range(len(names))}
    number_of = np.array([numbers.get(i, 0) for i in ids.tolist()], np.uint16)
    regions = label_regions.find_regions(number_of[labels])
    return [
        {
            "id": segment_id(FIRST_STUFF + k),
            "category": name,
            "area": regions[k + 1].area_px,
            "bbox": box_xywh(regions[k + 1].box),
            "iscrowd": 0,
        }
        for k, name in enumerate(names)
    ]


def _categories(things: Sequence[str], stuff: Sequence[str]) -> list[dict[str, Any]]:
    colors = label_colors.voc_palette()
    known = _scenery_categories()
    numbered = [*known, *(name for name in stuff if name not in known)]
    ids = {name: len(things) + k for k, name in enumerate(numbered, 1)}
    listed = [*enumerate(things, 1), *sorted((ids[name], name) for name in stuff)]
    return [
        {
            "id": k,
            "name": name,
            "supercategory": "object" if k <= len(things) else "background",
            "isthing": int(k <= len(things)),
            "color": colors[1 + (k - 1) % 255].tolist(),
        }
        for k, name in listed
    ]


def _scenery_categories() -> list[str]:
    """Categories that scenery and ground can have without own assets, sorted."""
    from gen_data.assets.families import own_families
    from gen_data.assets.family import Family

    families = (f for f in own_families().values() if isinstance(f, Family))
    return sorted({family.category for family in families} | set(STUFF_OF_SURFACE.values()))


def _image_line(line: str) -> str:
    row = json.loads(line)
    facts = {key: row[key] for key in ("id", "width", "height")}
    return canonical_json({**facts, "file_name": row["photograph"]})


def _annotation_lines(lines: Iterable[str], ids: Mapping[str, int]) -> Iterator[str]:
    for line in lines:
        row = json.loads(line)
        stuff = [{**s, "category_id": ids[s["category"]]} for s in row["stuff"]]
        for segment in stuff:
            del segment["category"]
        yield canonical_json(
            {
                "image_id": row["id"],
                "file_name": row["file_name"],
                "segments_info": [*row["things"], *stuff],
            }
        )
