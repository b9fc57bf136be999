"""Pascal VOC: boxes in XML files, and label images of classes and objects.

::

    VOCdevkit/VOC2012/labelmap.txt           name:r,g,b:parts:actions of each class, for converters
    VOCdevkit/VOC2012/JPEGImages/000000012_color.jpg
    VOCdevkit/VOC2012/Annotations/000000012_color.xml
    VOCdevkit/VOC2012/SegmentationClass/000000012_color.png    class; 0 background, 255 void
    VOCdevkit/VOC2012/SegmentationObject/000000012_color.png   number in the XML file, from 1
    VOCdevkit/VOC2012/ImageSets/{Main,Segmentation}/{train,val,trainval,test}.txt
    VOCdevkit/VOC2012/ImageSets/Main/car_train.txt             1, -1 = absent, 0 = difficult

* **Boxes** are of whole pixels from 1, the last pixel included: ``xmin`` is COCO's x + 1, ``xmax``
  COCO's x + width.
* **Classes** are the data set's categories, numbered from 1 in their order; label images have VOC's
  colours. There are no void borders around objects.
* ``truncated`` is 1 if more than 15 % of the silhouette are outside the image, ``occluded`` if more
  than 5 % inside it are hidden, as in VOC's annotation guidelines. ``difficult`` is 1 for ignored
  objects, which come last and are void in label images; those without a class are listed under
  every class.
* **Images** are JPEG of quality 95, as VOC's readers append ``.jpg`` to names; ``images: png``
  links the lossless originals instead, for readers that use the name in the XML file.

References: Everingham and Winn, "The PASCAL Visual Object Classes Challenge 2012 Development Kit";
VOC2011 annotation guidelines.
"""

from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from functools import lru_cache
from pathlib import Path
from typing import Any, ClassVar, Literal
from xml.sax.saxutils import escape

import cv2
import numpy as np

from gen_data.core.capture import Channel
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import ImageTruth, ObjectTruth, Sample
from gen_data.exporters import base, coco, fragments
from gen_data.exporters.conventions import ANY_LENS, Conventions
from gen_data.exporters.ignored_regions import each_class
from gen_data.exporters.image_files import link_or_copy, read_pixels
from gen_data.exporters.label_colors import voc_palette
from gen_data.exporters.label_png import UInt16, encode_label_png, number_masks
from gen_data.exporters.sensor_selection import check_channels, photographs
from gen_data.exporters.sequences import write_bytes, write_text

YEAR = "VOCdevkit/VOC2012"
"""Folder of the data set; readers know the years 2007 to 2012."""
VOID = 255
LABELS_MAX = 254
JPEG_QUALITY = 95
TRUNCATED = 0.15
"""Share of the silhouette outside the image above which ``truncated`` is 1."""
OCCLUDED = 0.05
"""Hidden share of the silhouette in the image above which ``occluded`` is 1."""
SETS = {"train": ("train", "trainval"), "val": ("val", "trainval"), "test": ("test",)}
"""Image sets that each split belongs to."""
FOLDERS = {
    ".xml": "Annotations",
    ".class.png": "SegmentationClass",
    ".object.png": "SegmentationObject",
}


class Voc(base.ExporterBase):
    """Pascal VOC boxes and label images of all cameras with the rgb channel."""

    type: Literal["voc"] = "voc"
    conventions: ClassVar[Conventions] = Conventions(
        box="first and last pixel, from 1", lens=ANY_LENS
    )
    annotators: ClassVar[frozenset[str]] = frozenset({"instance_masks", "visibility"})

    image_formats: ClassVar[frozenset[str]] = base.ANY_FORMAT
    images: Literal["jpeg", "png"] = "jpeg"
    """JPEG files, which all readers take: of quality 95, or links if the camera writes JPEG; or
    links to the files as they are."""

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent.

        Raises:
            ConfigError: no sensor writes the rgb channel, there are too many categories, two have
                one name of files, or ``labelmap.txt`` cannot hold one.
        """
        check_channels(info, (), self.type)
        for category in info.categories:
            if ":" in category or category.startswith("#"):
                raise ConfigError(
                    f"exporter '{self.type}': category '{category}': labelmap.txt has ':' between "
                    "columns and '#' before comments; rename it by a label map"
                )
        base.check_distinct(self.type, info, _file_word)
        if len(info.categories) > LABELS_MAX:
            raise ConfigError(
                f"exporter '{self.type}': label images have room for {LABELS_MAX} categories, but "
                f"there are {len(info.categories)}; use coco, or merge some by a label map"
            )

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write XML file, label images and JPEG of every image, and a JSON line for it.

        Raises:
            ConfigError: see ``check``.
            StorageError: an image is missing.
        """
        self.check(info)
        rows = [
            self._write_image(info, sample, sensor, shard_dir)
            for sample, sensor in photographs(info, samples)
        ]
        fragments.write_fragment(shard_dir / self.type, "images", rows)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Link the files of all shards, and list the images of every set and class."""
        root = dataset_dir / YEAR
        for folder in ("Main", "Segmentation"):
            (root / "ImageSets" / folder).mkdir(parents=True, exist_ok=True)
        write_text(root / "labelmap.txt", labelmap_text(info.categories))
        with ExitStack() as stack:
            files: dict[str, Any] = {}
            for shard_dir, row in fragments.fragment_rows(shard_dirs, self.type, "images"):
                stem = row["stem"]
                for suffix, folder in FOLDERS.items():
                    source = shard_dir / f"{self.type}/{stem}{suffix}"
                    link_or_copy(source, root / f"{folder}/{stem}{source.suffix}")
                image = self._image(info, shard_dir, row)
                link_or_copy(image, root / f"JPEGImages/{row['file_name']}")
                for name, line in _list_lines(info, row):
                    if name not in files:
                        path = root / "ImageSets" / f"{name}.txt"
                        file = path.open("w", encoding="utf-8", newline="\n")
                        files[name] = stack.enter_context(file)
                    files[name].write(line)

    def _write_image(
        self, info: DatasetInfo, sample: Sample, sensor: str, shard_dir: Path
    ) -> dict[str, Any]:
        truth = sample.truth[sensor]
        listed = [thing for thing in truth.objects if thing.box is not None]
        # VOC's files name objects by their order; ignored ones have no number in label images.
        listed.sort(key=lambda thing: thing.ignored)
        stem = Path(coco.image_name(sample.index, sensor)).stem
        file_name = f"{stem}{self._suffix(info, sensor)}"
        row = {
            "stem": stem,
            "file_name": file_name,
            "sensor": sensor,
            "sample": sample.index,
            "split": sample.split,
            "shown": _shown(each_class(info, listed)),
        }
        folder = shard_dir / self.type
        text = annotation_text(info, truth, listed, file_name)
        write_bytes(folder / f"{stem}.xml", text.encode())
        for suffix, image in zip(
            (".class.png", ".object.png"), label_images(truth, listed), strict=True
        ):
            write_bytes(folder / f"{stem}{suffix}", image)
        if self._encodes(info, sensor):
            source = info.media_path(shard_dir, sensor, Channel.RGB, sample.index)
            write_bytes(folder / f"{stem}.jpg", encode_jpeg(source))
        return row

    def _encodes(self, info: DatasetInfo, sensor: str) -> bool:
        """Whether it makes JPEG files of other ones."""
        return self.images == "jpeg" and info.encoding(sensor, Channel.RGB).format != "jpeg"

    def _suffix(self, info: DatasetInfo, sensor: str) -> str:
        return ".jpg" if self.images == "jpeg" else info.encoding(sensor, Channel.RGB).suffix

    def _image(self, info: DatasetInfo, shard_dir: Path, row: dict[str, Any]) -> Path:
        if self._encodes(info, row["sensor"]):
            return shard_dir / f"{self.type}/{row['file_name']}"
        return info.media_path(shard_dir, row["sensor"], Channel.RGB, row["sample"])


def labelmap_text(categories: Sequence[str]) -> str:
    """Classes and colours of label images, as CVAT and Datumaro read them."""
    names = {0: "background", **dict(enumerate(categories, 1)), VOID: "ignored"}
    rows = (f"{names[k]}:{','.join(map(str, voc_palette()[k]))}::\n" for k in sorted(names))
    return "# label:color_rgb:parts:actions\n" + "".join(rows)


def annotation_text(
    info: DatasetInfo, truth: ImageTruth, listed: Sequence[ObjectTruth], file_name: str
) -> str:
    """Text of an XML file."""
    camera = truth.camera.intrinsics
    objects = "".join(_object_text(info, thing) for thing in each_class(info, listed))
    return (
        "<annotation>\n"
        f"\t<folder>VOC2012</folder>\n\t<filename>{escape(file_name)}</filename>\n"
        f"\t<source>\n\t\t<database>{escape(info.name)}</database>\n"
        "\t\t<annotation>gen-data</annotation>\n\t\t<image>synthetic</image>\n\t</source>\n"
        f"\t<size>\n\t\t<width>{camera.width_px}</width>\n\t\t<height>{camera.height_px}</height>\n"
        "\t\t<depth>3</depth>\n\t</size>\n\t<segmented>1</segmented>\n"
        f"{objects}</annotation>\n"
    )


def label_images(truth: ImageTruth, listed: Sequence[ObjectTruth]) -> tuple[bytes, bytes]:
    """PNG files of classes and of objects, indices of VOC's colours.

    Args:
        truth: Truth of the image.
        listed: Visible objects in the order of the XML file. Ignored ones, and those after the
            254th, are void.
    """
    camera = truth.camera.intrinsics
    numbers = number_masks(listed, camera.height_px, camera.width_px)
    void = [thing.ignored or k > LABELS_MAX for k, thing in enumerate(listed, 1)]
    classes = [VOID if v else t.instance.category_id for v, t in zip(void, listed, strict=True)]
    objects = [VOID if v else k for k, v in enumerate(void, 1)]
    return _indices_png(numbers, classes), _indices_png(numbers, objects)


def _indices_png(numbers: UInt16, indices: Sequence[int]) -> bytes:
    """PNG file of indices by number of object, from 1."""
    return encode_label_png(numbers, np.array([0, *indices], np.uint8), voc_palette())


def encode_jpeg(source: Path) -> bytes:
    """Encode a PNG file as JPEG. Raises StorageError if the file is missing or no PNG."""
    image = read_pixels(source, is_bgr=True)
    _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return data.tobytes()


def _object_text(info: DatasetInfo, thing: ObjectTruth) -> str:
    assert thing.box is not None, "invisible objects are not listed"
    assert thing.truncation is not None, "the annotation visibility is in `needs`"
    assert thing.occlusion is not None, "the annotation visibility is in `needs`"
    box = thing.box
    return (
        f"\t<object>\n\t\t<name>{escape(info.categories[thing.instance.category_id - 1])}</name>\n"
        "\t\t<pose>Unspecified</pose>\n"
        f"\t\t<truncated>{int(thing.truncation > TRUNCATED)}</truncated>\n"
        f"\t\t<occluded>{int(thing.occlusion > OCCLUDED)}</occluded>\n"
        f"\t\t<difficult>{int(thing.ignored)}</difficult>\n"
        f"\t\t<bndbox>\n\t\t\t<xmin>{box.x_min + 1}</xmin>\n\t\t\t<ymin>{box.y_min + 1}</ymin>\n"
        f"\t\t\t<xmax>{box.x_max}</xmax>\n\t\t\t<ymax>{box.y_max}</ymax>\n\t\t</bndbox>\n"
        "\t</object>\n"
    )


def _shown(listed: Iterable[ObjectTruth]) -> dict[str, int]:
    """By category id: 1 if an object counts, 0 if all of them are ignored."""
    shown: dict[str, int] = {}
    for thing in listed:
        key = str(thing.instance.category_id)
        shown[key] = max(shown.get(key, 0), int(not thing.ignored))
    return shown


def _list_lines(info: DatasetInfo, row: dict[str, Any]) -> Iterable[tuple[str, str]]:
    """Image sets that list an image, each with its line."""
    stem = row["stem"]
    for name in SETS.get(row["split"], (row["split"],)):
        yield f"Main/{name}", f"{stem}\n"
        yield f"Segmentation/{name}", f"{stem}\n"
        for k, category in enumerate(info.categories, 1):
            yield (
                f"Main/{_file_word(category)}_{name}",
                f"{stem} {row['shown'].get(str(k), -1):2d}\n",
            )


@lru_cache(maxsize=1024)
def _file_word(category: str) -> str:
    return "".join(c if c.isalnum() else "-" for c in category)
