"""Samples of a data set: readings, their annotations, and the scene they come from."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gen_data.core import boxes, lane_geometry, se3, serialization
from gen_data.core.capture import Capture
from gen_data.core.motion import STILL, Twist
from gen_data.core.scene import Camera, Instance, Scene
from gen_data.core.writing import Kind


@dataclass(frozen=True, eq=False, slots=True)
class MaskPx:
    """A binary mask, stored tight: the box it fills and the pixels inside that box.

    Attributes:
        x_px, y_px: Where ``pixels[0, 0]`` lies in the image (may be negative when amodal).
        pixels: bool [h, w].
    """

    x_px: int
    y_px: int
    pixels: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class KeypointTruth:
    """One keypoint of an instance in one image.

    Attributes:
        position_m: In the camera frame.
        image_px: Image coordinates; (0, 0) where it is not in the image.
        visibility: COCO's: 0 not in the image, 1 in the image and hidden, 2 visible.
    """

    name: str
    position_m: se3.Vec3
    image_px: tuple[float, float] = (0.0, 0.0)
    visibility: Literal[0, 1, 2] = 0


@dataclass(frozen=True, slots=True)
class MotionTruth:
    """Motion of an instance over the ground, in the axes of several frames.

    All three are the motion of the instance's frame relative to the world: the motion of camera and
    ego is not subtracted.

    Attributes:
        ego: None in a scene without a rig.
    """

    world: Twist
    camera: Twist
    ego: Twist | None = None

    @property
    def speed_m_s(self) -> float:
        """Of its frame's origin."""
        x, y, z = self.world.velocity_m_s
        return math.sqrt(x * x + y * y + z * z)


PointPx = tuple[float, float]
"""Image coordinates."""


@dataclass(frozen=True, eq=False, slots=True)
class ObjectTruth:
    """All annotations of one instance in one image.

    A field is None when its annotator was not asked for.

    Attributes:
        visible_px: Pixels of the instance in the image.
        box: Tight box of the visible pixels.
        amodal_box: Tight box of the whole silhouette, hidden parts and parts outside the image
            included (boxes2d).
        oriented_box: Corners of the smallest rectangle around the visible pixels with sides along
            the heading of the object as the image shows it: front left, front right, rear right,
            rear left, clockwise seen from above; may leave the image (oriented_boxes2d).
        box3d_world, box3d_camera: The oriented box in both frames (boxes3d).
        T_camera_object: Pose of the instance frame in the camera frame (poses).
        mask: Visible pixels (instance_masks).
        amodal_mask: The whole silhouette, clipped to the image (amodal_masks).
        visible_fraction: Visible pixels / pixels of the whole silhouette, in or out of the image
            (BOP's visib_fract) (visibility).
        occlusion: Share of the silhouette inside the image that other objects hide (visibility).
        truncation: Share of the silhouette that lies outside the image (visibility).
        detectability: Contrast of the visible pixels to the pixels around them over the noise:
            d' of the ideal observer; None without a photograph too (detectability).
        part_px: Visible pixels per part name, for instances with parts (part_masks).
        keypoints: In the order of ``instance.keypoints``; empty if it has none (keypoints).
        lidar_points: Points of each laser scanner on the instance, by sensor; None without one.
        motion: How it moves at the image's instant (motion).
        extra: Results of third-party annotators, plain data by the annotator's type.
        ignored: Set by a label map: a region that is neither object nor background, which training
            and evaluation leave out.
    """

    instance: Instance
    visible_px: int
    box: boxes.BoxPx | None
    amodal_box: boxes.BoxPx | None = None
    oriented_box: tuple[PointPx, PointPx, PointPx, PointPx] | None = None
    box3d_world: boxes.OrientedBox | None = None
    box3d_camera: boxes.OrientedBox | None = None
    T_camera_object: se3.SE3 | None = None
    mask: MaskPx | None = None
    amodal_mask: MaskPx | None = None
    visible_fraction: float | None = None
    occlusion: float | None = None
    truncation: float | None = None
    detectability: float | None = field(default=None, metadata={serialization.SPARSE: True})
    part_px: Mapping[str, int] | None = None
    keypoints: tuple[KeypointTruth, ...] | None = None
    lidar_points: Mapping[str, int] | None = None
    motion: MotionTruth | None = None
    extra: Mapping[str, object] = field(default_factory=dict)
    ignored: bool = False


@dataclass(frozen=True, slots=True)
class BorderTruth:
    """A stretch of a lane's border that lies in one image.

    Attributes:
        border: Name of the ``LaneBorder``; one that leaves the image and returns has several.
        kind: As there.
        points_px: Image coordinates, in the border's direction.
        visible: Whether each point is seen; False where a nearer object hides it.
    """

    border: str
    kind: Literal["lane", "road", "edge"]
    points_px: tuple[tuple[float, float], ...]
    visible: tuple[bool, ...]


QuadPx = tuple[PointPx, PointPx, PointPx, PointPx]
"""Image coordinates of four corners, from the top left of the upright text clockwise."""


@dataclass(frozen=True, slots=True)
class CharacterTruth:
    """A character of a word in one image.

    Attributes:
        text: The character; empty for strokes that only look like writing.
        quad_px: Corners of its ink; they may lie outside the image.
        visible_fraction: Visible share of the quad, inside and outside the image.
    """

    text: str
    quad_px: QuadPx
    visible_fraction: float


@dataclass(frozen=True, slots=True)
class WordTruth:
    """A word in one image: the characters between two spaces.

    Attributes:
        text: Its characters; empty for strokes that only look like writing.
        quad_px: Corners of its ink; they may lie outside the image.
        characters: In reading order.
        visible_fraction: Visible share of its characters' quads, inside and outside the image.
        height_px: Height of its highest character.
        stroke_px: Width of its strokes, in the direction in which the image shortens them most.
        readable: Whether its size and visibility suffice to read it; see the annotation.
    """

    text: str
    quad_px: QuadPx
    characters: tuple[CharacterTruth, ...]
    visible_fraction: float
    height_px: float
    stroke_px: float
    readable: bool


@dataclass(frozen=True, slots=True)
class TextTruth:
    """A line of text in one image.

    Attributes:
        text: The line; empty for strokes that only look like writing.
        language: ISO 639-1 code; ``zxx`` for numbers and codes, ``und`` for invented names, ``mul``
            for several languages.
        kind: ``print``; ``scribble`` for strokes that only look like writing; ``code`` for a
            two-dimensional code, whose only word and character is its content.
        quad_px: Corners of its ink; they may lie outside the image.
        body: Name of the body that it is on.
        instance_id: Its instance; 0 = background.
        visible_fraction: Visible share of its characters' quads, inside and outside the image.
        complete: Whether the surface has all characters of the texture's line.
        words: In reading order.
    """

    text: str
    language: str
    kind: Kind
    quad_px: QuadPx
    body: str
    instance_id: int
    visible_fraction: float
    complete: bool
    words: tuple[WordTruth, ...]


Predicate = Literal[
    "on",
    "inside",
    "supported_by",
    "held_by",
    "near",
    "left_of",
    "right_of",
    "in_front_of",
    "behind",
]
INVERSE: Mapping[Predicate, Predicate] = {
    "near": "near",
    "left_of": "right_of",
    "right_of": "left_of",
    "in_front_of": "behind",
    "behind": "in_front_of",
}
"""Predicates of which annotations state one direction only; the other follows."""


@dataclass(frozen=True, slots=True)
class Relation:
    """An edge of a scene graph: ``subject predicate object``, such as "mug on table".

    Attributes:
        subject, object: Instance ids. Objects may be instances that are not annotated: furniture.
        predicate: As defined by the annotation ``relations``.
    """

    subject: int
    predicate: Predicate
    object: int


def both_ways(relations: Iterable[Relation]) -> set[tuple[int, str, int]]:
    """Relations and their inverses: subject, predicate, object."""
    edges: set[tuple[int, str, int]] = set()
    for relation in relations:
        edges.add((relation.subject, relation.predicate, relation.object))
        if relation.predicate in INVERSE:
            edges.add((relation.object, INVERSE[relation.predicate], relation.subject))
    return edges


@dataclass(frozen=True, slots=True)
class Measured:
    """The numbers that decide an answer.

    Attributes:
        numbers: In the order in which the question names them; see the question's kind.
        unit: ``m``, ``deg``, ``px``, or ``1`` for counts.
        margin: Change of the deciding number that would make the answer wrong, in the unit.
        resolution: Smallest difference that the sensor could measure, in the unit: expanded
            uncertainty, coverage factor 2. It is at most the margin.
    """

    numbers: tuple[float, ...]
    unit: str
    margin: float
    resolution: float


_SPARSE = {serialization.SPARSE: True}


@dataclass(frozen=True, slots=True)
class Utterance:
    """A sentence, expression or question about one image, in English.

    Attributes:
        kind: Name in the table of questions, such as ``caption`` of the image, ``relation``
            between two objects, or ``expression`` that refers to one object and no other.
        text: The sentence, expression or question. Pixels in texts are written ``(x, y)``.
        answer: To a question; else empty.
        instances: Ids of the objects it is about: the mask of an answer is the union of theirs.
        measured: The numbers behind the answer; None = it follows from no measurement.
        points_px: Points that answer the question, image coordinates.
        region: All pixels that answer the question, if they are not the objects' masks.
        other: The second image that it is about: the name of another camera at the same instant,
            or ``FIRST``; empty = none.
    """

    kind: str
    text: str
    answer: str = ""
    instances: tuple[int, ...] = ()
    measured: Measured | None = field(default=None, metadata=_SPARSE)
    points_px: tuple[PointPx, ...] = field(default=(), metadata=_SPARSE)
    region: MaskPx | None = field(default=None, metadata=_SPARSE)
    other: str = field(default="", metadata=_SPARSE)


FIRST = "<first>"
"""The image of the same camera at the beginning of the sequence; not the name of a camera."""


@dataclass(frozen=True, eq=False, slots=True)
class ImageTruth:
    """The annotations of one camera image.

    A field is None when its annotator was not asked for.

    Attributes:
        objects: In order of instance id.
        borders: Lane borders, in order of the scene's (lanes).
        free_space: Pixels that show ground on which one may drive and nothing stands (free_space).
        relations: Among the instances that the image shows, in order (relations).
        utterances: Captions, expressions and questions (language).
        texts: Lines of text, in the order of the scene's bodies (text).
        extra: Results of third-party annotators, plain data by the annotator's type.
    """

    camera: Camera
    objects: tuple[ObjectTruth, ...]
    borders: tuple[BorderTruth, ...] | None = None
    free_space: MaskPx | None = None
    relations: tuple[Relation, ...] | None = None
    utterances: tuple[Utterance, ...] | None = None
    texts: tuple[TextTruth, ...] | None = field(default=None, metadata=_SPARSE)
    extra: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True, eq=False, slots=True)
class BirdseyeMap:
    """The ground around the ego from above.

    Attributes:
        T_world_map: X forward, Y left, Z up; level, below the ego's rig.
        px_m: Side of a pixel.
        layers: Masks bool [n, n]. Row 0 is farthest ahead, column 0 farthest to the left; the
            centre of pixel (r, c) is at x = (n / 2 - r - 0.5) px_m, y = (n / 2 - c - 0.5) px_m.
    """

    T_world_map: se3.SE3
    px_m: float
    layers: Mapping[str, NDArray[np.bool_]]


VOXEL_STATES = ("free", "surface", "interior")
"""States of a voxel, by index."""


@dataclass(frozen=True, eq=False, slots=True)
class Occupancy:
    """Voxels around the ego: their states and instances, and which sensors have observed them.

    Attributes:
        T_world_frame: Frame of the voxels' coordinates.
        low_m: Lowest corner of the first voxel in that frame [m].
        voxel_m: Side of a voxel.
        state: Index in ``VOXEL_STATES``, uint8 [x, y, z]: along the axes of the frame.
        instance_id: uint16 [x, y, z]; 0 = none.
        surface: Index in ``asset_types.SURFACES``, uint8 [x, y, z]; 0 = any other, and none.
        observed: By sensor, whether a ray of its reading has passed or ended there, bool [x, y, z].
    """

    T_world_frame: se3.SE3
    low_m: se3.Vec3
    voxel_m: float
    state: NDArray[np.uint8]
    instance_id: NDArray[np.uint16]
    surface: NDArray[np.uint8]
    observed: Mapping[str, NDArray[np.bool_]]

    def centers_m(self, voxels: NDArray[np.integer]) -> se3.Array:
        """Centres of voxels, numbers [n, 3], in the frame [m], [n, 3]."""
        return np.asarray((voxels + 0.5) * self.voxel_m + self.low_m)

    def velocities_m_s(self, instances: Iterable[Instance]) -> NDArray[np.float32]:
        """Velocity of each voxel's instance, axes of the frame, [x, y, z, 3]; 0 = at rest or free.

        Instances move as rigid bodies, evaluated at the voxels' centres: limbs of a person move
        with the person.
        """
        velocities = np.zeros((*self.state.shape, 3), np.float32)
        T_frame_world = self.T_world_frame.inverse()
        for instance in instances:
            if instance.twist == STILL:
                continue
            voxels = np.argwhere(self.instance_id == instance.instance_id)
            p_world = self.T_world_frame.apply(self.centers_m(voxels))
            arm = p_world - instance.T_world_instance.translation_m
            spin = np.cross(instance.twist.angular_velocity_rad_s, arm)
            velocity = T_frame_world.rotate(spin + instance.twist.velocity_m_s)
            velocities[tuple(voxels.T)] = velocity
        return velocities


TRACK_STATES = ("visible", "glass", "occluded", "outside", "behind")
"""Whether a sensor sees a tracked point, by index: yes; through panes of glass only; hidden by a
surface; not in the image; behind the plane of a pinhole or outside a lens's field."""


@dataclass(frozen=True, eq=False, slots=True)
class SensorTracks:
    """Tracked points as one sensor has them.

    Attributes:
        position_m: In the sensor's frame at the reading's instant, float32 [n, 3].
        image_px: Image coordinates, float32 [n, 2]; NaN where the lens has no image of the point,
            and for scanners.
        state: Index in ``TRACK_STATES``, uint8 [n].
        hidden_by: Instance id of the first surface that hides the point, or of the first pane
            before it, uint16 [n]; 0 = none, or a surface without an id.
    """

    position_m: NDArray[np.float32]
    image_px: NDArray[np.float32]
    state: NDArray[np.uint8]
    hidden_by: NDArray[np.uint16]

    @property
    def visible(self) -> NDArray[np.bool_]:
        """Whether each point is seen, through air alone, bool [n]."""
        return np.asarray(self.state == TRACK_STATES.index("visible"))


@dataclass(frozen=True, eq=False, slots=True)
class PointTracks:
    """Points on surfaces, the same ones in all samples of a sequence, in the same order.

    Attributes:
        instance_id: Instance that each is on, uint16 [n]; 0 = none.
        position_m: In the world at the sample's instant, float32 [n, 3].
        sensors: By name, as every sensor that reads at this step has them.
    """

    instance_id: NDArray[np.uint16]
    position_m: NDArray[np.float32]
    sensors: Mapping[str, SensorTracks]


@dataclass(frozen=True, slots=True)
class Grasp:
    """A pose at which a parallel gripper can hold an instance.

    Attributes:
        T_world_grasp: Origin midway between the contacts, X = direction of approach, Y = direction
            in which the fingers open: the frame of GraspNet-1Billion (Fang et al., CVPR 2020).
        width_m: Distance between the contacts.
        score: 1.1 minus the least coefficient of friction that holds, at most 1, as there.
    """

    instance_id: int
    T_world_grasp: se3.SE3
    width_m: float
    score: float


@dataclass(frozen=True, slots=True)
class Suction:
    """A point at which a suction cup can hold an instance.

    Attributes:
        point_m: Centre of the cup, world.
        normal: Unit vector out of the surface, world.
        score: In [0, 1]: flatness under the rim, times nearness to the centre.
    """

    instance_id: int
    point_m: se3.Vec3
    normal: se3.Vec3
    score: float


@dataclass(frozen=True, eq=False, slots=True)
class EgoTruth:
    """Annotations of a sample as a whole.

    A field is None when its annotator was not asked for.

    Attributes:
        rig: Name of the ego's rig; empty in a scene without one.
        T_world_ego: Its pose.
        twist: How it moves, world axes.
        boxes3d: By frame, the boxes of annotated instances, by instance id: ``ego``, and every
            laser scanner at the instant of its sweep (boxes3d).
        borders: Lane borders, world frame (lanes).
        birdseye: The ground from above (bev_map).
        occupancy: Voxels around the ego (occupancy).
        tracks: Points followed over the sequence (tracks).
        relations: Relations of annotated instances in space, whether seen or not, in order
            (relations).
        grasps: Grasps of annotated loose instances, by instance and falling score (grasps).
        suctions: The same for suction cups (grasps).
        extra: Results of third-party annotators, plain data by the annotator's type.
    """

    rig: str = ""
    T_world_ego: se3.SE3 = se3.IDENTITY
    twist: Twist = STILL
    boxes3d: Mapping[str, Mapping[int, boxes.OrientedBox]] | None = None
    borders: tuple[lane_geometry.LaneBorder, ...] | None = None
    birdseye: BirdseyeMap | None = None
    occupancy: Occupancy | None = field(default=None, metadata={serialization.SPARSE: True})
    tracks: PointTracks | None = field(default=None, metadata={serialization.SPARSE: True})
    relations: tuple[Relation, ...] | None = None
    grasps: tuple[Grasp, ...] | None = None
    suctions: tuple[Suction, ...] | None = None
    extra: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True, eq=False, slots=True)
class Sample:
    """One element of the data set.

    Attributes:
        index: Number in the data set, from 0: scene, then view, then step, the last the fastest.
        step_index: Instant of its view's sequence; ``scene.time_s`` is its time.
        split: ``train``, ``val`` or ``test``: the same for all views of a scene.
        scene: The final world; rendering it again needs no randomizer and no physics.
        truth: Annotations by sensor name.
        frame: Annotations of no single image; None where none was asked for.
        attempts: How many layouts were drawn before this one was accepted.
        view_attempts: How many views were drawn before this one was accepted.
        timings_s: Seconds of CPU by stage. Never written to a data file.
        cameras: Sorted names of all cameras of the data set, including cameras that do not read at
            this step; empty = the cameras that read at this step.
        instants: The world at the readings of sensors that do not read at the sample's instant.
    """

    index: int
    scene_index: int
    view_index: int
    split: str
    scene: Scene
    capture: Capture
    truth: Mapping[str, ImageTruth]
    attempts: int = 1
    view_attempts: int = 1
    timings_s: Mapping[str, float] = field(default_factory=dict)
    step_index: int = 0
    cameras: tuple[str, ...] = ()
    frame: EgoTruth | None = None
    instants: Mapping[str, Scene] = field(default_factory=dict)

    def scene_of(self, sensor: str) -> Scene:
        """The world when a sensor read; at the sample's instant where it did not."""
        return self.instants.get(sensor, self.scene)

    def image_id(self, sensor: str) -> int:
        """Number of one image of the sample, from 1, unique in the data set."""
        return image_number(self.index, self.cameras or tuple(sorted(self.truth)), sensor)

    def annotation_id(self, sensor: str, instance_id: int) -> int:
        """Number of one annotation, from 1, unique in the data set.

        A fixed stride per image makes it a pure function of (sample, sensor, instance): no
        counting, so shards can be written in any order.
        """
        return (self.image_id(sensor) - 1) * ANNOTATION_STRIDE + instance_id


def image_number(index: int, cameras: Sequence[str], sensor: str) -> int:
    """Number of the image of a sample, from 1, among the ``cameras`` of the data set."""
    return index * len(cameras) + cameras.index(sensor) + 1


ANNOTATION_STRIDE = 65_536
"""Instance ids are 16-bit, so each image owns this many annotation ids."""
