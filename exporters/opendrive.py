"""OpenDRIVE: the streets of each world, as one file.

::

    000003.xodr       roads, junctions, marks and crosswalks of world 3
    worlds.jsonl      one line per sample: ``index`` and ``world``, the file

Version 1.7, in the frame of the world. Lanes that run side by side are one road, whose reference
line is the border between the directions (``opendrive_roads.py``); every way through a junction is
a road of its junction. Reference lines are straight or cubic and pass through the places of the
scene's lanes to a micrometre. Heights are elevations and lateral shapes, marks are read from the
paint of the meshes. Lanes for turns in a median, and bays at an angle, are separate roads.

Types are ``driving``, ``biking``, ``parking`` and ``sidewalk``; ground between two lanes, such as
kerbs and verges, is ``none``. A lane that leads to several roads without a junction has a link to
the first of them. Not written: signals, and objects except crosswalks.

Reference: ASAM OpenDRIVE 1.7.
"""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import ClassVar, Literal

from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import Sample
from gen_data.core.scene import Scene
from gen_data.exporters import base, fragments, image_files
from gen_data.exporters.conventions import NO_CONVENTIONS, Conventions
from gen_data.exporters.opendrive_xml import opendrive_bytes
from gen_data.exporters.road_map import StreetExporter
from gen_data.exporters.sequences import write_bytes, write_text

WORLDS = "worlds"


class OpenDrive(StreetExporter):
    """OpenDRIVE 1.7: roads, lanes, junctions, heights, marks and crosswalks of each world."""

    type: Literal["opendrive"] = "opendrive"
    conventions: ClassVar[Conventions] = NO_CONVENTIONS
    image_formats: ClassVar[frozenset[str]] = base.ANY_FORMAT

    def check_scene(self, scene: Scene) -> None:
        """Reject scenes without a street, and lanes whose width changes."""
        super().check_scene(scene)
        for lane in scene.lanes:
            if lane.widths_m:
                raise ConfigError(
                    f"exporter '{self.type}': lane '{lane.name}' changes its width, which is not "
                    "written; leave the exporter out, the file of the road network has the lane"
                )

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write the file of each world of the shard, and a line per sample.

        Raises:
            ConfigError: a scene has no street.
        """
        self.check(info)
        folder = shard_dir / self.type
        rows = []
        for sample in samples:
            name = f"{sample.scene_index:06d}.xodr"
            if not (folder / name).exists():
                self.check_scene(sample.scene)
                write_bytes(folder / name, opendrive_bytes(sample.scene, self.library, info.name))
            rows.append({"index": sample.index, "world": name})
        fragments.write_fragment(folder, WORLDS, rows)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Link the files, and join the lines."""
        del info
        for shard_dir, row in fragments.fragment_rows(shard_dirs, self.type, WORLDS):
            target = dataset_dir / row["world"]
            if not target.exists():
                image_files.link_or_copy(shard_dir / self.type / row["world"], target)
        lines = list(fragments.fragment_lines([d / self.type for d in shard_dirs], WORLDS))
        write_text(dataset_dir / f"{WORLDS}.jsonl", "".join(f"{line}\n" for line in lines))
