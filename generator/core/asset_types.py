"""Types of assets: materials, meshes, textures, collision geometry, robots."""

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gen_data.core.se3 import SE3, Vec3

Float32 = NDArray[np.float32]
Int32 = NDArray[np.int32]
UInt8 = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Material:
    """Metallic-roughness surface of one mesh slot (Burley 2012, as in glTF 2.0).

    Attributes:
        base_color: Linear RGB in [0, 1]; multiplies the texture where there is one.
        roughness: Perceptual roughness in [0, 1]; GGX alpha is its square.
        metallic: 0 dielectric, 1 metal.
        specular: Dielectric reflectance at normal incidence is ``0.08 * specular``.
        texture: Texture id of the library; empty = none.
        texture_scale_m: Length of one texture repeat [m] under triplanar mapping; 0 = use the
            mesh's own UVs.
        emission_cd_m2: Emitted luminance, linear RGB [cd/m^2]; multiplies the texture's emission
            where it has one.
        coat: Weight in [0, 1] of a clear coat above it all, of refractive index 1.5.
        coat_roughness: Perceptual roughness of the coat in [0, 1].
        transmission: Share in [0, 1] of the light under the specular layer that goes through
            instead of being scattered back; tinted by the base colour.
        ior: Refractive index where light is transmitted.
        thin: Whether a transmitting slot is a pane without refraction; else a solid that refracts.
        opacity: Share in [0, 1] of the background that it hides; labels treat it as solid.
        diffuse_transmission: Albedo of the light that a thin sheet such as a leaf scatters to its
            other side, linear RGB in [0, 1]; multiplies the texture. Renderers reduce it where it
            and the base colour exceed 1 together. Metals have none.
        printed: The texture is essential to the object (a label, a book cover);
            randomizers leave colour and texture alone. On paint, plates and signs it is on the
            front only: their backs have its mean colour.
        role: Function of the slot on its object, for randomizers that target it:
            ``paint``, ``glass``, ``headlight``, ``lens_red``, ``skin``, ...; empty = nothing
            special.
    """

    base_color: Vec3 = (0.6, 0.6, 0.6)
    roughness: float = 0.5
    metallic: float = 0.0
    specular: float = 0.5
    texture: str = ""
    texture_scale_m: float = 0.0
    emission_cd_m2: Vec3 = (0.0, 0.0, 0.0)
    coat: float = 0.0
    coat_roughness: float = 0.03
    transmission: float = 0.0
    ior: float = 1.5
    thin: bool = True
    opacity: float = 1.0
    diffuse_transmission: Vec3 = (0.0, 0.0, 0.0)
    printed: bool = False
    role: str = ""


SURFACES = (
    "", "air", "asphalt", "marking", "pavement", "kerb", "grass", "leaf", "bark", "sign", "plate",
    "glass", "window", "facade", "roof", "paint", "tyre", "skin", "lamp", "mirrored",
)  # fmt: skip
"""Kinds of surfaces that a laser may hit, by index: fog and rain (``air``), a mirror image, or the
role of a material; 0 = any other."""

LAYER_MATERIALS = ("", "other", "see_through", "mirror", *SURFACES[2:-1])
"""Materials in the channel MATERIAL_LAYERS, by number: see-through surfaces and mirrors by their
optics, all others by their role; 0 = no surface."""


@dataclass(frozen=True, eq=False, slots=True)
class MeshData:
    """A triangle mesh in its body's frame: metres, Z up, counter-clockwise outward.

    Attributes:
        vertices_m: float32 [n, 3].
        faces: int32 [m, 3], indices into the vertices.
        normals: float32 [n, 3], unit; vertices are split along creases.
        uvs: float32 [n, 2], (0, 0) at the image's bottom left; all zero where there are none.
        face_slots: int32 [m], the material slot of each face.
        materials: The mesh's own materials, one per slot.
    """

    vertices_m: Float32
    faces: Int32
    normals: Float32
    uvs: Float32
    face_slots: Int32
    materials: tuple[Material, ...]

    @property
    def nbytes(self) -> int:
        """Bytes held by its arrays."""
        arrays = (self.vertices_m, self.faces, self.normals, self.uvs, self.face_slots)
        return sum(array.nbytes for array in arrays)

    def bounds_m(self) -> tuple[Vec3, Vec3]:
        """Smallest and largest coordinates."""
        # Sixteen vertices at once: reducing [n, 3] over its rows takes thirty times as long.
        whole = len(self.vertices_m) // 16 * 16
        blocks, rest = self.vertices_m[:whole].reshape(-1, 48), self.vertices_m[whole:]
        lows, highs = rest, rest
        if whole:
            lows = np.concatenate([blocks.min(axis=0).reshape(16, 3), rest])
            highs = np.concatenate([blocks.max(axis=0).reshape(16, 3), rest])
        low, high = lows.min(axis=0).tolist(), highs.max(axis=0).tolist()
        return (low[0], low[1], low[2]), (high[0], high[1], high[2])


@dataclass(frozen=True, eq=False, slots=True)
class TextureData:
    """The images of one texture; all have the same size and tile in both directions.

    Attributes:
        albedo: sRGB colour, uint8 [height, width, 3].
        roughness: Factor on the material's roughness, 255 = 1, uint8 [height, width]; None = 1.
        normal: Tangent-space normal (OpenGL convention, +Y up), uint8 [height, width, 3]; or None.
        metallic: Factor on the material's metallic, 255 = 1, uint8 [height, width]; None = 1.
        occlusion: Share of ambient light that arrives, 255 = 1, uint8 [height, width]; None = 1.
        emission: sRGB factor on the material's emission, uint8 [height, width, 3]; None = 1.
        alpha: Coverage, uint8 [height, width]: below 128 there is a hole, for labels and rays
            too; None = no holes.
    """

    albedo: UInt8
    roughness: UInt8 | None = None
    normal: UInt8 | None = None
    metallic: UInt8 | None = None
    occlusion: UInt8 | None = None
    emission: UInt8 | None = None
    alpha: UInt8 | None = None

    @property
    def nbytes(self) -> int:
        """Bytes held by its images."""
        images = (getattr(self, image.name) for image in fields(self))
        return sum(image.nbytes for image in images if image is not None)


@dataclass(frozen=True, eq=False, slots=True)
class ConvexParts:
    """Collision geometry: a union of convex hulls in the body's frame.

    Attributes:
        parts_m: One float64 [n, 3] array of hull vertices per part.
    """

    parts_m: tuple[NDArray[np.float64], ...]


@dataclass(frozen=True, slots=True)
class Keypoint:
    """A named point of an object: a joint of a body, the hub of a wheel, a lamp.

    Attributes:
        position_m: In the asset's frame; in the instance frame once it belongs to an Instance.
        radius_m: How deep below the visible surface it may lie and still count as seen.
    """

    name: str
    position_m: Vec3
    radius_m: float = 0.05


@dataclass(frozen=True, slots=True)
class Symmetry:
    """A turn about an axis that leaves an object as it looks.

    Attributes:
        axis: Unit vector in the asset's frame.
        fold: Number of equal turns in a circle; 0 = every angle.
        offset_m: A point that the axis goes through, in the asset's frame.
    """

    axis: Vec3
    fold: int = 0
    offset_m: Vec3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Joint:
    """One joint of a robot; the child link's frame is the joint frame (as in URDF).

    Attributes:
        kind: ``fixed``, ``revolute`` (bounded), ``continuous`` or ``prismatic``.
        T_parent_joint: Pose of the joint frame in the parent link at position 0.
        axis: Unit axis in the joint frame.
        lower, upper: Limits [rad or m].
        mimic: Name of the joint this one follows, or empty.
        speed_max: Limit of its speed [rad/s or m/s]; 0 = unknown.
        mimic_multiplier, mimic_offset: A joint that follows another is at
            ``multiplier * position + offset`` of that one [rad or m].
    """

    name: str
    kind: Literal["fixed", "revolute", "continuous", "prismatic"]
    parent: str
    child: str
    T_parent_joint: SE3
    axis: Vec3
    lower: float
    upper: float
    mimic: str = ""
    speed_max: float = 0.0
    mimic_multiplier: float = 1.0
    mimic_offset: float = 0.0

    @property
    def movable(self) -> bool:
        """Whether a position belongs to it."""
        return self.kind != "fixed"


@dataclass(frozen=True, slots=True)
class SuctionCup:
    """A vacuum cup, whose rim is a circle about the grasp frame's Z, in its XY plane.

    Attributes:
        radius_m: Rim radius.
        force_n: Largest force that it holds; a larger one tears the object off.
    """

    radius_m: float
    force_n: float


@dataclass(frozen=True, slots=True)
class Gripper:
    """The hand of a robot.

    Attributes:
        link: Link whose frame carries the grasp frame.
        T_link_grasp: Grasp frame: origin between the finger tips, Z out of the hand,
            Y the direction in which the fingers open.
        finger_joints: Joints that open the gripper, each over its whole range.
        stroke_m: Distance between the fingers when fully open; 0 is closed.
        open_at: Limit of the finger joints at which the gripper is fully open.
        cup: Holds by vacuum instead of fingers; None = it has fingers.
    """

    link: str
    T_link_grasp: SE3
    finger_joints: tuple[str, ...]
    stroke_m: float
    open_at: Literal["lower", "upper"] = "upper"
    cup: SuctionCup | None = None


WORKSPACE_FROM_M = 0.3
"""Of an arm that reaches 0.85 m, such as a Panda."""


@dataclass(frozen=True, slots=True)
class RobotModel:
    """Kinematics of a robot, from its URDF.

    Attributes:
        links: Link names, root first, each after its parent.
        joints: All joints, in the order of their child links.
        visuals: ``{link: mesh asset id}``; links without geometry are absent.
        collisions: ``{link: asset id whose convex parts collide}``.
        home: A nominal, collision-free position per movable joint, in the order of ``joints``.
        gripper: Present when the robot can hold objects.
        no_collide: Link pairs that may touch (neighbours, and pairs that touch by design).
        workspace_from_m: Horizontal distance from the base to where its workspace begins.
    """

    links: tuple[str, ...]
    joints: tuple[Joint, ...]
    visuals: dict[str, str]
    collisions: dict[str, str]
    home: tuple[float, ...]
    gripper: Gripper | None
    no_collide: frozenset[tuple[str, str]]
    workspace_from_m: float = WORKSPACE_FROM_M

    @property
    def movable(self) -> tuple[Joint, ...]:
        """Joints that have a position, in order."""
        return tuple(j for j in self.joints if j.movable)


@dataclass(frozen=True, slots=True)
class AssetFacts:
    """Further facts about an object for its labels, next to the category.

    Attributes:
        subcategory: A finer name than the category (``hatchback``, ``child``); may be empty.
        attributes: Further facts that labels carry, ``(name, value)``, sorted by name.
        symmetries: Turns that leave the object as it looks; empty where none is known.
    """

    subcategory: str = ""
    attributes: tuple[tuple[str, str], ...] = ()
    symmetries: tuple[Symmetry, ...] = ()


@dataclass(frozen=True, slots=True)
class Asset:
    """One entry of the library.

    Attributes:
        asset_id: Its name in YAML and scenes: ``mug?seed=3``, ``pybullet/teddy``.
        kind: ``object`` (a mesh), ``robot``, ``texture``, ``environment`` or ``plate``.
        category: Its category in labels.
        tags: Tags for selection in YAML, sorted.
        mass_kg: Nominal mass; 0 = unknown.
        sha256: Content hash of the files or of the generator's version and parameters.
        stackable: Flat above and below: may be stacked.
        facts: Finds further facts for labels. Finding the facts of all objects that a street can
            have takes 0.3 s, and few of them are asked for.
    """

    asset_id: str
    kind: Literal["object", "robot", "texture", "environment", "plate"]
    category: str
    tags: tuple[str, ...]
    licence: str
    author: str
    source: str
    sha256: str
    mass_kg: float = 0.0
    stackable: bool = False
    facts: Callable[[], AssetFacts] = field(default=AssetFacts, repr=False, compare=False)

    @property
    def subcategory(self) -> str:
        """See ``AssetFacts``."""
        return self.facts().subcategory

    @property
    def attributes(self) -> tuple[tuple[str, str], ...]:
        """See ``AssetFacts``."""
        return self.facts().attributes

    @property
    def symmetries(self) -> tuple[Symmetry, ...]:
        """See ``AssetFacts``."""
        return self.facts().symmetries

    @property
    def words(self) -> frozenset[str]:
        """Tags, category and, if it has one, ``category/subcategory``: YAML excludes it by them."""
        part = (f"{self.category}/{self.subcategory}",) if self.subcategory else ()
        return frozenset((self.category, *part, *self.tags))

    def has_word(self, word: str) -> bool:
        """Whether ``words`` contain a word."""
        if word == self.category or word in self.tags:
            return True
        return word.startswith(f"{self.category}/") and word in self.words
