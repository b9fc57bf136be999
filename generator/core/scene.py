"""Scene: the complete, frozen description of one world.

It contains no engine handles, distributions or unresolved references. World frame: right-handed, Z
up, metres, seconds, radians. Template elements become bodies, lights and labels; nothing downstream
depends on the types of elements.
"""

from dataclasses import dataclass, field, replace
from typing import Literal, Protocol, TypeVar, get_args

from gen_data.core import asset_types, serialization
from gen_data.core.boxes import OrientedBox
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.motion import STILL, JointTrajectory, StateChange, Trajectory, Twist
from gen_data.core.relief import Relief
from gen_data.core.se3 import IDENTITY, SE3, Vec3
from gen_data.core.shutter import INSTANT, Shutter

SharedValue = str | float | int | bool
Motion = Literal["static", "dynamic", "kinematic"]
Placement = Literal["drop", "scatter", "grid", "stack", "row", "pile", "hang", "along"]
PanelKind = Literal["rectangle", "disk"]
LampKind = Literal["sphere", "spot", PanelKind]
LightKind = Literal["sphere", "spot", "sun", PanelKind]
PANEL_KINDS: tuple[PanelKind, ...] = get_args(PanelKind)
LIGHT_KINDS: tuple[LightKind, ...] = get_args(LightKind)
"""On the device, kinds are represented by their index in this list."""
LaneKind = Literal[
    "driving",
    "parking",
    "bicycle",
    "sidewalk",
    "crosswalk",
    "verge",
    "furniture",
    "garden",
    "frontage",
]


Box3dExtent = Literal["body", "all", "annotated"]
"""Extent of 3D boxes: the body of a vehicle, without exterior mirrors; all of it; or the body, and
people as widely as annotators of tracks draw them."""

PERSON_MARGIN_M = 0.05
"""Margin that annotators leave on each side of a person and above: KITTI's boxes are .66 m wide on
average (sizes of Frustum PointNets, CVPR 2018), people with their swinging arms .57 m."""

LABEL_IDS_MAX = 65_535
"""Largest instance id and category id: label images have 16 bits."""


@dataclass(frozen=True, slots=True)
class Instance:
    """One labelled object.

    Attributes:
        instance_id: From 1; 0 = none.
        category_id: From 1, index into the data set's sorted category names; 0 = no category.
        annotated: Whether it is annotated. Distractors and furniture have an instance id in the id
            images and no annotation.
        parts: Names of its parts; part id ``k`` is ``parts[k - 1]``. Robots: their links.
        T_world_instance: Pose of the instance frame (a body's own frame; a robot's base).
        box_min_m, box_max_m: Tight bounds of the visual geometry in the instance frame [m].
        body_bounds_m: Bounds of the part that its 3D box encloses, smallest and largest
            coordinates in the instance frame [m]; None = all of the visual geometry.
        subcategory: A finer name than the category; may be empty.
        attributes: Further attributes in labels, ``(name, value)``, sorted by name.
        keypoints: Named points in the instance frame, in the order of their skeleton.
        twist: Motion of its frame.
    """

    instance_id: int
    name: str
    category: str
    category_id: int
    asset: str
    annotated: bool = True
    parts: tuple[str, ...] = ()
    T_world_instance: SE3 = IDENTITY
    box_min_m: Vec3 = (0.0, 0.0, 0.0)
    box_max_m: Vec3 = (0.0, 0.0, 0.0)
    subcategory: str = ""
    attributes: tuple[tuple[str, str], ...] = ()
    keypoints: tuple[asset_types.Keypoint, ...] = ()
    twist: Twist = STILL
    body_bounds_m: tuple[Vec3, Vec3] | None = None

    @property
    def box3d(self) -> OrientedBox:
        """Its annotated box in the world, along the axes of its frame."""
        low_m, high_m = self.body_bounds_m or (self.box_min_m, self.box_max_m)
        (x0, y0, z0), (x1, y1, z1) = low_m, high_m
        T_instance_box = SE3((0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * (z0 + z1)))
        return OrientedBox(self.T_world_instance @ T_instance_box, (x1 - x0, y1 - y0, z1 - z0))

    @property
    def tight_box3d(self) -> OrientedBox:
        """The part of ``box3d`` that geometry fills: smaller where annotators draw wide boxes."""
        if self.body_bounds_m is None:
            return self.box3d
        (x0, y0, z0), (x1, y1, z1) = self.body_bounds_m
        (a0, b0, c0), (a1, b1, c1) = self.box_min_m, self.box_max_m
        inner = (max(x0, a0), max(y0, b0), max(z0, c0)), (min(x1, a1), min(y1, b1), min(z1, c1))
        return replace(self, body_bounds_m=inner).box3d


@dataclass(frozen=True, slots=True)
class Body:
    """One rigid piece of geometry.

    Attributes:
        name: Unique in the scene: ``table``, ``clutter/3``, ``arm/panda_link4``.
        asset: Mesh asset id.
        scale: Uniform factor on the mesh.
        instance_id: The instance it belongs to; 0 = unlabelled background.
        part_id: From 1 within its instance; 0 = no part.
        group: Name of the object group it belongs to; empty = none.
        motion: ``dynamic`` bodies fall; ``kinematic`` ones are posed by a robot.
        collides: Whether it collides in physics.
        materials: One per mesh slot; empty = the asset's own.
    """

    name: str
    asset: str
    T_world_body: SE3 = IDENTITY
    scale: float = 1.0
    instance_id: int = 0
    part_id: int = 0
    group: str = ""
    motion: Motion = "static"
    collides: bool = True
    mass_kg: float = 0.0
    friction: float = 0.6
    restitution: float = 0.05
    materials: tuple[asset_types.Material, ...] = ()


@dataclass(frozen=True, slots=True)
class SupportSurface:
    """A rectangle that objects can stand on, level or sloping gently.

    Attributes:
        body: Name of the body it belongs to.
        T_world_surface: Centre of the rectangle, Z = its normal.
        size_m: Extent along the surface's X and Y.
        clearance_m: Free height above it.
        walled: Enclosed at the sides: objects dropped into it cannot leave.
    """

    name: str
    body: str
    T_world_surface: SE3
    size_m: tuple[float, float]
    clearance_m: float
    walled: bool = False


@dataclass(frozen=True, slots=True)
class Lane:
    """A strip of a street along which objects move or stand.

    Attributes:
        kind: ``driving``, ``parking``, ``bicycle``; ``sidewalk`` and ``crosswalk`` for people;
            ``verge`` for plants, ``furniture`` for lamps and bins, ``garden`` for the land before
            houses, ``frontage`` for the line of house fronts, with the street on its left.
        center_m: Points of the centre line, world, in the direction of travel, at most 2 m apart
            in bends; Z is the height of the ground.
        width_m: Across the centre line; the mean where it changes along the lane.
        road: Name of the template element it belongs to.
        successors: Names of the lanes that continue at its end.
        left, right: Names of the adjacent lanes of the same direction; empty = none.
        speed_m_s: Usual speed; 0 = for standing objects.
        junction: Whether it crosses a junction, where nothing may stop.
        bank: Rise from its right to its left side, per metre of width.
        banks: The same at each point, where it changes along the lane; empty = ``bank``.
        widths_m: Width at each point, where it changes along the lane; empty = ``width_m``.
    """

    name: str
    kind: LaneKind
    center_m: tuple[Vec3, ...]
    width_m: float
    road: str = ""
    successors: tuple[str, ...] = ()
    left: str = ""
    right: str = ""
    speed_m_s: float = 0.0
    junction: bool = False
    bank: float = 0.0
    banks: tuple[float, ...] = ()
    widths_m: tuple[float, ...] = field(default=(), metadata={serialization.SPARSE: True})


@dataclass(frozen=True, slots=True)
class ObjectGroup:
    """A group of objects to place on surfaces or along lanes.

    Attributes:
        surfaces: Names of the surfaces to place them on.
        lanes: Kinds of the lanes to place them on (placement ``along``).
        facing: Direction of fronts on lanes: ``along`` the lane, or to its ``left``.
        assets: Ids of the assets to draw from, sorted.
        keep_out: Discs ``(x, y, radius)`` [m], world, to keep free (the arm's base).
    """

    name: str
    surfaces: tuple[str, ...]
    assets: tuple[str, ...]
    count: int
    placement: Placement
    annotated: bool = True
    keep_out: tuple[Vec3, ...] = ()
    lanes: tuple[LaneKind, ...] = ()
    facing: Literal["along", "left"] = "along"


@dataclass(frozen=True, slots=True)
class ArmGoal:
    """A goal of an arm, drawn by a randomizer and accomplished by physics.

    Physics takes the first candidate that is within limits and free of collision.

    Attributes:
        kind: ``joints``: candidates are joint positions. ``reach``: candidates are poses of the
            grasp frame in the world. ``hold``: like reach, with ``grasped_object`` between the
            fingers. In tasks only: ``grasp`` picks up one of ``objects``, ``place`` puts the held
            object down, ``move`` passes ``waypoints`` in straight lines, ``grip`` opens or closes
            the fingers, or closes them on the first of ``objects``, and lets go of a held one;
            with ``carries`` it then holds that object where it is.
        joint_candidates: One tuple per candidate [rad or m], arm joints in order.
        pose_candidates: ``T_world_grasp`` per candidate; for ``place``, a point on a surface and
            a rotation about Z of the object from its former pose at rest.
        gripper_opening: In [0, 1]; ignored for ``hold``, ``grasp`` and ``place``.
        grasped_object: Name of the body to hold; empty = none.
        objects: Names of the bodies that may be grasped, the preferred one first.
        speed: Share of the joints' speed limits to use.
        waypoints: Motions of a ``move`` in the world, passed in order; each leads from the pose of
            the hand at the beginning of the move (``waypoint @ T_world_grasp``).
        carries: Whether candidates of ``reach`` are, as for ``place``, points below the held
            object and its rotation about Z, instead of poses of the hand.
        touches: Names of the bodies that a ``move`` may touch and push.
        pivots: Whether a ``move`` leads the hand's origin along the waypoints without turning the
            hand; the held object turns about the line between the fingers as contacts make it.
        phase: Name of this part of a demonstration in labels; empty = the kind.
        arms: Names of the arms that pursue it, in demonstrations; several move together. Empty =
            the arm whose task it is part of.
    """

    kind: Literal["joints", "reach", "hold", "grasp", "place", "move", "grip"]
    joint_candidates: tuple[tuple[float, ...], ...] = ()
    pose_candidates: tuple[SE3, ...] = ()
    gripper_opening: float = 1.0
    grasped_object: str = ""
    objects: tuple[str, ...] = ()
    speed: float = 0.5
    waypoints: tuple[SE3, ...] = ()
    carries: bool = False
    touches: tuple[str, ...] = ()
    pivots: bool = False
    phase: str = ""
    arms: tuple[str, ...] = field(default=(), metadata={serialization.SPARSE: True})


Measure = Literal["distance", "offset", "height", "gap", "tilt", "travel"]
FailureKind = Literal["", "slip", "miss", "collision", "late", "wrong_object"]
HAND = "hand"
"""Stands for the origin of the grasp frame where conditions name a body."""


@dataclass(frozen=True, slots=True)
class Condition:
    """A measure of simulated bodies within bounds; a demonstration succeeds if all of its hold.

    Attributes:
        measure: ``distance``: between the middles of two boxes along the axes of the world [m].
            ``offset``: its horizontal part [m]. ``height``: from the top of ``other`` up to the
            bottom of ``body`` [m]. ``gap``: between surfaces, negative if they overlap, at most
            0.1 [m]. ``tilt``: of the body from its rotation at time 0 [rad], the angle between
            both directions of its Z axis. ``travel``: position of its joint [m or rad].
        body, other: Names of bodies; ``hand`` = the grasp frame's origin.
        at_least, at_most: Bounds, inclusive; None = unbounded.
        ever: Whether it is enough that it holds at one instant; else it must hold at the end.
    """

    measure: Measure
    body: str
    other: str = ""
    at_least: float | None = None
    at_most: float | None = None
    ever: bool = False

    def holds(self, value: float) -> bool:
        """Whether a measured value is within the bounds."""
        above = self.at_least is None or value >= self.at_least
        return above and (self.at_most is None or value <= self.at_most)


@dataclass(frozen=True, slots=True)
class Assignment:
    """An arm's assignment: the goals of ``Articulation.task`` are its program.

    Attributes:
        name: Name of the task.
        instruction: The task as a sentence.
        success: Conditions that physics must confirm.
        failure: Failure that is to happen; empty = none.
        joints: Joints of bodies of the task, such as drawers.
        recovers: Whether the arm notices the failure, recovers from it and succeeds.
        deadline_s: Time within which the conditions must hold; None = at the end of the program.
        mistaken: Name of the body that the arm takes first if it fails by ``wrong_object``.
    """

    name: str
    instruction: str
    success: tuple[Condition, ...] = ()
    failure: FailureKind = ""
    joints: "tuple[BodyJoint, ...]" = ()
    recovers: bool = field(default=False, metadata={serialization.SPARSE: True})
    deadline_s: float | None = field(default=None, metadata={serialization.SPARSE: True})
    mistaken: str = field(default="", metadata={serialization.SPARSE: True})


@dataclass(frozen=True, slots=True)
class BodyJoint:
    """The joint that connects a body to the world: a drawer's slide, a door's hinge.

    Attributes:
        kind: ``prismatic`` along the axis or ``revolute`` about it.
        axis: Unit vector in the frame of the body.
        anchor_m: A point of the axis in the frame of the body.
        lower, upper: Limits of the position [m or rad], which is 0 at time 0.
        friction: Force or torque that moves it at least [N or N m].
        stiffness: Stiffness of a spring that returns it to 0 [N/m or N m/rad].
    """

    body: str
    kind: Literal["prismatic", "revolute"]
    axis: Vec3
    anchor_m: Vec3 = (0.0, 0.0, 0.0)
    lower: float = 0.0
    upper: float = 0.0
    friction: float = 1.0
    stiffness: float = 0.0


@dataclass(frozen=True, slots=True)
class Span:
    """A time during which something holds, from ``start_s`` until before ``end_s``."""

    label: str
    start_s: float
    end_s: float


@dataclass(frozen=True, slots=True)
class ContactSpan(Span):
    """A time during which two bodies touch.

    Attributes:
        label: Names of both, sorted, with `` + `` between them.
        step_s: Time between the values of ``forces_n`` and ``points_m``, of which the first one
            is taken at ``start_s``.
        forces_n: Sum of the normal forces that the engine found between them; 0 where it pushed
            neither: a held object follows its planned path.
        points_m: Middle of their contact points in the world.
    """

    step_s: float = 0.0
    forces_n: tuple[float, ...] = ()
    points_m: tuple[Vec3, ...] = ()

    def at(self, time_s: float) -> tuple[float, Vec3]:
        """Force and point at an instant of the span."""
        # Times of steps are sums of floats.
        number = int((time_s - self.start_s + 1e-6) / self.step_s)
        number = max(0, min(number, len(self.forces_n) - 1))
        return self.forces_n[number], self.points_m[number]


@dataclass(frozen=True, slots=True)
class Episode:
    """A simulated demonstration of an Assignment.

    Attributes:
        succeeded: Whether all conditions held in physics.
        failure: Why it failed; empty if it succeeded.
        phases: Parts of the program, one after the other.
        held: Times at which a body is in the hand; the label is its name.
        contacts: Times at which two bodies touch, one of them in motion or of the arm.
        recovered: The failure that happened in a success; empty = none.
    """

    succeeded: bool
    failure: FailureKind = ""
    phases: tuple[Span, ...] = ()
    held: tuple[Span, ...] = ()
    contacts: tuple[ContactSpan, ...] = ()
    recovered: FailureKind = field(default="", metadata={serialization.SPARSE: True})

    def __post_init__(self) -> None:
        """Raise ValueError for a success that is labelled as a failure."""
        if self.succeeded and self.failure:
            raise ValueError(f"an episode that succeeded has no failure, but '{self.failure}'")


@dataclass(frozen=True, slots=True)
class Articulation:
    """A robot: its link bodies are ``<name>/<link>`` and move with its joints.

    Attributes:
        joint_positions: One per movable joint, in the robot model's order [rad or m].
        goal: Its goal at time 0; None = its joint positions.
        workspace_m: Low and high corner [m] of the targets of its hand, world.
        task: Its goals from time 0 on, one after the other: all kinds but ``hold``.
        joint_track: Trajectory of its joints; None = they do not move.
        assignment: Purpose of the task; None = a motion that is not judged.
        episode: Its demonstration in physics; None = there is none.
    """

    name: str
    asset: str
    instance_id: int
    T_world_base: SE3
    joint_positions: tuple[float, ...]
    goal: ArmGoal | None = None
    workspace_m: tuple[Vec3, Vec3] = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    task: tuple[ArmGoal, ...] = ()
    joint_track: JointTrajectory | None = None
    assignment: Assignment | None = None
    episode: Episode | None = None


@dataclass(frozen=True, slots=True)
class Outcome:
    """A motion of a settled scene: one of several that may follow from its state at time 0."""

    articulations: tuple[Articulation, ...]
    tracks: tuple[Trajectory, ...]


@dataclass(frozen=True, slots=True)
class Light:
    """A light source.

    Attributes:
        kind: ``sphere`` radiates uniformly in all directions, ``spot`` within a cone; ``sun`` is
            at infinity; ``rectangle`` and ``disk`` are one-sided Lambertian panels.
        position_m: Centre, world [m] (all but sun).
        direction: Unit vector in which the light travels (spot, sun); a panel's normal.
        color: Linear RGB with luminance 1.
        intensity_cd: Luminous intensity [cd] (all but sun); of panels, along their normal: their
            luminance times their area.
        illuminance_lux: On a surface that faces it [lx] (sun).
        radius_m: Radius of the emitter, which makes shadows soft (sphere, spot, disk).
        size_m: Size of the rectangle, along ``side`` and across it.
        side: Unit vector along the rectangle's first side, perpendicular to ``direction``.
        angular_radius_rad: Angular radius of the sun's disc.
        cone_rad: Half angle at which a spot has faded to 0.
        even: Share of the cone within which a spot is uniform; outside it fades.
        cutoff: Slope of the cut-off below the horizon of a spot that is a dipped headlight; 0 =
            rotationally symmetric.
        body: Name of the body that carries it; empty = none.
    """

    name: str
    kind: LightKind
    position_m: Vec3 = (0.0, 0.0, 2.0)
    direction: Vec3 = (0.0, 0.0, -1.0)
    color: Vec3 = (1.0, 1.0, 1.0)
    intensity_cd: float = 0.0
    illuminance_lux: float = 0.0
    radius_m: float = 0.05
    size_m: tuple[float, float] = (0.5, 0.5)
    side: Vec3 = (1.0, 0.0, 0.0)
    angular_radius_rad: float = 0.00465
    cone_rad: float = 0.6
    even: float = 0.8
    cutoff: float = 0.0
    body: str = ""


VOLUME_REACH_M = 0.12
"""Reach of irradiance volumes beyond their boxes: of rooms, to frames and leaves of doors."""


@dataclass(frozen=True, slots=True)
class IrradianceVolume:
    """Ambient light inside a box: ambient cubes on a grid of probes.

    Sources: Greger et al., "The irradiance volume", IEEE CG&A 18, 1998; McTaggart, "Half-Life 2 /
    Valve Source shading", GDC 2004 (ambient cubes).

    Attributes:
        low_m, high_m: Corners of the box, world.
        counts: Numbers of probes along X, Y and Z, each in the middle of a cell of the box.
        light_cd_m2: Irradiance over pi from around +X, -X, +Y, -Y, +Z and -Z, linear RGB, of all
            probes; Z is fastest.
    """

    low_m: Vec3
    high_m: Vec3
    counts: tuple[int, int, int]
    light_cd_m2: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Environment:
    """Light from all around: an equirectangular image of relative luminance (mean 1).

    Attributes:
        image: Environment id of the library.
        luminance_cd_m2: Mean luminance over the sphere.
        yaw_rad: Rotation about world Z.
        visible: Whether it is visible as background; else the background is black.
        volumes: Boxes in which other ambient light replaces it, such as rooms; where they overlap,
            light passes evenly from one to the other, and small ones prevail. The path-traced tier
            finds that light itself.
    """

    image: str = "environment/neutral?seed=0"
    luminance_cd_m2: float = 100.0
    yaw_rad: float = 0.0
    visible: bool = True
    volumes: tuple[IrradianceVolume, ...] = field(default=(), metadata={serialization.SPARSE: True})


@dataclass(frozen=True, slots=True)
class Weather:
    """State of air and ground. The sun is a Light, the sky an Environment.

    Attributes:
        fog_extinction_per_m: At the ground; the meteorological range is ``3.912 /`` it
            (Koschmieder 1924, 2 % contrast).
        fog_height_m: Scale height: fog thins by a factor of e per this height; 0 = uniform.
        rain_mm_h, snow_mm_h: Rates of precipitation (snow as water equivalent).
        wetness: Wetness of surfaces open to the sky, from 0 = dry to 1 = soaked.
        puddles: Share of level, paved ground under standing water; higher places and soil have
            less.
        snow_cover: Share of upward surfaces that lies under snow.
        lens_drops: Share of the image behind drops on the lens.
        seed: Seed of the patterns of puddles, patches, streaks, flakes and drops.
    """

    fog_extinction_per_m: float = 0.0
    fog_height_m: float = 0.0
    rain_mm_h: float = 0.0
    snow_mm_h: float = 0.0
    wetness: float = 0.0
    puddles: float = 0.0
    snow_cover: float = 0.0
    lens_drops: float = 0.0
    seed: int = 0


@dataclass(frozen=True, slots=True)
class Rig:
    """A frame that sensors are mounted on: the ego vehicle's, a robot's wrist.

    Attributes:
        body: Name of the body that carries it; empty = none, it stands in the world.
        T_body_rig: Pose on the body, in the world without one. X forward, Y left, Z up.
    """

    name: str
    body: str
    T_body_rig: SE3 = IDENTITY


@dataclass(frozen=True, slots=True)
class Camera:
    """A camera.

    Attributes:
        name: The sensor's name in the YAML.
        T_world_camera: Camera frame: X right, Y down, Z forward. Follows the rig if it has one.
        ev100: Fixed exposure value at ISO 100; None = exposed automatically.
        rig: Name of the rig it is mounted on; empty = fixed in the world.
        T_rig_camera: Pose on the rig.
        shutter: Exposure of its rows around the scene's instant.
        layers: Surfaces along each ray in channels of layers; 0 = as many as usual.
        T_sensor_reported: Pose that its calibration states, in its true frame; None = the true one.
    """

    name: str
    T_world_camera: SE3
    intrinsics: Intrinsics
    ev100: float | None = None
    rig: str = ""
    T_rig_camera: SE3 = IDENTITY
    shutter: Shutter = INSTANT
    layers: int = field(default=0, metadata={serialization.SPARSE: True})
    T_sensor_reported: SE3 | None = field(default=None, metadata={serialization.SPARSE: True})


@dataclass(frozen=True, slots=True)
class Lidar:
    """A laser scanner on a rig, or at a camera.

    Attributes:
        name: The sensor's name in the YAML.
        camera: Name of the camera it is mounted at; empty = it is on ``rig``.
        T_rig_lidar: Pose on the rig. Both frames are X forward, Y left, Z up; the origin of a
            camera's rig is the camera's centre, its X axis the camera's optical axis.
        T_world_lidar: Pose, derived from the rig's.
        model: Name of the device in labels, such as ``HDL-64E``.
        rig: Name of its rig; empty = it is mounted at ``camera``.
        sweep_s: Duration of a sweep; the scene's instant is its middle.
        origins: Whether its scans have ``capture.ORIGIN`` records.
        T_sensor_reported: Pose that its calibration states, in its true frame; None = the true one.
    """

    name: str
    camera: str
    T_rig_lidar: SE3 = IDENTITY
    T_world_lidar: SE3 = IDENTITY
    model: str = ""
    rig: str = ""
    sweep_s: float = 0.0
    origins: bool = field(default=False, metadata={serialization.SPARSE: True})
    T_sensor_reported: SE3 | None = field(default=None, metadata={serialization.SPARSE: True})


@dataclass(frozen=True, slots=True)
class Device:
    """Any other sensor on a rig: radar, IMU, GNSS receiver, odometer, event detector or camera.

    Attributes:
        name: The sensor's name in the YAML.
        kind: Kind of device, such as ``radar``.
        rig: Name of its rig; empty = it is mounted at ``camera``.
        T_rig_device: Pose on the rig. X forward, Y left, Z up.
        T_world_device: Pose, derived from the rig's.
        model: Name of the device in labels.
        camera: Name of the camera it is mounted at; empty = none.
        T_sensor_reported: Pose that its calibration states, in its true frame; None = the true one.
    """

    name: str
    kind: str
    rig: str
    T_rig_device: SE3 = IDENTITY
    T_world_device: SE3 = IDENTITY
    model: str = ""
    camera: str = ""
    T_sensor_reported: SE3 | None = field(default=None, metadata={serialization.SPARSE: True})


@dataclass(frozen=True, slots=True)
class Region:
    """The region of interest for cameras: a box in the world."""

    center_m: Vec3 = (0.0, 0.0, 0.0)
    size_m: Vec3 = (1.0, 1.0, 0.4)


@dataclass(frozen=True, slots=True)
class StagePiece:
    """One mesh of a stage file.

    Attributes:
        name: Unique in the stage.
        asset: Id of its mesh.
        T_stage_piece: Pose of the mesh in the stage.
        thing: Name of the labelled prim that it belongs to; empty = none.
        category: The label of that prim.
    """

    name: str
    asset: str
    T_stage_piece: SE3
    thing: str = ""
    category: str = ""


@dataclass(frozen=True, slots=True)
class StageModel:
    """An imported world in its own frame: metres, Z up.

    Attributes:
        cameras: Names and ``T_stage_camera``.
    """

    pieces: tuple[StagePiece, ...]
    lights: tuple[Light, ...] = ()
    cameras: tuple[tuple[str, SE3], ...] = ()


@dataclass(frozen=True, slots=True)
class Scene:
    """One world. Change it with ``dataclasses.replace``.

    Attributes:
        interior_m: Low and high corner of the space for cameras and lights; a room's inner walls.
        lanes: Lanes of a street.
        shared: Shared values, ``(name, value)``, sorted by name.
        time_s: The scene's instant; 0 = as built.
        step_s: Time between the instants of its sequence.
        box3d: Extent of the 3D boxes of its instances.
        tracks: Trajectories of bodies; at most one per body.
        changes: Changes of state, in order of time.
        relief: Height of its ground above the level world of its layout; None = it is level. A
            view is lifted once, after it was drawn.
        twins: Whether each view comes twice: with a demonstration that fails, and with the one
            that recovers.
        recovery: The motion with which demonstrations recover, of settled scenes with twins; the
            scene itself has the one that fails. None in views.
    """

    template: str
    bodies: tuple[Body, ...] = ()
    instances: tuple[Instance, ...] = ()
    surfaces: tuple[SupportSurface, ...] = ()
    groups: tuple[ObjectGroup, ...] = ()
    articulations: tuple[Articulation, ...] = ()
    lights: tuple[Light, ...] = ()
    environment: Environment = field(default_factory=Environment)
    cameras: tuple[Camera, ...] = ()
    lidars: tuple[Lidar, ...] = ()
    focus: Region = field(default_factory=Region)
    interior_m: tuple[Vec3, Vec3] = ((-50.0, -50.0, 0.0), (50.0, 50.0, 50.0))
    lanes: tuple[Lane, ...] = ()
    weather: Weather = Weather()
    shared: tuple[tuple[str, SharedValue], ...] = ()
    rigs: tuple[Rig, ...] = ()
    devices: tuple[Device, ...] = ()
    time_s: float = 0.0
    step_s: float = 0.1
    tracks: tuple[Trajectory, ...] = ()
    changes: tuple[StateChange, ...] = ()
    box3d: Box3dExtent = "all"
    relief: Relief | None = field(default=None, metadata={serialization.SPARSE: True})
    twins: bool = field(default=False, metadata={serialization.SPARSE: True})
    recovery: Outcome | None = field(default=None, metadata={serialization.SPARSE: True})

    def twin(self, number: int) -> "Scene":
        """The scene with one of its two outcomes: 0 fails, 1 recovers; itself without twins."""
        if self.recovery is None:
            return self
        motion = self.recovery if number else Outcome(self.articulations, self.tracks)
        return replace(
            self, articulations=motion.articulations, tracks=motion.tracks, recovery=None
        )

    def body(self, name: str) -> Body:
        """The body of that name; KeyError if there is none."""
        return _named(self.bodies, name)

    def surface(self, name: str) -> SupportSurface:
        """The surface of that name; KeyError if there is none."""
        return _named(self.surfaces, name)

    def camera(self, name: str) -> Camera:
        """The camera of that name; KeyError if there is none."""
        return _named(self.cameras, name)

    def lidar(self, name: str) -> Lidar:
        """The laser scanner of that name; KeyError if there is none."""
        return _named(self.lidars, name)

    def device(self, name: str) -> Device:
        """The device of that name; KeyError if there is none."""
        return _named(self.devices, name)

    def rig(self, name: str) -> Rig:
        """The rig of that name; KeyError if there is none."""
        return _named(self.rigs, name)

    def track(self, body: str) -> Trajectory | None:
        """The trajectory of that body; None if it does not move."""
        return next((track for track in self.tracks if track.body == body), None)

    def rig_pose(self, name: str) -> SE3:
        """``T_world_rig``; KeyError if there is none."""
        rig = self.rig(name)
        return self.body(rig.body).T_world_body @ rig.T_body_rig if rig.body else rig.T_body_rig

    def instance(self, instance_id: int) -> Instance:
        """The instance with that id; KeyError if there is none."""
        for instance in self.instances:
            if instance.instance_id == instance_id:
                return instance
        raise KeyError(instance_id)

    def with_bodies(self, *changed: Body) -> "Scene":
        """The scene with bodies replaced by the given bodies of the same name."""
        by_name = {body.name: body for body in changed}
        return replace(self, bodies=tuple(by_name.get(b.name, b) for b in self.bodies))


class _Named(Protocol):
    @property
    def name(self) -> str: ...


_N = TypeVar("_N", bound=_Named)


def _named(items: tuple[_N, ...], name: str) -> _N:
    for item in items:
        if item.name == name:
            return item
    raise KeyError(name)
