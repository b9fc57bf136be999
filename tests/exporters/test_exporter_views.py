"""Exporters that see some sensors of a data set, and bent lenses as pinholes."""

import json
import tarfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from gen_data.annotations.annotate import Thresholds
from gen_data.core.capture import Channel
from gen_data.core.errors import ConfigError
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import Lens
from gen_data.core.scene import Scene
from gen_data.exporters import TABLE
from gen_data.pipeline.exporter_views import ExporterView, view_of
from tests.exporters.bent import LENSES, bent_samples, opencv_maps
from tests.tiers import sampled

PINHOLES_ONLY = ("bop", "cityscapes", "kitti", "scannet", "semantickitti", "solo", "tum_rgbd")


def viewed(kind: str, **fields: Any) -> Any:
    own = TABLE.load(kind).model_validate_json(json.dumps({"type": kind, **fields}))
    return view_of(own, own, Thresholds())


def two_cameras(world: Any) -> tuple[Any, list[Any]]:
    """A fisheye ``wide`` next to the pinhole ``color``, and a scanner."""
    samples = []
    for bent, sample in zip(bent_samples(world, "kannala_brandt"), world.samples, strict=False):
        wide = bent.capture.readings["color"]
        wide = replace(wide, sensor="wide", camera=replace(wide.camera, name="wide"))
        truth = replace(bent.truth["color"], camera=wide.camera)
        capture = replace(
            sample.capture, readings={"color": sample.capture.readings["color"], "wide": wide}
        )
        scene = replace(sample.scene, cameras=(*sample.scene.cameras, wide.camera))
        changes = {"truth": {**sample.truth, "wide": truth}, "cameras": ("color", "wide")}
        samples.append(replace(sample, capture=capture, scene=scene, **changes))
    info = world.info(len(samples), ("color", "wide"), ("top",), lenses={"wide": "kannala_brandt"})
    return info, world.with_bodies(samples)


@pytest.mark.parametrize("kind", TABLE.names())
def test_every_exporter_takes_cameras_sensors_and_rectify(kind: str) -> None:
    """The fields are the base's, documented there; without them shards keep their bytes."""
    own = TABLE.load(kind)()
    assert view_of(own, own, Thresholds()) is own
    view = viewed(kind, cameras=["front_*"], sensors=["top"], rectify={"hfov_deg": 90})
    assert isinstance(view, ExporterView)
    assert (view.type, view.cameras, view.sensors) == (kind, ("front_*",), ("top",))
    assert view.rectify is not None
    assert view.rectify.hfov_deg == 90.0


@pytest.mark.parametrize("cameras", [["color"], ["co*"]])
def test_only_the_listed_cameras_are_exported(world: Any, tmp_path: Path, cameras: Any) -> None:
    """Images, annotations and cameras of the others are absent; ids are as in the whole set."""
    info, samples = two_cameras(world)
    whole = world.export(viewed("coco", sensors=["top"]), info, samples, tmp_path / "whole")
    some = world.export(viewed("coco", cameras=cameras), info, samples, tmp_path / "some")
    everything = json.loads((whole / "annotations/instances_train.json").read_text())
    listed = json.loads((some / "annotations/instances_train.json").read_text())
    kept = [i for i in everything["images"] if i["sensor"] == "color"]
    assert 0 < len(kept) < len(everything["images"])
    assert [i["id"] for i in listed["images"]] == [i["id"] for i in kept]
    ids = {i["id"] for i in kept}
    expected = [a for a in everything["annotations"] if a["image_id"] in ids]
    assert listed["annotations"] == expected
    assert not [path for path in some.rglob("*") if "wide" in path.name]


@pytest.mark.parametrize("kind", [*PINHOLES_ONLY, "nuscenes"])
def test_a_bent_camera_that_is_not_listed_blocks_no_format(world: Any, kind: str) -> None:
    info, _ = two_cameras(world)
    own = {"camera": "wide"} if kind not in ("nuscenes", "solo") else {}
    refused = viewed(kind, **own)
    with pytest.raises(ConfigError, match="rectify: true") as error:
        refused.check(info)
    assert "cameras:" in str(error.value)
    viewed(kind, cameras=["color"]).check(info)


def test_names_of_no_sensor_are_refused_and_disparities_not_rectified(world: Any) -> None:
    """They are displacements in the original image: formats that need them say so."""
    info, _ = two_cameras(world)
    with pytest.raises(ConfigError, match=r"exporter 'coco': cameras: 'colour' .*'color'\?"):
        viewed("coco", cameras=["colour"]).check(info)
    with pytest.raises(ConfigError, match=r"exporter 'coco': sensors: 'color' fits no sensor"):
        viewed("coco", sensors=["color"]).check(info)
    channels = (Channel.RGB, Channel.DISPARITY, Channel.FLOW_FORWARD)
    info = world.info(2, media={"color": channels}, lenses={"color": "brown_conrady"})
    assert viewed("coco", rectify=True).info(info).media == {"color": (Channel.RGB,)}
    # A question about the bent image may have another answer in the rectified one.
    info = world.info(2, lenses={"color": "brown_conrady"})
    with pytest.raises(ConfigError, match=r"exporter 'language': rectify: its texts"):
        viewed("language", rectify=True).check(info)
    with pytest.raises(ConfigError, match=r"exporter 'scene_text': rectify: its texts"):
        viewed("scene_text", rectify=True).check(info)


def test_scanners_can_be_left_out(world: Any, tmp_path: Path) -> None:
    """``sensors`` selects laser scanners and devices."""
    info, samples = two_cameras(world)
    info = replace(info, sensors=info.sensors)
    some = world.export(viewed("webdataset", sensors=["imu"]), info, samples, tmp_path)
    names = []
    for path in sorted(some.rglob("*.tar")):
        with tarfile.open(path) as archive:
            names += archive.getnames()
    assert names
    assert not [name for name in names if "top" in name]


@pytest.mark.parametrize("model", sorted(LENSES))
@pytest.mark.parametrize("kind", sampled([*PINHOLES_ONLY, "coco", "hdf5", "yolo"], 4))
def test_pinhole_formats_rectify_images(world: Any, tmp_path: Path, kind: str, model: Any) -> None:
    """In every format the photographs are OpenCV's, and the bent ones are nowhere."""
    samples = world.with_bodies(bent_samples(world, model))
    info = world.info(len(samples), lidars=("top",), lenses={"color": model})
    exporter = viewed(kind, rectify=True)
    exporter.check(info)
    folder = world.export(exporter, info, samples, tmp_path)
    bent, other = cv2.imread, cv2.remap
    view = exporter._camera(samples[0].scene.cameras[0])
    maps = opencv_maps(LENSES[model], view.intrinsics)
    rectified = tmp_path / "shards/000000/_rectified/color/rgb"
    for path in sorted(rectified.iterdir()):
        original = bent(str(tmp_path / "shards/000000/color/rgb" / path.name))
        image = bent(str(path))
        # Edges of flat colours: weights of 1/32 against exact ones.
        assert np.abs(image.astype(int) - other(original, *maps, cv2.INTER_LINEAR)).max() <= 9
    bent_bytes = {p.read_bytes() for p in (tmp_path / "shards/000000/color/rgb").iterdir()}
    photographs = [p for p in folder.rglob("*") if p.suffix in (".png", ".jpg")]
    assert photographs or kind in ("hdf5", "semantickitti")
    assert not [p for p in photographs if p.read_bytes() in bent_bytes]


def test_the_matrix_of_bop_is_that_of_the_rectified_image(world: Any, tmp_path: Path) -> None:
    """So a model under ``cam_R_m2c``, ``cam_t_m2c`` lies on its rectified mask."""
    samples = world.with_bodies(bent_samples(world, "brown_conrady", 1))
    info = world.info(1, lenses={"color": "brown_conrady"})
    exporter = viewed("bop", rectify=True)
    folder = world.export(exporter, info, samples, tmp_path)
    (scene,) = {p.parent for p in folder.rglob("scene_gt.json")}
    camera = json.loads((scene / "scene_camera.json").read_text())
    ((number, shown),) = json.loads((scene / "scene_gt.json").read_text()).items()
    K = np.array(camera[number]["cam_K"]).reshape(3, 3)
    k = exporter._camera(samples[0].scene.cameras[0]).intrinsics
    np.testing.assert_allclose(K, k.matrix(), atol=1e-6)
    for place, one in enumerate(shown):
        mask = cv2.imread(str(scene / f"mask_visib/{int(number):06d}_{place:06d}.png"), -1)
        at = K @ np.array(one["cam_t_m2c"])
        columns = np.flatnonzero(mask.any(axis=0))
        u, _ = at[:2] / at[2]
        # Origins are the middle of the ground under an object.
        assert columns.min() - 8 < u < columns.max() + 8


def test_exporters_of_equal_settings_share_rectified_images(world: Any, tmp_path: Path) -> None:
    """One copy in the shard, whichever exporter comes first."""
    samples = world.with_bodies(bent_samples(world, "brown_conrady"))
    info = world.info(len(samples), lenses={"color": "brown_conrady"})
    shard = tmp_path / "shards/000000"
    world.export(viewed("kitti", rectify=True), info, samples, tmp_path)
    before = {p: p.stat().st_mtime_ns for p in shard.rglob("_rectified/color/**/*.png")}
    viewed("solo", rectify=True).write_shard(info, samples, shard)
    viewed("yolo", rectify={"hfov_deg": 50}).write_shard(info, samples, shard)
    assert before
    assert {p: p.stat().st_mtime_ns for p in before} == before
    assert sorted(p.name for p in shard.glob("_rectified*")) == ["_rectified", "_rectified_hfov_50"]


def test_a_lens_that_sees_too_much_is_refused_before_anything_is_generated() -> None:
    """The message names camera and remedy."""
    lens = Lens("kannala_brandt", (0.0, 0.0, 0.0, 0.0))
    intrinsics = Intrinsics.from_hfov(160, 120, np.radians(200.0), lens)
    from tests.exporters.conftest import level_camera

    scene = Scene("street", cameras=(replace(level_camera("dome"), intrinsics=intrinsics),))
    with pytest.raises(ConfigError, match=r"exporter 'kitti': camera 'dome': rectify: .*hfov_deg"):
        viewed("kitti", rectify=True).check_scene(scene)
    viewed("kitti", rectify={"hfov_deg": 90}).check_scene(scene)
    viewed("kitti", rectify=True, cameras=["front"]).check_scene(scene)
