"""Readers of arms, clips, pairs of images, grasps, labelled scans and tables."""

import json
import sys
import tempfile
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from benchmarks.readers import detection, records, truth
from benchmarks.readers.views import Thing, View, cube, of_pixels, thing
from gen_data.core.se3 import SE3


def by_lerobot(root: Path) -> Iterator[View]:
    """Rows of LeRobot's data set: joints, and images as fractions of 255."""
    detection.import_torchvision()
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    (folder,) = root.glob("train/*")
    data = LeRobotDataset("local/arm", root=folder)
    for k in range(len(data)):
        row = data[k]
        yield View(truth.image_name(k, "arm"), (thing("state", row["observation.state"].numpy()),))
        for key in data.meta.camera_keys:
            pixels = 255.0 * row[key].permute(1, 2, 0).numpy()
            yield View(truth.image_name(k, key.rpartition(".")[2]), (thing("rgb", pixels),))


def by_lerobot_geometry(root: Path) -> Iterator[View]:
    """Geometry of LeRobot's rows: tensors of the shapes that ``info.json`` states."""
    detection.import_torchvision()
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    (folder,) = root.glob("train/*")
    data = LeRobotDataset("local/arm", root=folder)
    marks = {key.removeprefix("annotation.") for key in data.features}
    for k in range(len(data)):
        row = data[k]
        values = {key: row.get(f"annotation.{key}") for key in marks}
        yield from geometry_views(
            k, {key: v.numpy() for key, v in values.items() if hasattr(v, "numpy")}
        )


def by_tfrecord_geometry(root: Path) -> Iterator[View]:
    """Geometry of the steps of an episode: lists, one after the other, and 16-bit PNG files."""
    (path,) = root.glob("train/*/metadata.json")
    facts = json.loads(path.read_text())
    for row in records.examples(root, "train/*/*.tfrecord"):
        for k in range(len(row["steps/is_first"])):
            values = {}
            for key, fact in facts.items():
                name, shape = key.removeprefix("steps/").replace("/", "."), fact.get("shape")
                if shape and fact["dtype"] == "bytes":
                    file = np.frombuffer(row[key][k], np.uint8)
                    values[name.removeprefix("observation.")] = decoded(file)
                elif shape:
                    values[name] = np.reshape(row[key], (-1, *shape))[k]
            yield from geometry_views(k, values)


def geometry_views(k: int, values: dict[str, Any]) -> Iterator[View]:
    """Geometry of one step, by the names of its features; rows of 0 are padding."""
    ids = np.atleast_1d(values["object_id"])
    things = [thing(f"pose {n}", p) for n, p in zip(ids, values["object_pose"], strict=True) if n]
    edges = values["relation"][values["relation"].any(axis=1)]
    touching = values["contact_id"].any(axis=1)
    things.append(thing("relations", edges.astype(float)))
    things.append(thing("contacts", values["contact"][touching]))
    yield View(truth.image_name(k, "world"), tuple(things))
    for key in (key for key in values if key.startswith("depth.")):
        camera = key.partition(".")[2]
        K, ids = values[f"K.{camera}"], values[f"instance.{camera}"]
        of_camera = (
            thing("depth", values[key].astype(float)),
            thing("ids", ids.astype(float)),
            thing("pose", values[f"T_world_camera.{camera}"][:3]),
        )
        lens = (K[0, 0], K[1, 1], K[0, 2], K[1, 2])
        yield View(truth.image_name(k, camera), of_camera, tuple(map(float, lens)))


def by_tfrecord_episodes(root: Path) -> Iterator[View]:
    """The steps of an episode: lists, one after the other."""
    for row in records.examples(root, "train/*/*.tfrecord"):
        steps = len(row["steps/is_first"])
        for k, state in enumerate(np.reshape(row["steps/observation/state"], (steps, -1))):
            yield View(truth.image_name(k, "arm"), (thing("state", state),))
        for key in (key for key in row if "/image/" in key):
            for k, file in enumerate(row[key]):
                pixels = decoded(np.frombuffer(file, np.uint8))
                yield View(truth.image_name(k, key.rpartition("/")[2]), (thing("rgb", pixels),))


def decoded(file: Any) -> Any:
    """Pixels of an encoded image, or of a file; colours as RGB."""
    import cv2

    data = np.fromfile(file, np.uint8) if isinstance(file, Path) else file
    pixels = cv2.imdecode(data, cv2.IMREAD_UNCHANGED)
    return pixels if pixels.ndim == 2 else pixels[..., 2::-1]


def segments(ids: Any, names: Any) -> tuple[Thing, ...]:
    """An object per value of an image; ``names`` have the same shape."""
    values = (ids == value for value in np.unique(ids) if value)
    return tuple(of_pixels(str(names[pixels][0]), pixels) for pixels in values)


def by_datasets_clips(root: Path) -> Iterator[View]:
    """Hugging Face's folder of images; a colour per instance."""
    for k, row in enumerate(r for split in records.load_dataset(str(root)).values() for r in split):
        pixels = {key: np.array(row[key]) for key in ("image", "depth", "segmentation")}
        colors = pixels["segmentation"].astype(int) @ (65536, 256, 1)
        things = segments(colors, np.full(colors.shape, "instance"))
        yield View(
            truth.image_name(k, "color"),
            (*things, thing("rgb", pixels["image"]), thing("depth", pixels["depth"])),
        )


def by_opencv_scannet(root: Path) -> Iterator[View]:
    """Images of ScanNet: depth in millimetres, class and instance of each pixel; poses and K."""
    lines = (root / "scannetv2-labels.combined.tsv").read_text().splitlines()[1:]
    names = np.array(["", *(line.split("\t")[1] for line in lines)])
    for k, folder in enumerate(sorted((root / "scans").iterdir())):
        classes, ids, depth = (
            decoded(folder / kind / "0.png") for kind in ("label-filt", "instance-filt", "depth")
        )
        pose = np.loadtxt(folder / "pose/0.txt")[:3]
        K = np.loadtxt(folder / "intrinsic/intrinsic_depth.txt")[:3, :3]
        things = (*segments(ids, names[classes]), thing("depth", depth), thing("pose", pose))
        yield View(truth.image_name(k, "color"), things, detection.matrix_lens(K, shift=0.5))


def by_graspnet(root: Path) -> Iterator[View]:
    """Grasps of each object, in their order."""
    # The package imports its evaluation, which takes packages that no longer build.
    package, spec = ModuleType("graspnetAPI"), find_spec("graspnetAPI")
    package.__path__ = spec.submodule_search_locations  # type: ignore[union-attr,assignment]
    sys.modules["graspnetAPI"] = package
    from graspnetAPI.grasp import GraspGroup

    for path in sorted(root.glob("*/*_grasps.npy")):
        grasps = GraspGroup().from_npy(str(path))
        rows = np.column_stack([
            grasps.scores, grasps.widths, grasps.rotation_matrices.reshape(-1, 9),
            grasps.translations,
        ])  # fmt: skip
        numbers = np.unique(grasps.object_ids)
        things = (thing(str(int(k)), rows[grasps.object_ids == k]) for k in numbers)
        yield View(path.stem.removesuffix("_grasps"), tuple(things))


def by_torchvision_stereo(root: Path) -> Iterator[View]:
    """KITTI's benchmark of 2015: disparities, and flow of the frames that have a next one.

    The reader of disparities takes images of the next step for further pairs, also in the original
    data: it gets images of the first step only.
    """
    detection.import_torchvision()
    import torch
    from torchvision.datasets import Kitti2015Stereo, KittiFlow, _optical_flow

    # Its decoder does not load either with a build of torch without CUDA.
    _optical_flow.read_file = Path
    _optical_flow.decode_png = lambda path: torch.from_numpy(
        decoded(path).transpose(2, 0, 1).astype(np.int32)
    )
    scratch = Path(tempfile.mkdtemp())
    (scratch / "KittiFlow").symlink_to(root.resolve())
    for folder in ("image_2", "image_3", "disp_occ_0", "disp_occ_1"):
        target = scratch / "Kitti2015/training" / folder
        target.mkdir(parents=True)
        # The right camera's disparities, which we do not write, must exist.
        for path in (root / "training" / folder.replace("occ_1", "occ_0")).glob("*_10.png"):
            (target / path.name).symlink_to(path.resolve())
    flows = [(flow * valid).transpose(1, 2, 0) for *_, flow, valid in KittiFlow(str(scratch))]
    for k, (_, _, disparity, _) in enumerate(Kitti2015Stereo(str(scratch))):
        things = [thing("disparity", disparity), *(thing("flow", f) for f in flows[k : k + 1])]
        yield View(truth.image_name(k, "image_02"), tuple(things))


def by_trackeval(root: Path) -> Iterator[View]:
    """KITTI tracking as its evaluation reads it: types, track ids and boxes."""
    from trackeval.datasets import Kitti2DBox

    folder = str(root / "training")
    options = {"GT_FOLDER": folder, "TRACKERS_FOLDER": folder, "TRACKERS_TO_EVAL": []}
    data = Kitti2DBox({**options, "PRINT_CONFIG": False})
    names = {number: name for name, number in reversed(data.class_name_to_class_id.items())}
    for sequence in data.seq_list:
        rows = data._load_raw_file("", sequence, is_gt=True)
        columns = zip(rows["gt_classes"], rows["gt_ids"], rows["gt_dets"], strict=True)
        for k, found in enumerate(columns):
            things = (thing(f"{names[c]} {n}", box) for c, n, box in zip(*found, strict=True))
            yield View(truth.image_name(k, "image_02"), tuple(things))


def by_open3d_ml(root: Path) -> Iterator[View]:
    """SemanticKITTI: points of each instance; moving classes become static ones."""
    from open3d._ml3d.datasets import SemanticKITTI

    names = SemanticKITTI.get_label_to_names()
    scratch = Path(tempfile.mkdtemp())
    (scratch / "dataset").symlink_to(root.resolve())
    known = sorted(path.name for path in (root / "sequences").iterdir())
    scans = SemanticKITTI(str(scratch), training_split=known).get_split("train")
    for k in range(len(scans)):
        row = scans.get_data(k)
        path = scans.get_attr(k)["path"].replace("velodyne", "labels").replace(".bin", ".label")
        # The rule of semantic-kitti-api: the instance is the upper half.
        ids = np.fromfile(path, np.uint32) >> 16
        things = (
            thing(f"{names[row['label'][ids == n][0]]} {n}", row["point"][ids == n])
            for n in np.unique(ids)
            if n
        )
        yield View(truth.image_name(k, "velodyne"), tuple(things))


def by_pandas_tables(root: Path) -> Iterator[View]:
    """Columns of every device, by sample."""
    import pandas

    for path in sorted(root.glob("*/*.csv")):
        for index, rows in pandas.read_csv(path).groupby("sample"):
            columns = rows.drop(columns="sample").items()
            things = (thing(name, np.nan_to_num(column.to_numpy())) for name, column in columns)
            yield View(truth.image_name(int(index), path.parent.name), tuple(things))


def by_numpy_voxels(root: Path) -> Iterator[View]:
    """States, objects and observed voxels of the grid around the ego."""
    import pandas

    for row in pandas.read_json(root / "frames.jsonl", lines=True).itertuples():
        grid = np.load(root / f"grids/{row.index:09d}.npz")
        masks = {f"state {k}": grid["state"] == k for k in range(3)}
        ids = grid["instance_id"]
        masks |= {f"instance {k}": ids == k for k in np.unique(ids)}
        masks |= {f"observed by {n}": grid[f"observed_{n}"] for n in row.sensors}
        things = tuple(thing(name, row.low_m, mask) for name, mask in masks.items())
        yield View(truth.image_name(row.index, "world"), things)


def by_numpy_tracks(root: Path) -> Iterator[View]:
    """Places of tracked points in the frames of cameras, whether they are seen, and lenses."""
    for path in sorted((root / "tapvid3d").glob("*/*.npz")):
        scene = np.load(path)
        sequence, _, camera = path.stem.partition("_")
        steps = len(scene["visibility"])
        for step, seen in enumerate(scene["visibility"]):
            points = thing("points", scene["tracks_XYZ"][step].ravel(), seen[None])
            lens = tuple(scene["fx_fy_cx_cy"].tolist())
            yield View(truth.image_name(int(sequence) * steps + step, camera), (points,), lens)


def by_pandas_birdseye(root: Path) -> Iterator[View]:
    """Boxes in the frame of the ego, moved to the world, and layers of the map."""
    import pandas

    rows = pandas.read_json(root / "frames.jsonl", lines=True)
    for row in rows.itertuples():
        matrix = np.array(row.ego["T_world_ego"])
        T_world_ego = SE3.from_matrix(matrix)
        things = [
            cube(
                box["category"],
                T_world_ego @ SE3(tuple(box["center_m"]), tuple(box["quaternion_wxyz"])),
                box["size_m"],
            )
            for box in row.boxes3d["ego"]
        ]
        for path in sorted(root.glob(f"*/{row.index:09d}.png")):
            things.append(thing(path.parent.name, (), decoded(path) > 0))
        yield View(truth.image_name(row.index, "world"), tuple(things))
