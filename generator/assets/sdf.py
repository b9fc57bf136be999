"""SDFormat reader: models of links, joints and geometry, with models inside models.

Source: sdformat.org, specification 1.6 to 1.12, and "Pose semantics". The model's own pose in its
world is not used: elements place it.
"""

import math
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import PurePosixPath
from xml.etree.ElementTree import Element

from gen_data.assets import asset_folder, urdf
from gen_data.assets.robot_description import (
    FORMAT_ROOTS,
    MAX_LINKS,
    Link,
    Look,
    PlacedJoint,
    RobotDescription,
    Shape,
    jointed,
)
from gen_data.assets.robot_files import resolve_uri
from gen_data.core import errors, safe_xml
from gen_data.core.asset_types import Joint
from gen_data.core.se3 import SE3, Vec3

_MAX_ELEMENTS = 100_000
_MAX_DEPTH = 8
"""Of models inside models."""
_MODEL = FORMAT_ROOTS[1]
_ENDLESS = 1e3
"""Limits [rad or m] beyond this are none; 1e16 is the format's default."""
_TRUE = ("true", "1")
_KINDS = {"fixed", "revolute", "continuous", "prismatic"}
_HELD = {"ball", "universal", "screw", "revolute2", "gearbox"}
"""Kinds of other than one position; such a joint stays where the file places it."""
_UNUSED = ("sensor", "light", "plugin", "gripper", "particle_emitter", "projector", "audio_source")
_GAZEBO: dict[str, Vec3] = {
    "Black": (0.0, 0.0, 0.0),
    "Blue": (0.0, 0.0, 1.0),
    "DarkGrey": (0.175, 0.175, 0.175),
    "DarkGray": (0.175, 0.175, 0.175),
    "FlatBlack": (0.1, 0.1, 0.1),
    "Green": (0.0, 1.0, 0.0),
    "Grey": (0.7, 0.7, 0.7),
    "Gray": (0.7, 0.7, 0.7),
    "Orange": (1.0, 0.5088, 0.0468),
    "Purple": (1.0, 0.0, 1.0),
    "Red": (1.0, 0.0, 0.0),
    "Turquoise": (0.0, 1.0, 1.0),
    "White": (1.0, 1.0, 1.0),
    "Yellow": (1.0, 1.0, 0.0),
}
"""Diffuse sRGB of Gazebo's plain materials (its media/materials/scripts/gazebo.material)."""


def read_sdf(folder: asset_folder.Folder, relative: str) -> RobotDescription:
    """Read the model of an SDF file; all its links hang below the link ``__model__``.

    Raises:
        AssetError: if it is malformed, holds no model or several, or refers outside the folder.
    """
    reader = _Reader(folder, relative)
    reader.add_file(relative, "", (), _Placement())
    return reader.describe()


class _Fault(ValueError):
    def __init__(self, element: Element, reason: str) -> None:
        super().__init__(reason)
        self.element = element


@dataclass(frozen=True)
class _Scope:
    """A model that is being read.

    Attributes:
        file: Its file.
        prefix: Prefix of the names of its parts.
        frame: Name of the model's frame, ``__model__`` inside it.
        depth: Files and models around it, and itself.
        lenient: Whether its version, below 1.7, lets parts of two kinds have one name.
        axes_of_model: Whether its version, below 1.5, states axes of joints in the model's frame
            (sdformat, ``sdf/1.5/1_4.convert``).
    """

    file: str
    prefix: str
    frame: str
    depth: tuple[str, ...]
    lenient: bool
    axes_of_model: bool

    def named(self, name: str) -> str:
        """Global name of the part that this model calls ``name``."""
        return self.frame if name == _MODEL else self.prefix + name


@dataclass(frozen=True)
class _Placement:
    """Where an included model is: pose of its frame ``placed`` (empty = its own) in ``frame``.

    ``model`` is the name that its own frame gets, ``held`` whether its joints do not move.
    """

    model: str = _MODEL
    frame: str = ""
    pose: SE3 = field(default_factory=SE3)
    placed: str = ""
    held: bool = False


_Shapes = tuple[tuple[Shape, str], ...]


@dataclass
class _Reader:
    """Collects links, joints and frames of a model and those inside it.

    Attributes:
        frames: ``{name: (frame it is stated in, its pose there)}``; also of links and joints.
        attached: Link or frame that a frame moves with.
        shapes: Visual and collision shapes of a link, each with the frame of its pose.
        anchors: Joints with the frame of the axis and the axis in it.
    """

    folder: asset_folder.Folder
    relative: str
    frames: dict[str, tuple[str, SE3]] = field(default_factory=dict)
    attached: dict[str, str] = field(default_factory=dict)
    links: dict[str, Link] = field(default_factory=dict)
    shapes: dict[str, tuple[_Shapes, _Shapes]] = field(default_factory=dict)
    anchors: dict[str, tuple[Joint, str, Vec3]] = field(default_factory=dict)
    included: list[str] = field(default_factory=list)
    remarks: Counter[str] = field(default_factory=Counter)

    def add_file(
        self, file: str, prefix: str, depth: tuple[str, ...], placement: _Placement
    ) -> None:
        place = str(self.folder.root / file)
        data = self.folder.read(file)
        root = safe_xml.parse_xml(data, place, "sdf", "an SDF file", _MAX_ELEMENTS)
        models = root.findall("model") or root.findall("world/model")
        included = [] if models else root.findall("include") or root.findall("world/include")
        if len(models) + len(included) != 1:
            raise errors.AssetError(f"{place}: holds {len(models)} models; give a file with one")
        version = [int(n) for n in re.findall(r"\d+", root.get("version", ""))]
        names = (file, prefix, placement.model, (*depth, file))
        scope = _Scope(*names, version < [1, 7], [] != version < [1, 5])
        try:
            if included:
                inner = self._model_file(file, included[0])
                self.add_file(inner, prefix, scope.depth, placement)
            else:
                self._add_model(models[0], scope, placement)
        except (ValueError, KeyError) as error:
            at = error.element if isinstance(error, _Fault) else (models + included)[0]
            reason = f"missing {error}" if isinstance(error, KeyError) else error
            raise errors.AssetError(
                f"{place}{safe_xml.format_position(at)}: malformed SDF ({reason}); correct it"
            ) from None

    def _add_model(self, model: Element, scope: _Scope, placement: _Placement) -> None:
        if len(scope.depth) > _MAX_DEPTH:
            raise ValueError(f"models inside models, more than {_MAX_DEPTH} deep")
        self.frames[scope.frame] = (placement.frame, placement.pose)
        before = len(self.links)
        held = placement.held or _is_static(model)
        for element in model:
            self.remarks[element.tag] += element.tag in _UNUSED
            try:
                self._add_part(element, scope, held=held)
            except (ValueError, KeyError) as error:
                if isinstance(error, _Fault):
                    raise
                reason = f"missing {error}" if isinstance(error, KeyError) else error
                name = scope.prefix + element.get("name", "")
                raise _Fault(element, f"{element.tag} '{name[:60]}': {reason}") from None
        first = next(iter([*self.links][before:]), "")
        canonical = model.get("canonical_link", "")
        self.attached[scope.frame] = scope.named(canonical) if canonical else first
        placed = placement.placed or model.get("placement_frame", "")
        if placed:
            T_model_placed = self._at(scope.named(placed), scope.frame)
            pose = placement.pose @ T_model_placed.inverse()
            self.frames[scope.frame] = (placement.frame, pose)

    def _add_part(self, element: Element, scope: _Scope, *, held: bool) -> None:
        if element.tag == "include":
            self._include(element, scope, held=held)
            return
        if element.tag not in ("link", "joint", "frame", "model"):
            return
        name = scope.prefix + element.get("name", "")
        alike = {"link": [*self.links], "joint": [*self.anchors]}.get(element.tag, [])
        if scope.lenient and name in self.frames and name not in alike:
            name += f"_{element.tag}"
        if name in self.frames or not element.get("name"):
            raise ValueError("its name is missing or used twice")
        if element.tag == "model":
            frame, pose = self._pose(element, scope, scope.frame)
            prefix = f"{name}::"
            inside = replace(
                scope, prefix=prefix, frame=prefix + _MODEL, depth=(*scope.depth, name)
            )
            self._add_model(element, inside, _Placement(inside.frame, frame, pose, held=held))
        elif element.tag == "link":
            self.frames[name] = self._pose(element, scope, scope.frame)
            visuals, collisions = (
                tuple(self._shapes(element, tag, scope, name)) for tag in ("visual", "collision")
            )
            for tag in _UNUSED:
                self.remarks[tag] += len(element.findall(tag))
            self.shapes[name] = (visuals, collisions)
            self.links[name] = Link(name, (), ())
            if len(self.links) > MAX_LINKS:
                raise ValueError(f"more than {MAX_LINKS} links")
        elif element.tag == "frame":
            base = scope.named(element.get("attached_to") or _MODEL)
            self.frames[name] = self._pose(element, scope, base)
            self.attached[name] = base
        else:
            self._add_joint(element, name, scope, held=held)

    def _include(self, element: Element, scope: _Scope, *, held: bool) -> None:
        """Add an included model, with ``merge`` as if its parts were this model's own."""
        file = self._model_file(scope.file, element)
        if file in scope.depth:
            raise ValueError(f"{file} includes itself")
        self.included.append(file)
        uri = (element.findtext("uri") or "").strip()
        name = (element.findtext("name") or PurePosixPath(uri).name).strip()
        merged = element.get("merge") in ("true", "1")
        prefix = scope.prefix if merged else f"{scope.prefix}{name}::"
        model = f"{prefix}_merged__{name}__model__" if merged else prefix + _MODEL
        frame, pose = self._pose(element, scope, scope.frame)
        placed = (element.findtext("placement_frame") or "").strip()
        held = held or _is_static(element)
        self.add_file(file, prefix, scope.depth, _Placement(model, frame, pose, placed, held))

    def _model_file(self, file: str, include: Element) -> str:
        """SDF file of an included model: the folder's ``model.config`` names it."""
        uri = (include.findtext("uri") or "").strip().removeprefix("file://")
        if PurePosixPath(uri).suffix == ".sdf":
            return resolve_uri(self.folder, file, uri)
        config = resolve_uri(self.folder, file, f"{uri}/model.config")
        if "://" not in uri and not self.folder.exists(config):
            # Gazebo looks a bare name up among the models.
            config = resolve_uri(self.folder, file, f"model://{uri}/model.config")
        base = PurePosixPath(config).parent
        if not self.folder.exists(config):
            return str(base / "model.sdf")
        place = str(self.folder.root / config)
        data = self.folder.read(config)
        root = safe_xml.parse_xml(data, place, "model", "a model.config", _MAX_ELEMENTS)
        self.included.append(config)
        names = [(k.text or "").strip() for k in root.findall("sdf")]
        return self.folder.refer(config, names[-1] if names else "model.sdf")

    def _pose(self, element: Element, scope: _Scope, default: str) -> tuple[str, SE3]:
        pose = element.find("pose")
        if pose is None:
            return default, SE3()
        relative = pose.get("relative_to") or pose.get("frame")
        return scope.named(relative) if relative else default, _parse_pose(pose)

    def _add_joint(self, element: Element, name: str, scope: _Scope, *, held: bool) -> None:
        kind = element.attrib["type"]
        parent, child = ((element.findtext(tag) or "").strip() for tag in ("parent", "child"))
        if not parent or not child:
            raise ValueError("it has no parent or no child")
        child = scope.named(child)
        parent = _MODEL if parent == "world" else scope.named(parent)
        self.frames[name] = self._pose(element, scope, child)
        if kind in _HELD:
            self.remarks[f"{kind} joint (it stays at its origin)"] += 1
            kind = "fixed"
        if kind not in _KINDS:
            raise ValueError(f"its type is '{kind[:40]}', not one of {sorted(_KINDS | _HELD)}")
        joint = Joint(name, "fixed", parent, child, SE3(), (1.0, 0.0, 0.0), 0.0, 0.0)
        frame, direction = name, (0.0, 0.0, 1.0)
        axis = element.find("axis")
        if kind != "fixed" and not held and axis is not None:
            xyz = axis.find("xyz")
            if xyz is not None:
                direction = _unit(_numbers(xyz.text or "", 3))
                stated = xyz.get("expressed_in")
                frame = scope.named(stated) if stated else name
            in_model = axis.findtext("use_parent_model_frame")
            if scope.axes_of_model if in_model is None else in_model.strip().lower() in _TRUE:
                frame = scope.frame
            joint = self._moving(joint, kind, axis, scope)
        self.anchors[name] = (joint, frame, direction)

    def _moving(self, joint: Joint, kind: str, axis: Element, scope: _Scope) -> Joint:
        lower, upper = (float(axis.findtext(f"limit/{k}") or s * 1e16)
                        for k, s in (("lower", -1), ("upper", 1)))  # fmt: skip
        if not lower <= upper:
            raise ValueError(f"lower limit {lower} above upper {upper}")
        if max(-lower, upper) > _ENDLESS:
            if kind == "prismatic":
                self.remarks["prismatic joint without limits (it stays at its origin)"] += 1
                return joint
            kind = "continuous"
        if kind == "continuous":
            lower, upper = -math.pi, math.pi
        speed = float(axis.findtext("limit/velocity") or 0.0)
        joint = replace(joint, kind=kind, lower=lower, upper=upper,  # type: ignore[arg-type]
                        speed_max=speed if 0.0 < speed < 1e6 else 0.0)  # fmt: skip
        mimic = axis.find("mimic")
        if mimic is not None:
            factor, offset, reference = (
                float(mimic.findtext(k) or d)
                for k, d in (("multiplier", 1.0), ("offset", 0.0), ("reference", 0.0))
            )
            joint = replace(
                joint,
                mimic=scope.prefix + mimic.attrib["joint"],
                mimic_multiplier=factor,
                mimic_offset=round(offset - factor * reference, 9),
            )
        return joint

    def _shapes(
        self, link: Element, tag: str, scope: _Scope, name: str
    ) -> Iterator[tuple[Shape, str]]:
        for element in link.findall(tag):
            frame, pose = self._pose(element, scope, name)
            shape = self._shape(element, scope, pose)
            if shape is None:
                continue
            zeros = shape.size[: _EXTENTS.get(shape.kind, 0)].count(0.0)
            if zeros > (tag == "visual" and shape.kind == "box"):
                self.remarks[f"{tag} {shape.kind} of size 0"] += 1
                continue
            if tag == "visual":
                shape = replace(shape, look=self._look(element, scope))
                if shape.look.opacity == 0.0:
                    self.remarks["invisible visual"] += 1
                    continue
            yield shape, frame

    def _shape(self, element: Element, scope: _Scope, at: SE3) -> Shape | None:
        geometry = element.find("geometry")
        given = geometry[0] if geometry is not None and len(geometry) else None
        kind = "empty" if given is None else given.tag
        if given is None or kind not in (*_EXTENTS, "mesh"):
            self.remarks[f"{kind} geometry"] += 1
            return None
        if kind == "mesh":
            uri = (given.findtext("uri") or "").strip()
            file = resolve_uri(self.folder, scope.file, uri.removeprefix("file://"))
            scale = _numbers(given.findtext("scale") or "1 1 1", 3)
            part = (given.findtext("submesh/name") or "").strip()
            centered = (given.findtext("submesh/center") or "").strip() in ("true", "1")
            return Shape("mesh", file, scale, at, part=part, centered=centered)
        if kind == "box":
            size = _numbers(given.findtext("size") or "", 3)
        elif kind == "ellipsoid":
            size = _numbers(given.findtext("radii") or "", 3)
        else:
            length = given.findtext("length") or ("0" if kind == "sphere" else "nan")
            size = (float(given.findtext("radius") or "nan"), float(length), 0.0)
        if not min(size) >= 0.0:
            raise _Fault(element, f"<{kind}> has a negative or no size")
        return Shape(kind, "", size, at)

    def _look(self, element: Element, scope: _Scope) -> Look:
        opacity = 1.0 - float(element.findtext("transparency") or 0.0)
        material = element.find("material")
        if material is None:
            return Look(opacity=round(opacity, 6))
        look = Look(element.get("name", ""))
        script = (material.findtext("script/name") or "").strip()
        color = material.findtext("diffuse") or material.findtext("ambient")
        if color:
            red, green, blue, *alpha = _numbers_of(color, (3, 4))
            opacity *= alpha[0] if alpha else 1.0
            look = replace(look, color=(red, green, blue), whole=True)
        elif script.removeprefix("Gazebo/") in _GAZEBO:
            look = replace(look, color=_GAZEBO[script.removeprefix("Gazebo/")], whole=True)
        elif script:
            self.remarks[f"material {script[:60]}"] += 1
        for pbr in material.findall("pbr/metal"):
            image = (pbr.findtext("albedo_map") or "").strip()
            if image:
                file = resolve_uri(self.folder, scope.file, image.removeprefix("file://"))
                look = replace(look, texture=file, color=look.color or (1.0, 1.0, 1.0), whole=True)
            for name, tag in (("roughness", "roughness"), ("metallic", "metalness")):
                if pbr.findtext(tag):
                    value = min(max(float(pbr.findtext(tag) or 0.0), 0.0), 1.0)
                    look = replace(look, **{name: value})  # type: ignore[arg-type]
        return replace(look, opacity=round(min(max(opacity, 0.0), 1.0), 6))

    def describe(self) -> RobotDescription:
        place = str(self.folder.root / self.relative)
        self.frames[_MODEL] = ("", SE3())
        try:
            poses = {name: self._at(name) for name in self.links}
            placed: list[PlacedJoint] = []
            children: set[str] = set()
            for anchor in self.anchors.values():
                joint = self._place(*anchor)
                if joint.joint.child in children:
                    self.remarks[f"joint '{joint.joint.name[:60]}' (it closes a loop)"] += 1
                    continue
                children.add(joint.joint.child)
                placed.append(joint)
            for name in self.links:
                if name not in children:
                    fixed = Joint(f"{name}_fixed", "fixed", _MODEL, name, SE3(), _X, 0.0, 0.0)
                    placed.append(PlacedJoint(fixed, (0.0, 0.0, 0.0), _X))
            poses[_MODEL] = SE3()
            links = {_MODEL: Link(_MODEL, (), ()), **{n: self._whole(n) for n in self.links}}
            described = jointed(links, poses, placed)
        except ValueError as error:
            raise errors.AssetError(f"{place}: malformed SDF ({error}); correct it") from None
        remarks = tuple(
            f"not used: {n} {what}{'' if n == 1 or what.endswith(')') else 's'}"
            for what, n in sorted(self.remarks.items())
            if n
        )
        files = tuple(dict.fromkeys(self.included))
        return replace(described, included=files, remarks=remarks)

    def _whole(self, name: str) -> Link:
        """A link with its shapes, whose poses may refer to other frames."""
        visuals, collisions = (
            tuple(
                shape
                if frame == name
                else replace(shape, T_link_shape=self._between(name, frame) @ shape.T_link_shape)
                for shape, frame in shapes
            )
            for shapes in self.shapes[name]
        )
        return Link(name, visuals, collisions)

    def _between(self, link: str, frame: str) -> SE3:
        """``T_link_frame``."""
        return self._at(link).inverse() @ self._at(frame)

    def _place(self, joint: Joint, frame: str, axis: Vec3) -> PlacedJoint:
        """A joint in the frame of the root, between links."""
        parent, child = self._link_of(joint.parent), self._link_of(joint.child)
        x, y, z = (float(v) for v in self._at(frame).rotate(axis))  # type: ignore[arg-type]
        at = self._at(joint.name).translation_m
        return PlacedJoint(replace(joint, parent=parent, child=child), at, (x, y, z))

    def _link_of(self, name: str) -> str:
        """Link that a link or frame of this name moves with."""
        for _ in range(len(self.frames) + 1):
            if name in self.links or name == _MODEL:
                return name
            if name not in self.attached:
                break
            name = self.attached[name]
        raise ValueError(f"there is no link or frame '{name[:60]}'")

    def _at(self, name: str, base: str = _MODEL) -> SE3:
        """Pose of a frame in the root frame, or in ``base`` around it."""
        pose = SE3()
        for _ in range(len(self.frames) + 1):
            if name in ("", base):
                return pose
            if name not in self.frames:
                raise ValueError(f"there is no frame '{name[:60]}'")
            name, own = self.frames[name]
            pose = own @ pose
        raise ValueError(f"the pose of '{name[:60]}' is stated relative to itself")


_X: Vec3 = (1.0, 0.0, 0.0)
_EXTENTS = {"box": 3, "cylinder": 2, "capsule": 1, "sphere": 1, "ellipsoid": 3}
"""Number of sizes that must not be 0."""


def _is_static(element: Element) -> bool:
    """Whether a model, or an included one, does not move, nor any of its joints."""
    return (element.findtext("static") or "").strip().lower() in _TRUE


def _parse_pose(pose: Element) -> SE3:
    """A pose: position and roll, pitch, yaw, or a quaternion x y z w."""
    if pose.get("rotation_format") == "quat_xyzw":
        x, y, z, i, j, k, w = _numbers_of(pose.text or "0 0 0 0 0 0 1", (7,))
        norm = math.sqrt(w * w + i * i + j * j + k * k)
        if norm < 1e-9:
            raise _Fault(pose, "a quaternion of length zero")
        return SE3((x, y, z), (w / norm, i / norm, j / norm, k / norm))
    x, y, z, *angles = _numbers_of((pose.text or "").strip() or "0 0 0 0 0 0", (6,))
    if pose.get("degrees") in ("true", "1"):
        angles = [math.radians(a) for a in angles]
    return SE3((x, y, z), urdf.rpy_to_quaternion(*angles))


def _numbers(text: str, count: int) -> Vec3:
    x, y, z = _numbers_of(text, (count,))
    return (x, y, z)


def _numbers_of(text: str, counts: tuple[int, ...]) -> tuple[float, ...]:
    numbers = tuple(float(word) for word in text.split())
    if len(numbers) not in counts or not all(math.isfinite(n) for n in numbers):
        wanted = " or ".join(str(n) for n in counts)
        raise ValueError(f"'{text.strip()[:40]}' is not {wanted} numbers")
    return numbers


def _unit(vector: Vec3) -> Vec3:
    x, y, z = vector
    length = math.sqrt(x * x + y * y + z * z)
    if length < 1e-9:
        raise ValueError("a joint axis of length zero")
    return (x / length, y / length, z / length)
