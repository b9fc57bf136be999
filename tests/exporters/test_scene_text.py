"""Words on disk, by the rules of ICDAR's evaluation and of COCO-Text's programming interface."""

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from shapely.geometry import Polygon

from gen_data.core.capture import Channel
from gen_data.core.sample import CharacterTruth, Sample, TextTruth, WordTruth
from gen_data.exporters.scene_text import SceneText, outline, region
from tests.exporters.datasets import made_of

LINE = re.compile(r"^\s*" + r"(-?[0-9]+)\s*,\s*" * 8 + r"(.*)$")
"""A line of ground truth, as ICDAR's evaluation takes it apart."""


def quad(left: float, top: float, width: float, height: float, lean: float = 0.0) -> Any:
    """A rectangle, its right side lower by ``lean``."""
    right, low = left + width, top + height
    return ((left, top), (right, top + lean), (right, low + lean), (left, low))


def word(text: str, left: float, top: float, *, seen: tuple[float, ...] = (), lean: float = 0.0,
         readable: bool = True) -> WordTruth:  # fmt: skip
    """A word of characters of 8 by 12 px, each lower by ``lean`` than the one before."""
    shown = seen or (1.0,) * max(len(text), 1)
    characters = tuple(
        CharacterTruth(letter, quad(left + 8 * k, top + lean * k, 8, 12, lean), share)
        for k, (letter, share) in enumerate(zip(text or [""], shown, strict=True))
    )
    whole = quad(left, top, 8 * len(characters), 12, lean * len(characters))
    return WordTruth(text, whole, characters, float(np.mean(shown)), 12.0, 2.0, readable)


def line(language: str, *words: WordTruth) -> TextTruth:
    kind = "print" if words[0].text else "scribble"
    return TextTruth(" ".join(w.text for w in words), language, kind, words[0].quad_px, "sign", 3,
                     1.0, True, words)  # fmt: skip


LINES = (
    line(
        "de",
        word("Am", 10.25, 20.5),
        word('"Markt"', 40.0, 20.0),
        word("gone", 70, 20, seen=(0.0,) * 4),
    ),
    line("zxx", word("B-AB,12", 20, 50, lean=3.0)),
    line("en", word("HALF", 80, 70, seen=(1.0, 0.7, 0.0, 0.0), readable=False)),
    line("zxx", word("", 100.0, 100.0, readable=False)),
)


def written(world: Any) -> list[Sample]:
    """The frames with four lines each, moved by a pixel from frame to frame."""

    def moved(truth: Any, k: int) -> Any:
        def shift(q: Any) -> Any:
            return tuple((u + k, v) for u, v in q)

        texts = tuple(
            replace(t, quad_px=shift(t.quad_px), words=tuple(
                replace(w, quad_px=shift(w.quad_px), characters=tuple(
                    replace(c, quad_px=shift(c.quad_px)) for c in w.characters))
                for w in t.words))
            for t in LINES
        )  # fmt: skip
        return replace(truth, texts=texts)

    return [
        replace(s, truth={name: moved(t, s.index) for name, t in s.truth.items()})
        for s in world.samples
    ]


def texts(world: Any) -> tuple[Any, list[Sample]]:
    return world.info(7), written(world)


folder = made_of(SceneText(), texts)


def icdar(folder: Path) -> Iterator[tuple[int, Path, list[tuple[Any, str]]]]:
    """Number, photograph, and quads with transcriptions of each file."""
    for file in sorted(folder.glob("icdar2015/*/gt/gt_img_*.txt")):
        data = file.read_bytes()
        assert data.startswith(b"\xef\xbb\xbf")
        found = []
        for text in data.decode("utf-8-sig").splitlines():
            match = LINE.match(text)
            assert match, text
            content = match[9]
            quoted = re.match(r'^\s*"(.*)"\s*$', content)
            if quoted:
                content = quoted[1].replace("\\\\", "\\").replace('\\"', '"')
            points = np.array(match.groups()[:8], float).reshape(4, 2)
            # Clockwise in the image, as the evaluation requires.
            after = np.roll(points, -1, axis=0)
            assert ((after[:, 0] - points[:, 0]) * (after[:, 1] + points[:, 1])).sum() < 0.0
            found.append((points, content))
        number = int(re.fullmatch(r"gt_img_([0-9]+)\.txt", file.name)[1])  # type: ignore[index]
        yield number, file.parents[1] / f"images/img_{number}.png", found


def problems(folder: Path, samples: Any) -> None:
    """Words and photographs are as in the samples."""
    seen = list(icdar(folder))
    assert len(seen) == len(samples)
    for sample in samples:
        (found,) = [s for s in seen if s[0] == sample.image_id("color")]
        image = cv2.imread(str(found[1]))[..., ::-1]
        np.testing.assert_array_equal(image, sample.capture.readings["color"].channels[Channel.RGB])
        expected = [w for t in sample.truth["color"].texts for w in t.words if w.visible_fraction]
        assert [c for _, c in found[2]] == [w.text if w.readable else "###" for w in expected]
        for (points, _), truth in zip(found[2], expected, strict=True):
            if truth.readable:
                assert np.abs(points - truth.quad_px).max() <= 0.5


def test_icdar_has_a_line_per_visible_word_with_its_quad_in_whole_pixels(
    folder: Path, world: Any
) -> None:
    problems(folder, written(world))


def score(truth: list[tuple[Any, str]], found: list[tuple[Any, str]]) -> float:
    """Harmonic mean of precision and recall: pairs of an IoU over 0.5, without ``###``."""
    care = [Polygon(q) for q, text in truth if text != "###"]
    blank = [Polygon(q) for q, text in truth if text == "###"]
    own = [Polygon(q) for q, _ in found]
    own = [p for p in own if not any(p.intersection(b).area > 0.5 * p.area for b in blank)]
    free, matched = set(range(len(own))), 0
    for polygon in care:
        for k in sorted(free):
            if polygon.intersection(own[k]).area / polygon.union(own[k]).area > 0.5:
                free.discard(k)
                matched += 1
                break
    return 2.0 * matched / (len(care) + len(own))


def test_truth_as_prediction_scores_perfectly_and_moved_by_half_a_word_worse(folder: Path) -> None:
    for _, _, found in icdar(folder):
        assert len(found) == 5
        assert score(found, found) == 1.0
        assert score(found, [(np.add(q, (0.0, 6.0)), t) for q, t in found]) < 0.5


class CocoText:
    """The file as COCO-Text's interface indexes it: by whole numbers, with lists of annotations."""

    def __init__(self, path: Path) -> None:
        data = json.loads(path.read_text("utf-8"))
        self.images = {int(k): v for k, v in data["imgs"].items()}
        self.words = {int(k): v for k, v in data["anns"].items()}
        self.of_image = {int(k): v for k, v in data["imgToAnns"].items()}
        assert data["cats"] == {} and data["info"]

    def select(self, image: int, **properties: str) -> list[Any]:
        words = (self.words[k] for k in self.of_image[image])
        return [w for w in words if all(w[k] == v for k, v in properties.items())]


def test_coco_text_selects_words_by_legibility_language_and_class(folder: Path, world: Any) -> None:
    read = CocoText(folder / "coco_text/cocotext.v2.json")
    assert set(read.images) == {s.image_id("color") for s in world.samples}
    for number, image in read.images.items():
        assert (folder / "coco_text/images" / image["file_name"]).exists()
        assert image["set"] in image["file_name"] and image["id"] == number
        legible = read.select(number, legibility="legible")
        assert [w["utf8_string"] for w in legible] == ["Am", '"Markt"', "B-AB,12"]
        assert [w["language"] for w in legible] == ["not english", "not english", "na"]
        hidden, scribble = read.select(number, legibility="illegible")
        assert (hidden["utf8_string"], hidden["text"]) == ("", "HALF")
        assert hidden["language"] == "english" and hidden["visible_fraction"] < 0.5
        assert scribble["class"] == "handwritten" and hidden["class"] == "machine printed"
        for key in read.of_image[number]:
            one = read.words[key]
            assert one["id"] == key and one["image_id"] == number and one["instance_id"] == 3
            polygon = Polygon(np.reshape(one["mask"], (-1, 2)))
            assert polygon.is_valid and polygon.area == pytest.approx(one["area"], abs=0.01)
            x, y, w, h = one["bbox"]
            assert polygon.bounds == pytest.approx((x, y, x + w, y + h))


def test_a_bent_word_has_an_outline_along_its_characters_and_a_hidden_part_has_none(
    folder: Path, world: Any
) -> None:
    read = CocoText(folder / "coco_text/cocotext.v2.json")
    first = read.select(world.samples[0].image_id("color"))
    bent = replace(word("ARCH", 0, 0), characters=tuple(
        CharacterTruth(c, quad(8 * k, (0, -3, -3, 0)[k], 8, 12, (-3, 0, 0, 3)[k]), 1.0)
        for k, c in enumerate("ARCH")))  # fmt: skip
    points = outline(bent)
    assert len(points) == 16 and Polygon(points).is_valid
    whole = Polygon(points)
    assert all(whole.covers(Polygon(c.quad_px).buffer(-0.01)) for c in bent.characters)
    assert np.array_equal(region(bent), bent.quad_px)
    # Of HALF the first two characters.
    half = Polygon(np.reshape(first[3]["mask"], (-1, 2)))
    assert half.bounds == (80.0, 70.0, 96.0, 82.0)
