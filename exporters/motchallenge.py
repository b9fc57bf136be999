"""MOTChallenge: one folder per sequence, in the layout of MOT16 to MOT20.

::

    street-train/street-0003/seqinfo.ini        street-train/street-0003/img1/000001.png
    street-train/street-0003/gt/gt.txt          street-val/..., street-test/...
    seqmaps/street-train.txt                    sequences of a split, for TrackEval

Rows of ``gt.txt``: ``frame,id,left,top,width,height,flag,class,visibility``. Frames, ids and pixels
start at 1; ids are instance ids; ``flag`` is 1 for scored objects, which are pedestrians only, as
in MOT16. Ignored objects are distractors (8): evaluations remove tracks on them, while tracks on
pedestrians with the flag 0 count as false. ``visibility`` is the visible fraction of the whole
silhouette. A frame is an instant at which the camera reads; after a frame that is missing, another
sequence starts, numbered behind all views, since readers count the images.

Reference: Milan et al., "MOT16: A Benchmark for Multi-Object Tracking", 2016, table 5 (classes);
its static person (7) sits or lies. Vans, trucks and buses are cars here; categories without a class
have no rows.
"""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

from gen_data.core import capture, scene
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import ImageTruth, ObjectTruth, Sample
from gen_data.exporters import base, image_files, sensor_selection, sequences
from gen_data.exporters.conventions import ANY_LENS, Conventions

PEDESTRIAN, PERSON_ON_VEHICLE, BICYCLE, MOTORBIKE, STATIC_PERSON, DISTRACTOR = 1, 2, 4, 5, 7, 8
CLASSES = {
    "pedestrian": PEDESTRIAN,
    "person": PEDESTRIAN,
    "cyclist": PERSON_ON_VEHICLE,
    "motorcyclist": PERSON_ON_VEHICLE,
    "car": 3,
    "van": 3,
    "truck": 3,
    "bus": 3,
    "bicycle": BICYCLE,
    "motorcycle": MOTORBIKE,
}
"""MOT16's class numbers by category."""
RIDDEN = frozenset({BICYCLE, MOTORBIKE})
"""Classes that become persons on vehicles by the attribute ``rider``."""
STATIC_POSES = frozenset({"sit", "sitting", "lie", "lying"})
"""Values of the attribute ``pose`` that turn a person into a static person."""
SEQUENCES_MAX = 10_000
"""Names of sequences have four digits."""


class MotChallenge(base.ExporterBase):
    """MOTChallenge: images and tracks of every sequence of one camera."""

    type: Literal["motchallenge"] = "motchallenge"
    conventions: ClassVar[Conventions] = Conventions(
        box="left + 1, top + 1, width, height", lens=ANY_LENS, time="number of the frame, from 1"
    )
    annotators: ClassVar[frozenset[str]] = frozenset({"boxes2d", "visibility"})
    own_classes: ClassVar[bool] = True

    image_formats: ClassVar[frozenset[str]] = base.ANY_FORMAT
    camera: str = ""
    """Sensor of the images; empty = the first one, by name, with the rgb channel."""
    boxes: Literal["visible", "whole"] = "visible"
    """Boxes around the visible pixels, or around the whole silhouette, including hidden parts and
    parts outside the image, as MOT16's annotators estimated it."""

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent.

        Raises:
            ConfigError: the camera is missing, there are too many sequences, or no category has a
                class in this format.
        """
        sensor_selection.rgb_camera(info, self.camera, self.type)
        base.check_classes(self.type, info, CLASSES)
        sequences.check_sequence_count(info, SEQUENCES_MAX, self.type)

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write a line per frame with the rows of its objects."""
        self.check(info)
        camera = sensor_selection.rgb_camera(info, self.camera, self.type)
        rows = [
            self._row(info, sample, sample.truth[camera])
            for sample in samples
            if camera in sample.truth
        ]
        sequences.write_frames(shard_dir / self.type, rows)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Link images, join rows, and list the sequences of each split."""
        benchmark = "_".join(info.name.split())
        names: dict[str, list[str]] = {}
        for number, frames in sequences.even_sequences(info, shard_dirs, self.type).items():
            name = f"{benchmark}-{number:04d}"
            split = frames[0].row["split"]
            names.setdefault(split, []).append(name)
            self._write_sequence(info, frames, dataset_dir / f"{benchmark}-{split}" / name)
        for split, listed in names.items():
            lines = "".join(f"{name}\n" for name in ("name", *listed))
            sequences.write_text(dataset_dir / f"seqmaps/{benchmark}-{split}.txt", lines)

    def _row(self, info: DatasetInfo, sample: Sample, truth: ImageTruth) -> dict[str, Any]:
        rows = (gt_columns(thing, self.boxes) for thing in truth.objects)
        camera = truth.camera.intrinsics
        return sequences.frame_facts(info, sample) | {
            "size_px": [camera.width_px, camera.height_px],
            "gt": [row for row in rows if row],
        }

    def _write_sequence(
        self, info: DatasetInfo, frames: Sequence[sequences.Frame], folder: Path
    ) -> None:
        camera = sensor_selection.rgb_camera(info, self.camera, self.type)
        width_px, height_px = frames[0].row["size_px"]
        lines = [f"{k},{row}\n" for k, frame in enumerate(frames, 1) for row in frame.row["gt"]]
        sequences.write_text(folder / "gt/gt.txt", "".join(lines))
        suffix = info.encoding(camera, capture.Channel.RGB).suffix
        sequences.write_text(
            folder / "seqinfo.ini",
            f"[Sequence]\nname={folder.name}\nimDir=img1\n"
            f"frameRate={sequences.frame_rate_hz(info, frames):g}\nseqLength={len(frames)}\n"
            f"imWidth={width_px}\nimHeight={height_px}\nimExt={suffix}\n",
        )
        for k, frame in enumerate(frames, 1):
            source = info.media_path(frame.shard_dir, camera, capture.Channel.RGB, frame.index)
            image_files.link_or_copy(source, folder / f"img1/{k:06d}{suffix}")


def gt_columns(thing: ObjectTruth, boxes: Literal["visible", "whole"]) -> str:
    """Format the eight columns after the frame's number; empty for objects without a row."""
    box = thing.box if boxes == "visible" else thing.amodal_box
    number = mot_class(thing.instance)
    if thing.box is None or box is None or not number:
        return ""
    assert thing.visible_fraction is not None, "the annotation visibility is in `needs`"
    number = DISTRACTOR if thing.ignored else number
    flag = int(number == PEDESTRIAN)
    corner = f"{box.x_min + 1},{box.y_min + 1},{box.width_px},{box.height_px}"
    visibility = f"{min(thing.visible_fraction, 1.0):.6f}"
    return f"{thing.instance.instance_id},{corner},{flag},{number},{visibility}"


def _class_of(category: str) -> int:
    return CLASSES.get("_".join(category.lower().split()), 0)


def mot_class(instance: scene.Instance) -> int:
    """MOT16's class number of an object; 0 = none."""
    number = _class_of(instance.category)
    facts = dict(instance.attributes)
    if number == PEDESTRIAN and facts.get("pose") in STATIC_POSES:
        return STATIC_PERSON
    if number in RIDDEN and facts.get("rider") == "yes":
        return PERSON_ON_VEHICLE
    return number
