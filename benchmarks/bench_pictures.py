"""Cars and people in pictures beside those of real drives: ``python -m benchmarks.bench_pictures``.

Pictures come from the first step of every view of a configuration, or (``--kitti FOLDER``) from
``label_2`` of KITTI's object format. Objects are the rows of KITTI's labels: image boxes around the
projected 3D box, ``DontCare`` left out. Heights are in pixels of KITTI's camera (focal length
721.5 px): pictures of our cameras are rendered small, since labels need few pixels. ``--light``
adds the grey levels of people, at full size, which takes ten times as long.

The column ``real`` is of ``street_figures.yaml``.
"""

import argparse
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
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

FOCAL_PX = 721.5
"""Focal length of KITTI's rectified cameras."""
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
    def of(cls, row: str, focal_px: float) -> "Labelled | None":
        """The object of a row; None for other kinds."""
        kind, truncation, _, _, left, top, right, bottom, h, w, length, x, y, z, _ = row.split()
        if kind not in KINDS:
            return None
        scale = FOCAL_PX / focal_px
        size_px = (float(right) - float(left)) * scale, (float(bottom) - float(top)) * scale
        away_m = math.hypot(float(x), float(z))
        size_m = (float(length), float(w), float(h))
        return cls(KINDS[kind], size_px, size_m, away_m, float(y), float(truncation))


@dataclass(frozen=True, slots=True)
class Picture:
    """Objects of a picture, and the grey levels of the pixels that show people."""

    objects: tuple[Labelled, ...]
    grey: tuple[int, ...] = ()


def pictures_of_config(
    name: str, scenes: Iterable[int], given: Sequence[str], *, light: bool
) -> Iterator[list[Picture]]:
    """Pictures of each of these scenes by the first camera, one step of each view."""
    config = load_config(name, overrides=given)
    camera = next(s for s in config.sensors if hasattr(s, "size_px"))
    shrunk = 1 if light else SHRUNK
    size_px = [side // shrunk for side in camera.size_px]
    changes = [
        f"sensors.{camera.name}.size_px={size_px}",
        f"sensors.{camera.name}.channels=[{'rgb, ' if light else ''}instance, category]",
        f"labels.min_visible_px={16 // shrunk**2}",
        f"labels.min_box_px={3 // shrunk}",
        "annotations=[boxes2d, boxes3d, visibility]",
        "exporters=[]",
        "steps_per_scene=1",
    ]
    kitti = next((e for e in config.exporters if isinstance(e, Kitti)), Kitti(far_m=64))
    style = kitti.model_copy(update={"low_px": math.ceil(kitti.low_px / shrunk)})
    with open_pipeline(load_config(name, overrides=[*given, *changes])) as pipeline:
        for scene in scenes:
            pictures = []
            accepted = pipeline.accepted_scene(scene)
            sensors = [s for s in accepted.sensors if s.name == camera.name]
            for number in range(config.general.views_per_scene):
                view = pipeline.drawn_view(accepted, number)
                sample = pipeline.read_sensors(view, sensors, 0)
                truth = sample.truth[camera.name]
                pixels = sample.capture.readings[camera.name].channels
                grey = _grey_of_people(truth, pixels) if light else ()
                rows = [row for row, _ in label_rows(truth, style)]
                pictures.append(_picture(rows, truth.camera.intrinsics.fx_px, grey))
            yield pictures


def _picture(rows: Sequence[str], focal_px: float, grey: tuple[int, ...] = ()) -> Picture:
    found = (Labelled.of(row, focal_px) for row in rows)
    return Picture(tuple(thing for thing in found if thing is not None), grey)


def _grey_of_people(truth: ImageTruth, pixels: Mapping[Channel, NDArray[Any]]) -> tuple[int, ...]:
    seen = (thing.instance for thing in truth.objects)
    people = [one.instance_id for one in seen if one.category in ("person", "pedestrian")]
    rgb = pixels[Channel.RGB][np.isin(pixels[Channel.INSTANCE], people)]
    return tuple(np.rint(rgb @ (0.299, 0.587, 0.114)).astype(int).tolist())


def pictures_of_kitti(folder: Path, n: int) -> Iterator[Picture]:
    """The first ``n`` label files of a folder in KITTI's object format."""
    for path in sorted((folder / "label_2").glob("*.txt"))[:n]:
        yield _picture(path.read_text().splitlines(), FOCAL_PX)


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
    grey = np.concatenate([np.array(picture.grey, np.int64) for picture in pictures])
    figures["people: dark pixels"] = float((grey < DARK).mean()) if len(grey) else math.nan
    figures["people: mean grey"] = float(grey.mean()) if len(grey) else math.nan
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
