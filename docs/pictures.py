"""Draw the pictures of the reference and of the gallery from docs/pictures.yaml.

    python docs/pictures.py                          # all; PICTURES_PROCESSES=2
    python docs/pictures.py randomizer/lighting      # one plug-in
    python docs/pictures.py configuration            # the gallery
    python docs/pictures.py ladder                   # ladders of the gallery
    python docs/pictures.py tutorial                 # results of the tutorials
    python docs/pictures.py --missing                # pictures without a file

A strip shows one scene three times, with a low, a middle and a high value of one field. Strips of
distributions are histograms of drawn values.
"""

import json
import math
import os
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import cv2
import numpy as np
import yaml
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont
from pydantic import Field

from gen_data.config.base_model import Strict
from gen_data.config.distributions import DISTRIBUTIONS
from gen_data.config.yaml_scalars import to_flow_yaml
from gen_data.core.streams import Streams

DOCS = Path(__file__).parent
FOLDER = DOCS / "pictures"
TABLE = DOCS / "pictures.yaml"
WITHOUT_PICTURE = "no picture because "
MISSING = "--missing"
DISTRIBUTION, CONFIGURATION, TUTORIAL = "distribution", "configuration", "tutorial"
LADDER = "ladder"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"# ([\w./-]+\.(?:py|toml|yaml))\n")
WIDTH_PX, HEIGHT_PX = 320, 240
GAP_PX = 6
CAPTION_PX = 22
PAPER, INK, FAINT, BAR = (255, 255, 255), (45, 45, 45), (205, 205, 205), (63, 81, 181)
QUALITY = 78
DRAWS = 4000
BINS = 40
PROCESSES = int(os.environ.get("PICTURES_PROCESSES", "2"))

Pixels = NDArray[np.uint8]


class Strip(Strict):
    """Three pictures of one scene that differ in one field.

    Attributes:
        base: Name of a configuration in docs/pictures.
        field: Path of the field, as for ``--set``; empty for a distribution.
        values: Values of the field, from left to right.
        captions: Texts below the pictures; empty = the values.
        about: Statement below the strip.
        add: Changes of the base, as in a configuration that extends it.
        set_too: Further values by path, the same in all pictures.
        index: Number of the sample.
        show: Caption of the tile as in a contact sheet; empty = the first camera.
        labels: Whether to draw the labels.
        crop: Left, top, right and bottom of the shown part, as fractions of the image.
    """

    base: str = ""
    field: str = ""
    values: tuple[Any, ...] = Field(min_length=1, max_length=4)
    captions: tuple[str, ...] = ()
    about: str = ""
    add: dict[str, Any] = Field(default_factory=dict)
    set_too: dict[str, Any] = Field(default_factory=dict)
    index: int = Field(0, ge=0)
    show: str = ""
    labels: bool = False
    crop: tuple[float, float, float, float] = (0, 0, 1, 1)

    @property
    def name(self) -> str:
        """Last part of the field's path, for the file's name; ``draws`` without a field."""
        return self.field.rpartition(".")[2] or "draws"


class Sheet(Strict):
    """Samples of a shipped configuration, or of the configuration of a tutorial.

    Attributes:
        config: Name of the configuration; empty = name of the sheet.
        until: Text of the first block of a tutorial that is not executed before drawing.
        samples: Numbers of the samples.
        columns: Pictures in a row.
        seed: In place of the configuration's own.
        labels: Whether to draw the labels.
        tile_px: Width of a picture.
        channels: Channels to show; ``written`` = the channels of every sensor.
        quality: Quality of the file.
        set_too: Values by path.
    """

    config: str = ""
    until: str = ""
    samples: tuple[int, ...] = (0, 5, 10)
    columns: int = Field(3, ge=1)
    seed: int | None = None
    labels: bool = True
    tile_px: int = 320
    channels: str = "rgb"
    quality: int = Field(QUALITY, ge=1, le=100)
    set_too: dict[str, Any] = Field(default_factory=dict)


class Row(NamedTuple):
    """Entry of the table: the strips of a plug-in, or the reason why it has none."""

    kind: str
    name: str
    strips: tuple[Strip, ...]
    reason: str


@dataclass(frozen=True)
class Job:
    """One file to draw."""

    kind: str
    name: str
    entry: Strip | Sheet

    @property
    def path(self) -> Path:
        """The file."""
        if isinstance(self.entry, Strip):
            return strip_path(self.kind, self.name, self.entry)
        return sheet_path(self.name, self.kind)


def strip_path(kind: str, name: str, strip: Strip) -> Path:
    """File of a strip."""
    return FOLDER / kind / f"{name}-{strip.name}.webp"


def sheet_path(name: str, kind: str = CONFIGURATION) -> Path:
    """File of the contact sheet of a configuration or tutorial."""
    return FOLDER / kind / f"{name}.webp"


@cache
def read_rows() -> tuple[Row, ...]:
    """Strips of all plug-ins, in the order of the table.

    Raises:
        ValueError: an entry has no strips, and no reason.
    """
    rows = []
    for kind, entries in _table().items():
        if kind in (CONFIGURATION, TUTORIAL, LADDER):
            continue
        for name, entry in entries.items():
            if isinstance(entry, str) and not entry.startswith(WITHOUT_PICTURE):
                raise ValueError(f"{TABLE}: {kind}.{name}: expected '{WITHOUT_PICTURE}...'")
            listed = () if isinstance(entry, str) else entry
            reason = entry if isinstance(entry, str) else ""
            rows.append(Row(kind, name, tuple(map(_read_strip, listed)), reason))
    return tuple(rows)


@cache
def read_ladders() -> Mapping[str, Strip]:
    """Strips of the gallery's ladders by name."""
    return {name: _read_strip(entry) for name, entry in _table()[LADDER].items()}


def _read_strip(entry: Any) -> Strip:
    return Strip.model_validate_json(json.dumps(entry))


@cache
def read_sheets(kind: str = CONFIGURATION) -> Mapping[str, Sheet]:
    """Contact sheets by name of the configuration or tutorial; reasons are left out."""
    listed = {k: v for k, v in _table()[kind].items() if not isinstance(v, str)}
    return {name: Sheet.model_validate_json(json.dumps(entry)) for name, entry in listed.items()}


def find_jobs(words: Sequence[str] = ()) -> Iterator[Job]:
    """Files to draw: all, or the files of some kinds or plug-ins (``kind/name``)."""
    jobs = [Job(row.kind, row.name, strip) for row in read_rows() for strip in row.strips]
    jobs += [Job(LADDER, name, strip) for name, strip in read_ladders().items()]
    for kind in (CONFIGURATION, TUTORIAL):
        jobs += [Job(kind, name, sheet) for name, sheet in read_sheets(kind).items()]
    for job in jobs:
        names = {job.kind, f"{job.kind}/{job.name}", f"{job.kind}/{job.path.stem}"}
        if not words or names & set(words):
            yield job


def draw(job: Job) -> Path:
    """Draw one file."""
    entry = job.entry
    if isinstance(entry, Sheet) and job.kind == TUTORIAL:
        picture = _draw_tutorial(job.name, entry)
    elif isinstance(entry, Sheet):
        picture = _draw_sheet(job.name, entry)
    elif job.kind == DISTRIBUTION:
        tiles = [_plot_draws(job.name, value, entry.values) for value in entry.values]
        texts = [to_flow_yaml({job.name: value}) for value in entry.values]
        picture = _join(tiles, entry.captions or texts)
    else:
        values = [to_flow_yaml(value) for value in entry.values]
        tiles = _render_strip(entry)
        picture = _join(tiles, entry.captions or [f"{entry.name}: {value}" for value in values])
    job.path.parent.mkdir(parents=True, exist_ok=True)
    quality = entry.quality if isinstance(entry, Sheet) else QUALITY
    picture.save(job.path, quality=quality, method=6)
    return job.path


def strip_configurations(strip: Strip) -> list[tuple[Any, str]]:
    """Configurations of the pictures of a strip, and the name of the sensor that each shows.

    Copies of one sensor with different values share a configuration, and so the scene.
    """
    section, _, path = strip.field.partition(".")
    if section != "sensors":
        return [(_load(strip, {strip.field: value}), "") for value in strip.values]
    name, _, key = path.partition(".")
    listed = _load(strip, {strip.field: strip.values[0]}).resolved["sensors"]
    sensor = next(entry for entry in listed if entry["name"] == name)
    names = [name, *(f"{name}_{number}" for number in range(1, len(strip.values)))]
    copies = [{**sensor, "name": copied} for copied in names[1:]]
    fields = {f"sensors.{n}.{key}": v for n, v in zip(names, strip.values, strict=True)}
    config = _load(strip, fields, copies)
    return [(config, copied) for copied in names]


def _load(strip: Strip, fields: Mapping[str, Any], sensors: Sequence[Any] = ()) -> Any:
    """Configuration (``assemble.config.Config``) of the base with changes."""
    from gen_data.assemble.config import load_config

    listed = [*strip.add.get("sensors", ()), *sensors]
    extended = {"extends": str(FOLDER / f"{strip.base}.yaml"), **strip.add, "sensors": listed}
    overrides = [f"{k}={to_flow_yaml(v)}" for k, v in {**strip.set_too, **fields}.items()]
    # Only a configuration in a file may extend another one.
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"{strip.base}.yaml"
        path.write_text(yaml.safe_dump(extended, sort_keys=False), "utf-8")
        return load_config(str(path), overrides=overrides)


def _table() -> Any:
    return yaml.safe_load(TABLE.read_text("utf-8"))


def _render_strip(strip: Strip) -> list[Pixels]:
    """Pictures of a strip, uint8 [HEIGHT_PX, WIDTH_PX, 3] each."""
    tiles: dict[int, list[Any]] = {}
    pictures = []
    for config, sensor in strip_configurations(strip):
        if id(config) not in tiles:
            tiles[id(config)] = _tiles_of(config, strip)
        shown, wanted = tiles[id(config)], sensor or strip.show
        tile = next((t for t in shown if wanted in ("", t.caption)), None)
        if tile is None:
            raise ValueError(f"{strip.name}: no '{wanted}' in {[t.caption for t in shown]}")
        pictures.append(_fit(tile.image, strip.crop))
    return pictures


def _tiles_of(config: Any, strip: Strip) -> list[Any]:
    """Tiles (``contact_sheet.Tile``) of a sample."""
    from gen_data.assemble.pipeline_factory import open_pipeline
    from gen_data.preview.contact_sheet import Tile, make_tiles
    from gen_data.preview.sensor_views import top_view

    with open_pipeline(config) as pipeline:
        sample = pipeline.sample(strip.index)
        shown = pipeline.info.media
        tiles = list(make_tiles([sample], shown, labels=strip.labels, views=pipeline.info.views))
    known = {tile.caption for tile in tiles}
    for name, cloud in sample.capture.clouds.items():
        # Contact sheets leave pseudo lidars out.
        if name not in known:
            tiles.append(Tile(name, top_view(cloud, sample.scene, WIDTH_PX / HEIGHT_PX)))
    return tiles


def _fit(image: Pixels, crop: tuple[float, float, float, float]) -> Pixels:
    """The shown part of an image, scaled to the size of a picture, with borders if need be."""
    height, width = image.shape[:2]
    left, top, right, bottom = crop
    image = image[round(top * height) : round(bottom * height)]
    image = image[:, round(left * width) : round(right * width)]
    scale = min(WIDTH_PX / image.shape[1], HEIGHT_PX / image.shape[0])
    how = cv2.INTER_AREA if scale < 1 else cv2.INTER_NEAREST
    size = (max(1, round(image.shape[1] * scale)), max(1, round(image.shape[0] * scale)))
    part = cv2.resize(np.ascontiguousarray(image), size, interpolation=how)
    picture = np.full((HEIGHT_PX, WIDTH_PX, 3), PAPER, np.uint8)
    y, x = (HEIGHT_PX - size[1]) // 2, (WIDTH_PX - size[0]) // 2
    picture[y : y + size[1], x : x + size[0]] = part
    return picture


def _join(tiles: Sequence[Pixels], captions: Sequence[str]) -> Image.Image:
    """Pictures side by side, each with its caption below."""
    width = len(tiles) * (WIDTH_PX + GAP_PX) - GAP_PX
    sheet = Image.new("RGB", (width, HEIGHT_PX + CAPTION_PX), PAPER)
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(13)
    for number, (tile, caption) in enumerate(zip(tiles, captions, strict=True)):
        x = number * (WIDTH_PX + GAP_PX)
        sheet.paste(Image.fromarray(tile), (x, 0))
        pen.text((x + 2, HEIGHT_PX + 3), caption, INK, font)
    return sheet


def _draw_tutorial(name: str, sheet: Sheet) -> Image.Image:
    """Contact sheet of the configuration that a reader of the page has at ``sheet.until``."""
    former = Path.cwd()
    with TemporaryDirectory() as folder:
        os.chdir(folder)
        Path("examples").symlink_to(DOCS.parent / "examples")
        try:
            _follow_tutorial((DOCS / f"tutorials/{name}.md").read_text("utf-8"), sheet.until)
            return _draw_sheet(name, sheet)
        finally:
            os.chdir(former)


def _follow_tutorial(text: str, until: str) -> None:
    """Write the files and run the code of a page in the current folder, up to a block.

    Packages are installed into the folder ``packages``.
    """
    sys.path.insert(0, str(Path.cwd() / "packages"))
    path = os.pathsep.join(["packages", str(DOCS.parent), os.environ.get("PYTHONPATH", "")])
    for kind, block in BLOCK.findall(text):
        if until and until in block:
            break
        file = FILE.match(block)
        if file:
            target = Path(file[1])
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(block.removeprefix(file[0]) if kind == "python" else block, "utf-8")
        elif kind in ("bash", "python"):
            install = "pip install -q --no-deps --no-build-isolation --target packages "
            code = block.replace("pip install ", install) if kind == "bash" else block
            code = code.replace("gen-data ", f"{sys.executable} -m gen_data ")
            words = ["bash", "-ec"] if kind == "bash" else [sys.executable, "-c"]
            subprocess.run([*words, code], check=True, env={**os.environ, "PYTHONPATH": path})


def _draw_sheet(name: str, sheet: Sheet) -> Image.Image:
    from gen_data.assemble.config import load_config
    from gen_data.assemble.pipeline_factory import open_pipeline
    from gen_data.core.capture import Channel
    from gen_data.preview.contact_sheet import arrange_tiles, make_tiles, render_tiles

    overrides = [f"{path}={to_flow_yaml(value)}" for path, value in sheet.set_too.items()]
    config = load_config(sheet.config or f"{name}.yaml", seed=sheet.seed, overrides=overrides)
    own = sheet.channels == "written"
    wanted = () if own else tuple(Channel(word) for word in sheet.channels.split(","))
    with open_pipeline(config, extra_channels=frozenset(wanted)) as pipeline:
        samples = [pipeline.sample(index) for index in sheet.samples]
        info = pipeline.info
        shown = info.media if own else dict.fromkeys(info.cameras, wanted)
        views = info.views if own else {}
        tiles = list(make_tiles(samples, shown, labels=sheet.labels, views=views))
    images = render_tiles(tiles, sheet.tile_px, captions=len(info.cameras) > 1 or own)
    return Image.fromarray(arrange_tiles(images, sheet.columns))


def _plot_draws(name: str, argument: Any, all_arguments: Sequence[Any]) -> Pixels:
    """Histogram of numbers and names, or points seen from the front, left and above."""
    draws = _draw_values(name, argument)
    if isinstance(draws[0], tuple):
        return _plot_points(np.array([_as_point(value) for value in draws]))
    if isinstance(draws[0], (str, bool)):
        names = sorted({str(v) for a in all_arguments for v in _draw_values(name, a)})
        return _plot_bars([sum(str(v) == n for v in draws) for n in names], names)
    others = [value for a in all_arguments for value in _draw_values(name, a)]
    low, high = float(min(others)), float(max(others))
    digits = 2 - math.floor(math.log10(high - low))
    low, high = round(low, digits), round(high, digits)
    counts, _ = np.histogram(draws, BINS, (low, high))
    return _plot_bars(counts.tolist(), [f"{low:.3g}", f"{high:.3g}"])


def _draw_values(name: str, argument: Any) -> list[Any]:
    """Values of ``DRAWS`` scenes."""
    from gen_data.config.distributions import (
        DIRECTION,
        FLAG,
        NAME,
        NUMBER,
        POSITION,
        ROTATION,
        WHOLE_NUMBER,
    )
    from gen_data.config.distributions.base import read_distribution

    kinds = (NUMBER, WHOLE_NUMBER, FLAG, NAME, ROTATION, DIRECTION, POSITION)
    known = DISTRIBUTIONS.load(name).kinds
    plain = {name: argument} if argument is not None else name
    texts = isinstance(argument, (list, dict)) and isinstance(next(iter(argument)), str)
    wanted = "name" if texts and "name" in known else next(k.name for k in kinds if k.name in known)
    found = read_distribution(plain, next(kind for kind in kinds if kind.name == wanted))
    return [found.draw(Streams(0, n, index=n).rng("docs")) for n in range(DRAWS)]


def _as_point(value: tuple[float, ...]) -> tuple[float, ...]:
    """A position or direction itself; a rotation by the tip of its turned X axis."""
    from gen_data.core.se3 import SE3

    if len(value) == 3:
        return value
    return tuple(float(x) for x in SE3((0, 0, 0), value).matrix()[:3, 0])


def _plot_points(points: NDArray[np.float64]) -> Pixels:
    """Points in a cube, X to the lower left, Y to the right, Z up, in parallel projection."""
    image = Image.new("RGB", (WIDTH_PX, HEIGHT_PX), PAPER)
    pen = ImageDraw.Draw(image)
    scale = 85 / max(1.0, float(np.abs(points).max()))

    def project(xyz: NDArray[np.float64]) -> NDArray[np.float64]:
        x, y, z = xyz.T * scale
        return np.stack([WIDTH_PX / 2 + y - 0.5 * x, HEIGHT_PX / 2 - z + 0.35 * x], axis=-1)

    for axis, label in zip(np.eye(3) * 105 / scale, "XYZ", strict=True):
        start, end = project(np.zeros((1, 3)))[0], project(axis[None])[0]
        pen.line([tuple(start), tuple(end)], FAINT, 2)
        pen.text(tuple(end + 2), label, INK, ImageFont.load_default(12))
    for x, y in project(points):
        pen.point([(x, y), (x + 1, y)], BAR)
    return np.asarray(image)


def _plot_bars(counts: Sequence[int], names: Sequence[str]) -> Pixels:
    """Bars above a line; names below the bars, or at both ends."""
    image = Image.new("RGB", (WIDTH_PX, HEIGHT_PX), PAPER)
    pen, font = ImageDraw.Draw(image), ImageFont.load_default(12)
    left, right, top, bottom = 12, WIDTH_PX - 12, 14, HEIGHT_PX - 24
    step = (right - left) / len(counts)
    for number, count in enumerate(counts):
        x = left + number * step
        height = (bottom - top) * count / max(counts)
        wide = 1 if len(counts) == BINS else 0.25 * step
        if count:
            pen.rectangle((x + wide, bottom - height, x + step - wide, bottom), BAR)
    pen.line((left, bottom, right, bottom), INK)
    if len(names) == len(counts):
        for number, text in enumerate(names):
            pen.text((left + (number + 0.5) * step, bottom + 4), text, INK, font, anchor="ma")
    else:
        pen.text((left, bottom + 4), names[0], INK, font)
        pen.text((right, bottom + 4), names[-1], INK, font, anchor="ra")
    return np.asarray(image)


def main(words: Sequence[str]) -> None:
    """Draw the files that the words select; print their names and sizes [kB]."""
    names = [word for word in words if word != MISSING]
    found = list(find_jobs(names))
    if not found:
        sys.exit(f"no picture for {' '.join(names)}; see {TABLE}")
    jobs = [job for job in found if MISSING not in words or not job.path.exists()]
    failed = 0
    # Forked processes would share the state of the renderer's threads; a process that has listed
    # the plug-ins does not find the one that a tutorial installs.
    with ProcessPoolExecutor(PROCESSES, get_context("spawn"), max_tasks_per_child=1) as pool:
        running = {pool.submit(draw, job): job for job in jobs}
        for number, future in enumerate(as_completed(running), 1):
            name = running[future].path.relative_to(DOCS)
            error = future.exception()
            failed += error is not None
            text = (
                f"{(DOCS / name).stat().st_size / 1000:.0f} kB"
                if error is None
                else f"failed: {error}"
            )
            print(f"{number}/{len(jobs)} {name}: {text}", flush=True)
    if failed:
        sys.exit(f"{failed} pictures failed")


if __name__ == "__main__":
    main(sys.argv[1:])
