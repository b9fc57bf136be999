"""Pascal VOC export, held against ``coco`` and the images of the shards."""

from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from gen_data.exporters.label_colors import voc_palette
from gen_data.exporters.voc import YEAR, Voc
from tests.exporters.datasets import made_of
from tests.exporters.label_readers import voc_objects

dataset = made_of(Voc())


def test_palette_and_label_map_are_the_kits_and_images_the_photographs(dataset: Path) -> None:
    """Aeroplane, bicycle, bird, ..., and the cream colour of void."""
    colors = voc_palette()
    assert colors[[0, 1, 2, 3, 4, 8, 20, 255]].tolist() == [
        [0, 0, 0], [128, 0, 0], [0, 128, 0], [128, 128, 0], [0, 0, 128], [64, 0, 0], [0, 64, 128],
        [224, 224, 192],
    ]  # fmt: skip
    with Image.open(dataset / f"{YEAR}/SegmentationClass/000000000_color.png") as image:
        assert image.getpalette()[: 3 * 256] == colors.ravel().tolist()
    # Rows ``name:r,g,b:parts:actions``, as CVAT and Datumaro read them; void is "ignored".
    root = dataset / YEAR
    rows = [line.split(":") for line in (root / "labelmap.txt").read_text().splitlines()[1:]]
    color_of = {name: tuple(map(int, color.split(","))) for name, color, *_ in rows}
    with Image.open(next((root / "SegmentationClass").iterdir())) as image:
        palette = np.array(image.getpalette()).reshape(-1, 3).tolist()
    assert list(color_of) == ["background", "car", "crate", "pedestrian", "ignored"]
    assert [list(c) for c in color_of.values()] == [palette[k] for k in (0, 1, 2, 3, 255)]
    # JPEG of high quality, in the right order of colours.
    with Image.open(dataset / f"{YEAR}/JPEGImages/000000000_color.jpg") as picture:
        assert (picture.format, picture.mode) == ("JPEG", "RGB")
        copy = np.asarray(picture).astype(int)
    with Image.open(dataset.parent / "shards/000000/color/rgb/000000000.png") as picture:
        photograph = np.asarray(picture).astype(int)
    assert np.abs(copy - photograph).mean() < 6


def test_lists_of_classes_name_the_images_that_show_them(dataset: Path) -> None:
    """1 for every image with an object, -1 for all others."""
    root = dataset / YEAR
    shown = set()
    for line in (root / "ImageSets/Main/pedestrian_trainval.txt").read_text().splitlines():
        stem, value = line.split()
        names = [thing["name"] for thing in voc_objects(root / f"Annotations/{stem}.xml")]
        assert int(value) == (1 if "pedestrian" in names else -1)
        shown.add(value)
    assert shown == {"1", "-1"}


def test_truncated_and_occluded_follow_the_guidelines(world: Any, dataset: Path) -> None:
    """More than 15 % outside the image; more than 5 % hidden in it."""
    root = dataset / YEAR
    states = set()
    for sample in world.samples:
        rows = voc_objects(root / f"Annotations/{sample.index:09d}_color.xml")
        things = [t for t in sample.truth["color"].objects if t.box is not None]
        for row, thing in zip(rows, things, strict=True):
            assert row["truncated"] == str(int(thing.truncation > 0.15))
            assert row["occluded"] == str(int(thing.occlusion > 0.05))
            states.add((row["truncated"], row["occluded"]))
    assert {"0", "1"} == {a for a, _ in states} == {b for _, b in states}


def test_ignored_objects_are_difficult_and_void(world: Any, tmp_path: Path) -> None:
    """They come last: the others are numbered without gaps."""
    sample = world.samples[0]
    first, *others = sample.truth["color"].objects
    folder = world.export(Voc(images="png"), world.info(1), [world.ignoring(sample)], tmp_path)
    root = folder / YEAR
    rows = voc_objects(root / "Annotations/000000000_color.xml")
    assert [row["difficult"] for row in rows] == ["0"] * len(others) + ["1"]
    for name in ("SegmentationClass", "SegmentationObject"):
        with Image.open(root / f"{name}/000000000_color.png") as image:
            labels = np.asarray(image)
        assert (labels == 255).sum() == first.visible_px
    assert set(np.unique(labels)) == {0, *range(1, len(others) + 1), 255}
    assert (root / "JPEGImages/000000000_color.png").samefile(
        folder.parent / "shards/000000/color/rgb/000000000.png"
    )
