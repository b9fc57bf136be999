"""Rerun recordings of samples: the 3D scene, images and scans.

Timelines are ``sample``, the index of the sample, and for sequences ``time`` in seconds, with one
sequence after the other. Unchanged values are not sent again. Rerun's quaternions are x y z w, its
boxes have half sizes; a pinhole's principal point is as in this project (pixel centres at i + 0.5).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from gen_data.core import (
    asset_types,
    errors,
    interfaces,
    intrinsics,
    se3,
    serialization,
    skeletons,
    whole_files,
)
from gen_data.core.boxes import OrientedBox
from gen_data.core.capture import LAYERS, Capture, Channel, PointCloud, SensorReading
from gen_data.core.lane_geometry import LaneBorder
from gen_data.core.sample import BorderTruth, ImageTruth, Occupancy, Sample, SensorTracks, TextTruth
from gen_data.core.scene import Body, Instance, Scene
from gen_data.exporters import label_parts
from gen_data.exporters.label_colors import id_color
from gen_data.preview import overlay, sensor_views, text_view

TIMELINE = "sample"
TIME = "time"
APPLICATION = "gen-data"
IN_IMAGE = {Channel.RGB, Channel.Z_DEPTH, Channel.MEASURED_DEPTH, Channel.DEPTH_LAYERS}
"""Channels that are overlaid in one view; each other channel has its own view."""
AXES_M = 0.5
"""Length of the axes of rigs and devices."""


IMAGE_PLANE_M = 0.15
"""Distance of a camera's image from the camera in the 3D view."""
EYE_M = 0.25
"""Distance before the first camera at which the 3D view opens: its image does not fill the view."""
TARGET_M = 2.0
"""Distance from there of the point that the view turns around."""
WAY_M = 0.1
"""Shortest trajectory to show."""


@dataclass
class Recorder:
    """Writes samples to one recording stream; remembers the data already sent.

    Attributes:
        stream: Recording to write to.
        info: Data set of the samples.
        points: Property that determines the colour of laser points.
    """

    stream: rr.RecordingStream
    assets: interfaces.AssetLibrary
    info: interfaces.DatasetInfo
    points: sensor_views.PointColors = "class"
    _sent: dict[str, tuple[Any, ...]] = field(default_factory=dict)
    _skeletons: dict[int, skeletons.Skeleton] = field(default_factory=dict)
    _borders: tuple[LaneBorder, ...] = ()
    _sequence: int = -1
    _is_open: bool = False

    def start(self) -> None:
        """Log values common to all samples: axes and category names."""
        self._name_classes()
        self.stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)

    def _name_classes(self) -> None:
        background = rr.AnnotationInfo(id=0, label="background", color=(60, 60, 60))
        described = [rr.ClassDescription(info=background)]
        for k, name in enumerate(self.info.categories, 1):
            info = rr.AnnotationInfo(id=k, label=name, color=id_color(k))
            skeleton = self._skeletons.get(k, skeletons.Skeleton(()))
            described.append(
                rr.ClassDescription(
                    info=info,
                    keypoint_annotations=[
                        rr.AnnotationInfo(id=i, label=label, color=id_color(k))
                        for i, label in enumerate(skeleton.names)
                    ],
                    keypoint_connections=skeleton.bones,
                )
            )
        self.stream.log("/", rr.AnnotationContext(described), static=True)

    def _learn_skeletons(self, instances: Iterable[Instance]) -> None:
        """Log the keypoints of categories that are new or have more keypoints than before."""
        known = dict(self._skeletons)
        for instance in instances:
            if instance.keypoints and instance.category_id:
                before = known.get(instance.category_id, skeletons.Skeleton(()))
                names = (*before.names, *(point.name for point in instance.keypoints))
                known[instance.category_id] = skeletons.find_skeleton(names)
        if known != self._skeletons:
            self._skeletons = known
            self._name_classes()

    def record(self, sample: Sample) -> None:
        """Log one sample at its time."""
        if not self._is_open:
            self._is_open = True
            self.stream.send_blueprint(_layout(self.info, sample))
        self._learn_skeletons(sample.scene.instances)
        self._set_time(sample, sample.scene.time_s)
        self._record_bodies(sample.scene)
        self._record_frames(sample.scene)
        self._record_ways(sample)
        if sample.truth:
            self.stream.log("world/boxes", boxes_3d(sample))
        if sample.frame is not None and sample.frame.occupancy is not None:
            self._record_voxels(sample.frame.occupancy, sample.scene)
        borders = () if sample.frame is None else sample.frame.borders or ()
        if borders != self._borders:
            self._borders = borders
            self.stream.log("world/lanes", lane_strips_3d(borders))
        tracks = None if sample.frame is None else sample.frame.tracks
        if tracks is not None:
            colors = label_parts.track_colors(len(tracks.position_m))
            places = rr.Points3D(tracks.position_m, colors=colors)
            self.stream.log("world/tracks", places)
        for name, reading in sorted(sample.capture.readings.items()):
            self._set_time(sample, reading.time_s)
            self._record_image(name, reading, sample.truth[name])
            self._record_delivery(name, reading)
            if tracks is not None:
                points = tracked_points(tracks.sensors[name])
                self.stream.log(f"world/cameras/{name}/image/tracks", points)
        for name, cloud in sorted(sample.capture.clouds.items()):
            self._set_time(sample, cloud.time_s)
            self._record_cloud(name, cloud)
            self._record_delivery(name, cloud)
        self._record_faults(sample.capture)

    def _record_faults(self, capture: Capture) -> None:
        """Log the true faults of all readings that have some, as text."""
        for name, found in capture.faults():
            if found:
                text = serialization.canonical_json(found)
                self.stream.log(f"faults/{name}", rr.TextDocument(text))

    def _set_time(self, sample: Sample, time_s: float) -> None:
        """Set the time of the following logs to an instant of the sample's sequence."""
        self.stream.set_time(TIMELINE, sequence=sample.index)
        if self.info.steps_per_scene > 1:
            begins_s = (sample.index - sample.step_index) * self.info.step_s
            self.stream.set_time(TIME, duration=round(begins_s + time_s, 9))

    def _record_bodies(self, scene: Scene) -> None:
        paths = set()
        for body in scene.bodies:
            path = f"world/bodies/{body.name}"
            paths.add(path)
            look, place = (body.asset, body.materials), (body.T_world_body, body.scale)
            before = self._sent.get(path, (None, None))
            self._sent[path] = (look, place)
            if before[1] != place:
                self.stream.log(path, transform(*place))
            if before[0] != look:
                mesh = self.assets.mesh(body.asset)
                self.stream.log(path, mesh_3d(mesh, self._slot_colors(body, mesh)))
        for path in sorted(set(self._sent) - paths):
            del self._sent[path]
            self.stream.log(path, rr.Clear(recursive=False))

    def _record_frames(self, scene: Scene) -> None:
        """Log the poses of rigs and devices; cameras and scanners are logged per reading."""
        frames: dict[str, se3.SE3] = {
            f"world/rigs/{rig.name}": scene.rig_pose(rig.name) for rig in scene.rigs
        } | {f"world/devices/{device.name}": device.T_world_device for device in scene.devices}
        for path, pose in frames.items():
            self.stream.log(path, transform(pose), rr.TransformAxes3D(AXES_M))

    def _record_voxels(self, grid: Occupancy, scene: Scene) -> None:
        """Log voxels with a surface as boxes that touch."""
        centers_m, colors = label_parts.surface_voxels(grid, label_parts.categories_of(scene))
        self.stream.log("world/occupancy", transform(grid.T_world_frame))
        half_m = np.full_like(centers_m, 0.5 * grid.voxel_m)
        solid = rr.components.FillMode.Solid
        voxels = rr.Boxes3D(centers=centers_m, half_sizes=half_m, colors=colors, fill_mode=solid)
        self.stream.log("world/occupancy/voxels", voxels)

    def _record_ways(self, sample: Sample) -> None:
        sequence = sample.index // self.info.steps_per_scene
        if self.info.steps_per_scene > 1 and sequence != self._sequence:
            self._sequence = sequence
            remaining = self.info.steps_per_scene - 1 - sample.step_index
            until_s = sample.scene.time_s + remaining * self.info.step_s
            self.stream.log("world/ways", trajectory_strips(sample.scene, until_s))

    def _slot_colors(self, body: Body, mesh: asset_types.MeshData) -> NDArray[np.uint8]:
        """SRGB colour per material slot: base colour times the texture's mean."""
        colors = []
        for material in body.materials or mesh.materials:
            linear = np.asarray(material.base_color)
            if material.texture:
                albedo = self.assets.texture(material.texture).albedo[::8, ::8] / 255.0
                linear = linear * (albedo**2.2).mean(axis=(0, 1))
            colors.append(np.clip(linear, 0, 1) ** (1 / 2.2) * 255)
        return np.asarray(colors).astype(np.uint8)

    def _record_image(self, name: str, reading: SensorReading, truth: ImageTruth) -> None:
        path = f"world/cameras/{name}"
        self.stream.log(path, transform(reading.camera.T_world_camera))
        # Rerun supports pinholes only: images of other lenses are shown without projection.
        if reading.camera.intrinsics.straight:
            self.stream.log(f"{path}/image", pinhole(reading.camera.intrinsics))
        for channel, data in reading.channels.items():
            if channel is Channel.RGB:
                self.stream.log(f"{path}/image/rgb", rr.Image(data).compress(90))
            elif channel in (Channel.Z_DEPTH, Channel.MEASURED_DEPTH):
                shown = np.where(np.isfinite(data), data, 0).astype(np.float32)
                self.stream.log(f"{path}/image/{channel.value}", rr.DepthImage(shown, meter=1.0))
            elif channel is Channel.DEPTH_LAYERS:
                for number, layer_m in enumerate(np.moveaxis(data, -1, 0)):
                    shown = np.where(np.isfinite(layer_m), layer_m, 0).astype(np.float32)
                    layer = f"{path}/image/{channel.value}/{number}"
                    self.stream.log(layer, rr.DepthImage(shown, meter=1.0))
            elif channel in LAYERS:
                for number, image in enumerate(overlay.layer_images(reading, channel)):
                    layer = f"channels/{name}/{channel.value}/{number}"
                    self.stream.log(layer, rr.Image(image).compress(90))
            elif channel is Channel.CATEGORY:
                self.stream.log(f"channels/{name}/category", rr.SegmentationImage(data))
            else:
                colored = overlay.channel_image(reading, channel)
                self.stream.log(f"channels/{name}/{channel.value}", rr.Image(colored).compress(90))
                if channel is Channel.MIRRORED_POSITION:
                    places_m, colors = label_parts.mirrored_points(data, colored)
                    self.stream.log(f"world/mirrored/{name}", rr.Points3D(places_m, colors=colors))
        self._record_truth(f"{path}/image", truth)

    def _record_truth(self, path: str, truth: ImageTruth) -> None:
        """Log the annotations of an image below it."""
        self.stream.log(f"{path}/boxes", boxes_2d(truth))
        if truth.borders is not None:
            self.stream.log(f"{path}/lanes", lane_strips_2d(truth.borders))
        if truth.texts is not None:
            self.stream.log(f"{path}/texts", text_strips(truth.texts))
        self._record_keypoints(f"{path}/keypoints", truth)

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

    def _record_delivery(self, name: str, reading: SensorReading | PointCloud) -> None:
        """Log how often an image or scan arrives, and how late."""
        found = label_parts.delivery(self.info, name, reading)
        if found is not None:
            for entity, number in zip(("arrivals", "late_s"), found, strict=True):
                self.stream.log(f"delivery/{name}/{entity}", rr.Scalars(number))

    def _record_cloud(self, name: str, cloud: PointCloud) -> None:
        path = f"world/lidars/{name}"
        self.stream.log(path, transform(cloud.lidar.T_world_lidar))
        colors = sensor_views.point_colors(cloud, self.points)
        points = rr.Points3D(
            cloud.points["position_m"], colors=colors, radii=rr.Radius.ui_points(1.5)
        )
        self.stream.log(f"{path}/points", points)


def save_recording(
    path: Path,
    samples: Iterable[Sample],
    assets: interfaces.AssetLibrary,
    *,
    info: interfaces.DatasetInfo,
    points: sensor_views.PointColors = "class",
) -> None:
    """Write samples to a ``.rrd`` file. Raises StorageError if the file cannot be written."""
    try:
        with whole_files.whole_file(path) as unfinished:
            unfinished.touch()
            stream = rr.RecordingStream(APPLICATION)
            stream.save(unfinished)
            _record_all(Recorder(stream, assets, info, points), samples)
            stream.disconnect()
    except OSError as error:
        raise errors.StorageError(f"{path}: {error.strerror or error}") from error


def send_samples(
    url: str,
    samples: Iterable[Sample],
    assets: interfaces.AssetLibrary,
    *,
    info: interfaces.DatasetInfo,
    points: sensor_views.PointColors = "class",
) -> None:
    """Send samples to the viewer at ``url``, one by one as they are generated."""
    stream = rr.RecordingStream(APPLICATION)
    stream.connect_grpc(url)
    _record_all(Recorder(stream, assets, info, points), samples)
    stream.flush()


def _record_all(recorder: Recorder, samples: Iterable[Sample]) -> None:
    recorder.start()
    for sample in samples:
        recorder.record(sample)


def _layout(info: interfaces.DatasetInfo, first: Sample) -> rrb.Blueprint:
    world = rrb.Spatial3DView(origin="world", name="scene", eye_controls=_eye(first))
    cameras = rrb.Vertical(*(_camera_view(info, name, first) for name in info.cameras))
    return rrb.Blueprint(rrb.Horizontal(world, cameras), collapse_panels=True)


def _eye(sample: Sample) -> rrb.EyeControls3D | None:
    """The first camera's view: from outside, a closed room shows its walls."""
    if not sample.capture.readings:
        return None
    _, reading = min(sample.capture.readings.items())
    ahead = np.array([[0.0, 0.0, EYE_M], [0.0, 0.0, EYE_M + TARGET_M]])
    position, target = reading.camera.T_world_camera.apply(ahead)
    return rrb.EyeControls3D(position=position, look_target=target, eye_up=(0.0, 0.0, 1.0))


def _camera_view(
    info: interfaces.DatasetInfo, name: str, first: Sample
) -> rrb.Spatial2DView | rrb.Tabs:
    image = rrb.Spatial2DView(origin=f"world/cameras/{name}/image", name=name)
    reading = first.capture.readings.get(name)
    others = [
        rrb.Spatial2DView(origin=f"channels/{name}/{view}", name=f"{name} {view}")
        for channel in info.media.get(name, ())
        if channel not in IN_IMAGE
        for view in _views_of(channel, reading)
    ]
    return rrb.Tabs(image, *others) if others else image


def _views_of(channel: Channel, reading: SensorReading | None) -> list[str]:
    """Names of the views of a channel: one, or one of each layer."""
    if channel not in LAYERS or reading is None:
        return [channel.value]
    return [f"{channel.value}/{layer}" for layer in range(reading.channels[channel].shape[-1])]


def transform(pose: se3.SE3, scale: float = 1.0) -> rr.Transform3D:
    """Convert a pose, with an optional scale of its children."""
    return rr.Transform3D(
        translation=pose.translation_m,
        quaternion=rr.Quaternion(xyzw=_xyzw(pose)),
        scale=scale if scale != 1.0 else None,
    )


def pinhole(camera: intrinsics.Intrinsics) -> rr.Pinhole:
    """Convert a pinhole camera: X right, Y down, Z forward."""
    return rr.Pinhole(
        image_from_camera=camera.matrix(),
        width=camera.width_px,
        height=camera.height_px,
        camera_xyz=rr.ViewCoordinates.RDF,
        image_plane_distance=IMAGE_PLANE_M,
    )


def tracked_points(tracks: SensorTracks) -> rr.Points2D:
    """Convert the tracked points inside an image; hidden ones are smaller."""
    shown = label_parts.inside_image(tracks)
    colors = label_parts.track_colors(len(tracks.state))
    return rr.Points2D(
        tracks.image_px[shown],
        colors=[colors[k] for k in shown.tolist()],
        radii=np.where(tracks.visible[shown], *label_parts.TRACK_RADII[::-1]),
        keypoint_ids=shown,
        show_labels=False,
    )


def mesh_3d(mesh: asset_types.MeshData, slot_colors: NDArray[np.uint8]) -> rr.Mesh3D:
    """Convert a mesh with one sRGB colour per material slot, [slots, 3]."""
    corners = mesh.faces.reshape(-1)
    slots = np.repeat(mesh.face_slots, 3)
    return rr.Mesh3D(
        vertex_positions=mesh.vertices_m[corners],
        vertex_normals=mesh.normals[corners],
        vertex_colors=slot_colors[slots],
        triangle_indices=np.arange(len(corners), dtype=np.uint32).reshape(-1, 3),
    )


def boxes_3d(sample: Sample) -> rr.Boxes3D:
    """World boxes, at the sample's instant, of all objects visible to any camera, by id."""
    boxes_then = {thing.instance_id: thing.box3d for thing in sample.scene.instances}
    found: dict[int, tuple[Instance, OrientedBox]] = {
        item.instance.instance_id: (item.instance, boxes_then[item.instance.instance_id])
        for truth in sample.truth.values()
        for item in truth.objects
        if item.box3d_world is not None
    }
    boxes = [found[key] for key in sorted(found)]
    return rr.Boxes3D(
        centers=[box.T_frame_box.translation_m for _, box in boxes],
        half_sizes=[[0.5 * s for s in box.size_m] for _, box in boxes],
        quaternions=[_xyzw(box.T_frame_box) for _, box in boxes],
        labels=[instance.category for instance, _ in boxes],
        class_ids=[instance.category_id for instance, _ in boxes],
    )


def boxes_2d(truth: ImageTruth) -> rr.Boxes2D:
    """Image boxes of all visible objects."""
    items = [item for item in truth.objects if item.box is not None]
    return rr.Boxes2D(
        mins=[(item.box.x_min, item.box.y_min) for item in items if item.box],
        sizes=[(item.box.width_px, item.box.height_px) for item in items if item.box],
        labels=[overlay.title(item) for item in items],
        class_ids=[item.instance.category_id for item in items],
    )


def lane_strips_3d(borders: Sequence[LaneBorder]) -> rr.LineStrips3D:
    """Convert borders of lanes in the world, coloured by kind."""
    return rr.LineStrips3D(
        [np.add(border.points_m, (0.0, 0.0, label_parts.LIFT_M)) for border in borders],
        colors=[label_parts.border_color(border.kind) for border in borders],
        radii=rr.Radius.ui_points(1.0),
    )


def lane_strips_2d(borders: Sequence[BorderTruth]) -> rr.LineStrips2D:
    """Convert borders of lanes in an image; hidden parts are darker and thinner."""
    parts = [(b.kind, seen, line) for b in borders for seen, line in label_parts.split_border(b)]
    return rr.LineStrips2D(
        [line for _, _, line in parts],
        colors=[label_parts.border_color(kind, visible=seen) for kind, seen, _ in parts],
        radii=[label_parts.BORDER_RADII[seen] for _, seen, _ in parts],
    )


def text_strips(texts: Sequence[TextTruth]) -> rr.LineStrips2D:
    """Convert words in an image: outlines with the text, in the colours of ``text_view``."""
    words = [word for text in texts for word in text.words if word.visible_fraction > 0.0]
    return rr.LineStrips2D(
        [[*word.quad_px, word.quad_px[0]] for word in words],
        colors=[text_view.word_color(word) for word in words],
        labels=[word.text for word in words],
        show_labels=False,
        radii=-1.0,
    )


def trajectory_strips(scene: Scene, until_s: float) -> rr.LineStrips3D:
    """Trajectories of bodies from now to an instant, coloured by category; rigs in white."""
    categories = label_parts.categories_of(scene)
    carriers = {rig.body for rig in scene.rigs}
    strips, colors = [], []
    for track in scene.tracks:
        steps = max(2, round((until_s - scene.time_s) / track.step_s) + 1)
        times_s = np.linspace(scene.time_s, until_s, steps)
        _, places_m = track.poses(times_s)
        if float(np.ptp(places_m, axis=0).max()) < WAY_M:
            continue
        category_id = categories.get(scene.body(track.body).instance_id, 0)
        strips.append(np.add(places_m, (0.0, 0.0, label_parts.LIFT_M)))
        carries = track.body in carriers or not category_id
        colors.append((255, 255, 255) if carries else id_color(category_id))
    return rr.LineStrips3D(strips, colors=colors, radii=rr.Radius.ui_points(1.5))


def _xyzw(pose: se3.SE3) -> tuple[float, float, float, float]:
    w, x, y, z = pose.quaternion_wxyz
    return (x, y, z, w)
