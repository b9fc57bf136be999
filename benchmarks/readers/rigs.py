"""Readers of drives: boxes in space, scans, poses and calibrations."""

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.readers.detection import import_torchvision, matrix_lens
from benchmarks.readers.truth import image_name
from benchmarks.readers.views import Thing, View, cube, thing
from gen_data.core.se3 import SE3


def by_nuscenes_devkit(root: Path) -> Iterator[View]:
    """Boxes in the frame of each camera, as the devkit moves them there, and K."""
    for devkit, sample, channel, token in _nuscenes(root):
        if channel.startswith("CAM"):
            _, boxes, K = devkit.get_sample_data(token, box_vis_level=0)
            things = (
                cube(b.name, SE3(tuple(b.center), tuple(b.orientation)), b.wlh[[1, 0, 2]])
                for b in boxes
            )
            name = image_name(sample, channel.removeprefix("CAM_").lower())
            yield View(name, tuple(things), matrix_lens(K, shift=0.5))


def by_nuscenes_points(root: Path) -> Iterator[View]:
    """Points of every scan; nuScenes' scanner has X to the right and Y forward."""
    from nuscenes.utils.data_classes import LidarPointCloud

    for devkit, sample, channel, token in _nuscenes(root):
        if channel == "LIDAR_TOP":
            x, y, z = LidarPointCloud.from_file(devkit.get_sample_data_path(token)).points[:3]
            points = np.stack([y, -x, z], -1).astype(float)
            yield View(image_name(sample, "velodyne"), (Thing("points", points.ravel()),))


def _nuscenes(root: Path) -> Iterator[tuple[Any, int, str, str]]:
    from nuscenes.nuscenes import NuScenes

    devkit = NuScenes("v1.0-mini", str(root), verbose=False)
    for k, sample in enumerate(devkit.sample):
        for channel, token in sample["data"].items():
            yield devkit, k, channel, token


def by_torchvision_kitti(root: Path) -> Iterator[View]:
    """KITTI's 3D boxes in the camera's frame; ``DontCare`` are left out."""
    import_torchvision()
    from torchvision.datasets import Kitti

    home = Path(tempfile.mkdtemp()) / "Kitti"
    home.mkdir()
    (home / "raw").symlink_to(root.resolve())
    data = Kitti(str(home.parent), train=True)
    # It lists images in the order of the folder.
    for path, (_, rows) in zip(data.images, data, strict=True):
        found = [row for row in rows if row["type"] != "DontCare"]
        name = image_name(int(Path(path).stem), "image_02")
        yield View(name, tuple(map(_kitti_cube, found)))


def _kitti_cube(row: dict[str, Any]) -> Thing:
    """KITTI's readme: the location is the middle of the lower face, Y points down."""
    (h, w, length), (x, y, z), turn = row["dimensions"], row["location"], row["rotation_y"]
    forward = np.array([np.cos(turn), 0.0, -np.sin(turn)])
    up = np.array([0.0, -1.0, 0.0])
    axes = np.array([forward * length, np.cross(up, forward) * w, up * h]) / 2
    return thing(row["type"], np.vstack([[x, y - h / 2, z], axes]))


def by_pykitti(root: Path) -> Iterator[View]:
    """Scans of KITTI's raw recordings, and K of the rectified cameras."""
    import pykitti

    (drive,) = root.glob("*/*_sync")
    date, _, number, _ = drive.name.rsplit("_", 3)
    data = pykitti.raw(str(root), date, number)
    for k in range(len(data)):
        points = data.get_velo(k)[:, :3].astype(float)
        yield View(image_name(k, "velodyne"), (Thing("points", points.ravel()),))
        for camera, K in (("image_02", data.calib.K_cam2), ("image_03", data.calib.K_cam3)):
            yield View(image_name(k, camera), (), matrix_lens(K, shift=0.5))


def by_open3d(root: Path) -> Iterator[View]:
    """Points of PLY files."""
    import open3d

    for path in sorted(root.glob("*/*.ply")):
        points = np.asarray(open3d.t.io.read_point_cloud(str(path)).point.positions.numpy(), float)
        yield View(f"{path.stem}_{path.parent.name}", (Thing("points", points.ravel()),))


def mcap_messages(root: Path) -> Iterator[tuple[int, str, Any]]:
    """Number of the instant, topic and message of all files, in order."""
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory

    instants: dict[tuple[Path, int], int] = {}
    paths = [path for split in ("train", "val") for path in sorted((root / split).glob("*.mcap"))]
    for path in paths:
        with path.open("rb") as file:
            reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
            for _, channel, message, value in reader.iter_decoded_messages():
                key = (path, message.log_time)
                yield instants.setdefault(key, len(instants)), channel.topic, value


def by_mcap(root: Path) -> Iterator[View]:
    """Boxes in images and calibrations; the lens has OpenCV's pixel centres."""
    views: dict[str, dict[str, Any]] = {}
    for k, topic, value in mcap_messages(root):
        _, kind, *rest = topic.split("/")
        if kind == "camera" and rest[1] in ("annotations", "calibration"):
            views.setdefault(image_name(k, rest[0]), {})[rest[1]] = value
    for name, found in views.items():
        things, calibration = [], found["calibration"]
        for shape, text in zip(
            found["annotations"].points, found["annotations"].texts, strict=True
        ):
            corners = [(point.x, point.y) for point in shape.points]
            things.append(thing(text.text, (*np.min(corners, 0), *np.max(corners, 0))))
        yield View(name, tuple(things), matrix_lens(calibration.K, calibration.D, 0.5))


def by_mcap_cubes(root: Path) -> Iterator[View]:
    """Boxes in the world."""
    for k, topic, value in mcap_messages(root):
        if topic == "/objects":
            things = []
            for entity in value.entities:
                category = {pair.key: pair.value for pair in entity.metadata}["category"]
                (box,) = entity.cubes
                place, turn = box.pose.position, box.pose.orientation
                pose = SE3((place.x, place.y, place.z), (turn.w, turn.x, turn.y, turn.z))
                things.append(cube(category, pose, (box.size.x, box.size.y, box.size.z)))
            yield View(image_name(k, "world"), tuple(things))


def by_mcap_points(root: Path) -> Iterator[View]:
    """Points of every scan."""
    for k, topic, value in mcap_messages(root):
        if topic.endswith("/points"):
            cells = np.frombuffer(value.data, np.uint8).reshape(-1, value.point_stride)
            points = np.ascontiguousarray(cells[:, :12]).view("<f4").astype(float)
            yield View(image_name(k, topic.split("/")[2]), (Thing("points", points.ravel()),))


def by_evo(root: Path) -> Iterator[View]:
    """Trajectory of TUM's benchmark."""
    from evo.tools import file_interface

    for k, path in enumerate(sorted(root.glob("*/*/groundtruth.txt"))):
        for pose in file_interface.read_tum_trajectory_file(str(path)).poses_se3:
            yield View(image_name(k, "color"), (thing("pose", pose[:3]),))


def by_opencv(root: Path) -> Iterator[View]:
    """Calibrations as OpenCV's ``FileStorage`` reads them."""
    import cv2

    rows = [line.split(",") for line in (root / "samples.csv").read_text().splitlines()[1:]]
    for index, _, number in rows:
        for path in sorted((root / f"{int(number):04d}/opencv").glob("*.yml")):
            file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
            K, D = (file.getNode(k).mat() for k in ("camera_matrix", "distortion_coefficients"))
            yield View(image_name(int(index), path.stem), (), matrix_lens(K, D.ravel(), 0.5))


def by_pycolmap(root: Path) -> Iterator[View]:
    """COLMAP's models: poses and lenses of all photographs."""
    import pycolmap

    for folder in sorted((root / "colmap").iterdir()):
        model = pycolmap.Reconstruction(str(folder))
        for image in model.images.values():
            camera, sample = Path(image.name).parent.name, int(Path(image.name).stem)
            pose = image.cam_from_world().inverse().matrix()
            lens = tuple(map(float, model.cameras[image.camera_id].params))
            yield View(image_name(sample, camera), (thing("pose", pose),), lens)


def by_usd_core(root: Path) -> Iterator[View]:
    """Cameras of OpenUSD stages: poses, apertures as K, and our attributes of bent lenses."""
    from pxr import Usd, UsdGeom

    for path in sorted(root.glob("*.usdc")):
        stage = Usd.Stage.Open(str(path))
        for prim in stage.Traverse():
            if not prim.IsA(UsdGeom.Camera):
                continue
            camera = UsdGeom.Camera(prim).GetCamera()
            width, height = prim.GetAttribute("genData:imageSize").Get()
            px, py = width / camera.horizontalAperture, height / camera.verticalAperture
            lens = (
                camera.focalLength * px, camera.focalLength * py,
                width / 2 - camera.horizontalApertureOffset * px,
                height / 2 + camera.verticalApertureOffset * py,
                *(prim.GetAttribute("genData:lens:coefficients").Get() or ()),
            )  # fmt: skip
            # USD's cameras look along -Z, with Y up; its matrices stand to the right of points.
            pose = np.array(camera.transform).T @ np.diag([1.0, -1.0, -1.0, 1.0])
            name = image_name(int(path.stem), prim.GetName())
            yield View(name, (thing("pose", pose[:3]),), lens)


def by_av2(root: Path) -> Iterator[View]:
    """Argoverse 2: boxes in the city, and lenses of the cameras."""
    from av2.geometry.camera.pinhole_camera import PinholeCamera
    from av2.structures.cuboid import CuboidList
    from av2.utils.io import read_city_SE3_ego

    (log,) = root.glob("*/*")
    cuboids = CuboidList.from_feather(log / "annotations.feather")
    egos = read_city_SE3_ego(log)
    for k, path in enumerate(sorted((log / "sensors/lidar").glob("*.feather"))):
        here = [c for c in cuboids.cuboids if c.timestamp_ns == int(path.stem)]
        things = []
        for one in here:
            box = one.transform(egos[int(path.stem)])
            axes = box.dst_SE3_object.rotation.T * box.dims_lwh_m[:, None] / 2
            things.append(thing(one.category, np.vstack([box.xyz_center_m, axes])))
        yield View(image_name(k, "world"), tuple(things))
        for folder in sorted((log / "sensors/cameras").iterdir()):
            K = PinholeCamera.from_feather(log, folder.name).intrinsics.K
            yield View(image_name(k, folder.name), (), matrix_lens(K, shift=0.5))


def by_av2_points(root: Path) -> Iterator[View]:
    """Argoverse 2: points of each sweep, back in the scanner's frame."""
    from av2.structures.sweep import Sweep

    for k, path in enumerate(sorted(root.glob("*/*/sensors/lidar/*.feather"))):
        sweep = Sweep.from_feather(path)
        points = sweep.ego_SE3_up_lidar.inverse().transform_point_cloud(sweep.xyz)
        yield View(image_name(k, "velodyne"), (Thing("points", points.ravel()),))
