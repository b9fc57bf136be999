"""The page of a report: figures, checks, near-duplicates, and that it is closed to the outside."""

import base64
import hashlib
import json
from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from gen_data.cli.report_command import report
from gen_data.core.boxes import BoxPx
from gen_data.core.errors import ConfigError, StorageError
from gen_data.core.sample import KeypointTruth, MaskPx, ObjectTruth
from gen_data.report.html_page import format_page
from gen_data.report.image_statistics import DISTANCE_MAX, ImageFile, group_duplicates, measure_look
from gen_data.report.label_checks import CHECKS, LabelChecks
from gen_data.report.report_data import describe_dataset, without_pictures
from gen_data.report.sample_browser import evenly_spread
from gen_data.report.stored_labels import read_images
from gen_data.runner.stored import StoredSamples
from tests.report.handmade import HOSTILE, HOSTILE_NAME, make_image, make_object, write_dataset

Json = dict[str, Any]


@pytest.fixture(scope="module")
def hand(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five samples: the fourth is empty, the last has the image of the first, a little darker."""
    rng = np.random.default_rng(1)
    samples = [[make_object(1, "car"), make_object(2, HOSTILE_NAME, 40, 4)],
               [make_object(1, "car", side_px=16)],
               [make_object(1, "car"), make_object(2, "car", 40)], [],
               [make_object(1, HOSTILE_NAME)]]  # fmt: skip
    images = [make_image(rng) for _ in samples]
    images[4] = (images[0] * 0.8).astype(np.uint8)
    folder = tmp_path_factory.mktemp("hand") / HOSTILE_NAME
    return write_dataset(folder, samples, ("bus", "car", HOSTILE_NAME), images)


@pytest.fixture(scope="module")
def described(hand: Path) -> Json:
    return describe_dataset(hand, scenes_max=0)


def test_figures_viewpoints_and_duplicates_are_those_of_data(described: Json, hand: Path) -> None:
    """Counted on paper; brightness by OpenCV from the files."""
    assert described["counts"] == {"images": 5, "objects": 6}
    assert described["splits"] == {"val": 2, "train": 3}
    counted = {row["name"]: (row["objects"], row["images"]) for row in described["categories"]}
    assert counted == {"bus": (0, 0), "car": (4, 3), HOSTILE_NAME: (2, 2)}
    (sizes,) = (h for h in described["labels"] if h["title"].startswith("Size of the box"))
    # Sides of 8, 16, 8 and 8 px; edges are 0, 8, 16, 32.
    assert sizes["counts"]["car"][:3] == [0, 3, 1] and sizes["counts"][HOSTILE_NAME][:2] == [1, 1]
    (points,) = (h for h in described["labels"] if h["title"].startswith("Laser points"))
    assert points["counts"]["car"][points["edges"].index(10.0)] == 4  # 7 + 4 points each
    (bright,) = (h for h in described["images"] if h["title"].startswith("Brightness"))
    paths = sorted(hand.rglob("rgb/*.png"))
    means = [cv2.imread(str(p), cv2.IMREAD_GRAYSCALE).mean() / 255.0 for p in paths]
    assert bright["counts"]["color"] == np.histogram(means, bright["edges"])[0].tolist()
    assert described["rejected_layouts"] == 2
    assert described["licences"][0]["assets"] == "cube, a | b"
    # The cubes turn their +Z to the camera: elevations are near 90 degrees, the last row.
    cells = np.array(described["viewpoints"]["counts"]["car"])
    assert cells.sum() == 4
    assert cells[:, -1].sum() == 4
    # A darker copy is found, in its split.
    found = described["duplicates"]
    assert (found["groups"], found["grouped"]) == (1, 2)
    (group,) = found["shown"]
    assert [m["index"] for m in group["members"]] == [0, 4]
    assert group["splits"] == ["val"]
    assert group["members"][0]["picture"].startswith("data:image/jpeg;base64,/9j/")


def test_the_browser_has_every_image_of_a_small_data_set(described: Json) -> None:
    """Masks are numbers of objects; boxes and edges are in pixels of the image."""
    assert [image["index"] for image in described["browser"]] == [0, 1, 2, 3, 4]
    first = described["browser"][0]
    encoded = base64.b64decode(first["pictures"]["masks"].partition(",")[2])
    masks = cv2.imdecode(np.frombuffer(encoded, np.uint8), cv2.IMREAD_GRAYSCALE)
    assert (masks[24, 24], masks[22, 41], masks[0, 0]) == (1, 2, 0)
    assert first["objects"][0]["box"] == [20, 20, 28, 28]
    assert len(first["objects"][0]["edges"]) == 12
    assert np.abs(np.reshape(first["objects"][0]["edges"], (-1, 2)).mean(axis=0) - 24).max() < 1
    depth = base64.b64decode(first["pictures"]["depth"].partition(",")[2])
    assert np.ptp(cv2.imdecode(np.frombuffer(depth, np.uint8), cv2.IMREAD_GRAYSCALE)) == 0
    points = np.frombuffer(base64.b64decode(first["points"]), "<u2").reshape(-1, 3)
    # The focal length is 32 px / tan(30 degrees); the point behind the camera is not shown.
    assert points[:, :2].tolist() == [[32, 24], [32 + int(55.4 * 0.025), 24 + int(55.4 * 0.05)]]
    text = json.dumps(without_pictures(described))
    assert "base64" not in text and '"objects"' in text


class Page(HTMLParser):
    """Tags of a page, and the texts of its scripts and styles."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.raw: dict[str, list[str]] = {"script": [], "style": []}
        self._inside = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        self._inside = tag
        if tag in self.raw:
            self.raw[tag].append("")

    def handle_endtag(self, tag: str) -> None:
        self._inside = ""

    def handle_data(self, data: str) -> None:
        if self._inside in self.raw:
            self.raw[self._inside][-1] += data


def test_hostile_names_stay_text_and_the_policy_permits_one_script_only(described: Json) -> None:
    """A browser's parser finds our two scripts and no other tag; the data is unchanged."""
    text = format_page([described])
    page = Page(text)
    assert [tag for tag, _ in page.tags].count("script") == 2
    assert not [tag for tag, _ in page.tags if tag == "img"]
    assert not [name for _, attributes in page.tags for name in attributes if name[:2] == "on"]
    assert json.loads(page.raw["script"][0]) == [json.loads(json.dumps(described))]
    assert HOSTILE not in text
    assert HOSTILE_NAME not in text
    # Digests of both, images in ``data:`` URLs, and no address of any other place.
    (policy,) = (a["content"] for t, a in page.tags if a.get("http-equiv"))
    rules = dict(rule.strip().split(" ", 1) for rule in str(policy).split(";"))

    def digest(part: str) -> str:
        return "'sha256-" + base64.b64encode(hashlib.sha256(part.encode()).digest()).decode() + "'"

    assert rules["default-src"] == "'none'" and rules["img-src"] == "data:"
    assert rules["script-src"] == digest(page.raw["script"][1])
    assert rules["style-src"] == digest(page.raw["style"][0])
    assert set(rules) == {
        "default-src", "img-src", "script-src", "style-src", "base-uri", "form-action",
    }  # fmt: skip
    # The script creates SVG by its namespace, which is a name and no address to load.
    assert text.replace("http://www.w3.org/2000/svg", "").count("http") == 1  # http-equiv


def _resize(box: BoxPx | None, **corners: int) -> BoxPx:
    assert box is not None
    return replace(box, **corners)


DAMAGE: dict[str, Callable[[ObjectTruth], ObjectTruth]] = {
    "Box without area, or without visible pixels": lambda o: replace(o, box=None, mask=None),
    "Box outside the image": lambda o: replace(
        o, box=BoxPx(60, 20, 68, 28), amodal_box=None, mask=None, box3d_camera=None
    ),
    "Box differs from the tight box of the mask": lambda o: replace(
        o, mask=MaskPx(21, 20, np.ones((8, 8), bool))
    ),
    "Mask differs from the number of visible pixels": lambda o: replace(o, visible_px=63),
    "Box of visible pixels exceeds the amodal box": lambda o: replace(
        o, amodal_box=_resize(o.amodal_box, x_min=21)
    ),
    "Fractions contradict each other": lambda o: replace(o, occlusion=0.5),
    "Labelled keypoint outside the image": lambda o: replace(
        o, keypoints=(KeypointTruth("nose", (0.0, 0.0, 1.0), (64.5, 3.0), 1),)
    ),
    "2D box exceeds the projected 3D box": lambda o: replace(
        o, box=_resize(o.box, x_max=40), amodal_box=None, mask=None
    ),
}


def contradictions(folder: Path, *objects: ObjectTruth) -> list[Any]:
    """Checks that find something in a data set of one image."""
    write_dataset(folder, [objects], ("car",), [np.zeros((48, 64, 3), np.uint8)])
    checks = LabelChecks()
    for labels in read_images(StoredSamples(folder)):
        checks.add(labels)
    return [result for result in checks.results if result.found]


@pytest.mark.parametrize("title", CHECKS)
def test_each_check_finds_its_contradiction_and_no_other(tmp_path: Path, title: str) -> None:
    """One damaged object next to an intact one."""
    damaged = DAMAGE[title](make_object(1, "car"))
    (result,) = contradictions(tmp_path / "set", damaged, make_object(2, "car"))
    assert (result.title, result.found) == (title, 1)
    (finding,) = result.examples
    assert (finding.index, finding.instance_id) == (0, 1)


def test_mirrors_may_exceed_the_3d_box(tmp_path: Path) -> None:
    """Where labels leave them out, the 2D box is compared with the whole geometry's."""
    thing = make_object(1, "car")
    assert thing.box3d_camera is not None
    side_m = thing.box3d_camera.size_m[0]
    half = (0.5 * side_m,) * 3
    whole = replace(
        thing.instance,
        T_world_instance=thing.box3d_camera.T_frame_box,
        box_min_m=(-half[0], -half[1], -half[2]),
        box_max_m=half,
        body_bounds_m=((-half[0], -0.3 * half[1], -half[2]), (half[0], 0.3 * half[1], half[2])),
    )
    narrow = replace(thing.box3d_camera, size_m=(side_m, 0.3 * side_m, side_m))
    labelled = replace(thing, instance=whole, box3d_camera=narrow)
    too_small = replace(labelled, instance=replace(whole, box_max_m=(0.0, *half[1:])))
    assert contradictions(tmp_path / "good", labelled) == []
    (result,) = contradictions(tmp_path / "bad", too_small)
    assert result.title == "2D box exceeds the projected 3D box"


def test_all_pairs_of_near_hashes_are_found_but_of_one_scene_or_another_content() -> None:
    """As by comparing all pairs: components of the graph of pairs at most 4 bits apart."""
    rng = np.random.default_rng(7)
    centers = rng.integers(0, 2**63, 40, dtype=np.uint64)
    flips = [1 << int(b) for b in rng.integers(0, 64, 400)]
    hashes = [int(centers[k % 40]) ^ flips[k] ^ flips[-k] for k in range(200)]
    files = [ImageFile(k, "color", k, "train", Path(str(k))) for k in range(200)]
    groups = group_duplicates(files, hashes)
    apart = np.array([[(a ^ b).bit_count() for b in hashes] for a in hashes])
    reach = apart <= DISTANCE_MAX
    for _ in range(8):
        reach = reach @ reach
    expected = {tuple(np.flatnonzero(row).tolist()) for row in reach if row.sum() > 1}
    assert {group.members for group in groups} == expected
    assert len(expected) == 40
    # Views and instants look alike by design.
    files = [ImageFile(k, "color", 5, "train", Path(str(k))) for k in range(3)]
    assert group_duplicates(files, [9, 9, 9]) == []
    # Half the bits of unrelated images differ.
    rng = np.random.default_rng(3)
    one, other = (cv2.cvtColor(make_image(rng), cv2.COLOR_BGR2GRAY) for _ in range(2))
    small = cv2.resize((one * 0.7).astype(np.uint8), (48, 36), interpolation=cv2.INTER_AREA)
    assert (measure_look(one).hash ^ measure_look(small).hash).bit_count() <= DISTANCE_MAX
    assert (measure_look(one).hash ^ measure_look(other).hash).bit_count() > 16


@pytest.mark.parametrize("count", [0, 1, 2, 7, 64, 1000])
def test_images_are_spread_evenly(count: int) -> None:
    """All numbers occur once; the first 16 leave gaps of at most two sixteenths."""
    order = list(evenly_spread(count))
    assert sorted(order) == list(range(count))
    if count >= 64:
        chosen = np.sort([*order[:16], count])
        assert np.diff(chosen).max() <= 2 * count / 16


def test_the_page_of_a_data_set_is_in_its_run_folder(hand: Path) -> None:
    """The figures are in the same folder; a second data set is shown in the same page."""
    done = CliRunner().invoke(report, [str(hand), "--compare", str(hand), "--scenes", "0"])
    assert done.exit_code == 0, done.output
    folder = hand / "run/report"
    page = Page((folder / "index.html").read_text(encoding="utf-8"))
    figures = json.loads((folder / "index.json").read_text(encoding="utf-8"))["sets"]
    assert len(json.loads(page.raw["script"][0])) == len(figures) == 2
    assert figures[0]["counts"] == {"images": 5, "objects": 6}


def test_bad_input_has_one_clear_message(hand: Path, tmp_path: Path) -> None:
    """A negative number, an unfinished data set, a damaged line, a missing image."""
    negative = CliRunner().invoke(report, [str(hand), "--scenes", "-1"])
    assert isinstance(negative.exception, ConfigError)
    folder = write_dataset(tmp_path / "set", [[]], ("car",), [np.zeros((48, 64, 3), np.uint8)])
    (next(folder.rglob("rgb/*.png"))).write_bytes(b"")
    with pytest.raises(StorageError, match=r"000000000.png: cannot be read"):
        describe_dataset(folder, scenes_max=0)
    (folder / "shards/000000/labels.jsonl").write_text("{}\n")
    with pytest.raises(StorageError, match=r"labels.jsonl: its labels cannot be read"):
        describe_dataset(folder, scenes_max=0)
    (folder / "manifest.json").unlink()
    with pytest.raises(StorageError, match="the data set is unfinished"):
        describe_dataset(folder, scenes_max=0)


@pytest.mark.slow
def test_the_page_of_a_large_data_set_is_bounded(tmp_path: Path) -> None:
    """The browser has a limited number of images, and a limited size; figures count all images."""
    rng = np.random.default_rng(2)
    objects = [make_object(1, "car")]
    small = write_dataset(tmp_path / "small", [objects] * 110, ("car",), [make_image(rng)])
    noise = [rng.integers(0, 256, (480, 640, 3), dtype=np.uint8)]  # compresses worst
    large = write_dataset(tmp_path / "large", [objects] * 40, ("car",), noise)
    many, heavy = (describe_dataset(folder, scenes_max=0) for folder in (small, large))
    assert len(many["browser"]) == 96 and many["counts"]["images"] == 110
    assert many["duplicates"]["grouped"] == 110
    assert len(heavy["browser"]) < 40
    assert 8_000_000 < len(format_page([heavy])) < 15_000_000
