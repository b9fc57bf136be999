"""Occupancy grids: voxels with their state, object, class and motion, and who observes them.

::

    grids/000000012.npz                          every sample
    frames.jsonl                                 a line per sample: pose and size of its grid
    classes.json                                 names of the numbers in the grids
    occ3d/gts/<scene>/<token>/labels.npz         layout ``occ3d``
    surroundocc/<token>.npy                      layout ``surroundocc``
    openoccupancy/scene_<token>/occupancy/<token of the scan>.npy    layout ``openoccupancy``
    semantickitti/sequences/00/voxels/000000.*   layout ``semantickitti``: bin, label, invalid,
                                                 occluded

Arrays of ``grids`` are [x, y, z] along the axes of the frame ``T_world_frame``, from the corner
``low_m``: ``state`` (0 free, 1 surface, 2 interior), ``instance_id``, ``category_id``, ``surface``,
``observed_<sensor>``; ``moving`` [n, 3] lists voxels of moving objects and ``velocity_m_s`` [n, 3]
their velocities along the axes of the frame.

* **occ3d**: ``semantics``, ``mask_lidar``, ``mask_camera`` uint8, as Occ3D-nuScenes has them, and
  ``flow`` float16 [x, y, z, 2], velocity along X and Y [m/s] as in OpenOcc. Classes are the ones of
  nuScenes' lidarseg challenge, 0 = others, 17 = free; the inside of an object has its class, and
  the land below the ground is free and in no mask, as there. Scenes and tokens agree with
  ``nuscenes``. Its grid is 200 x 200 x 16 from (-40, -40, -1) m.
* **surroundocc**: rows ``x, y, z, class`` of voxels with a surface, int64 [n, 4], with the same
  classes. Its grid is 200 x 200 x 16 from (-50, -50, -5) m, 0.5 m each, in the scanner's frame.
* **openoccupancy**: rows ``z, y, x, class`` of voxels with a surface, uint16 [n, 4], with the same
  classes; its code ignores voxels of class 0. Tokens of scenes and scans agree with ``nuscenes``.
  Its grid is 512 x 512 x 40 from (-51.2, -51.2, -5) m, 0.2 m each, in the scanner's frame.
* **semantickitti**: flags of 8 voxels share a byte, the first one in its highest bit; ``label`` is
  uint16, 0 = free. ``bin``: voxels with a point of the scan. ``invalid``: interiors, which no scan
  can show.
  ``occluded``: voxels that the scan does not observe. Sequences are numbered as in
  ``semantickitti``. Its grid is 256 x 256 x 32 from (0, -25.6, -2) m, 0.2 m each, in the scanner's
  frame.

Other grids are written as they are; readers with fixed sizes need the ones above.

References: Tian et al., "Occ3D", NeurIPS 2023; Wei et al., "SurroundOcc", ICCV 2023; Wang et al.,
"OpenOccupancy", ICCV 2023; Liu et al., "OpenOcc" of the CVPR 2024 challenge on occupancy and flow;
Behley et al., "SemanticKITTI", ICCV 2019, and semantic-kitti-api.
"""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from gen_data.core import se3
from gen_data.core.asset_types import SURFACES
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import VOXEL_STATES, Occupancy, Sample
from gen_data.core.scene import Scene
from gen_data.core.serialization import canonical_json
from gen_data.exporters import base, image_files, nuscenes_classes, point_cloud_io, semantickitti
from gen_data.exporters.conventions import ANY_LENS, SAMPLE, Conventions
from gen_data.exporters.fragments import fragment_rows
from gen_data.exporters.npz import npy_bytes, npz_bytes
from gen_data.exporters.nuscenes_recording import LIDAR_TOP, scene_name
from gen_data.exporters.nuscenes_tables import Tokens
from gen_data.exporters.sensor_selection import has_scans, laser_scanner
from gen_data.exporters.sequences import (
    FRAMES,
    frame_facts,
    write_bytes,
    write_frames,
    write_json,
    write_text,
)

Layout = Literal["occ3d", "surroundocc", "openoccupancy", "semantickitti"]
FREE = 17
"""Class of free voxels in Occ3D."""
VOXEL = np.dtype([("instance_id", "<u2"), ("surface", "u1")])
FRAMES_NAME = "frames.jsonl"
LEVEL = 1
"""Of compression: higher ones take longer and save little."""
PARTS = ("bin", "label", "invalid", "occluded")
"""Files of a scan in SemanticKITTI."""


class OccupancyGrids(base.ExporterBase):
    """Occupancy grids of all samples, also as Occ3D, SurroundOcc, OpenOccupancy, SemanticKITTI.

    Attributes:
        layouts: Further layouts.
        lidar: Scanner whose scans ``semantickitti`` lists; empty = the first one by name.
    """

    type: Literal["occupancy"] = "occupancy"
    conventions: ClassVar[Conventions] = Conventions(lens=ANY_LENS, time=SAMPLE)
    annotators: ClassVar[frozenset[str]] = frozenset({"occupancy"})
    own_classes: ClassVar[bool] = True
    image_formats: ClassVar[frozenset[str]] = base.ANY_FORMAT
    layouts: tuple[Layout, ...] = ()
    lidar: str = ""

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set without the scanner that a layout needs.

        Raises:
            ConfigError: there is no such scanner.
        """
        listing = [name for name in ("semantickitti", "openoccupancy") if name in self.layouts]
        if listing and not laser_scanner(info, self.lidar, self.type):
            raise ConfigError(
                f"exporter '{self.type}': layouts: '{listing[0]}' lists scans, but there is no"
                " lidar; add a sensor of that type"
            )

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write the grids of each sample, and a line for it."""
        self.check(info)
        folder = shard_dir / self.type
        rows = []
        for sample in samples:
            assert sample.frame is not None, "occupancy is in `needs`"
            grid = sample.frame.occupancy
            assert grid is not None, "occupancy is in `needs`"
            for name, data in self._files(info, sample, grid, shard_dir).items():
                write_bytes(folder / f"{sample.index:09d}.{name}", data)
            rows.append(frame_facts(info, sample) | {"scene": sample.scene_index} | _facts(grid))
        write_frames(folder, rows)

    def _files(
        self, info: DatasetInfo, sample: Sample, grid: Occupancy, shard_dir: Path
    ) -> dict[str, bytes]:
        """Contents of the files of a sample by their ending."""
        velocities = grid.velocities_m_s(sample.scene.instances)
        files = {"npz": npz_bytes(_arrays(sample, grid, velocities), LEVEL)}
        if {"occ3d", "surroundocc", "openoccupancy"} & set(self.layouts):
            classes = driving_classes(sample.scene, grid)
            surface = grid.state == VOXEL_STATES.index("surface")
            rows = np.column_stack([np.argwhere(surface), classes[surface]])
        if "occ3d" in self.layouts:
            labels = {
                "semantics": classes,
                "mask_lidar": _seen_by(grid, info.lidars),
                "mask_camera": _seen_by(grid, info.cameras),
                "flow": velocities[..., :2].astype("<f2"),
            }
            files["occ3d"] = npz_bytes(labels, LEVEL)
        if "surroundocc" in self.layouts:
            files["surroundocc"] = npy_bytes(rows.astype("<i8"))
        if "openoccupancy" in self.layouts:
            files["openoccupancy"] = npy_bytes(rows[:, [2, 1, 0, 3]].astype("<u2"))
        lidar = laser_scanner(info, self.lidar, self.type)
        if "semantickitti" in self.layouts and has_scans(shard_dir, lidar, sample.index):
            points = point_cloud_io.read_points(shard_dir, lidar, sample.index)
            T_world_lidar = sample.scene_of(lidar).lidar(lidar).T_world_lidar
            p_world = T_world_lidar.apply(points["position_m"].astype(np.float64))
            files |= completion_files(sample.scene, grid, p_world, lidar)
        return files

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Link the grids of all shards, by the names of each layout."""
        token = Tokens(info)
        lines = []
        for shard_dir, row in fragment_rows(shard_dirs, self.type, FRAMES):
            stem = shard_dir / self.type / f"{row['index']:09d}"
            key = token("sample", row["index"])
            scene = token("scene", row["sequence"])
            scan = token("sample_data", row["index"], LIDAR_TOP)
            targets = {
                "npz": f"grids/{row['index']:09d}.npz",
                "occ3d": f"occ3d/gts/{scene_name(row['sequence'])}/{key}/labels.npz",
                "surroundocc": f"surroundocc/{key}.npy",
                "openoccupancy": f"openoccupancy/scene_{scene}/occupancy/{scan}.npy",
            }
            for ending, target in targets.items():
                if ending == "npz" or ending in self.layouts:
                    image_files.link_or_copy(stem.with_suffix(f".{ending}"), dataset_dir / target)
            lines.append(canonical_json({**row, "sample_token": key}) + "\n")
        write_text(dataset_dir / FRAMES_NAME, "".join(lines))
        names = {"categories": ["", *info.categories], "surfaces": SURFACES, "states": VOXEL_STATES}
        write_json(dataset_dir / "classes.json", names)
        if "semantickitti" in self.layouts:
            self._link_scans(info, shard_dirs, dataset_dir / "semantickitti")

    def _link_scans(self, info: DatasetInfo, shard_dirs: Sequence[Path], root: Path) -> None:
        numbered = semantickitti.numbered_sequences(info, shard_dirs, self.type)
        for number, frames in numbered.items():
            folder = root / f"sequences/{number:02d}/voxels"
            stems = [f.shard_dir / self.type / f"{f.index:09d}" for f in frames]
            scans = [stem for stem in stems if stem.with_suffix(".bin").exists()]
            for k, stem in enumerate(scans):
                for part in PARTS:
                    image_files.link_or_copy(
                        stem.with_suffix(f".{part}"), folder / f"{k:06d}.{part}"
                    )


def driving_classes(scene: Scene, grid: Occupancy) -> NDArray[np.uint8]:
    """Classes of Occ3D-nuScenes, uint8 [x, y, z]; 17 = free, 0 = others."""
    occupied = _objects(grid)
    found = np.full(grid.state.shape, FREE, np.uint8)
    voxels = _records(grid, occupied)
    members = voxels["instance_id"].astype(np.int64)
    categories = nuscenes_classes.point_classes(voxels, members, scene, 0)
    found[occupied] = nuscenes_classes.challenge_classes()[categories]
    return found


def completion_files(
    scene: Scene, grid: Occupancy, p_world: se3.Array, lidar: str
) -> dict[str, bytes]:
    """Files of SemanticKITTI's scene completion by their ending; the points are its scan's."""
    shape = grid.state.shape
    occupied = _objects(grid)
    labels = np.zeros(shape, "<u2")
    labels[occupied] = semantickitti.point_labels(_records(grid, occupied), scene) & 0xFFFF
    hit = np.zeros(shape, np.bool_)
    p_grid = grid.T_world_frame.inverse().apply(p_world)
    voxels = np.floor((p_grid - grid.low_m) / grid.voxel_m).astype(np.intp)
    hit[tuple(voxels[((voxels >= 0) & (voxels < shape)).all(axis=1)].T)] = True
    flags = {
        "bin": hit,
        "invalid": grid.state == VOXEL_STATES.index("interior"),
        "occluded": ~grid.observed[lidar],
    }
    packed = {name: np.packbits(mask).tobytes() for name, mask in flags.items()}
    return {**packed, "label": labels.tobytes()}


def _objects(grid: Occupancy) -> NDArray[np.bool_]:
    """Occupied voxels without the land below the ground, which has no surface and no object."""
    return np.asarray((grid.state == VOXEL_STATES.index("surface")) | (grid.instance_id > 0))


def _records(grid: Occupancy, chosen: NDArray[np.bool_]) -> NDArray[np.void]:
    """Voxels as points with the object and surface in them."""
    voxels = np.zeros(int(chosen.sum()), VOXEL)
    voxels["instance_id"], voxels["surface"] = grid.instance_id[chosen], grid.surface[chosen]
    return voxels


def _arrays(
    sample: Sample, grid: Occupancy, velocities: NDArray[np.float32]
) -> dict[str, NDArray[Any]]:
    instances = sample.scene.instances
    categories = np.zeros(max((i.instance_id for i in instances), default=0) + 1, "<u2")
    for instance in instances:
        categories[instance.instance_id] = instance.category_id
    moving = np.argwhere((velocities != 0.0).any(axis=-1))
    return {
        "state": grid.state,
        "instance_id": grid.instance_id,
        "category_id": categories[grid.instance_id],
        "surface": grid.surface,
        "moving": moving.astype("<i4"),
        "velocity_m_s": velocities[tuple(moving.T)],
        **{f"observed_{name}": mask for name, mask in grid.observed.items()},
    }


def _seen_by(grid: Occupancy, sensors: Iterable[str]) -> NDArray[np.uint8]:
    """Whether any of some sensors observes a voxel, uint8 [x, y, z]."""
    seen = np.zeros(grid.state.shape, np.uint8)
    for name in sensors:
        if name in grid.observed:
            seen |= grid.observed[name]
    return seen


def _facts(grid: Occupancy) -> dict[str, Any]:
    return {
        "T_world_frame": grid.T_world_frame.matrix().tolist(),
        "low_m": grid.low_m,
        "voxel_m": grid.voxel_m,
        "shape": grid.state.shape,
        "sensors": sorted(grid.observed),
    }
