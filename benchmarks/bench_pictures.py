"""Cars and people in rendered and real pictures: ``python -m benchmarks.bench_pictures``.

Pictures come from the first step of every view of a configuration, or (``--kitti FOLDER``) from
``label_2`` of KITTI's object format. Objects are the rows of KITTI's labels: image boxes around the
projected 3D box, ``DontCare`` left out. Real figures are of KITTI's camera, so the first
camera of a configuration takes its size, lens, height and direction, and keeps its place and its
image pipeline. Pictures are rendered small, since labels need few pixels. ``--light`` adds grey
levels: pictures with people are rendered again at full size. Real labels have no silhouettes, so
real figures refer to boxes.

The column ``real`` is read from ``street_figures.yaml``.
"""

import argparse
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.real_figures import real_figures
from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.core.capture import Channel
from gen_data.core.sample import ImageTruth
from gen_data.exporters.kitti import Kitti, label_rows
from gen_data.lab.study.real_pictures import read_image
from gen_data.pipeline.pipeline import AcceptedScene, Pipeline
from gen_data.sensors.camera.rgb_camera import RgbCamera

Pixels = Mapping[Channel, NDArray[Any]]

FOCAL_PX = 721.5
"""Focal length of KITTI's rectified cameras."""
SIZE_PX = 1242, 375
"""Width and height of KITTI's rectified images."""
HFOV_DEG = 81.43
HEIGHT_M = 1.65
"""Height of KITTI's cameras above the ground (Geiger et al., figure 3)."""
SHRUNK = 3
"""Factor between the sizes of pictures without and with ``--light``."""
ENDS_PX = (0.0, 25.0, 48.0, 96.0, 192.0, math.inf)
BINS = ("< 25", "25-48", "48-96", "96-192", "> 192")
DARK = 25
"""Grey level below which a pixel counts as dark."""
KINDS = {"Car": "cars", "Pedestrian": "people", "Cyclist": "cyclists"}

REAL = real_figures("pictures").rows


@dataclass(frozen=True, slots=True)
class Labelled:
    """One row of a label file.

    Attributes:
        size_px: Width and height in KITTI's pixels.
        size_m: Length, width and height.
        away_m: Distance along the ground.
        below_m: Depth of the bottom below the camera.
        truncation: Share outside the image.
    """

    kind: str
    size_px: tuple[float, float]
    size_m: tuple[float, float, float]
    away_m: float
    below_m: float
    truncation: float

    @classmethod
    def of(cls, row: str, px: float = 1.0) -> "Labelled | None":
        """The object of a row, whose pixels are ``px`` of KITTI's; None = of another kind."""
        kind, truncation, _, _, left, top, right, bottom, h, w, length, x, y, z, _ = row.split()
        if kind not in KINDS:
            return None
        size_px = (float(right) - float(left)) * px, (float(bottom) - float(top)) * px
        away_m = math.hypot(float(x), float(z))
        size_m = (float(length), float(w), float(h))
        return cls(KINDS[kind], size_px, size_m, away_m, float(y), float(truncation))


@dataclass(frozen=True, slots=True)
class Grey:
    """Pixels, how many of them are dark, and the sum of their grey levels."""

    pixels: int = 0
    dark: int = 0
    total: float = 0.0

    @classmethod
    def of(cls, levels: NDArray[np.float64]) -> "Grey":
        """Grey levels [n] of some pixels."""
        return cls(levels.size, int((levels < DARK).sum()), float(levels.sum()))


@dataclass(frozen=True, slots=True)
class Picture:
    """Objects of a picture, the pixels in the boxes of people, and the pixels that show people."""

    objects: tuple[Labelled, ...]
    boxes: Grey = Grey()
    silhouettes: Grey = Grey()

    @classmethod
    def of(cls, rows: Sequence[str], px: float = 1.0) -> "Picture":
        """The objects of label rows, whose pixels are ``px`` of KITTI's."""
        found = (Labelled.of(row, px) for row in rows)
        return cls(tuple(thing for thing in found if thing is not None))


@dataclass(frozen=True, eq=False, slots=True)
class _Camera:
    """The first camera of a configuration with a size, and the style of its labels."""

    pipeline: Pipeline
    name: str
    style: Kitti

    def look(self, accepted: AcceptedScene, number: int) -> tuple[list[str], ImageTruth, Pixels]:
        """Rows of the label file of a view, its truth, and its channels."""
        sensors = [s for s in accepted.sensors if s.name == self.name]
        sample = self.pipeline.read_sensors(self.pipeline.drawn_view(accepted, number), sensors, 0)
        truth = sample.truth[self.name]
        rows = [row for row, _ in label_rows(truth, self.style)]
        return rows, truth, sample.capture.readings[self.name].channels


def as_kitti(camera: RgbCamera, shrunk: int) -> list[str]:
    """Overrides with size, lens, height and direction of KITTI's camera; the image is smaller."""
    fields = {"size_px": [side // shrunk for side in SIZE_PX], "hfov_deg": HFOV_DEG}
    if camera.rig:
        ahead_m, left_m, _ = camera.offset_m
        fields |= {"offset_m": [ahead_m, left_m, HEIGHT_M], "yaw_deg": 0, "pitch_deg": 0}
        fields |= {"roll_deg": 0}
    return [f"sensors.{camera.name}.{name}={value}" for name, value in fields.items()]


@contextmanager
def _camera(name: str, given: Sequence[str], shrunk: int, channels: str) -> Iterator[_Camera]:
    """The first camera of a configuration as KITTI's, its pictures smaller by a factor."""
    config = load_config(name, overrides=list(given))
    camera = next(s for s in config.sensors if isinstance(s, RgbCamera))
    changes = [
        *as_kitti(camera, shrunk),
        f"sensors.{camera.name}.channels=[{channels}]",
        f"labels.min_visible_px={16 // shrunk**2}",
        f"labels.min_box_px={3 // shrunk}",
        "annotations=[boxes2d, boxes3d, visibility]",
        "exporters=[]",
        "steps_per_scene=1",
    ]
    kitti = next(
        (e for e in config.exporters if isinstance(e, Kitti)), Kitti(far_m=64, far_people_m=45)
    )
    style = kitti.model_copy(update={"low_px": math.ceil(kitti.low_px / shrunk)})
    with open_pipeline(load_config(name, overrides=[*given, *changes])) as pipeline:
        yield _Camera(pipeline, camera.name, style)


def pictures_of_config(
    name: str, scenes: Iterable[int], given: Sequence[str], *, light: bool
) -> Iterator[list[Picture]]:
    """Pictures of each of these scenes by the first camera, one step of each view.

    With ``light`` pictures with people are rendered again at full size.
    """
    views = load_config(name, overrides=list(given)).general.views_per_scene
    with (
        _camera(name, given, SHRUNK, "instance, category") as small,
        _camera(name, given, 1, "rgb, instance, category") if light else nullcontext() as full,
    ):
        for scene in scenes:
            pictures = []
            accepted = small.pipeline.accepted_scene(scene)
            again = None
            for number in range(views):
                rows, truth, _ = small.look(accepted, number)
                picture = Picture.of(rows, FOCAL_PX / truth.camera.intrinsics.fx_px)
                if full and any(thing.kind == "people" for thing in picture.objects):
                    again = again or full.pipeline.accepted_scene(scene)
                    picture = _with_light(picture, *full.look(again, number))
                pictures.append(picture)
            yield pictures


def _with_light(
    picture: Picture, rows: Sequence[str], truth: ImageTruth, pixels: Pixels
) -> Picture:
    """The picture with the grey levels of its people."""
    seen = (thing.instance for thing in truth.objects)
    people = [one.instance_id for one in seen if one.category in ("person", "pedestrian")]
    grey = grey_levels(pixels[Channel.RGB])
    shown = Grey.of(grey[np.isin(pixels[Channel.INSTANCE], people)])
    return replace(picture, boxes=grey_in_boxes(grey, rows), silhouettes=shown)


def grey_levels(rgb: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Grey levels [h, w] of a picture [h, w, 3]."""
    levels: NDArray[np.float64] = rgb @ np.array([0.299, 0.587, 0.114])
    return levels


def grey_in_boxes(grey: NDArray[np.float64], rows: Sequence[str]) -> Grey:
    """Pixels [h, w] in the boxes of people, each counted once, by rows of a label file."""
    inside = np.zeros(grey.shape, np.bool_)
    for row in rows:
        kind, *_, left, top, right, bottom = row.split()[:8]
        if KINDS.get(kind) == "people":
            x0, y0 = (max(0, math.floor(float(edge))) for edge in (left, top))
            inside[y0 : math.floor(float(bottom)) + 1, x0 : math.floor(float(right)) + 1] = True
    return Grey.of(grey[inside])


def pictures_of_kitti(folder: Path, n: int) -> Iterator[Picture]:
    """The first ``n`` label files of a folder in KITTI's object format, with its images if any."""
    for path in sorted((folder / "label_2").glob("*.txt"))[:n]:
        rows = path.read_text().splitlines()
        image = folder / f"image_2/{path.stem}.png"
        grey = grey_levels(read_image(image)) if image.is_file() else None
        picture = Picture.of(rows)
        yield picture if grey is None else replace(picture, boxes=grey_in_boxes(grey, rows))


def summarise(pictures: Sequence[Picture]) -> dict[str, float]:
    """Figures of all pictures, by the names of ``REAL``; NaN where nothing was counted."""
    objects = [thing for picture in pictures for thing in picture.objects]
    of = {k: [thing for thing in objects if thing.kind == k] for k in KINDS.values()}
    figures: dict[str, float] = {}
    for kind in ("cars", "people"):
        counts, _ = np.histogram([thing.size_px[1] for thing in of[kind]], ENDS_PX)
        for name, count in zip(BINS, counts, strict=True):
            figures[f"{kind} {name} px"] = count / len(pictures)
    figures |= {kind: len(found) / len(pictures) for kind, found in of.items()}
    whole = [thing for thing in of["people"] if thing.truncation < 0.05]
    ratios = [thing.size_px[0] / thing.size_px[1] for thing in whole]
    quantiles = {
        "people: width / height": (ratios, (10, 50, 90)),
        "people: length": ([t.size_m[0] for t in of["people"]], (50,)),
        "people: width": ([t.size_m[1] for t in of["people"]], (50,)),
        "people: distance": ([t.away_m for t in of["people"]], (50,)),
        "cars: length": ([t.size_m[0] for t in of["cars"]], (5, 50)),
        "cars: width": ([t.size_m[1] for t in of["cars"]], (50, 95)),
        "cars: height": ([t.size_m[2] for t in of["cars"]], (50,)),
        "ground below cars": ([t.below_m for t in of["cars"]], (5, 95)),
    }
    for name, (values, shares) in quantiles.items():
        unit = "" if "/" in name else " [m]"
        for share in shares:
            at = float(np.percentile(values, share)) if values else math.nan
            figures[f"{name}, p{share}{unit}"] = at
    for where in ("boxes", "silhouettes"):
        pixels, dark, total = (
            sum(getattr(getattr(picture, where), part) for picture in pictures)
            for part in ("pixels", "dark", "total")
        )
        figures[f"people: dark pixels in {where}"] = dark / pixels if pixels else math.nan
        figures[f"people: mean grey in {where}"] = total / pixels if pixels else math.nan
    return figures


def main() -> None:
    """Print the table; the last column is the deviation from the real figure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--config", default="street.yaml")
    parser.add_argument("--kitti", type=Path, help="folder with label_2")
    parser.add_argument("--n", type=int, default=60, help="number of scenes, or of label files")
    parser.add_argument("--light", action="store_true", help="measure grey levels of people")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    arguments = parser.parse_args()
    if arguments.kitti is not None:
        pictures = list(pictures_of_kitti(arguments.kitti, arguments.n))
    else:
        given = (arguments.config, range(arguments.n), arguments.set)
        pictures = [p for scene in pictures_of_config(*given, light=arguments.light) for p in scene]
    figures = summarise(pictures)
    print(f"{len(pictures)} pictures")
    print(f"{'':30} {'real':>8} {'here':>8}")
    for name, real in REAL.items():
        value = figures[name]
        away = f"{value / real - 1.0:+7.0%}" if real and not math.isnan(value) else ""
        print(f"{name:30} {real:8.4g} {value:8.3g} {away}")


if __name__ == "__main__":
    main()
