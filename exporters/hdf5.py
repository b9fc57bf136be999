"""One container per image with all its arrays, under the keys of BlenderProc.

::

    <split>/000000012_color.hdf5    or .npz
    categories.json                 names by category id

=========================  =====================  ================================================
key                        array                  meaning
=========================  =====================  ================================================
colors                     uint8 [h, w, 3]        sRGB
depth, distance            float32 [h, w]         along the optical axis, along the ray [m]; inf
normals                    float32 [h, w, 3]      ``(n + 1) / 2``, X right, Y up, Z to the camera;
                                                  0.5
instance_segmaps           uint16 [h, w]          instance id; 0
category_id_segmaps        uint16 [h, w]          category id; 0
nocs                       float32 [h, w, 4]      ``(p + 1) / 2`` for the position p in the object's
                                                  frame [m], and 1; 0
forward_flow,              float32 [h, w, 2]      displacement to the right and down [px]; NaN
backward_flow
instance_attribute_maps    JSON                   list: ``idx``, ``category_id``, ``name``, ... of
                                                  each visible object, after the background
campose                    JSON                   list of one: ``cam2world_matrix`` (X right, Y up,
                                                  Z backwards, as in Blender), ``location``,
                                                  ``cam_K``, ``fov_x``, ``fov_y`` [rad]
K                          float64 [3, 3]         intrinsics
lens                       JSON                   of other lenses than a pinhole, before ``K``:
                                                  ``model``, ``distortion`` with the names
                                                  ``coefficients`` in OpenCV's order,
                                                  ``half_field_rad``
T_world_camera             float64 [4, 4]         pose; X right, Y down, Z forward
=========================  =====================  ================================================

A channel that the camera does not write has no key; channels that BlenderProc does not have keep
their names (``part``, ``disparity``, ...). ``nocs`` is in [0, 1] for objects within 1 m of their
origin, and metric for all, as BlenderProc's ``render_nocs`` has it: positions are not scaled to the
object's box, as ``object_coordinates`` of the shards are; its camera needs the channel
``instance`` too. ``K`` and ``cam_K`` refer to pixel centres at whole
numbers, as BlenderProc's do: the principal point is ours minus 0.5. Instances without an entry in
``instance_attribute_maps`` are not annotated. JSON texts are byte strings.

Reference: the writer and the documentation of BlenderProc 2, https://dlr-rm.github.io/BlenderProc.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

import deflate
import numpy as np
from numpy.typing import NDArray

from gen_data.core import errors, intrinsics, optional_packages, se3, serialization
from gen_data.core.capture import Channel
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.reported import reported
from gen_data.core.sample import ImageTruth, ObjectTruth, Sample
from gen_data.core.scene import Scene
from gen_data.exporters import base, fragments, image_files, npz, sensor_selection
from gen_data.exporters.conventions import Conventions
from gen_data.exporters.lens_fields import lens_fields
from gen_data.exporters.sequences import write_json

NOCS = "nocs"
KEYS = {
    Channel.RGB: "colors",
    Channel.Z_DEPTH: "depth",
    Channel.RANGE: "distance",
    Channel.NORMALS: "normals",
    Channel.INSTANCE: "instance_segmaps",
    Channel.CATEGORY: "category_id_segmaps",
    Channel.OBJECT_COORDINATES: NOCS,
    Channel.FLOW_FORWARD: "forward_flow",
    Channel.FLOW_BACKWARD: "backward_flow",
}
"""BlenderProc's keys; other channels keep their names."""

BLENDER_AXES = np.array([1.0, -1.0, -1.0])
"""Signs of our camera axes along Blender's: Y up, Z backwards."""

LEVEL = 1
"""Level of gzip."""

FILES = "files"


class Hdf5(base.ExporterBase):
    """A container per image, with the keys of BlenderProc.

    Attributes:
        container: ``hdf5``, or ``npz`` for NumPy alone.
        compression: Compression of images: ``gzip`` as BlenderProc has it, or ``none`` for larger
            files that are written faster.
    """

    type: Literal["hdf5"] = "hdf5"
    conventions: ClassVar[Conventions] = Conventions(pixel_centre="i", lens="any; `lens`")

    image_formats: ClassVar[frozenset[str]] = base.ANY_FORMAT
    container: Literal["hdf5", "npz"] = "hdf5"
    compression: Literal["gzip", "none"] = "gzip"

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set without images, or a machine without h5py.

        Raises:
            ConfigError: no camera writes a channel, one with object coordinates writes no
                instances, or the package is missing.
        """
        if not any(info.media.values()):
            raise errors.ConfigError(
                f"exporter '{self.type}': no camera writes a channel; add an rgb_camera"
            )
        for camera, channels in info.media.items():
            if Channel.OBJECT_COORDINATES in channels:
                sensor_selection.require_channels(info, camera, [Channel.INSTANCE], self.type)
        missing = optional_packages.missing_packages("h5py")
        if self.container == "hdf5" and missing:
            raise errors.ConfigError(f"exporter 'hdf5' {missing}, or set container: npz")

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write one container per image.

        Raises:
            ConfigError: see ``check``.
            StorageError: an image of the shard is missing.
        """
        self.check(info)
        folder = shard_dir / self.type
        rows = []
        for sample in samples:
            for camera, channels in info.media.items():
                if camera not in sample.truth or not channels:
                    continue
                arrays = {
                    KEYS.get(c, c.value): _read(info, shard_dir, sample, camera, c)
                    for c in channels
                }
                if NOCS in arrays:
                    ids = arrays[KEYS[Channel.INSTANCE]]
                    arrays[NOCS] = _object_colors(arrays[NOCS], ids, sample.scene_of(camera))
                arrays |= _camera_arrays(sample.truth[camera])
                name = f"{sample.split}/{sample.index:09d}_{camera}.{self.container}"
                self._write(folder / name, arrays)
                rows.append({"file": name})
        fragments.write_fragment(folder, FILES, rows)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Link the containers of all shards into one tree."""
        categories = {str(k): name for k, name in enumerate(info.categories, 1)}
        write_json(dataset_dir / "categories.json", categories)
        for shard_dir, row in fragments.fragment_rows(shard_dirs, self.type, FILES):
            image_files.link_or_copy(shard_dir / self.type / row["file"], dataset_dir / row["file"])

    def _write(self, path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        if self.container == "npz":
            path.write_bytes(npz.npz_bytes(arrays, LEVEL if self.compression == "gzip" else 0))
        else:
            compressed = self.compression == "gzip"
            write_hdf5(path, arrays, self.conventions.facts(), compressed=compressed)


def write_hdf5(
    path: Path,
    arrays: Mapping[str, NDArray[Any]],
    attributes: Mapping[str, str] | None = None,
    *,
    compressed: bool = True,
) -> None:
    """Write arrays by name as an HDF5 file; compressed images are one chunk each.

    Args:
        path: File to write.
        arrays: Arrays by key.
        attributes: Attributes of the file, by name.
        compressed: Whether images are compressed.
    """
    import h5py

    with h5py.File(path, "w", libver="earliest") as file:
        file.attrs.update(attributes or {})
        for name, array in arrays.items():
            if array.size <= 16 or not compressed:
                file.create_dataset(name, data=array)
                continue
            dataset = file.create_dataset(
                name,
                array.shape,
                array.dtype,
                chunks=array.shape,
                compression="gzip",
                compression_opts=LEVEL,
                shuffle=array.itemsize > 1,
            )
            # HDF5's own zlib takes several times as long, and its bytes depend on the build.
            packed = deflate.zlib_compress(_shuffled(array), LEVEL)
            dataset.id.write_direct_chunk((0,) * array.ndim, bytes(packed))


def _shuffled(array: NDArray[Any]) -> bytes:
    """Bytes as HDF5's filter ``shuffle`` orders them: all first ones, all second ones, ..."""
    flat = np.ascontiguousarray(array).reshape(-1)
    return bytes(flat.view(np.uint8).reshape(-1, array.itemsize).T.tobytes())


def _read(
    info: DatasetInfo, shard_dir: Path, sample: Sample, name: str, channel: Channel
) -> NDArray[Any]:
    path = info.media_path(shard_dir, name, channel, sample.index)
    camera = sample.truth[name].camera.intrinsics
    size_px = (camera.width_px, camera.height_px)
    pixels = image_files.read_image(path, channel, info.depth_scale_m, size_px)
    if channel is Channel.NORMALS:
        pixels = ((pixels * BLENDER_AXES + 1.0) * 0.5).astype(np.float32)
    return pixels


def _object_colors(
    coordinates: NDArray[np.float32], ids: NDArray[np.uint16], scene: Scene
) -> NDArray[np.float32]:
    """BlenderProc's colours of positions in objects' frames, with an alpha, float32 [h, w, 4].

    Args:
        coordinates: Positions in the boxes of instances, [0, 1], [h, w, 3].
        ids: Instance of each pixel [h, w]; 0 = none.
        scene: The scene with their boxes.
    """
    top = max((thing.instance_id for thing in scene.instances), default=0)
    low_m, size_m = np.zeros((2, max(top, int(ids.max(initial=0))) + 1, 3))
    for thing in scene.instances:
        low_m[thing.instance_id] = thing.box_min_m
        size_m[thing.instance_id] = np.subtract(thing.box_max_m, thing.box_min_m)
    position_m = low_m[ids] + coordinates * size_m[ids]
    there = (ids > 0)[..., None]
    colors = np.concatenate([0.5 * position_m + 0.5, np.ones_like(position_m[..., :1])], axis=-1)
    found: NDArray[np.float32] = np.where(there, colors, 0.0).astype(np.float32)
    return found


def _camera_arrays(truth: ImageTruth) -> dict[str, NDArray[Any]]:
    """Arrays of an image that are not a channel."""
    seen = [thing for thing in truth.objects if thing.box is not None]
    background: dict[str, Any] = {"idx": 0, "category_id": 0, "name": "background"}
    T_world_camera = np.round(reported(truth.camera).T_world_camera.matrix(), 9) + 0.0
    return {
        "instance_attribute_maps": _text([background, *(_attributes(thing) for thing in seen)]),
        "campose": _text([_camera_pose(truth, T_world_camera)]),
        "K": _intrinsics(truth),
        **{key: _text(lens) for key, lens in lens_fields(truth.camera.intrinsics.lens).items()},
        "T_world_camera": T_world_camera,
    }


def _attributes(thing: ObjectTruth) -> dict[str, Any]:
    instance = thing.instance
    facts = {
        "idx": instance.instance_id,
        "category_id": instance.category_id,
        "name": instance.name,
        "category": instance.category,
        "asset": instance.asset,
    }
    if instance.subcategory:
        facts["subcategory"] = instance.subcategory
    if thing.ignored:
        facts["ignored"] = True
    return {**dict(instance.attributes), **facts}


def _intrinsics(truth: ImageTruth) -> se3.Array:
    """K for pixel centres at whole numbers, [3, 3]."""
    k = np.round(truth.camera.intrinsics.matrix(), 9)
    k[:2, 2] -= 0.5
    return k


def _camera_pose(truth: ImageTruth, T_world_camera: se3.Array) -> dict[str, Any]:
    """Pose with Blender's camera axes, and the field of view."""
    camera = truth.camera.intrinsics
    pose = T_world_camera.copy()
    pose[:3, :3] *= BLENDER_AXES
    fov_x, fov_y = fields_rad(camera)
    return {
        "cam2world_matrix": (pose + 0.0).tolist(),
        "location": pose[:3, 3].tolist(),
        "cam_K": _intrinsics(truth).tolist(),
        "fov_x": round(fov_x, 9),
        "fov_y": round(fov_y, 9),
    }


def fields_rad(camera: intrinsics.Intrinsics) -> tuple[float, float]:
    """Horizontal and vertical field of view.

    For a pinhole as BlenderProc has them, as if its principal point were centred. For other lenses
    the angles that the row and the column of the principal point see, within the lens's field.
    """
    width, height = camera.width_px, camera.height_px
    if camera.straight:
        half = (0.5 * width / camera.fx_px, 0.5 * height / camera.fy_px)
        return 2.0 * math.atan(half[0]), 2.0 * math.atan(half[1])
    # The edge of a panorama is the seam, which rounding may put outside of the model.
    u, v = (np.linspace(1e-7, size - 1e-7, 4 * size + 1) for size in (width, height))
    row = camera.rays(np.column_stack([u, np.full_like(u, camera.cy_px)]))
    column = camera.rays(np.column_stack([np.full_like(v, camera.cx_px), v]))
    across, down = np.arctan2(row[:, 0], row[:, 2]), np.arctan2(column[:, 1], column[:, 2])
    return float(np.nanmax(across) - np.nanmin(across)), float(np.nanmax(down) - np.nanmin(down))


def _text(value: Any) -> NDArray[np.bytes_]:
    """JSON as a byte string, [] (a scalar)."""
    return np.array(serialization.canonical_json(value).encode("utf-8"))
