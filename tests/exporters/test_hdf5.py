"""Containers with BlenderProc's keys, read by h5py and NumPy and held against the street."""

import json
import zipfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from gen_data.core.capture import Channel
from gen_data.core.errors import ConfigError
from gen_data.exporters.hdf5 import Hdf5
from tests.exporters.conftest import MEDIA, SIZES_M
from tests.exporters.datasets import imaging

CONTAINERS = ("hdf5", "npz")


def load(path: Path) -> dict[str, Any]:
    if path.suffix == ".npz":
        with np.load(path, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    with h5py.File(path) as file:
        return {name: np.asarray(file[name]) for name in file}


def problems(path: Path, sample: Any) -> Iterator[str]:
    data = load(path)
    reading = sample.capture.readings["color"]
    if not np.array_equal(data["colors"], reading.channels[Channel.RGB]):
        yield "colors"
    if not np.array_equal(data["instance_segmaps"], reading.channels[Channel.INSTANCE]):
        yield "instance_segmaps"
    entries = {row["idx"]: row for row in json.loads(data["instance_attribute_maps"].item())}
    if set(entries) != {0, *np.unique(data["instance_segmaps"]).tolist()}:
        yield "instance_attribute_maps lists other instances"
    for number, row in entries.items():
        there = data["category_id_segmaps"][data["instance_segmaps"] == number]
        if (there != row["category_id"]).any():
            yield f"category of instance {number}"
    yield from wrong_geometry(data, sample, entries)
    (camera,) = json.loads(data["campose"].item())
    # Blender's camera looks along -Z: its third axis is the opposite of the optical axis.
    pose = np.array(camera["cam2world_matrix"])
    if not np.allclose(-pose[:3, 2], data["T_world_camera"][:3, 2]) or not np.isclose(
        np.linalg.det(pose[:3, :3]), 1.0
    ):
        yield "campose"


def wrong_geometry(data: Any, sample: Any, entries: Any) -> Iterator[str]:
    """Points through depth, K and pose; K is for pixel centres at whole numbers."""
    rows, columns = np.indices(data["depth"].shape)
    rays = np.stack([columns, rows, np.ones_like(rows)], -1) @ np.linalg.inv(data["K"]).T
    seen = np.isfinite(data["depth"])
    camera = rays[seen] * data["depth"][seen][:, None]
    world = camera @ data["T_world_camera"][:3, :3].T + data["T_world_camera"][:3, 3]
    ids = data["instance_segmaps"][seen]
    # A unit of the depth image is a millimetre, which grows along the ray.
    slack = 0.0006 * np.linalg.norm(rays[seen], axis=1) + 1e-5
    if (np.abs(world[ids == 0][:, 2]) > slack[ids == 0]).any():
        yield "ground is not at height 0"
    for thing in sample.scene.instances:
        here = ids == thing.instance_id
        if not thing.asset.endswith("box") or thing.instance_id not in entries:
            continue
        local = thing.T_world_instance.inverse().apply(world[here])
        half = 0.5 * np.array(SIZES_M[thing.category])
        from_centre = np.abs(local - [0.0, 0.0, half[2]]) - half
        if (np.abs(from_centre.max(axis=1)) > slack[here]).any():
            yield f"instance {thing.instance_id} is not where it stands"
    up = data["normals"][seen][ids == 0] * 2.0 - 1.0
    # Pixels at the edge of an object mix two surfaces.
    if len(up) and np.median(up @ [0.0, 1.0, 0.0]) < 0.99:
        yield "normals of the ground do not point up"


@pytest.fixture(scope="module", params=CONTAINERS)
def dataset(world: Any, request: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    info = world.info(7, media={"color": (*MEDIA, Channel.NORMALS)})
    folder = tmp_path_factory.mktemp(request.param)
    return world.export(Hdf5(container=request.param), info, world.samples, folder)


def test_containers_hold_the_street(dataset: Path, world: Any) -> None:
    """Colours, depth, normals, ids, attributes and cameras of every frame agree."""
    paths = sorted(dataset.rglob("0*"), key=lambda p: p.name)
    assert [p.parent.name for p in paths] == [s.split for s in world.samples]
    for path, sample in zip(paths, world.samples, strict=True):
        assert list(problems(path, sample)) == []
    # Other programs decode them: the archive passes its checksums, HDF5 has the filters.
    path = next((dataset / "train").iterdir())
    if path.suffix == ".npz":
        with zipfile.ZipFile(path) as archive:
            assert archive.testzip() is None
        return
    with h5py.File(path) as file:
        assert file["colors"].compression == file["depth"].compression == "gzip"
        assert file["depth"].shuffle and not file["colors"].shuffle


@pytest.mark.parametrize("container", CONTAINERS)
def test_layers_are_a_last_axis(container: str, world: Any, tmp_path: Path) -> None:
    sample = world.samples[0]
    ids = sample.capture.readings["color"].channels[Channel.INSTANCE]
    layers = np.stack([ids, np.roll(ids, 1, axis=0), np.zeros_like(ids)], axis=-1)
    sample = imaging(sample, "color", {Channel.INSTANCE_LAYERS: layers})
    info = world.info(1, media={"color": (*MEDIA, Channel.INSTANCE_LAYERS)})
    folder = world.export(Hdf5(container=container), info, [sample], tmp_path)
    (path,) = folder.rglob("0*")
    np.testing.assert_array_equal(load(path)["instance_layers"], layers)


@pytest.mark.parametrize("container", CONTAINERS)
def test_uncompressed_files_hold_the_same(container: str, world: Any, tmp_path: Path) -> None:
    sizes = {}
    for compression in ("gzip", "none"):
        exporter = Hdf5(container=container, compression=compression)
        folder = world.export(exporter, world.info(1), world.samples[:1], tmp_path / compression)
        (path,) = folder.rglob("0*")
        sizes[compression] = path.stat().st_size
        data = load(path)
        rgb = world.samples[0].capture.readings["color"].channels[Channel.RGB]
        np.testing.assert_array_equal(data["colors"], rgb)
    assert sizes["none"] > 3 * sizes["gzip"]


def test_each_camera_has_a_container_whose_keys_are_blenderprocs_or_our_names(
    world: Any, tmp_path: Path, samples: Any
) -> None:
    """A channel that is not written has no key."""
    info = world.info(1, media={"color": (Channel.RGB, Channel.PART)})
    root = world.export(Hdf5(), info, world.samples[:1], tmp_path)
    keys = set(load(root / "train/000000000_color.hdf5"))
    assert keys == {
        "colors", "part", "instance_attribute_maps", "campose", "K", "T_world_camera",
    }  # fmt: skip
    root = world.export(Hdf5(), world.info(8, ("left", "right")), samples, tmp_path / "b")
    names = sorted(p.name for p in (root / "train").iterdir())
    assert names[:2] == ["000000000_left.hdf5", "000000000_right.hdf5"]
    assert len(names) == 8


@pytest.mark.parametrize("container", CONTAINERS)
def test_nocs_are_positions_in_the_objects_frame_as_blenderprocs(
    container: str, world: Any, tmp_path: Path
) -> None:
    """Render_nocs of BlenderProc 2: half the position [m] in the object's frame plus 0.5.

    With an alpha of 1; the background is 0. Through depth, K and pose, they lead to the same place.
    """
    sample = world.samples[0]
    reading = sample.capture.readings["color"]
    ids = reading.channels[Channel.INSTANCE]
    camera = reading.camera
    rows, columns = np.indices(ids.shape)
    rays = camera.intrinsics.rays(np.stack([columns, rows], -1).reshape(-1, 2) + 0.5)
    rays = rays / rays[:, 2:]
    depth_m = np.nan_to_num(reading.channels[Channel.Z_DEPTH], posinf=0.0)
    p_world = camera.T_world_camera.apply(rays * depth_m.reshape(-1, 1)).reshape(*ids.shape, 3)
    shares, expected = np.zeros((2, *ids.shape, 3))
    for thing in sample.scene.instances:
        here = ids == thing.instance_id
        local = thing.T_world_instance.inverse().apply(p_world[here])
        expected[here] = 0.5 * local + 0.5
        shares[here] = (local - thing.box_min_m) / np.subtract(thing.box_max_m, thing.box_min_m)
    channels = {**reading.channels, Channel.OBJECT_COORDINATES: shares.astype(np.float32)}
    capture = replace(sample.capture, readings={"color": replace(reading, channels=channels)})
    info = world.info(1, media={"color": (*MEDIA, Channel.OBJECT_COORDINATES)})
    given = [replace(sample, capture=capture)]
    folder = world.export(Hdf5(container=container), info, given, tmp_path)
    nocs = load(next(folder.rglob("0*")))["nocs"]
    assert (nocs.dtype, nocs.shape) == (np.float32, (*ids.shape, 4))
    np.testing.assert_array_equal(nocs[..., 3], ids > 0)
    # 16 bits over a box of 4 m, halved; rays that graze the edge of a box leave it by rounding.
    np.testing.assert_allclose(nocs[..., :3], expected, atol=2e-4)
    assert nocs.max() > 1.2


def test_nocs_need_instances(world: Any) -> None:
    info = world.info(1, media={"color": (Channel.RGB, Channel.OBJECT_COORDINATES)})
    with pytest.raises(ConfigError, match="does not write the channel instance"):
        Hdf5(container="npz").check(info)
