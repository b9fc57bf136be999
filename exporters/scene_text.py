"""Words in images as ICDAR 2015 and COCO-Text have them.

::

    icdar2015/<split>/images/img_12.png       layout ``icdar2015``: links to the photographs
    icdar2015/<split>/gt/gt_img_12.txt        a line per word: x1,y1,x2,y2,x3,y3,x4,y4,transcription
    coco_text/images/<split>/12.png           layout ``coco_text``: links to the photographs
    coco_text/cocotext.v2.json                ``imgs``, ``anns`` and ``imgToAnns`` by id, ``cats``

Words without a visible character and two-dimensional codes are left out. The region of a word is
the quad of the word; where some of its characters are hidden or outside the image, it covers the
others, and is not readable.

* **icdar2015**: UTF-8 with a byte order mark; whole pixels along the edges of pixels, clockwise
  from the top left of the upright word; ``###`` stands for words that are not readable.
* **coco_text**: ``mask`` is the outline of the visible characters, along their upper edges and back
  along the lower ones: bent words have more than four corners. ``polygon`` is the quad, as in
  version 1. ``bbox`` is left, top, width, height; ``legibility`` ``legible`` or ``illegible`` (with
  an empty ``utf8_string``); ``language`` ``english``, ``not english``, or ``na`` for numbers, codes
  and invented names; ``class`` ``machine printed``, or ``handwritten`` for strokes that only look
  like writing. Further keys tell the true ``text`` with the code of its language,
  ``visible_fraction``, ``height_px`` and ``instance_id`` (0 = background).

Reference: Karatzas et al., "ICDAR 2015 Competition on Robust Reading", challenge 4; Veit et al.,
"COCO-Text", arXiv:1601.07140, and the files of its version 2.
"""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

import cv2
import numpy as np
from pydantic import Field

from gen_data.core import writing
from gen_data.core.capture import Channel
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import ANNOTATION_STRIDE, Sample, TextTruth, WordTruth
from gen_data.core.se3 import Array
from gen_data.exporters import base, fragments, image_files
from gen_data.exporters.conventions import ANY_LENS, EDGES, Conventions
from gen_data.exporters.sensor_selection import photographs, rgb_camera
from gen_data.exporters.sequences import FRAMES, write_frames, write_json, write_text

Layout = Literal["icdar2015", "coco_text"]
UNREADABLE = "###"
LANGUAGES = {"en": "english", writing.NO_LANGUAGE: "na", writing.UNDETERMINED: "na"}
"""COCO-Text's names of languages; all others are ``not english``."""


class SceneText(base.ExporterBase):
    """Words for text detection and recognition: ICDAR 2015 and COCO-Text.

    Attributes:
        layouts: Layouts to write.
    """

    type: Literal["scene_text"] = "scene_text"
    conventions: ClassVar[Conventions] = Conventions(
        pixel_centre="i + 0.5", box=EDGES, lens=ANY_LENS
    )
    annotators: ClassVar[frozenset[str]] = frozenset({"text"})
    own_classes: ClassVar[bool] = True
    image_formats: ClassVar[frozenset[str]] = base.PNG_OR_JPEG
    layouts: tuple[Layout, ...] = Field(("icdar2015", "coco_text"), min_length=1)

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set without photographs.

        Raises:
            ConfigError: no sensor writes the rgb channel.
        """
        rgb_camera(info, "", self.type)

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write a line for each photograph, with its words."""
        self.check(info)
        rows = []
        for sample, sensor in photographs(info, samples):
            lens = sample.truth[sensor].camera.intrinsics
            texts = sample.truth[sensor].texts
            assert texts is not None, "text is in `needs`"
            rows.append(
                {
                    "sample": sample.index,
                    "sensor": sensor,
                    "split": sample.split,
                    "id": sample.image_id(sensor),
                    "size": [lens.width_px, lens.height_px],
                    "suffix": info.encoding(sensor, Channel.RGB).suffix,
                    "words": [_facts(*pair) for pair in seen_words(texts)],
                }
            )
        write_frames(shard_dir / self.type, rows)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Link the photographs, and write the words of each layout."""
        coco: dict[str, Any] = {"info": {"description": "COCO-Text v2 layout"}, "cats": {},
                                "imgs": {}, "anns": {}, "imgToAnns": {}}  # fmt: skip
        for shard_dir, row in fragments.fragment_rows(shard_dirs, self.type, FRAMES):
            if "icdar2015" in self.layouts:
                folder = dataset_dir / "icdar2015" / row["split"]
                name = f"img_{row['id']}"
                image = folder / f"images/{name}{row['suffix']}"
                image_files.link_photograph(info, shard_dir, row, image)
                lines = [icdar_line(word) for word in row["words"]]
                write_text(folder / f"gt/gt_{name}.txt", "\ufeff" + "".join(filter(None, lines)))
            if "coco_text" in self.layouts:
                file = f"{row['split']}/{row['id']}{row['suffix']}"
                image = dataset_dir / "coco_text/images" / file
                image_files.link_photograph(info, shard_dir, row, image)
                _add_image(coco, row, file)
        if "coco_text" in self.layouts:
            write_json(dataset_dir / "coco_text/cocotext.v2.json", coco)


def seen_words(texts: Iterable[TextTruth]) -> Iterator[tuple[TextTruth, WordTruth]]:
    """Words with a visible character, each with its line; codes are left out."""
    for text in texts:
        words = () if text.kind == "code" else text.words
        yield from ((text, word) for word in words if word.visible_fraction > 0.0)


def _facts(text: TextTruth, word: WordTruth) -> dict[str, Any]:
    return {
        "text": word.text,
        "language": text.language,
        "kind": text.kind,
        "quad": region(word).tolist(),
        "outline": outline(word).tolist(),
        "readable": word.readable,
        "visible_fraction": word.visible_fraction,
        "height_px": word.height_px,
        "instance_id": text.instance_id,
    }


def _visible_quads(word: WordTruth) -> Array:
    quads = [c.quad_px for c in word.characters if c.visible_fraction > 0.0]
    return np.array(quads, np.float64)


def region(word: WordTruth) -> Array:
    """Quad of a word [px], [4, 2]; around its visible characters where some are hidden."""
    quads = _visible_quads(word)
    if len(quads) == len(word.characters):
        return np.array(word.quad_px)
    box = cv2.boxPoints(cv2.minAreaRect(quads.reshape(-1, 2).astype(np.float32)))
    if signed_area(box) < 0.0:
        box = box[::-1]
    first = int(np.linalg.norm(box - quads[0, 0], axis=1).argmin())
    return np.asarray(np.round(np.roll(box, -first, axis=0).astype(np.float64), 2))


def outline(word: WordTruth) -> Array:
    """Outline of the visible characters of a word [px], [n, 2], clockwise; its quad if flat."""
    quads = _visible_quads(word)
    across = np.array(word.quad_px[1]) - np.array(word.quad_px[0])
    along = quads[:, 1] - quads[:, 0]
    bend = np.abs(along[:, 0] * across[1] - along[:, 1] * across[0])
    size = np.linalg.norm(along, axis=1) * np.linalg.norm(across)
    if len(quads) == len(word.characters) and (bend <= _FLAT * size).all():
        return np.array(word.quad_px)
    return np.concatenate([quads[:, :2].reshape(-1, 2), quads[::-1, 2:].reshape(-1, 2)])


_FLAT = 0.05
"""Largest sine of the angle between the upper edges of a word and of its characters, if flat."""


def signed_area(points: Array) -> float:
    """Area of a polygon [n, 2] [px^2]; positive if clockwise in the image."""
    u, v = np.asarray(points, np.float64).T
    return float(0.5 * (u * np.roll(v, -1) - np.roll(u, -1) * v).sum())


def icdar_line(word: dict[str, Any]) -> str:
    """The line of a word; empty if its quad vanishes in whole pixels."""
    quad = np.floor(np.array(word["quad"]) + 0.5).astype(int)
    if signed_area(quad) < 1.0:
        return ""
    text = word["text"] if word["readable"] else UNREADABLE
    # Readers take quotation marks around the whole off.
    if text.startswith('"'):
        text = '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
    return ",".join(map(str, quad.reshape(-1).tolist())) + f",{text}\n"


def _add_image(coco: dict[str, Any], row: dict[str, Any], file: str) -> None:
    """Add an image with its words."""
    number, (width, height) = row["id"], row["size"]
    coco["imgs"][str(number)] = {
        "id": number, "file_name": file, "set": row["split"], "width": width, "height": height,
    }  # fmt: skip
    ids = []
    for place, word in enumerate(row["words"], 1):
        points = np.array(word["outline"])
        (x0, y0), (x1, y1) = points.min(axis=0), points.max(axis=0)
        key = (number - 1) * ANNOTATION_STRIDE + place
        ids.append(key)
        coco["anns"][str(key)] = {
            "id": key,
            "image_id": number,
            "bbox": np.round([x0, y0, x1 - x0, y1 - y0], 2).tolist(),
            "mask": points.reshape(-1).tolist(),
            "polygon": [coordinate for corner in word["quad"] for coordinate in corner],
            "area": round(abs(signed_area(points)), 2),
            "class": "handwritten" if word["kind"] == "scribble" else "machine printed",
            "legibility": "legible" if word["readable"] else "illegible",
            "language": LANGUAGES.get(word["language"], "not english"),
            "utf8_string": word["text"] if word["readable"] else "",
            **{k: word[k] for k in ("text", "visible_fraction", "height_px", "instance_id")},
            "language_code": word["language"],
        }
    coco["imgToAnns"][str(number)] = ids
