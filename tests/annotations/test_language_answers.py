"""Answers of the annotation ``language``, recomputed from the files of finished data sets.

Poses, boxes, cameras and surfaces come from ``labels.jsonl`` and ``scenes.jsonl``, pixels from the
instance images. Formulas are independent: rotations by SciPy, gaps of outlines by support
functions, distances in images by SciPy's distance transform, the reach of the arm from its maker's
dimensions.
"""

import json
import math
import re
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt, find_objects
from scipy.spatial.transform import Rotation

import gen_data

TABLE = """
extends: tabletop.yaml
seed: 3
views_per_scene: 3
without: {randomizers: [finish, cover, tabletop, colors, room, surroundings, distractors]}
shared: {robot: franka_panda}
randomizers: [{name: clutter, count: 8}]
sensors: [{name: color, size_px: [320, 240]}]
"""
ROOM = """
extends: rooms.yaml
shared: {room: bathroom}
views_per_scene: 2
sensors: [{name: color, size_px: [320, 240]}]
"""
STREET = """
extends: street_sequence.yaml
steps_per_scene: 2
step_s: 1.5
shared: {district: arterial}
sensors:
  - {name: color, size_px: [640, 192]}
  - {type: rgb_camera, name: high, rig: ego, offset_m: [-3, 0.5, 2.6], size_px: [640, 192],
     hfov_deg: 80, channels: [rgb, depth, instance]}
"""
ANGLES = np.linspace(0.0, math.pi, 20_001)
PANDA_SHOULDER_M = (0.0, 0.0, 0.333)
PANDA_REACH_M = (
    math.hypot(0.316, 0.0825) + math.hypot(0.384, 0.0825) + math.hypot(0.088, 0.107 + 0.1034)
)
"""Franka Robotics' Denavit-Hartenberg parameters: d1; the upper arm, the forearm, and the hand with
its fingers, each from joint to joint; the elbow's limits allow all three in one line."""
PIXEL = re.compile(r"\((\d+), (\d+)\)")
VAR_PX = 1.0 / 12.0
"""Variance of a number that is rounded to whole pixels."""


@dataclass(frozen=True)
class Frame:
    """One image of a data set, and its labels in the files."""

    shard: Path
    sensor: str
    label: dict[str, Any]
    scene: dict[str, Any]
    first: "Frame | None"

    @cached_property
    def spoken(self) -> set[int]:
        """Objects that the texts about the image name."""
        return {n for said in self.truth["utterances"] for n in said["instances"]}

    @property
    def truth(self) -> dict[str, Any]:
        found: dict[str, Any] = self.label["truth"][self.sensor]
        return found

    @cached_property
    def ids(self) -> Any:
        name = f"{self.sensor}/instance/{self.label['index']:09d}.png"
        return cv2.imread(str(self.shard / name), cv2.IMREAD_UNCHANGED)

    @cached_property
    def instances(self) -> dict[int, dict[str, Any]]:
        own = {o["instance"]["instance_id"]: o["instance"] for o in self.truth["objects"]
               if isinstance(o["instance"], dict)}  # fmt: skip
        return {i["instance_id"]: i for i in self.scene["instances"]} | own

    def eye(self, sensor: str = "") -> Any:
        camera = self.label["truth"][sensor or self.sensor]["camera"]
        return np.array(camera["T_world_camera"]["translation_m"])

    @cached_property
    def _corners(self) -> dict[int, Any]:
        return {}

    def corners(self, number: int) -> Any:
        """Corners of the 3D box of an instance [8, 3]: the geometry inside its annotated bounds."""
        if number not in self._corners:
            i = self.instances[number]
            low, high = np.array(i["box_min_m"]), np.array(i["box_max_m"])
            if i["body_bounds_m"] is not None:
                inner_low, inner_high = i["body_bounds_m"]
                low, high = np.maximum(low, inner_low), np.minimum(high, inner_high)
            grid = np.array(np.meshgrid(*zip(low, high, strict=True), indexing="ij"))
            turned_m = rotation(i["T_world_instance"]).apply(grid.reshape(3, 8).T)
            self._corners[number] = turned_m + i["T_world_instance"]["translation_m"]
        return self._corners[number]

    def center(self, number: int) -> Any:
        return self.corners(number).mean(0)

    def apart(self, number: int) -> float:
        return float(np.linalg.norm(self.center(number) - self.eye()))

    @cached_property
    def boxes(self) -> Any:
        return find_objects(self.ids)

    def box(self, number: int) -> Any:
        rows, columns = self.boxes[number - 1]
        return columns.start, rows.start, columns.stop, rows.stop

    def sigma(self, number: int, direction: Any) -> float:
        """Variance [m^2] of a point of an object along a direction."""
        x0, y0, x1, y1 = self.box(number)
        lens = self.truth["camera"]["intrinsics"]
        v = (0.5 * (y0 + y1) - lens["cy_px"]) / lens["fy_px"]
        us = [(0.5 * (x0 + x1) + s - lens["cx_px"]) / lens["fx_px"] for s in (-0.5, 0.5)]
        a, b = (np.array([u, v, 1.0]) / math.sqrt(u * u + v * v + 1.0) for u in us)
        pixel_rad = math.atan2(float(np.linalg.norm(np.cross(a, b))), float(a @ b))
        ray = self.center(number) - self.eye()
        away = float(np.linalg.norm(ray))
        along = float(ray @ direction / away) ** 2
        depth = away**2 * 2.0 * VAR_PX / ((x1 - x0) ** 2 + (y1 - y0) ** 2)
        return float((away * pixel_rad) ** 2 * VAR_PX * (1.0 - along) + depth * along)

    def ahead(self, number: int) -> Any:
        ray = self.center(number) - self.eye()
        return ray / np.linalg.norm(ray)

    def hidden(self, number: int) -> tuple[Any, int, float]:
        """Ids that cover the silhouette, its pixels, and the resolution of an area [px]."""
        (o,) = [o for o in self.truth["objects"] if number_of(o) == number]
        mask = o["amodal_mask"]
        height, width = mask["pixels"]["size"]
        runs = mask["pixels"]["runs"]
        whole = np.repeat(np.arange(len(runs)) % 2 == 1, runs).reshape(height, width)
        crop = self.ids[mask["y_px"] : mask["y_px"] + height, mask["x_px"] : mask["x_px"] + width]
        covered = crop[whole & (crop != number)]
        return covered, int(whole.sum()), 2.0 * math.sqrt(VAR_PX * 2.0 * (width + height))


def number_of(item: dict[str, Any]) -> int:
    own = item["instance"]
    return int(own["instance_id"] if isinstance(own, dict) else own)


def rotation(pose: dict[str, Any]) -> Rotation:
    w, x, y, z = pose["quaternion_wxyz"]
    return Rotation.from_quat([x, y, z, w])


def unit(v: Any) -> Any:
    length = np.linalg.norm(v)
    return v / length if length > 0.0 else np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Result:
    """A recomputed answer; ``least`` is its resolution, ``holds`` if the first form is true."""

    numbers: tuple[float, ...]
    margin: float
    least: float
    holds: bool | None = None


UP = np.array([0.0, 0.0, 1.0])


def length(f: Frame, vector: Any, *ids: int) -> Result:
    value = float(np.linalg.norm(vector))
    variance = sum(f.sigma(n, unit(vector)) for n in ids)
    return Result((value,), 0.1 * value, 2.0 * math.sqrt(variance))


def compared(f: Frame, a: float, b: float, variance: float, less: bool = True) -> Result:
    return Result((a, b), abs(a - b), 2.0 * math.sqrt(variance), (a < b) == less)


def sides(f: Frame, n: int) -> tuple[Any, Any, Any]:
    """The vertical edge of an upright box, and its longer and shorter horizontal ones [m]."""
    c = f.corners(n)
    edges = sorted((c[4] - c[0], c[2] - c[0], c[1] - c[0]), key=lambda e: -abs(unit(e)[2]))
    long, wide = sorted(edges[1:], key=lambda e: -float(np.linalg.norm(e)))
    assert abs(unit(edges[0])[2]) > math.cos(math.radians(1.001))
    return edges[0], long, wide


def tall(f: Frame, n: int) -> float:
    return float(np.linalg.norm(sides(f, n)[0]))


def support(points: Any) -> tuple[Any, Any]:
    """Least and largest extent of an outline along all horizontal directions."""
    along = points[:, :2] @ np.stack([np.cos(ANGLES), np.sin(ANGLES)])
    return along.min(0), along.max(0)


def clearance(f: Frame, a: int, b: int, c: int) -> Result:
    (a0, a1), (b0, b1), (c0, c1) = (support(f.corners(n)) for n in (a, b, c))
    free = np.maximum(b0 - a1, a0 - b1)
    k = int(free.argmax())
    gap, width = float(free[k]), float((c1 - c0).min())
    across = np.array([math.cos(ANGLES[k]), math.sin(ANGLES[k]), 0.0])
    variance = sum(f.sigma(n, across) for n in (a, b, c, c))
    return Result((gap, width), abs(gap - width), 2.0 * math.sqrt(variance), width <= gap)


def order(f: Frame, numbers: tuple[int, ...], name: str) -> Result:
    if name == "left to right":
        boxes = [f.box(n) for n in numbers]
        values = [0.5 * (b[0] + b[2]) for b in boxes]
        margin = min(b[0] - a[2] for a, b in pairwise(boxes))
        return Result(tuple(values), margin, 2.0 * math.sqrt(2.0 * VAR_PX))
    values = [f.apart(n) if "nearest" in name else float(f.center(n)[2]) for n in numbers]
    spread = [f.sigma(n, f.ahead(n) if "nearest" in name else UP) for n in numbers]
    steps = [(b - a, u + v) for a, b, u, v in
             zip(values, values[1:], spread, spread[1:], strict=False)]  # fmt: skip
    return Result(tuple(values), min(steps)[0], 2.0 * math.sqrt(min(steps)[1]))


def nearest(f: Frame, numbers: tuple[int, ...], rank: str) -> Result:
    k = ("nearest to", "second nearest to", "farthest from").index(rank)
    near = sorted(numbers, key=f.apart)
    assert near[k] == numbers[0]
    ranges = [f.apart(n) for n in near]
    gaps = [(ranges[i + 1] - ranges[i], i) for i in (0, 1) if k in (i, i + 1)]
    margin, i = min(gaps)
    variance = sum(f.sigma(n, f.ahead(n)) for n in near[i : i + 2])
    return Result(tuple(ranges), margin, 2.0 * math.sqrt(variance))


def nearest_to(f: Frame, numbers: tuple[int, ...]) -> Result:
    one, two, to = numbers
    vectors = [f.center(n) - f.center(to) for n in (one, two)]
    a, b = (float(np.linalg.norm(v)) for v in vectors)
    assert a < b
    variance = sum(f.sigma(n, unit(v)) + f.sigma(to, unit(v))
                   for n, v in zip((one, two), vectors, strict=True))  # fmt: skip
    return Result((a, b), b - a, 2.0 * math.sqrt(variance))


def reach(f: Frame, n: int) -> Result:
    (arm,) = f.scene["articulations"]
    base = arm["T_world_base"]
    shoulder = rotation(base).apply(PANDA_SHOULDER_M) + base["translation_m"]
    offset = f.center(n) - shoulder
    far = float(np.linalg.norm(offset))
    least = 2.0 * math.sqrt(f.sigma(n, unit(offset)))
    return Result((far, PANDA_REACH_M), abs(far - PANDA_REACH_M), least, far <= PANDA_REACH_M)


def spot(f: Frame, mask: Any, point: tuple[float, float]) -> Result:
    """The pixel is of the mask and as far from its outside as any."""
    inner = distance_transform_edt(np.pad(mask, 1))[1:-1, 1:-1]
    x, y = (math.floor(v) for v in point)
    assert mask[y, x]
    assert inner[y, x] == pytest.approx(inner.max(), abs=1e-3)
    return Result(point, float(inner[y, x]) - 0.5, 2.0 * math.sqrt(VAR_PX))


def bare(f: Frame, table: int, about: tuple[int, ...], side: str) -> Any:
    """Pixels that show the top of a table, or the part next to an object."""
    (top,) = [s for s in f.scene["surfaces"] if s["body"] in
              {b["name"] for b in f.scene["bodies"] if b["instance_id"] == table}]  # fmt: skip
    lens = f.truth["camera"]["intrinsics"]
    pose = f.truth["camera"]["T_world_camera"]
    v, u = np.nonzero(f.ids == table)
    x, y = (u + 0.5 - lens["cx_px"]) / lens["fx_px"], (v + 0.5 - lens["cy_px"]) / lens["fy_px"]
    rays = np.stack([x, y, np.ones(len(u))], axis=1)
    world = rotation(pose).apply(rays)
    plane = top["T_world_surface"]
    depth = (plane["translation_m"][2] - f.eye()[2]) / world[:, 2]
    local = rotation(plane).inv().apply(f.eye() + world * depth[:, None] - plane["translation_m"])
    mask = np.zeros(f.ids.shape, bool)
    mask[v, u] = (depth > 0) & (np.abs(local[:, :2]) <= 0.5 * np.array(top["size_m"])).all(1)
    if about:
        x0, y0, x1, y1 = f.box(about[0])
        part = np.zeros_like(mask)
        part[
            y0:y1, slice(max(2 * x0 - x1, 0), x0) if side == "left" else slice(x1, 2 * x1 - x0)
        ] = True
        mask &= part
    return mask


def occlusion(f: Frame, n: int) -> Result:
    covered, whole, least = f.hidden(n)
    return Result((len(covered), whole), len(covered) or least, least, len(covered) > 0)


def hiders(f: Frame, numbers: tuple[int, ...]) -> Result:
    covered, _, least = f.hidden(numbers[0])
    counts = Counter(covered.tolist())
    assert set(counts) == set(numbers[1:])
    values = tuple(float(counts[n]) for n in numbers[1:])
    assert list(values) == sorted(values, reverse=True)
    return Result(values, min(values), least)


def counted(f: Frame, numbers: tuple[int, ...], most: bool) -> Result:
    (category,) = {f.instances[n]["category"] for n in numbers}
    shown = {int(n) for n in np.unique(f.ids) if n and f.instances[int(n)]["category"] == category}
    assert shown == set(numbers)
    if not most:
        px = min(int((f.ids == n).sum()) for n in numbers)
        boxes = [f.box(n) for n in numbers]
        least = max(2.0 * math.sqrt(VAR_PX * 2.0 * (b[2] - b[0] + b[3] - b[1])) for b in boxes)
        return Result((len(numbers),), px, least)
    found = [f.hidden(n) for n in numbers]
    shares = [len(c) / whole for c, whole, _ in found]
    least = max(u / whole for _, whole, u in found)
    return Result((sum(s > 0.5 for s in shares), *shares), min(abs(s - 0.5) for s in shares), least)


def views(f: Frame, n: int, other: str) -> Result:
    here, vector = f.apart(n), f.center(n) - f.eye(other)
    there = float(np.linalg.norm(vector))
    return compared(f, here, there, f.sigma(n, f.ahead(n)) + f.sigma(n, unit(vector)))


def baseline(f: Frame, vector: Any) -> Result:
    near = min((number_of(o) for o in f.truth["objects"] if number_of(o) in f.spoken), key=f.apart)
    return length(f, vector, near, near)


def changed(f: Frame, n: int) -> Result:
    assert f.first is not None
    vector = f.first.center(n) - f.first.eye()
    then = float(np.linalg.norm(vector))
    return compared(f, f.apart(n), then, f.sigma(n, f.ahead(n)) + f.sigma(n, unit(vector)))


@dataclass(frozen=True)
class Said:
    """An utterance: the choice of words in its form, its point and its second image."""

    words: str
    point: Any
    other: str


def turned(f: Frame) -> Result:
    assert f.first is not None
    then, now = (rotation(g.truth["camera"]["T_world_camera"]) for g in (f.first, f))
    x, _, z = then.inv().apply(now.apply([0.0, 0.0, 1.0]))
    turn = math.degrees(math.atan2(x, z))
    near = min((number_of(o) for o in f.truth["objects"] if number_of(o) in f.spoken), key=f.apart)
    across = np.cross(f.ahead(near), [0.3, 0.5, 0.7])
    edge = math.sqrt(f.sigma(near, unit(across))) / f.apart(near)
    return Result((turn,), abs(turn), math.degrees(2.0 * math.sqrt(2.0) * edge), turn > 0.0)


def ranged(f: Frame, n: int) -> Result:
    return length(f, f.center(n) - f.eye(), n)


def closer(f: Frame, a: int, b: int) -> Result:
    spread = sum(f.sigma(n, f.ahead(n)) for n in (a, b))
    return compared(f, f.apart(a), f.apart(b), spread)


def taller(f: Frame, a: int, b: int) -> Result:
    spread = 2.0 * sum(f.sigma(n, UP) for n in (a, b))
    return compared(f, tall(f, a), tall(f, b), spread, less=False)


def higher(f: Frame, a: int, b: int) -> Result:
    spread = sum(f.sigma(n, UP) for n in (a, b))
    return compared(f, f.center(a)[2], f.center(b)[2], spread, less=False)


def moved(f: Frame, n: int) -> Result:
    assert f.first is not None
    return length(f, f.center(n) - f.first.center(n), n, n)


Check = Callable[[Frame, Any, Said], Result]
BEFORE = r"The second image is from before\. "
OPEN: list[tuple[str, str, Check]] = [
    ("distance", "How far is the center of X from the camera", lambda f, n, s: ranged(f, *n)),
    ("distance", "How far apart are the centers of X and X",
     lambda f, n, s: length(f, f.center(n[1]) - f.center(n[0]), *n)),
    ("size", "How tall is X", lambda f, n, s: length(f, sides(f, *n)[0], *n, *n)),
    ("size", "How long is the longer horizontal side of X",
     lambda f, n, s: length(f, sides(f, *n)[1], *n, *n)),
    ("size", "How long is the shorter horizontal side of X",
     lambda f, n, s: length(f, sides(f, *n)[2], *n, *n)),
    ("height", "How high above the (?:floor|road) is the top of X",
     lambda f, n, s: length(f, f.corners(*n)[:, 2].max() * UP, *n)),
    ("order", "List from (left to right|nearest to farthest from the camera|the lowest to the "
     "highest center): X", lambda f, n, s: order(f, n, s.words)),
    ("nearest", "Which is (nearest to|second nearest to|farthest from) the camera: X",
     lambda f, n, s: nearest(f, n, s.words)),
    ("nearest", "Which is nearest to X: X", lambda f, n, s: nearest_to(f, n)),
    ("pointing", "Point at X", lambda f, n, s: spot(f, f.ids == n[0], s.point)),
    ("free_spot", "Point at a free spot on X(?:, next to X on the (left|right))?",
     lambda f, n, s: spot(f, bare(f, n[-1], n[:-1], s.words), s.point)),
    ("occlusion", "What hides part of X", lambda f, n, s: hiders(f, n)),
    ("hidden_counting", "How many [a-z ]+ can be seen, including partly hidden ones",
     lambda f, n, s: counted(f, n, False)),
    ("hidden_counting", "How many of the [a-z ]+ that can be seen are more than half hidden",
     lambda f, n, s: counted(f, n, True)),
    ("views", "How far is the camera of the second image from the camera of the first image",
     lambda f, n, s: baseline(f, f.eye(s.other) - f.eye())),
    ("change", f"{BEFORE}How far has the center of X in the first image moved since",
     lambda f, n, s: moved(f, *n)),
    ("ego_motion", f"{BEFORE}How far has the camera moved since",
     lambda f, n, s: baseline(f, f.eye() - f.first.eye())),  # type: ignore[union-attr]
]  # fmt: skip
"""Kind, words (X: any), and the recomputed answer."""
YES_OR_NO: list[tuple[str, str, tuple[str, str], Check]] = [
    ("comparison", "Is the center of X W the camera than the center of X",
     ("closer to", "farther from"), lambda f, n, s: closer(f, *n)),
    ("comparison", "Is X W than X", ("taller", "shorter"), lambda f, n, s: taller(f, *n)),
    ("comparison", "Is the center of X W than the center of X", ("higher", "lower"),
     lambda f, n, s: higher(f, *n)),
    ("clearance", "Is the gap between X and X W for X", ("wide enough", "too narrow"),
     lambda f, n, s: clearance(f, *n)),
    ("reach", r"The hand of the arm gets 95 cm from its shoulder\. Is the center of X W its reach",
     ("within", "out of"), lambda f, n, s: reach(f, *n)),
    ("occlusion", "Is W front of it", ("part of X hidden by something in", "X free of anything in"),
     lambda f, n, s: occlusion(f, *n)),
    ("views", "Is the center of X in the first image W the camera of the first image than X that "
     "of the second", ("closer to", "farther from"), lambda f, n, s: views(f, n[0], s.other)),
    ("change", f"{BEFORE}Is the center of X in the first image W the camera now",
     ("closer to", "farther from"), lambda f, n, s: changed(f, *n)),
    ("ego_motion", f"{BEFORE}Has the camera turned to the W since", ("right", "left"),
     lambda f, n, s: turned(f)),
]  # fmt: skip
"""Kind, words, the words W of the positive and of the negative form, and the recomputed answer."""
FORMS = [(kind, text, True, check) for kind, text, check in OPEN] + [
    (kind, text.replace("W", word), word == both[0], check)
    for kind, text, both, check in YES_OR_NO
    for word in both
]

ANNOTATIONS = (
    "annotations=[boxes2d, instance_masks, amodal_masks, visibility, {type: language, most: 100, "
    "min_visible_px: 40, min_visible_fraction: 0.3, "
    f"kinds: [{', '.join(sorted({kind for kind, *_ in FORMS}))}]}}]"
)
"""Texts without numbers are left out: captions and expressions take as long as all of these."""


def frames(folder: Path) -> Iterator[Frame]:
    for shard in sorted(p for p in (folder / "shards").iterdir() if p.is_dir()):
        first: dict[str, Frame] = {}
        scenes: dict[int, dict[str, Any]] = {}
        texts = ((shard / f"{name}.jsonl").read_text("utf-8") for name in ("labels", "scenes"))
        for label, record in zip(*(text.splitlines() for text in texts), strict=True):
            plain, kept = json.loads(label), json.loads(record)
            # A line has the differences from the first sample of its scene.
            scene = scenes.get(kept["base"], {}) | kept["scene"]
            scenes[kept["index"]] = scene
            for sensor in plain["truth"]:
                frame = Frame(shard, sensor, plain, scene, first.get(sensor))
                if kept["step_index"] == 0:
                    first[sensor] = frame
                yield frame


def recompute(f: Frame, said: dict[str, Any]) -> tuple[Result, bool]:
    for kind, pattern, positive, check in FORMS:
        match = re.fullmatch(f"{pattern.replace('X', '.+?')}[?.]", said["text"])
        if match and kind == said["kind"]:
            point = said.get("points_px", [None])[0]
            words = Said(match[1] if match.groups() else "", point, said.get("other", ""))
            return check(f, tuple(said["instances"]), words), positive
    raise AssertionError(said)


def assert_answer(f: Frame, said: dict[str, Any]) -> None:
    result, positive = recompute(f, said)
    stated = said["measured"]
    # Outlines are compared along 20,001 directions.
    slack = 1e-3 if said["kind"] in ("clearance", "reach") else 2e-5
    assert stated["numbers"] == pytest.approx(result.numbers, abs=slack)
    assert stated["margin"] == pytest.approx(result.margin, abs=2 * slack, rel=1e-4)
    assert stated["resolution"] == pytest.approx(result.least, abs=2 * slack, rel=1e-3)
    assert stated["margin"] >= stated["resolution"] > 0.0
    if result.holds is not None:
        assert said["answer"] == ("yes" if result.holds == positive else "no")
    elif match := re.fullmatch(r"([\d.]+) (c?m)", said["answer"]):
        value = float(match[1]) * (0.01 if match[2] == "cm" else 1.0)
        assert abs(value - result.numbers[0]) <= 0.6 * stated["margin"]
    elif "points_px" in said:
        assert said["answer"] == "({}, {})".format(*(math.floor(v) for v in said["points_px"][0]))
    elif said["kind"] == "hidden_counting":
        assert said["answer"] == str(int(result.numbers[0]))
    elif said["kind"] == "order":
        listed = said["text"].partition(": ")[2].rstrip(".")
        assert len(said["answer"].split(", the ")) == 3
        assert all(part in listed for part in re.split(r", (?=the )", said["answer"]))
    elif said["kind"] == "nearest":
        assert said["answer"] in said["text"].partition(": ")[2]
    for x, y in PIXEL.findall(said["text"] + said["answer"]):
        assert f.ids[int(y), int(x)] in said["instances"]


@pytest.mark.slow
def test_two_thousand_answers_follow_from_the_files(tmp_path: Path) -> None:
    """On a table, in a room and in a street; each kind is there, and yes is as frequent as no."""
    kinds: Counter[str] = Counter()
    answers: Counter[str] = Counter()
    for name, text, n in (("table", TABLE, 3), ("room", ROOM, 2), ("street", STREET, 2)):
        config, out = tmp_path / f"{name}.yaml", tmp_path / name
        config.write_text(text, "utf-8")
        overrides = [ANNOTATIONS, "exporters=[]"]
        gen_data.generate(str(config), n, out=out, workers=0, overrides=overrides)
        for frame in frames(out):
            for said in frame.truth["utterances"]:
                if "measured" in said:
                    assert_answer(frame, said)
                    kinds[said["kind"]] += 1
                    answers[said["answer"]] += 1

    assert kinds.keys() == {kind for kind, *_ in FORMS}
    assert kinds.total() >= 2000
    both = answers["yes"] + answers["no"]
    # Three standard deviations of a fair coin.
    assert abs(answers["yes"] - 0.5 * both) <= 1.5 * math.sqrt(both)
