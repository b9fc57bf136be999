"""Vision-language labels: scene graphs, captions, referring expressions, questions with answers.

::

    <split>.jsonl               a line per caption, relation, expression or question
    <split>_images.jsonl        a line per image with its objects and their masks
    <split>/000000012_color.png

A line of ``<split>.jsonl`` has ``id`` (unique), ``image_id``, ``file_name``, ``kind``, ``text``,
``answer`` (empty without a question) and ``object_ids``, its objects: the mask of an
answer is the union of theirs, and an expression has one. Besides the lines of the annotation
``language`` there is one of the kind ``scene_caption`` about place, weather, light and view, as
``control_clips`` writes it.

A line of ``<split>_images.jsonl`` has ``image_id``, ``file_name``, ``width``, ``height``,
``objects`` and ``relationships``. Objects have ``object_id`` (the instance), ``annotation_id``
(the same as in ``coco``), ``category``, ``bbox`` ``[left, top, width, height]`` and
``segmentation`` (COCO's run lengths); furniture, which has no annotation, has ``object_id`` and
``category`` only. Relationships are ``subject_id``, ``predicate`` and ``object_id``, the keys of
Visual Genome (Krishna et al., 2017); they are there with the annotation ``relations``.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

from gen_data.core.capture import Channel
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import Sample, Utterance
from gen_data.core.serialization import canonical_json
from gen_data.exporters import captions, image_files, image_rows, rle
from gen_data.exporters.coco import box_xywh, image_name, scene_graph
from gen_data.exporters.conventions import ANY_LENS, EDGES, Conventions
from gen_data.exporters.fragments import fragment_rows, image_splits

UTTERANCE_STRIDE = 1_000
"""Ids of lines per image; more lines than this are left out."""


class LanguageJsonl(image_rows.ImageRowsExporter):
    """Text about every photograph as JSON lines, with masks of its objects."""

    type: Literal["language"] = "language"
    conventions: ClassVar[Conventions] = Conventions(box=EDGES, lens=ANY_LENS)
    annotators: ClassVar[frozenset[str]] = frozenset({"instance_masks", "language"})

    def image_row(self, info: DatasetInfo, sample: Sample, sensor: str) -> dict[str, Any]:
        """Its text and its objects."""
        return {
            "image": _image(info, sample, sensor),
            "lines": [_line(u) for u in _utterances(sample, sensor)],
        }

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Join the lines of all shards and link the images."""
        dataset_dir.mkdir(parents=True, exist_ok=True)
        for split in image_splits([shard_dir / self.type for shard_dir in shard_dirs]):
            with (
                (dataset_dir / f"{split}.jsonl").open("w", encoding="utf-8", newline="\n") as text,
                (dataset_dir / f"{split}_images.jsonl").open(
                    "w", encoding="utf-8", newline="\n"
                ) as images,
            ):
                for shard_dir, row in fragment_rows(shard_dirs, self.type, f"{split}.images"):
                    image = row["image"]
                    image["file_name"] = f"{split}/{image['file_name']}"
                    images.write(canonical_json(image) + "\n")
                    number = image["image_id"]
                    head = {"image_id": number, "file_name": image["file_name"]}
                    for k, line in enumerate(row["lines"][:UTTERANCE_STRIDE]):
                        identity = {"id": number * UTTERANCE_STRIDE + k}
                        text.write(json.dumps(identity | head | line, ensure_ascii=False) + "\n")
                    image_files.link_photograph(
                        info, shard_dir, row, dataset_dir / image["file_name"]
                    )


def _utterances(sample: Sample, sensor: str) -> list[tuple[str, Utterance]]:
    said = sample.truth[sensor].utterances
    assert said is not None, "the annotation language is in `needs`"
    scene = Utterance("caption", captions.caption(sample, sensor))
    return [("scene_caption", scene), *((u.kind, u) for u in said)]


def _line(item: tuple[str, Utterance]) -> dict[str, Any]:
    kind, said = item
    return {"kind": kind, "text": said.text, "answer": said.answer, "object_ids": said.instances}


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
