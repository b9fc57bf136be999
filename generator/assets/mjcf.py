"""MJCF reader: bodies, joints and geoms of MuJoCo's own parser and compiler.

Source: MuJoCo documentation, "XML Reference" and "Modeling". Files of meshes and images are never
given to it: MuJoCo compiles a box for each mesh, and shapes refer to the files. Its compiler
resolves defaults, frames, units of angles and all ways to state a direction. Meshes to which it
fits a box, a capsule or another primitive are read here, and given to it as triangles.
"""

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import PurePosixPath
from typing import Any
from xml.etree.ElementTree import Element, tostring

import numpy as np

from gen_data.assets import asset_folder, robot_description
from gen_data.assets.readers import read_mesh
from gen_data.core.asset_types import Joint
from gen_data.core.errors import AssetError
from gen_data.core.safe_xml import parse_xml
from gen_data.core.se3 import SE3, Vec3, rotation_to_quaternion

_MAX_ELEMENTS = 200_000
_ROOT = robot_description.FORMAT_ROOTS[0]
_SHOWN_GROUPS = 3
"""MuJoCo's viewer shows the groups 0 to 2."""
_PLAIN = (0.5, 0.5, 0.5, 1.0)
"""Colour of geoms that state none; only another colour overrides a material's."""


def read_mjcf(folder: asset_folder.Folder, relative: str) -> robot_description.RobotDescription:
    """Read an MJCF file.

    Its bodies are links and its named sites are links without geometry; both hang below the link
    ``world``. Joints whose positions an equality constraint couples mimic one another. A geom is
    seen if its group is and it is not opaque to collisions only, and collides if ``contype`` or
    ``conaffinity`` do.

    Raises:
        AssetError: if MuJoCo refuses it, or it refers outside the folder.
    """
    import mujoco

    place = str(folder.root / relative)
    data = folder.read(relative)
    root = parse_xml(data, place, "mujoco", "an MJCF", _MAX_ELEMENTS)
    included = _expand(folder, relative, root)
    # Unchanged where nothing is included: MuJoCo's messages state lines.
    text = tostring(root, encoding="unicode") if included else data.decode("utf-8", "replace")
    try:
        spec = mujoco.MjSpec.from_string(text)
        fitted = _fitted_meshes(spec, mujoco)
        source = _Source(folder, relative, *_strip_files(spec, mujoco))
        read_files = _fit_primitives(spec, fitted, source, mujoco)
        model = spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        reason = " ".join(str(error).split())[:300]
        raise AssetError(f"{place}: MuJoCo refuses it ({reason}); correct it") from None
    try:
        described = _Reader(source, model, mujoco).describe()
    except ValueError as error:
        raise AssetError(f"{place}: {error}; correct it") from None
    return replace(described, included=tuple(dict.fromkeys((*included, *read_files))))


def _expand(folder: asset_folder.Folder, relative: str, root: Element) -> tuple[str, ...]:
    """Put the content of included files in place of ``<include>``; return the files."""
    files: list[str] = []

    def expand(parent: Element) -> None:
        for k in reversed(range(len(parent))):
            if parent[k].tag != "include":
                expand(parent[k])
                continue
            # Paths of nested includes, too, are relative to the folder of the main file.
            file = folder.refer(relative, parent[k].get("file", ""))
            if file in files or file == relative:
                raise AssetError(
                    f"{folder.root / relative}: includes {file} twice, which MuJoCo does not "
                    "allow; remove one"
                )
            files.append(file)
            data = folder.read(file)
            tag = "mujocoinclude" if b"<mujocoinclude" in data else "mujoco"
            part = parse_xml(data, str(folder.root / file), tag, "an MJCF", _MAX_ELEMENTS)
            expand(part)
            parent[k : k + 1] = list(part)

    expand(root)
    return tuple(files)


@dataclass(frozen=True)
class _File:
    """A mesh as the description uses it."""

    file: str
    scale: Vec3
    T_ref: SE3


@dataclass(frozen=True)
class _Source:
    """Content taken out of a description before MuJoCo compiles it."""

    folder: asset_folder.Folder
    relative: str
    meshes: dict[str, _File]
    images: dict[str, str]
    colors: dict[str, Vec3]
    folders: tuple[str, str]
    remarks: Counter[str]

    def refer(self, folder: str, file: str) -> str:
        """Path of a file below a folder that the compiler element names."""
        return self.folder.refer(self.relative, str(PurePosixPath(folder) / file))


def _strip_files(spec: Any, mujoco: Any) -> tuple[Any, ...]:
    """Replace meshes by boxes and remove images; return these meshes and images."""
    remarks: Counter[str] = Counter()
    meshes = _strip_meshes(spec, mujoco)
    images, colors = _strip_images(spec, mujoco, remarks)
    for height in spec.hfields:
        height.file, height.nrow, height.ncol, height.userdata = "", 2, 2, [0, 0, 0, 1]
    for name, things in (("skin", spec.skins), ("flex", spec.flexes)):
        for thing in list(things):
            remarks[name] += 1
            spec.delete(thing)
    spec.compiler.fusestatic = False
    spec.compiler.discardvisual = False
    return meshes, images, colors, (spec.meshdir, spec.texturedir), +remarks


def _strip_meshes(spec: Any, mujoco: Any) -> dict[str, _File]:
    meshes: dict[str, _File] = {}
    corners, faces = _unit_box()
    for mesh in spec.meshes:
        scale, shift = _vec3(mesh.scale), np.array(mesh.refpos)
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, np.array(mesh.refquat) / np.linalg.norm(mesh.refquat))
        turned = SE3((0.0, 0.0, 0.0), rotation_to_quaternion(turn.reshape(3, 3).T))
        if mesh.file:
            if len(set(scale)) > 1 and not np.allclose(turned.rotation(), np.eye(3)):
                raise ValueError(f"mesh '{mesh.name}' is turned and scaled unevenly")
            moved = _vec3(-np.array(scale) * turned.rotate(shift))
            mesh.name = mesh.name or PurePosixPath(mesh.file).stem
            meshes[mesh.name] = _File(mesh.file, scale, SE3(moved, turned.quaternion_wxyz))
        mesh.file, mesh.content_type = "", ""
        mesh.scale, mesh.refpos, mesh.refquat = [1, 1, 1], [0, 0, 0], [1, 0, 0, 0]
        mesh.uservert, mesh.userface = corners, faces
        for attribute in ("usernormal", "usertexcoord", "userfacenormal", "userfacetexcoord"):
            setattr(mesh, attribute, [])
    return meshes


def _is_fitted(geom: Any, mujoco: Any) -> bool:
    """Whether the size and place of a primitive follow from a mesh."""
    kinds = mujoco.mjtGeom
    return bool(geom.meshname) and geom.type not in (kinds.mjGEOM_MESH, kinds.mjGEOM_SDF)


def _fitted_meshes(spec: Any, mujoco: Any) -> dict[str, dict[str, Any]]:
    """Attributes of the meshes to which primitives are fitted, by name."""
    names = {geom.meshname for geom in spec.geoms if _is_fitted(geom, mujoco)}
    found = {}
    for mesh in spec.meshes:
        name = mesh.name or PurePosixPath(mesh.file).stem
        if name in names:
            lists = {key: list(getattr(mesh, key)) for key in _MESH_LISTS}
            found[name] = {**lists, "inertia": mesh.inertia, "file": mesh.file}
    return found


_MESH_LISTS = ("scale", "refpos", "refquat", "uservert", "userface")


def _fit_primitives(
    spec: Any, fitted: Mapping[str, Mapping[str, Any]], source: _Source, mujoco: Any
) -> tuple[str, ...]:
    """Give MuJoCo the triangles of meshes to which it fits primitives; return their files.

    Raises:
        AssetError: a mesh is unusable.
    """
    files, suffix = list[str](), ".fitted"
    for name, values in fitted.items():
        mesh = spec.add_mesh()
        mesh.name = name + suffix
        for key in (*_MESH_LISTS, "inertia"):
            setattr(mesh, key, values[key])
        if values["file"]:
            files.append(source.refer(source.folders[0], values["file"]))
            soup = read_mesh(source.folder, files[-1], materials=False).soup
            corners, faces = np.unique(
                soup.corners.reshape(-1, 3).astype(np.float32), axis=0, return_inverse=True
            )
            mesh.uservert, mesh.userface = corners.ravel().tolist(), faces.ravel().tolist()
    for geom in spec.geoms:
        if _is_fitted(geom, mujoco) and geom.meshname in fitted:
            geom.meshname += suffix
    return tuple(files)


def _strip_images(
    spec: Any, mujoco: Any, remarks: Counter[str]
) -> tuple[dict[str, str], dict[str, Vec3]]:
    """Image file and colour of a procedural texture by material."""
    files = {texture.name or PurePosixPath(texture.file).stem: texture for texture in spec.textures}
    images, colors = dict[str, str](), dict[str, Vec3]()
    role = int(mujoco.mjtTextureRole.mjTEXROLE_RGB)
    for material in spec.materials:
        used = list(material.textures)
        texture = files.get(used[role])
        if texture is not None and texture.file:
            images[material.name] = texture.file
        elif texture is not None and texture.builtin:
            colors[material.name] = _vec3(texture.rgb1)
            if texture.builtin != int(mujoco.mjtBuiltin.mjBUILTIN_FLAT):
                remarks["procedural texture (its first colour is used)"] += 1
        elif texture is not None:
            remarks["texture of six files"] += 1
        remarks["textures of other roles than colour"] += sum(
            bool(name) for k, name in enumerate(used) if k != role
        )
        material.textures = [""] * len(used)
    for texture in list(spec.textures):
        spec.delete(texture)
    return images, colors


def _unit_box() -> tuple[list[float], list[int]]:
    """A box whose principal axes are its own: shapes keep the poses that the file states."""
    corners = [
        c for k in (-1, 1) for j in (-1, 1) for i in (-1, 1) for c in (0.1 * i, 0.2 * j, 0.3 * k)
    ]
    quads = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
    return corners, [i for q in quads for i in (*q[:3], q[0], *q[2:])]


@dataclass
class _Reader:
    """Reads a compiled model."""

    source: _Source
    model: Any
    mujoco: Any
    links: dict[str, robot_description.Link] = field(default_factory=dict)
    poses: dict[str, SE3] = field(default_factory=dict)
    joints: list[robot_description.PlacedJoint] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.data = self.mujoco.MjData(self.model)
        self.mujoco.mj_kinematics(self.model, self.data)
        self.remarks = self.source.remarks

    def describe(self) -> robot_description.RobotDescription:
        model = self.model
        if model.nbody + model.nsite > robot_description.MAX_LINKS:
            raise ValueError(f"more than {robot_description.MAX_LINKS} bodies and sites")
        if model.nbody < 2:
            raise ValueError("it holds no body")
        names = [_ROOT, *(self._name("body", k) for k in range(1, model.nbody))]
        for k, name in enumerate(names):
            self.poses[name] = _pose(self.data.xpos[k], self.data.xquat[k])
            if k:
                self._add_joints(k, name, names[int(model.body_parentid[k])])
            self.links[name] = robot_description.Link(name, *self._shapes(k))
        for k in range(model.nsite):
            name = _plain(model.site(k).name)
            if name and name not in self.links:
                body = names[int(model.site_bodyid[k])]
                turn = rotation_to_quaternion(self.data.site_xmat[k].reshape(3, 3))
                self.links[name] = robot_description.Link(name, (), ())
                self.poses[name] = SE3(_vec3(self.data.site_xpos[k]), turn)
                self._join(Joint(f"{name}_site", "fixed", body, name, SE3(), _X, 0.0, 0.0))
        self._couple()
        described = robot_description.jointed(self.links, self.poses, self.joints)
        for kind, number in (
            ("actuator", model.nu), ("camera", model.ncam), ("light", model.nlight),
            ("sensor", model.nsensor), ("tendon", model.ntendon),
        ):  # fmt: skip
            self.remarks[kind] += int(number)
        self.remarks = +self.remarks
        remarks = tuple(
            f"not used: {count} {what}{'' if count == 1 or what[-1] in ')s' else 's'}"
            for what, count in sorted(self.remarks.items())
        )
        return replace(described, home=self._home(described), remarks=remarks)

    def _name(self, kind: str, number: int) -> str:
        return _plain(getattr(self.model, kind)(number).name) or f"{kind}_{number}"

    def _join(self, joint: Joint, anchor_m: Vec3 = (0.0, 0.0, 0.0), axis: Vec3 = (1.0, 0.0, 0.0),
              position: float = 0.0) -> None:  # fmt: skip
        self.joints.append(robot_description.PlacedJoint(joint, anchor_m, axis, position))

    def _add_joints(self, body: int, name: str, parent: str) -> None:
        """Joints of a body; all but the last move links without geometry."""
        model, kinds = self.model, self.mujoco.mjtJoint
        first = int(model.body_jntadr[body])
        moving = []
        for j in range(first, first + int(model.body_jntnum[body])):
            number = int(model.jnt_type[j])
            if number == int(kinds.mjJNT_FREE):
                continue
            if number == int(kinds.mjJNT_BALL):
                self.remarks["ball joint (it stays at its origin)"] += 1
            elif number == int(kinds.mjJNT_SLIDE) and not model.jnt_limited[j]:
                self.remarks["sliding joint without range (it stays at its origin)"] += 1
            else:
                moving.append(j)
        if not moving:
            self._join(Joint(f"{name}_fixed", "fixed", parent, name, SE3(), _X, 0.0, 0.0))
        for j in moving:
            child = name if j == moving[-1] else f"{name}.{self._name('joint', j)}"
            if child != name:
                self.links[child] = robot_description.Link(child, (), ())
                self.poses[child] = self.poses[name]
            lower, upper = (round(float(v), _DECIMALS) for v in model.jnt_range[j])
            kind = "prismatic" if model.jnt_type[j] == int(kinds.mjJNT_SLIDE) else "revolute"
            if not model.jnt_limited[j]:
                kind, lower, upper = "continuous", -math.pi, math.pi
            joint = Joint(
                self._name("joint", j), kind, parent, child, SE3(), _X, lower, upper,  # type: ignore[arg-type]
            )  # fmt: skip
            at = self.data.xanchor[j], self.data.xaxis[j]
            zero = float(model.qpos0[model.jnt_qposadr[j]])
            self._join(joint, _vec3(at[0]), _vec3(at[1]), round(zero, _DECIMALS))
            parent = child

    def _couple(self) -> None:
        """Turn equality constraints between two joints into ``mimic``."""
        model, kinds = self.model, self.mujoco.mjtEq
        placed = {p.joint.name: k for k, p in enumerate(self.joints) if p.joint.movable}
        for e in range(model.neq):
            one, two = int(model.eq_obj1id[e]), int(model.eq_obj2id[e])
            if model.eq_type[e] != int(kinds.mjEQ_JOINT) or two < 0:
                self.remarks["constraint between bodies (closed loops are open)"] += 1
                continue
            names = self._name("joint", one), self._name("joint", two)
            if not model.eq_active0[e] or not {*names} <= {*placed}:
                continue
            # y - y0 = a0 + a1 (x - x0) + ..., from the reference positions x0 and y0.
            a0, a1, *higher = (float(v) for v in model.eq_data[e][:5])
            if any(higher):
                self.remarks["polynomial coupling of joints (its linear part is used)"] += 1
            y0, x0 = (float(model.qpos0[model.jnt_qposadr[j]]) for j in (one, two))
            k = placed[names[0]]
            follower = replace(
                self.joints[k].joint,
                mimic=names[1],
                mimic_multiplier=round(a1, _DECIMALS),
                mimic_offset=round(y0 + a0 - a1 * x0, _DECIMALS),
            )
            self.joints[k] = replace(self.joints[k], joint=follower)

    def _home(self, described: robot_description.RobotDescription) -> dict[str, float]:
        """Positions of the keyframe ``home``, or of the only one."""
        model = self.model
        keys = [k for k in range(model.nkey) if model.key(k).name == "home" or model.nkey == 1]
        if not keys:
            return {}
        limits = {j.name: (j.lower, j.upper) for j in described.joints if j.movable}
        home = {}
        for j in range(model.njnt):
            name = self._name("joint", j)
            if name in limits:
                low, high = limits[name]
                value = float(model.key_qpos[keys[0]][model.jnt_qposadr[j]])
                home[name] = round(min(max(value, low), high), 6)
        return home

    def _shapes(
        self, body: int
    ) -> tuple[tuple[robot_description.Shape, ...], tuple[robot_description.Shape, ...]]:
        model = self.model
        first = int(model.body_geomadr[body])
        geoms = range(first, first + int(model.body_geomnum[body])) if first >= 0 else range(0)
        colliding = {g: bool(model.geom_contype[g] or model.geom_conaffinity[g]) for g in geoms}
        shown = [g for g in geoms if model.geom_group[g] < _SHOWN_GROUPS]
        # Where a body has geoms for the eye only, geoms of other groups are for collisions only.
        groups = {int(model.geom_group[g]) for g in shown if not colliding[g]}
        visuals, collisions = [], []
        for g, shape in self._geoms(body, geoms):
            own = g in shown and (not groups or int(model.geom_group[g]) in groups)
            if own and shape.look.opacity > 0.0:
                visuals.append(shape)
            if colliding[g]:
                collisions.append(shape)
        return tuple(visuals), tuple(collisions)

    def _geoms(self, body: int, geoms: range) -> Iterator[tuple[int, robot_description.Shape]]:
        kinds, model = self.mujoco.mjtGeom, self.model
        T_body_world = _pose(self.data.xpos[body], self.data.xquat[body]).inverse()
        for g in geoms:
            turn = rotation_to_quaternion(self.data.geom_xmat[g].reshape(3, 3))
            pose = T_body_world @ SE3(_vec3(self.data.geom_xpos[g]), turn)
            a, b, c = (float(v) for v in model.geom_size[g])
            kind, file, size = "", "", (0.0, 0.0, 0.0)
            number = int(model.geom_type[g])
            if number == int(kinds.mjGEOM_MESH):
                mesh = self.source.meshes.get(model.mesh(int(model.geom_dataid[g])).name)
                if mesh is not None:
                    kind, size, pose = "mesh", mesh.scale, pose @ mesh.T_ref
                    file = self.source.refer(self.source.folders[0], mesh.file)
            elif number == int(kinds.mjGEOM_BOX):
                kind, size = "box", (2.0 * a, 2.0 * b, 2.0 * c)
            elif number == int(kinds.mjGEOM_SPHERE):
                kind, size = "sphere", (a, 0.0, 0.0)
            elif number == int(kinds.mjGEOM_ELLIPSOID):
                kind, size = "ellipsoid", (a, b, c)
            elif number in (int(kinds.mjGEOM_CYLINDER), int(kinds.mjGEOM_CAPSULE)):
                kind = "cylinder" if number == int(kinds.mjGEOM_CYLINDER) else "capsule"
                size = (a, 2.0 * b, 0.0)
            if kind:
                x, y, z = (round(v, _DECIMALS) for v in size)
                look = self._look(g)
                if look.texture and kind != "mesh" and self._is_repeated(g):
                    self.remarks[
                        "repetition of an image (it is wrapped once around its shape)"
                    ] += 1
                yield g, robot_description.Shape(kind, file, (x, y, z), pose, look)
            else:
                self.remarks[f"{kinds(number).name.removeprefix('mjGEOM_').lower()} geom"] += 1

    def _is_repeated(self, geom: int) -> bool:
        """Whether the material of a geom repeats its image."""
        number = int(self.model.geom_matid[geom])
        once = self.model.mat_texrepeat[number] == 1.0
        return bool(self.model.mat_texuniform[number]) or not once.all()

    def _look(self, geom: int) -> robot_description.Look:
        """Colour and image of a geom, as MuJoCo's viewer shows them."""
        model = self.model
        rgba = tuple(round(float(v), 6) for v in model.geom_rgba[geom])
        number = int(model.geom_matid[geom])
        name, texture = "", ""
        look = robot_description.Look(whole=True)
        if number >= 0:
            name = model.mat(number).name
            texture = self.source.images.get(name, "")
            if texture:
                texture = self.source.refer(self.source.folders[1], texture)
            if rgba == _PLAIN:
                rgba = tuple(round(float(v), 6) for v in model.mat_rgba[number])
            if name in self.source.colors:
                tint = self.source.colors[name]
                rgba = (*(a * b for a, b in zip(tint, rgba, strict=False)), rgba[3])
            rough, metal = float(model.mat_roughness[number]), float(model.mat_metallic[number])
            # Negative: not given.
            look = replace(look, roughness=round(rough, 6) if rough >= 0.0 else None)
            look = replace(look, metallic=round(metal, 6) if metal >= 0.0 else None)
        red, green, blue, alpha = rgba
        return replace(look, name=name, color=(red, green, blue), opacity=alpha, texture=texture)


_X: Vec3 = (1.0, 0.0, 0.0)
_DECIMALS = 9


def _plain(name: str) -> str:
    """A name without the slash that separates a link from its robot in ids."""
    return name.replace("/", "_")


def _vec3(values: Any) -> Vec3:
    x, y, z = (float(v) for v in values)
    return (x, y, z)


def _pose(position_m: Any, quaternion_wxyz: Any) -> SE3:
    w, x, y, z = (float(v) for v in quaternion_wxyz)
    return SE3(_vec3(position_m), (w, x, y, z))
