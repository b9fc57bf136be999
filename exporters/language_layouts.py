"""Conversations and benchmark files that trainers of vision-language models read.

A layout turns the lines of one image into entries of a JSON list. Pixels in texts, ``(x, y)``, take
the layout's coordinates:

``llava``        shares of the image's width and height, 0 to 1
``qwen2_5_vl``   pixels of the image as that model resizes it: to multiples of 28 (its training
                 code's ``smart_resize``)
``qwen3_vl``     thousandths of width and height, as Qwen2-VL has them
``robospatial``  as ``llava``; points are right inside the polygon of the answer

References: LLaVA, docs/Finetune_Custom_Data.md; Qwen3-VL, qwen-vl-finetune/README.md and
tools/process_bbox.ipynb; RoboSpatial-Eval, evaluation.py.
"""

import json
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from gen_data.core.english import sentence

Row = Mapping[str, Any]
Scale = Callable[[float, float], str]
"""Text of a point of the image [px]."""

FACTOR, LEAST_PX, MOST_PX = 28, 56 * 56, 14 * 14 * 4 * 1280
"""Multiple of the sides of Qwen2.5-VL's images, and its limits of their area."""
PIXEL = re.compile(r"\((\d+), (\d+)\)")
YES_OR_NO = frozenset({"yes", "no"})
ROBOSPATIAL = {
    "spatial": "configuration",
    "comparison": "configuration",
    "occlusion": "configuration",
    "clearance": "compatibility",
    "reach": "compatibility",
    "pointing": "context",
    "free_spot": "context",
}
"""Categories of RoboSpatial-Home by kind."""
POINTS = "Answer with points [(x, y), ...] in shares of the image's width and height."


def llava(image: Row, lines: Iterable[Row]) -> Iterator[dict[str, Any]]:
    """A conversation per image, and one per question about two images."""

    def point(x_px: float, y_px: float) -> str:
        return f"({x_px / image['width']:.3f}, {y_px / image['height']:.3f})"

    for number, turns in _conversations(image, lines, point, None):
        yield {"id": number, **turns}


def qwen2_5_vl(image: Row, lines: Iterable[Row]) -> Iterator[dict[str, Any]]:
    """Conversations in the pixels of the resized image."""
    width, height = resized(image["width"], image["height"])
    return _qwen(image, lines, width, height)


def qwen3_vl(image: Row, lines: Iterable[Row]) -> Iterator[dict[str, Any]]:
    """Conversations in thousandths of the image's sides."""
    return _qwen(image, lines, 1000, 1000)


def robospatial(image: Row, lines: Iterable[Row]) -> Iterator[dict[str, Any]]:
    """Questions with the answers yes and no, and points with the polygon of the right ones."""

    def point(x_px: float, y_px: float) -> str:
        return f"({x_px / image['width']:.4f}, {y_px / image['height']:.4f})"

    for line in lines:
        category, answer = ROBOSPATIAL.get(line["kind"]), line["answer"]
        question = _rescaled(line["text"], point)
        if category is None or "other_image" in line:
            continue
        if "polygon" in line:
            answer = f"[{', '.join(point(x, y) for x, y in line['polygon'])}]"
            question = f"{question} {POINTS}"
        elif answer not in YES_OR_NO:
            continue
        yield {
            "category": category,
            "question": question,
            "answer": answer,
            "img": image["file_name"],
        }


LAYOUTS: Mapping[str, Callable[[Row, Iterable[Row]], Iterator[dict[str, Any]]]] = {
    "llava": llava,
    "qwen2_5_vl": qwen2_5_vl,
    "qwen3_vl": qwen3_vl,
    "robospatial": robospatial,
}


def resized(width_px: int, height_px: int) -> tuple[int, int]:
    """Width and height of an image as Qwen2.5-VL sees it."""
    sides = [round(side / FACTOR) * FACTOR for side in (width_px, height_px)]
    area = sides[0] * sides[1]
    if area > MOST_PX:
        shrink = math.sqrt(width_px * height_px / MOST_PX)
        sides = [math.floor(s / shrink / FACTOR) * FACTOR for s in (width_px, height_px)]
    elif area < LEAST_PX:
        grow = math.sqrt(LEAST_PX / (width_px * height_px))
        sides = [math.ceil(s * grow / FACTOR) * FACTOR for s in (width_px, height_px)]
    return sides[0], sides[1]


def _qwen(image: Row, lines: Iterable[Row], width: int, height: int) -> Iterator[dict[str, Any]]:
    def scaled(x_px: float, y_px: float) -> list[int]:
        return [round(x_px / image["width"] * width), round(y_px / image["height"] * height)]

    def point(x_px: float, y_px: float) -> str:
        return "({}, {})".format(*scaled(x_px, y_px))

    boxes = {thing["object_id"]: thing.get("bbox") for thing in image["objects"]}

    def ground(line: Row) -> tuple[str, str] | None:
        """Question and answer as a list of boxes or points in JSON."""
        if line["kind"] == "expression":
            (number,) = line["object_ids"]
            if boxes.get(number) is None:
                return None
            left, top, box_width, box_height = boxes[number]
            box = [*scaled(left, top), *scaled(left + box_width, top + box_height)]
            text = _rescaled(line["text"], point)
            found: dict[str, Any] = {"bbox_2d": box, "label": text}
            question = f"Locate {text} and output the bbox coordinates in JSON format."
        elif "points" in line:
            question = _rescaled(line["text"], point)
            found = {"point_2d": scaled(*line["points"][0]), "label": question}
            question = f"{question} Output the point coordinates in JSON format."
        else:
            return None
        return question, f"```json\n[\n\t{json.dumps(found, ensure_ascii=False)}\n]\n```"

    for _, turns in _conversations(image, lines, point, ground):
        yield turns


def _conversations(
    image: Row,
    lines: Iterable[Row],
    point: Scale,
    ground: Callable[[Row], tuple[str, str] | None] | None,
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Id, images and turns: all questions about the image, then each about two images."""
    alone: list[tuple[str, str]] = []
    pairs: list[tuple[Row, tuple[str, str]]] = []
    for line in lines:
        grounded = ground(line) if ground is not None else None
        text, answer = (_rescaled(line[key], point) for key in ("text", "answer"))
        if grounded is not None:
            alone.append(grounded)
        elif line["kind"] == "scene_caption":
            alone.append(("Describe the image.", text))
        elif answer and "other_image" in line:
            pairs.append((line, (text, sentence(answer))))
        elif answer:
            alone.append((text, sentence(answer)))
    number, name = image["image_id"], image["file_name"]
    if alone:
        yield str(number), {"image": name, "conversations": _turns(alone, 1)}
    for k, (line, turn) in enumerate(pairs):
        files = [name, line["other_image"]]
        yield f"{number}-{k}", {"image": files, "conversations": _turns([turn], 2)}


def _turns(said: Iterable[tuple[str, str]], images: int) -> list[dict[str, str]]:
    """Turns of both sides; the first one shows the images."""
    turns: list[dict[str, str]] = []
    for question, answer in said:
        shown = "" if turns else "<image>\n" * images
        turns += [
            {"from": "human", "value": f"{shown}{question}"},
            {"from": "gpt", "value": answer},
        ]
    return turns


def _rescaled(text: str, point: Scale) -> str:
    """A text with its pixels, given by their numbers, in other coordinates: of their centres."""
    return PIXEL.sub(lambda m: point(int(m[1]) + 0.5, int(m[2]) + 0.5), text)
