"""BOP export: models rendered again by Embree under the written poses, as bop_toolkit does it."""

import contextlib
import io
import itertools
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import trimesh
from pycocotools import mask as coco_mask
from pycocotools.coco import COCO
from scipy.spatial import KDTree
from scipy.spatial.distance import cdist

from gen_data.annotations.annotate import Thresholds
from gen_data.core.asset_types import AssetFacts, Symmetry
from gen_data.core.errors import AssetError
from gen_data.core.scene import Articulation
from gen_data.core.se3 import IDENTITY, SE3
from gen_data.exporters.bop import Bop
from gen_data.exporters.rigid_models import Piece, build_model
from tests.embree import RayCaster
from tests.exporters.conftest import Props
from tests.exporters.datasets import in_scene, made_of

DELTA_MM = 5.0


def read(path: Path) -> Any:
    return json.loads(path.read_text())


def image(path: Path) -> Any:
    pixels = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    assert pixels is not None, f"{path} is missing"
    return pixels


class Renderer:
    """Depth of single models on a canvas of three by three images [mm]; 0 = nothing."""

    def __init__(self, folder: Path) -> None:
        self._scenes = {}
        for path in folder.glob("obj_*.ply"):
            mesh = trimesh.load(path, process=False)
            self._scenes[int(path.stem[4:])] = RayCaster((mesh.vertices, mesh.faces))

    def depth(self, gt: Any, camera: Any, width: int, height: int) -> Any:
        k = np.array(camera["cam_K"]).reshape(3, 3)
        rotation = np.array(gt["cam_R_m2c"]).reshape(3, 3)
        u, v = np.meshgrid(np.arange(-width, 2 * width) + 0.5, np.arange(-height, 2 * height) + 0.5)
        rays = np.stack([(u - k[0, 2]) / k[0, 0], (v - k[1, 2]) / k[1, 1], np.ones_like(u)], -1)
        # Rays have a unit of depth per unit of length: distances are depths.
        eye = -np.array(gt["cam_t_m2c"]) @ rotation
        depth = self._scenes[gt["obj_id"]].cast(eye, rays @ rotation).distance
        return np.where(np.isfinite(depth), depth, 0.0)


def box(mask: Any) -> list[int]:
    ys, xs = np.nonzero(mask)
    if not len(xs):
        return [-1, -1, -1, -1]
    low_x, low_y = int(xs.min()), int(ys.min())
    return [low_x, low_y, int(xs.max()) - low_x, int(ys.max()) - low_y]


def overlap(one: Any, other: Any) -> float:
    union = np.count_nonzero(one | other)
    return np.count_nonzero(one & other) / union if union else 1.0


def wrong_models(root: Path) -> Iterator[str]:
    """Extents, diameters, origins and symmetries against the files of the models."""
    infos = read(root / "models/models_info.json")
    paths = sorted((root / "models").glob("*.ply"))
    if [f"obj_{int(k):06d}" for k in infos] != [path.stem for path in paths]:
        yield "models_info lists other models"
    for path, info in zip(paths, infos.values(), strict=False):
        points = np.asarray(trimesh.load(path, process=False).vertices)
        corners = np.asarray(trimesh.PointCloud(points).convex_hull.vertices)
        diameter = cdist(corners, corners).max()
        if abs(diameter - info["diameter"]) > 1e-3 * diameter:
            yield f"{path.name}: diameter {info['diameter']}, not {diameter}"
        for k, axis in enumerate("xyz"):
            low, size = points[:, k].min(), np.ptp(points[:, k])
            if abs(info[f"min_{axis}"] - low) > 0.01 or abs(info[f"size_{axis}"] - size) > 0.01:
                yield f"{path.name}: extent along {axis}"
            if abs(low + 0.5 * size) > 0.01:
                yield f"{path.name}: the origin is not the centre"
        tree = KDTree(points)
        for row in info.get("symmetries_discrete", []):
            pose = np.array(row).reshape(4, 4)
            moved = points @ pose[:3, :3].T + pose[:3, 3]
            if tree.query(moved[::7])[0].max() > 0.02 * diameter:
                yield f"{path.name}: a symmetry changes the shape"


def wrong_images(root: Path) -> Iterator[str]:
    """Everything in the folders of scenes, against the models in the written poses."""
    renderer = Renderer(root / "models")
    for folder in sorted(path.parent for path in root.glob("*/*/scene_gt.json")):
        cameras, poses = read(folder / "scene_camera.json"), read(folder / "scene_gt.json")
        infos = read(folder / "scene_gt_info.json")
        if not list(cameras) == list(poses) == list(infos):
            yield f"{folder}: JSON files list different images"
            continue
        for im_id, things in poses.items():
            if len(infos[im_id]) != len(things):
                yield f"{folder}/{im_id}: other number of objects"
            rgb = image(folder / f"rgb/{int(im_id):06d}.png")
            depth = image(folder / f"depth/{int(im_id):06d}.png") * cameras[im_id]["depth_scale"]
            height, width = rgb.shape[:2]
            for k, (gt, info) in enumerate(zip(things, infos[im_id], strict=False)):
                name = f"{int(im_id):06d}_{k:06d}.png"
                whole = renderer.depth(gt, cameras[im_id], width, height)
                for text in wrong_object(folder, name, info, whole, depth):
                    yield f"{folder.parent.name}/{folder.name}/{name}: {text}"


def wrong_object(folder: Path, name: str, info: Any, whole: Any, depth: Any) -> Iterator[str]:
    """One object: masks, depth and the values of scene_gt_info."""
    height, width = depth.shape
    inside = whole[height : 2 * height, width : 2 * width]
    mask, visible = image(folder / "mask" / name) == 255, image(folder / "mask_visib" / name) == 255
    seen = (inside > 0) & (depth > 0) & (inside - depth < DELTA_MM)
    if overlap(mask, inside > 0) < 0.985:
        yield f"mask: IoU {overlap(mask, inside > 0):.4f}"
    if overlap(visible, seen) < 0.95:
        yield f"mask_visib: IoU {overlap(visible, seen):.4f}"
    both = visible & (inside > 0)
    # Facets of an ellipsoid miss its silhouette, where depth changes fast.
    error_mm = np.quantile(np.abs(inside - depth)[both], 0.95) if both.any() else 0.0
    if error_mm > 0.5 * DELTA_MM:
        yield f"depth: {error_mm:.1f} mm"
    counts = {"all": np.count_nonzero(whole), "valid": np.count_nonzero(depth[mask]),
              "visib": np.count_nonzero(visible)}  # fmt: skip
    for kind, count in counts.items():
        if abs(info[f"px_count_{kind}"] - count) > (0.015 * count + 2) * (kind == "all"):
            yield f"px_count_{kind}: {info[f'px_count_{kind}']}, not {count}"
    share = info["px_count_visib"] / info["px_count_all"]
    if abs(info["visib_fract"] - share) > 1e-6:
        yield "visib_fract"
    if info["bbox_visib"] != box(visible):
        yield f"bbox_visib: {info['bbox_visib']}, not {box(visible)}"
    outer = np.array(box(whole > 0)) - [width, height, 0, 0]
    if np.abs(outer - info["bbox_obj"]).max() > 1:
        yield f"bbox_obj: {info['bbox_obj']}, not {outer}"


def wrong_targets(root: Path) -> Iterator[str]:
    """The list of targets against scene_gt and scene_gt_info."""
    expected = []
    for folder in sorted((root / "test").glob("*")):
        infos = read(folder / "scene_gt_info.json")
        for im_id, things in read(folder / "scene_gt.json").items():
            seen = [g["obj_id"] for g, i in zip(things, infos[im_id], strict=True)
                    if i["visib_fract"] >= 0.1]  # fmt: skip
            expected += [
                {"im_id": int(im_id), "inst_count": seen.count(k), "obj_id": k,
                 "scene_id": int(folder.name)}
                for k in sorted(set(seen))
            ]  # fmt: skip
    if read(root / "test_targets_bop19.json") != expected:
        yield "test_targets_bop19.json"


def problems(root: Path) -> list[str]:
    return [*wrong_models(root), *wrong_images(root), *wrong_targets(root)]


def with_tests(world: Any) -> tuple[Any, Any]:
    """Seven frames, the second and the fifth for tests."""
    return world.info(7), [
        replace(s, split="test" if s.index in (1, 4) else s.split)
        for s in world.with_bodies(world.samples)
    ]


dataset = made_of(Bop(), with_tests)


@pytest.mark.slow
def test_models_in_the_written_poses_give_the_images(dataset: Path) -> None:
    """Masks, depth, visibility, boxes and targets follow from models, poses and intrinsics."""
    assert problems(dataset) == []
    assert len(read(dataset / "test_targets_bop19.json")) >= 6
    assert sum(len(v) for p in dataset.glob("*/*/scene_gt.json") for v in read(p).values()) >= 15


def test_coco_files_have_visible_masks_and_boxes_of_either_and_all_models(dataset: Path) -> None:
    """As calc_gt_coco.py of bop_toolkit makes them: by default boxes bound the file of ``mask``.

    Boxes are COCO's, a pixel wider than BOP's; ids count from 1. Categories are the models of the
    data set, the same in all folders.
    """
    models = sorted(map(int, read(dataset / "models/models_info.json")))
    hidden = 0
    for folder, (name, kind) in itertools.product(
        sorted(dataset.glob("train/*")),
        {"scene_gt_coco": "mask", "scene_gt_coco_modal": "mask_visib"}.items(),
    ):
        with contextlib.redirect_stdout(io.StringIO()):
            truth = COCO(str(folder / f"{name}.json"))
        poses = read(folder / "scene_gt.json")
        assert [str(k) for k in truth.imgs] == list(poses)
        assert truth.getCatIds() == models
        for im_id, things in poses.items():
            assert (folder / truth.imgs[int(im_id)]["file_name"]).is_file()
            rows = truth.imgToAnns[int(im_id)]
            assert [r["category_id"] for r in rows] == [gt["obj_id"] for gt in things]
            for k, row in enumerate(rows):
                stem = f"{int(im_id):06d}_{k:06d}.png"
                mask = image(folder / "mask_visib" / stem) == 255
                np.testing.assert_array_equal(truth.annToMask(row).astype(bool), mask)
                x, y, width, height = box(image(folder / kind / stem))
                assert row["bbox"] == [x, y, width + 1, height + 1]
                assert row["area"] == mask.sum()
                hidden += row["bbox"] != coco_mask.toBbox(truth.annToRLE(row)).tolist()
        assert min(truth.anns, default=1) == 1
    assert hidden > 0


def test_equal_geometries_share_a_model(dataset: Path) -> None:
    """Two crates of different shapes are two objects, in all frames the same ones."""
    assert {k: v["asset"] for k, v in read(dataset / "objects.json").items()} == {
        "1": "primitive/box/car",
        "2": "primitive/box/crate",
        "3": "primitive/box/pedestrian",
        "4": "primitive/ellipsoid/crate",
    }


def test_each_scale_is_an_object_of_its_own(world: Any, tmp_path: Path) -> None:
    first, *others = world.with_bodies(world.samples[:3])
    bodies = tuple(replace(b, scale=0.5) if "car" in b.name else b for b in first.scene.bodies)
    changed = in_scene(first, bodies=bodies)
    root = world.export(Bop(), world.info(3), [changed, *others], tmp_path)
    sizes = {
        (v["asset"], v["scale"]): read(root / "models/models_info.json")[k]["size_x"]
        for k, v in read(root / "objects.json").items()
    }
    assert sizes["primitive/box/car", 1.0] == pytest.approx(4000.0)
    assert sizes["primitive/box/car", 0.5] == pytest.approx(2000.0)


def test_robots_and_ignored_objects_are_left_out(world: Any, tmp_path: Path) -> None:
    """A robot bends; BOP has no regions to ignore."""
    (sample,) = world.with_bodies(world.samples[:1])
    truth = sample.truth["color"]
    robot = Articulation("arm", "robot", 2, IDENTITY, ())
    changed = world.ignoring(in_scene(sample, articulations=(robot,)))
    root = world.export(Bop(), world.info(1), [changed], tmp_path)
    assets = [v["asset"] for v in read(root / "objects.json").values()]
    assert assets == [
        "primitive/box/crate",
        "primitive/box/pedestrian",
        "primitive/ellipsoid/crate",
    ]
    assert len(read(root / "train/000000/scene_gt.json")["0"]) == len(truth.objects) - 2


def test_invisible_objects_have_no_box(world: Any, tmp_path: Path) -> None:
    """Their pose is written if their truth is, as BOP's own synthetic images have it."""
    front = world.instance(1, "car", 8.0, 0.0, 0.0)
    behind = world.instance(2, "crate", 14.0, 0.0, 0.0)
    (sample,) = world.with_bodies(
        [world.sample(0, (front, behind), [world.camera()],
                      thresholds=Thresholds(include_invisible=True))]
    )  # fmt: skip
    root = world.export(Bop(), world.info(1), [sample], tmp_path)
    _, hidden = read(root / "train/000000/scene_gt_info.json")["0"]
    assert hidden["bbox_visib"] == hidden["bbox_obj"] == [-1, -1, -1, -1]
    assert (hidden["px_count_visib"], hidden["visib_fract"]) == (0, 0.0)
    assert hidden["px_count_all"] > 0
    assert not image(root / "train/000000/mask_visib/000000_000001.png").any()
    assert len(read(root / "train/000000/scene_gt_coco.json")["annotations"]) == 1


def test_views_of_a_scene_share_a_folder(world: Any, tmp_path: Path) -> None:
    samples = [replace(s, split="train") for s in world.with_bodies(world.samples)]
    info = replace(world.info(7), views_per_scene=3)
    by_scene = world.export(Bop(), info, samples, tmp_path / "a")
    together = world.export(Bop(folders="thousand"), info, samples, tmp_path / "b")
    ids = {p.name: list(read(p / "scene_gt.json")) for p in sorted((by_scene / "train").iterdir())}
    assert ids == {"000000": ["0", "1", "2"], "000001": ["0", "1", "2"], "000002": ["0"]}
    assert list(read(together / "train/000000/scene_gt.json")) == [str(k) for k in range(7)]


class OneCube:
    """A library with a cube and the given symmetries."""

    def __init__(self, symmetries: tuple[Symmetry, ...]) -> None:
        self._props, self._symmetries = Props(), symmetries

    def get(self, asset_id: str) -> Any:
        facts = AssetFacts(symmetries=self._symmetries)
        return replace(self._props.get(asset_id), facts=lambda: facts)

    def mesh(self, asset_id: str) -> Any:
        return self._props.mesh(asset_id)


def info_of(*symmetries: Symmetry) -> Any:
    piece = Piece("primitive/box/crate", 2.0, IDENTITY)
    return build_model((piece,), OneCube(symmetries)).info  # type: ignore[arg-type]


def test_symmetries_are_a_whole_group_in_their_place_and_end() -> None:
    """Quarter turns about Z and half turns about X: eight poses, of which one is the identity."""
    middle = (0.0, 0.0, 0.45)
    info = info_of(Symmetry((0.0, 0.0, 1.0), 4), Symmetry((1.0, 0.0, 0.0), 2, offset_m=middle))
    assert len(info["symmetries_discrete"]) == 7
    for row in info["symmetries_discrete"]:
        pose = np.array(row).reshape(4, 4)
        np.testing.assert_allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-8)
        # Both axes go through the centre, which is the model's origin.
        np.testing.assert_allclose(pose[:3, 3], 0.0, atol=1e-3)
    # In millimetres from the centre of the scaled model.
    info = info_of(Symmetry((0.0, 0.0, 1.0), 0, (0.1, 0.0, 0.0)))
    (row,) = info["symmetries_continuous"]
    assert row["axis"] == [0.0, 0.0, 1.0]
    assert row["offset"] == pytest.approx([200.0, 0.0, -900.0], abs=1e-3)
    assert "symmetries_discrete" not in info
    # Parallel axes generate ever more poses.
    with pytest.raises(AssetError, match="symmetries generate more than 120 poses"):
        info_of(Symmetry((0.0, 0.0, 1.0), 2), Symmetry((0.0, 0.0, 1.0), 2, (1.0, 0.0, 0.0)))


def test_several_bodies_are_one_model() -> None:
    """Each at its pose in the frame of the instance."""
    pieces = (Piece("primitive/box/crate", 1.0, IDENTITY),
              Piece("primitive/box/crate", 1.0, SE3((3.0, 0.0, 0.0))))  # fmt: skip
    model = build_model(pieces, OneCube(()))  # type: ignore[arg-type]
    assert model.info["size_x"] == pytest.approx(4000.0)
    assert model.center_m == pytest.approx((1.5, 0.0, 0.45))
