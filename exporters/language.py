"""Vision-language labels: scene graphs, captions, referring expressions, questions with answers.

::

    <split>.jsonl               a line per caption, relation, expression or question
    <split>_images.jsonl        a line per image with its objects and their masks
    <split>/000000012_color.png

A line of ``<split>.jsonl`` has ``id`` (unique), ``image_id``, ``file_name``, ``kind``, ``text``,
``answer`` (empty without a question) and ``object_ids``, its objects: the mask of an
answer is the union of theirs, and an expression has one. Besides the lines of the annotation
``language`` there is one of the kind ``scene_caption`` about place, weather, light and view, as
``control_clips`` writes it. Lines with numbers have ``measured``: ``numbers``, ``unit``,
``margin`` and ``resolution``, as ``gen_data.core.sample.Measured`` defines them. Answers in pixels
have ``points``, image coordinates, and ``segmentation`` where the answer is not an object.
Questions about two images have ``other_image``, the file of the second one, which shows all of
their objects.

``layouts`` adds ``<split>_<layout>.json``, see ``gen_data.exporters.language_layouts``.

A line of ``<split>_images.jsonl`` has ``image_id``, ``file_name``, ``width``, ``height``,
``objects`` and ``relationships``. Objects have ``object_id`` (the instance), ``annotation_id``
(the same as in ``coco``), ``category``, ``bbox`` ``[left, top, width, height]`` and
``segmentation`` (COCO's run lengths); furniture, which has no annotation, has ``object_id`` and
``category`` only. Relationships are ``subject_id``, ``predicate`` and ``object_id``, the keys of
Visual Genome (Krishna et al., 2017); they are there with the annotation ``relations``.
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import IO, Any, ClassVar, Literal

import cv2
import numpy as np

from gen_data.core.capture import Channel
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import FIRST, MaskPx, Sample, Utterance
from gen_data.core.serialization import canonical_json, to_plain
from gen_data.exporters import (
    captions,
    image_files,
    image_rows,
    language_layouts,
    mask_polygons,
    rle,
)
from gen_data.exporters.coco import box_xywh, image_name, scene_graph
from gen_data.exporters.conventions import ANY_LENS, EDGES, Conventions
from gen_data.exporters.fragments import split_rows

Layout = Literal["llava", "qwen2_5_vl", "qwen3_vl", "robospatial"]
INNER = frozenset({"polygon"})
"""Keys of lines that only layouts use."""
UTTERANCE_STRIDE = 1_000
"""Ids of lines per image; more lines than this are left out."""


class LanguageJsonl(image_rows.ImageRowsExporter):
    """Text about every photograph as JSON lines, with masks of its objects.

    Attributes:
        layouts: Further files: conversations as LLaVA, Qwen2.5-VL and Qwen3-VL are trained with,
            and questions as RoboSpatial-Home has them.
    """

    type: Literal["language"] = "language"
    conventions: ClassVar[Conventions] = Conventions(box=EDGES, lens=ANY_LENS)
    annotators: ClassVar[frozenset[str]] = frozenset({"instance_masks", "language"})
    layouts: tuple[Layout, ...] = ()

    def image_row(self, info: DatasetInfo, sample: Sample, sensor: str) -> dict[str, Any]:
        """Its text and its objects."""
        polygons = "robospatial" in self.layouts
        said = _utterances(sample, sensor)
        lines = (_line(info, sample, sensor, kind, u, polygons) for kind, u in said)
        return {
            "image": _image(info, sample, sensor),
            "lines": [line for line in lines if line is not None],
            "step": sample.step_index,
        }

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Join the lines of all shards and link the images."""
        dataset_dir.mkdir(parents=True, exist_ok=True)
        for split, lines in split_rows(shard_dirs, self.type):
            rows = _rows(lines, split)
            with ExitStack() as files:

                def opened(name: str, files: ExitStack = files, split: str = split) -> IO[str]:
                    path = dataset_dir / f"{split}{name}"
                    return files.enter_context(path.open("w", encoding="utf-8", newline="\n"))

                text, images = opened(".jsonl"), opened("_images.jsonl")
                lists = {name: _JsonList(opened(f"_{name}.json")) for name in self.layouts}
                for shard_dir, row in rows:
                    image = row["image"]
                    images.write(canonical_json(image) + "\n")
                    number = image["image_id"]
                    head = {"image_id": number, "file_name": image["file_name"]}
                    for k, line in enumerate(row["lines"]):
                        told = {key: v for key, v in line.items() if key not in INNER}
                        told = {"id": number * UTTERANCE_STRIDE + k} | head | told
                        text.write(json.dumps(told, ensure_ascii=False) + "\n")
                    for name, entries in lists.items():
                        entries.extend(language_layouts.LAYOUTS[name](image, row["lines"]))
                    image_files.link_photograph(
                        info, shard_dir, row, dataset_dir / image["file_name"]
                    )
                for entries in lists.values():
                    entries.close()


class _JsonList:
    """A JSON list in a file, an entry per line."""

    def __init__(self, file: IO[str]) -> None:
        self.file, self.before = file, "["

    def extend(self, entries: Iterable[Mapping[str, Any]]) -> None:
        for entry in entries:
            self.file.write(f"{self.before}\n{json.dumps(entry, ensure_ascii=False)}")
            self.before = ","

    def close(self) -> None:
        self.file.write("[]\n" if self.before == "[" else "\n]\n")


def _rows(
    rows: Iterable[tuple[Path, dict[str, Any]]], split: str
) -> Iterator[tuple[Path, dict[str, Any]]]:
    """Rows with the paths of their images, and the lines that can be told."""
    first: dict[str, dict[str, Any]] = {}
    for shard_dir, row in rows:
        image = row["image"]
        image["file_name"] = f"{split}/{image['file_name']}"
        if row["step"] == 0:
            first[row["sensor"]] = row
        lines = []
        for line in row["lines"]:
            other = line.get("other_image")
            if other == FIRST:
                before = first.get(row["sensor"])
                if before is None or before["sample"] != row["sample"] - row["step"]:
                    continue
                shown = {o["object_id"] for o in before["image"]["objects"] if "bbox" in o}
                if not shown.issuperset(line["object_ids"]):
                    continue
                line["other_image"] = before["image"]["file_name"]
            elif other is not None:
                line["other_image"] = f"{split}/{other}"
            lines.append(line)
        row["lines"] = lines[:UTTERANCE_STRIDE]
        yield shard_dir, row


def _utterances(sample: Sample, sensor: str) -> list[tuple[str, Utterance]]:
    said = sample.truth[sensor].utterances
    assert said is not None, "the annotation language is in `needs`"
    scene = Utterance("caption", captions.caption(sample, sensor))
    return [("scene_caption", scene), *((u.kind, u) for u in said)]


def _line(
    info: DatasetInfo, sample: Sample, sensor: str, kind: str, said: Utterance, with_polygons: bool
) -> dict[str, Any] | None:
    """A line; None if it is about a second image that does not show all of its objects."""
    line: dict[str, Any] = {
        "kind": kind,
        "text": said.text,
        "answer": said.answer,
        "object_ids": said.instances,
    }
    if said.measured is not None:
        line["measured"] = to_plain(said.measured)
    truth = sample.truth[sensor]
    if said.points_px:
        line["points"] = said.points_px
        if with_polygons:
            masks = {t.instance.instance_id: t.mask for t in truth.objects}
            mask = said.region or masks[said.instances[0]]
            assert mask is not None, "the annotation instance_masks is in `needs`"
            line["polygon"] = _around(mask, said.points_px[0])
        if said.region is not None:
            lens = truth.camera.intrinsics
            line["segmentation"] = rle.encode_rle(said.region, lens.height_px, lens.width_px)
    if said.other == FIRST:
        line["other_image"] = FIRST
    elif said.other:
        if said.other not in sample.truth:
            return None
        seen = {t.instance.instance_id for t in sample.truth[said.other].objects if t.box}
        if not seen.issuperset(said.instances):
            return None
        suffix = info.encoding(said.other, Channel.RGB).suffix
        line["other_image"] = image_name(sample.index, said.other, suffix)
    return line


def _around(mask: MaskPx, point_px: tuple[float, float]) -> list[tuple[float, float]]:
    """The outline of the part of a mask that a point lies in."""
    for outline in mask_polygons.mask_polygons(mask):
        polygon = np.array(outline, np.float32)
        if cv2.pointPolygonTest(polygon, point_px, False) >= 0:
            return [(float(x), float(y)) for x, y in outline]
    return []


def _image(info: DatasetInfo, sample: Sample, sensor: str) -> dict[str, Any]:
    truth = sample.truth[sensor]
    camera = truth.camera.intrinsics
    size = (camera.height_px, camera.width_px)
    graph = scene_graph(sample.scene_of(sensor), truth)
    objects: list[dict[str, Any]] = []
    for thing in truth.objects:
        if thing.box is None or thing.ignored:
            continue
        assert thing.mask is not None, "the annotation instance_masks is in `needs`"
        objects.append(
            {
                "object_id": thing.instance.instance_id,
                "annotation_id": sample.annotation_id(sensor, thing.instance.instance_id),
                "category": thing.instance.category,
                "bbox": box_xywh(thing.box),
                "segmentation": rle.encode_rle(thing.mask, *size),
            }
        )
    listed = {thing["object_id"] for thing in objects}
    named = {n for said in truth.utterances or () for n in said.instances} - listed
    others = graph["others"] | {str(n): sample.scene_of(sensor).instance(n).category for n in named}
    objects += [{"object_id": int(n), "category": others[n]} for n in sorted(others, key=int)]
    row = {
        "image_id": sample.image_id(sensor),
        "file_name": image_name(sample.index, sensor, info.encoding(sensor, Channel.RGB).suffix),
        "width": camera.width_px,
        "height": camera.height_px,
        "objects": objects,
    }
    if truth.relations is not None:
        row["relationships"] = [
            {"subject_id": s, "predicate": p, "object_id": o} for s, p, o in graph["relationships"]
        ]
    return row
