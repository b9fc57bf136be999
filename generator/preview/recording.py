"""Samples as a Rerun recording: the 3D scene, the camera images, one timeline step per sample.

Borders of the format: quaternions are x y z w, boxes have half sizes, the pinhole's principal point
is in our own convention (pixel centres at i + 0.5).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from generator.core.capture import Channel, PointCloud, Reading
from generator.core.errors import StorageError
from generator.core.geometry import MeshData
from generator.core.interfaces import AssetLibrary
from generator.core.sample import ImageTruth, Sample
from generator.core.scene import Body, Instance, Scene
from generator.core.se3 import SE3
from generator.core.skeletons import Skeleton, skeleton_of
from generator.preview.clouds import point_colors
from generator.preview.palette import color_of

TIMELINE = "sample"
APPLICATION = "gen-data"


@dataclass
class Recorder:
    """Writes samples to one recording stream; remembers what it has already sent.

    Attributes:
        stream: Where to write.
        categories: Names; category id ``k`` is ``categories[k - 1]``.
    """

    stream: rr.RecordingStream
    assets: AssetLibrary
    categories: Sequence[str]
    _sent: dict[str, tuple[Any, ...]] = field(default_factory=dict)
    _skeletons: dict[int, Skeleton] = field(default_factory=dict)

    def start(self, sensors: Sequence[str]) -> None:
        """Log what holds for every sample: axes, category names, the layout of the views."""
        self._name_classes()
        self.stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        self.stream.send_blueprint(_layout(sensors))

    def _name_classes(self) -> None:
        """Log names and colours of categories and, as far as they are known, their skeletons."""
        background = rr.AnnotationInfo(id=0, label="background", color=(60, 60, 60))
        described = [rr.ClassDescription(info=background)]
        for k, name in enumerate(self.categories, 1):
            info = rr.AnnotationInfo(id=k, label=name, color=color_of(k))
            skeleton = self._skeletons.get(k, Skeleton(()))
            described.append(
                rr.ClassDescription(
                    info=info,
                    keypoint_annotations=[
                        rr.AnnotationInfo(id=i, label=label, color=color_of(k))
                        for i, label in enumerate(skeleton.names)
                    ],
                    keypoint_connections=skeleton.bones,
                )
            )
        self.stream.log("/", rr.AnnotationContext(described), static=True)

    def _learn_skeletons(self, instances: Iterable[Instance]) -> None:
        """Name the keypoints of categories that are met for the first time, or with more points."""
        known = dict(self._skeletons)
        for instance in instances:
            if instance.keypoints and instance.category_id:
                before = known.get(instance.category_id, Skeleton(()))
                names = (*before.names, *(point.name for point in instance.keypoints))
                known[instance.category_id] = skeleton_of(names)
        if known != self._skeletons:
            self._skeletons = known
            self._name_classes()

    def record(self, sample: Sample) -> None:
        """Log one sample at its own step of the timeline."""
        self._learn_skeletons(sample.scene.instances)
        self.stream.set_time(TIMELINE, sequence=sample.index)
        self._record_bodies(sample.scene)
        for name, reading in sorted(sample.capture.readings.items()):
            self._record_image(name, reading, sample.truth[name])
        for name, cloud in sorted(sample.capture.clouds.items()):
            self._record_cloud(name, cloud)
        self._record_boxes(sample)

    def _record_bodies(self, scene: Scene) -> None:
        paths = set()
        for body in scene.bodies:
            path = f"world/bodies/{body.name}"
            paths.add(path)
            self.stream.log(path, _transform(body.T_world_body, body.scale))
            look = (body.asset, body.materials)
            if self._sent.get(path) != look:
                self._sent[path] = look
                self.stream.log(path, self._mesh(body))
        for path in sorted(set(self._sent) - paths):
            del self._sent[path]
            self.stream.log(path, rr.Clear(recursive=False))

    def _mesh(self, body: Body) -> rr.Mesh3D:
        mesh = self.assets.mesh(body.asset)
        corners = mesh.faces.reshape(-1)
        slots = np.repeat(mesh.face_slots, 3)
        return rr.Mesh3D(
            vertex_positions=mesh.vertices_m[corners],
            vertex_normals=mesh.normals[corners],
            vertex_colors=self._slot_colors(body, mesh)[slots],
            triangle_indices=np.arange(len(corners), dtype=np.uint32).reshape(-1, 3),
        )

    def _slot_colors(self, body: Body, mesh: MeshData) -> NDArray[np.uint8]:
        """SRGB colour per material slot: base colour times the texture's mean."""
        colors = []
        for material in body.materials or mesh.materials:
            linear = np.asarray(material.base_color)
            if material.texture:
                albedo = self.assets.texture(material.texture).albedo[::8, ::8] / 255.0
                linear = linear * (albedo**2.2).mean(axis=(0, 1))
            colors.append(np.clip(linear, 0, 1) ** (1 / 2.2) * 255)
        return np.asarray(colors).astype(np.uint8)

    def _record_image(self, name: str, reading: Reading, truth: ImageTruth) -> None:
        camera, intrinsics = reading.camera, reading.camera.intrinsics
        path = f"world/cameras/{name}"
        self.stream.log(path, _transform(camera.T_world_camera))
        # Rerun knows no other camera: images of other lenses are shown by themselves.
        if intrinsics.straight:
            self.stream.log(
                f"{path}/image",
                rr.Pinhole(
                    image_from_camera=intrinsics.matrix(),
                    width=intrinsics.width_px,
                    height=intrinsics.height_px,
                    camera_xyz=rr.ViewCoordinates.RDF,
                    image_plane_distance=0.15,
                ),
            )
        channels = reading.channels
        if Channel.RGB in channels:
            self.stream.log(f"{path}/image/rgb", rr.Image(channels[Channel.RGB]).compress(90))
        if Channel.Z_DEPTH in channels:
            depth_m = channels[Channel.Z_DEPTH]
            shown = np.where(np.isfinite(depth_m), depth_m, 0).astype(np.float32)
            self.stream.log(f"{path}/image/depth", rr.DepthImage(shown, meter=1.0))
        if Channel.CATEGORY in channels:
            categories = rr.SegmentationImage(channels[Channel.CATEGORY], opacity=0.4)
            self.stream.log(f"{path}/image/category", categories)
        self.stream.log(f"{path}/image/boxes", _boxes_2d(truth))
        self._record_keypoints(f"{path}/image/keypoints", truth)

    def _record_keypoints(self, path: str, truth: ImageTruth) -> None:
        # One entity per object: Rerun joins the points of one class within an entity.
        self.stream.log(path, rr.Clear(recursive=True))
        for item in truth.objects:
            shown = [point for point in item.keypoints or () if point.visibility]
            category_id = item.instance.category_id
            if shown and category_id in self._skeletons:
                names = self._skeletons[category_id].names
                points = rr.Points2D(
                    [point.image_px for point in shown],
                    class_ids=[category_id] * len(shown),
                    keypoint_ids=[names.index(point.name) for point in shown],
                    radii=[-3.0 if point.visibility == 2 else -1.5 for point in shown],
                    show_labels=False,
                )
                self.stream.log(f"{path}/{item.instance.instance_id}", points)

    def _record_cloud(self, name: str, cloud: PointCloud) -> None:
        path = f"world/lidars/{name}"
        self.stream.log(path, _transform(cloud.lidar.T_world_lidar))
        points = rr.Points3D(
            cloud.points["position_m"], colors=point_colors(cloud), radii=rr.Radius.ui_points(1.5)
        )
        self.stream.log(f"{path}/points", points)

    def _record_boxes(self, sample: Sample) -> None:
        found = {
            item.instance.instance_id: (item.instance, item.box3d_world)
            for truth in sample.truth.values()
            for item in truth.objects
            if item.box3d_world is not None
        }
        boxes = [found[key] for key in sorted(found)]
        self.stream.log(
            "world/boxes",
            rr.Boxes3D(
                centers=[box.T_frame_box.translation_m for _, box in boxes if box],
                half_sizes=[[0.5 * s for s in box.size_m] for _, box in boxes if box],
                quaternions=[_xyzw(box.T_frame_box) for _, box in boxes if box],
                labels=[instance.category for instance, _ in boxes],
                class_ids=[instance.category_id for instance, _ in boxes],
            ),
        )


def save_recording(
    path: Path,
    samples: Iterable[Sample],
    assets: AssetLibrary,
    *,
    categories: Sequence[str],
    sensors: Sequence[str],
) -> None:
    """Write samples to a ``.rrd`` file.

    Raises:
        StorageError: if the file cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    except OSError as error:
        raise StorageError(f"{path}: {error.strerror}") from error
    stream = rr.RecordingStream(APPLICATION)
    stream.save(path)
    _record_all(Recorder(stream, assets, categories), samples, sensors)
    stream.disconnect()


def show_samples(
    samples: Iterable[Sample],
    assets: AssetLibrary,
    *,
    categories: Sequence[str],
    sensors: Sequence[str],
    web: bool,
) -> str:
    """Show samples in the desktop viewer, or serve them to a browser.

    Returns:
        Where the viewer is: a URL for the web viewer, else an empty string.
    """
    stream = rr.RecordingStream(APPLICATION)
    where = ""
    if web:
        where = stream.serve_grpc()
        rr.serve_web_viewer(open_browser=False, connect_to=where)
    else:
        stream.spawn()
    _record_all(Recorder(stream, assets, categories), samples, sensors)
    stream.flush()
    return where


def _record_all(recorder: Recorder, samples: Iterable[Sample], sensors: Sequence[str]) -> None:
    recorder.start(sensors)
    for sample in samples:
        recorder.record(sample)


def _layout(sensors: Sequence[str]) -> rrb.Blueprint:
    cameras = [
        rrb.Spatial2DView(origin=f"world/cameras/{name}/image", name=name) for name in sensors
    ]
    world = rrb.Spatial3DView(origin="world", name="scene")
    return rrb.Blueprint(rrb.Horizontal(world, rrb.Vertical(*cameras)), collapse_panels=True)


def _boxes_2d(truth: ImageTruth) -> rr.Boxes2D:
    items = [item for item in truth.objects if item.box is not None]
    return rr.Boxes2D(
        mins=[(item.box.x_min, item.box.y_min) for item in items if item.box],
        sizes=[(item.box.width_px, item.box.height_px) for item in items if item.box],
        labels=[item.instance.category for item in items],
        class_ids=[item.instance.category_id for item in items],
    )


def _transform(pose: SE3, scale: float = 1.0) -> rr.Transform3D:
    return rr.Transform3D(
        translation=pose.translation_m,
        quaternion=rr.Quaternion(xyzw=_xyzw(pose)),
        scale=scale if scale != 1.0 else None,
    )


def _xyzw(pose: SE3) -> tuple[float, float, float, float]:
    w, x, y, z = pose.quaternion_wxyz
    return (x, y, z, w)
