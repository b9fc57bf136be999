"""DOTA's format of oriented boxes in aerial images.

::

    <split>/images/000000012_camera.png
    <split>/labelTxt/000000012_camera.txt

A label file begins with ``imagesource:`` and ``gsd:`` (null: a perspective image has no single
ground sampling distance). Then a line per object: four corners ``x1 y1 ... x4 y4`` clockwise from
the front left one, its category, and whether it is ``difficult``. Categories have hyphens for
spaces, as DOTA's ``small-vehicle`` does. DOTA's corners are annotators' points of no defined pixel
centre; here they are image coordinates in which pixel ``i`` covers ``[i, i + 1)``, and may leave
the image.

Reference: https://captain-whu.github.io/DOTA/dataset.html, and its development kit.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

from pydantic import Field

from gen_data.core.capture import Channel
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import ObjectTruth, Sample
from gen_data.exporters import base, coco, fragments, image_files, image_rows, sequences
from gen_data.exporters.conventions import ANY_LENS, Conventions

HEADER = ("imagesource:gen-data", "gsd:null")


class Dota(image_rows.ImageRowsExporter):
    """DOTA labels of all cameras with the rgb channel.

    Attributes:
        difficult_below: Objects with a smaller visible fraction are ``difficult``; it needs the
            annotation visibility where it is above 0. DOTA leaves it to annotators.
    """

    type: Literal["dota"] = "dota"
    conventions: ClassVar[Conventions] = Conventions(
        pixel_centre="i + 0.5", box="corners along the edges of pixels", lens=ANY_LENS
    )

    difficult_below: float = Field(0.4, ge=0, le=1)

    @property
    def needs(self) -> frozenset[str]:
        """Names of the annotators that it requires."""
        return frozenset(
            {"oriented_boxes2d", "visibility"} if self.difficult_below else {"oriented_boxes2d"}
        )

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent.

        Raises:
            ConfigError: no sensor writes the rgb channel, or two categories are written alike.
        """
        super().check(info)
        base.check_distinct(self.type, info, _hyphenated)

    def image_row(self, info: DatasetInfo, sample: Sample, sensor: str) -> dict[str, Any]:
        """The lines of its label file."""
        suffix = info.encoding(sensor, Channel.RGB).suffix
        things = sample.truth[sensor].objects
        return {
            "file_name": coco.image_name(sample.index, sensor, suffix),
            "lines": [self._line(t) for t in things if t.oriented_box and not t.ignored],
        }

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Write the label files and link the images."""
        for split, rows in fragments.split_rows(shard_dirs, self.type):
            folder = dataset_dir / split
            for shard_dir, row in rows:
                name = Path(row["file_name"])
                text = "".join(f"{line}\n" for line in (*HEADER, *row["lines"]))
                sequences.write_text(folder / f"labelTxt/{name.stem}.txt", text)
                image_files.link_photograph(info, shard_dir, row, folder / "images" / name)

    def _line(self, thing: ObjectTruth) -> str:
        assert thing.oriented_box is not None, "filtered by the caller"
        corners = " ".join(f"{u:.1f} {v:.1f}" for u, v in thing.oriented_box)
        category = _hyphenated(thing.instance.category)
        share = thing.visible_fraction
        difficult = share is not None and share < self.difficult_below
        return f"{corners} {category} {int(difficult)}"


def _hyphenated(category: str) -> str:
    return "-".join(category.split())
