"""Conversations and benchmark files, as their trainers and evaluation read them."""

import ast
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import cv2
import numpy as np
import pytest

from gen_data.core.sample import FIRST, Sample, Utterance
from gen_data.exporters.language import LanguageJsonl, Layout
from gen_data.exporters.language_layouts import LAYOUTS, qwen2_5_vl, qwen3_vl, resized
from tests.exporters.label_readers import json_lines

ALL = get_args(Layout)


@pytest.fixture
def folder(world: Any, tmp_path: Path) -> Path:
    found: Path = world.export(LanguageJsonl(layouts=ALL), world.info(7), world.samples, tmp_path)
    return found


def entries(folder: Path, layout: str) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads((folder / f"train_{layout}.json").read_text("utf-8"))
    return found


def test_every_layout_of_the_configuration_has_a_function() -> None:
    assert set(ALL) == set(LAYOUTS)


@pytest.mark.parametrize("layout", ["llava", "qwen2_5_vl", "qwen3_vl"])
def test_conversations_alternate_and_show_their_images(folder: Path, layout: str) -> None:
    """The rules of LLaVA's and Qwen's loaders: human first, one placeholder per image."""
    found = entries(folder, layout)

    assert found
    for entry in found:
        files = [entry["image"]] if isinstance(entry["image"], str) else entry["image"]
        turns = entry["conversations"]
        text = "".join(turn["value"] for turn in turns)
        assert [turn["from"] for turn in turns] == ["human", "gpt"] * (len(turns) // 2)
        assert all(turn["value"].strip() for turn in turns)
        assert text.count("<image>") == len(files) == turns[0]["value"].count("<image>")
        assert all((folder / name).exists() for name in files)
    if layout == "llava":
        assert len({entry["id"] for entry in found}) == len(found)


GROUNDING = [("qwen3_vl", (1000, 1000)), ("qwen2_5_vl", None)]


@pytest.mark.parametrize(("layout", "canvas"), GROUNDING)
def test_grounding_recovers_the_boxes(folder: Path, layout: str, canvas: Any) -> None:
    """Scaled back to the image, boxes and points are off by at most half a unit."""
    images = {i["file_name"]: i for i in json_lines(folder / "train_images.jsonl")}
    lines = [
        r for r in json_lines(folder / "train.jsonl") if r["kind"] in ("expression", "pointing")
    ]
    boxes: dict[str, list[Any]] = {}
    for entry in entries(folder, layout):
        for turn in entry["conversations"]:
            if match := re.fullmatch(r"```json\n(\[.*\])\n```", turn["value"], re.DOTALL):
                boxes.setdefault(entry["image"], []).append(json.loads(match[1])[0])
    checked = 0
    for name, image in images.items():
        size = np.array([image["width"], image["height"]])
        unit = size / (canvas or resized(*size.tolist()))
        wanted = [line for line in lines if line["file_name"] == name]
        for line, item in zip(wanted, boxes.get(name, []), strict=True):
            if line["kind"] == "expression":
                (own,) = (o for o in image["objects"] if o["object_id"] in line["object_ids"])
                left, top, width, height = own["bbox"]
                values, truth = item["bbox_2d"], [left, top, left + width, top + height]
            else:
                values, truth = item["point_2d"], line["points"][0]
            error = np.abs(np.array(values).reshape(-1, 2) * unit - np.array(truth).reshape(-1, 2))
            assert (error <= 0.5 * unit + 1e-9).all()
            checked += 1
    assert checked


@pytest.mark.slow
def test_supervision_reads_groundings(folder: Path) -> None:
    """Its parsers of Qwen2.5-VL's and Qwen3-VL's answers find box and label."""
    vlm = pytest.importorskip("supervision.detection.vlm")
    image = {"image_id": 1, "file_name": "a.png", "width": 640, "height": 428,
             "objects": [{"object_id": 1, "bbox": [146, 137, 469, 278]}]}  # fmt: skip
    line = {"kind": "expression", "text": "the bowl", "answer": "", "object_ids": [1]}
    (new,), (old,) = qwen3_vl(image, [line]), qwen2_5_vl(image, [line])
    by_3 = vlm.from_qwen_3_vl(new["conversations"][1]["value"], (640, 428))
    by_2_5 = vlm.from_qwen_2_5_vl(old["conversations"][1]["value"], (644, 420), (640, 428))

    for xyxy, _, names in (by_3, by_2_5):
        assert np.abs(xyxy - [[146, 137, 615, 415]]).max() < 0.6
        assert names.tolist() == ["the bowl"]


def test_boxes_are_those_of_the_conversion_in_qwen_s_repository() -> None:
    """Values that its ``tools/process_bbox.ipynb`` computes for its own example."""
    image = {"image_id": 1, "file_name": "a.png", "width": 640, "height": 428,
             "objects": [{"object_id": 1, "bbox": [146, 137, 469, 278]}]}  # fmt: skip
    line = {"kind": "expression", "text": "the bowl", "answer": "", "object_ids": [1]}
    texts = [
        next(layout(image, [line]))["conversations"][1]["value"]
        for layout in (qwen3_vl, qwen2_5_vl)
    ]

    assert [json.loads(t.strip("`json\n"))[0]["bbox_2d"] for t in texts] == [
        [228, 320, 961, 970], [147, 134, 619, 407],
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("size", "expected"),
    [((640, 480), (644, 476)), ((320, 240), (308, 252)), ((50, 60), (56, 56)),
     ((1920, 1080), (1316, 728)), ((630, 70), (616, 56))],
)  # fmt: skip
def test_sizes_are_those_of_qwen_s_smart_resize(
    size: tuple[int, int], expected: tuple[int, int]
) -> None:
    """Computed by its own function with its defaults."""
    assert resized(*size) == expected


def test_points_lie_in_the_polygons_of_robospatial(folder: Path) -> None:
    """As its evaluation decides: yes, no, or the first point inside the polygon."""
    found = entries(folder, "robospatial")
    images = {i["file_name"]: i for i in json_lines(folder / "train_images.jsonl")}
    lines = [r for r in json_lines(folder / "train.jsonl") if r["kind"] == "pointing"]
    context = [e for e in found if e["category"] == "context"]

    assert {e["category"] for e in found} >= {"configuration", "context"}
    assert {e["answer"] for e in found if e["category"] != "context"} == {"yes", "no"}
    assert len(context) == len(lines)
    for entry, line in zip(context, lines, strict=True):
        image = images[entry["img"]]
        polygon = np.array(ast.literal_eval(entry["answer"]), np.float32)
        x, y = line["points"][0]
        share = (x / image["width"], y / image["height"])
        assert 0.0 <= polygon.min() <= polygon.max() <= 1.0
        assert cv2.pointPolygonTest(polygon, share, False) > 0


def said(sample: Sample, step: int, *utterances: Utterance, objects: int) -> Sample:
    truth = sample.truth["color"]
    truth = replace(truth, utterances=utterances, objects=truth.objects[:objects])
    return replace(sample, step_index=step, split="train", truth={"color": truth})


def test_questions_about_two_images_name_the_second_one(world: Any, tmp_path: Path) -> None:
    """They are left out where the second image does not show their objects."""
    first, second = world.samples[:2]
    one, two, *_ = (t.instance.instance_id for t in first.truth["color"].objects)
    here = Utterance("change", "Closer now?", "yes", (one,), other=FIRST)
    gone = replace(here, text="Farther now?", instances=(two,))
    elsewhere = replace(here, text="Closer to the other?", other="left")
    samples = [said(first, 0, objects=1), said(second, 1, here, gone, elsewhere, objects=2)]
    exporter = LanguageJsonl(layouts=("llava",))
    folder = world.export(exporter, world.info(2), samples, tmp_path, shard_size=1)
    rows = [r for r in json_lines(folder / "train.jsonl") if r["kind"] == "change"]
    (pair,) = (e for e in entries(folder, "llava") if not isinstance(e["image"], str))
    files = [i["file_name"] for i in json_lines(folder / "train_images.jsonl")]

    assert [(r["text"], r["other_image"]) for r in rows] == [("Closer now?", files[0])]
    assert pair["image"] == files[::-1]
    assert pair["conversations"] == [
        {"from": "human", "value": "<image>\n<image>\nCloser now?"},
        {"from": "gpt", "value": "Yes"},
    ]
