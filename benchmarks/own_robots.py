"""Robots of users, read here and by an independent reader.

That is yourdfpy for URDF, MuJoCo for MJCF and Drake for SDF. Drake does not know Gazebo's sensors,
plug-ins, materials and parts of meshes: files with the former are compared without them.

    pip install yourdfpy drake trimesh
    python -m benchmarks.own_robots ROOT FILE...      # descriptions below an asset folder ROOT

prints, for each description, whether links, joint limits, colours and the bounding box at the
zero position agree. ``--python`` runs the independent readers in another environment, which needs
yourdfpy, mujoco or drake and trimesh, and numpy.
"""

import argparse
import json
import re
import subprocess
import sys
import warnings
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

ENDLESS = 1e3
TOLERANCE_M = 1e-4
"""Of edges of the bounding box; meshes are not decimated."""


def ours(root: Path, file: str) -> dict[str, Any]:
    """Facts of a description as this project reads it."""
    from gen_data.assets.asset_folder import Folder
    from gen_data.assets.robot_formats import read_description
    from gen_data.assets.robot_shapes import read_shape
    from gen_data.core.errors import AssetError

    folder = Folder(root)
    try:
        robot = read_description(folder, file)
        poses = robot.poses_at_zero()
        points = [
            read_shape(folder, shape, poses[link.name]).soup.corners.reshape(-1, 3)
            for link in robot.links.values()
            for shape in link.visuals
        ]
        for link in robot.links.values():
            for shape in link.collisions:
                read_shape(folder, shape, poses[link.name], materials=False)
    except AssetError as error:
        return {"error": str(error).replace(str(root), "")}
    colors = [
        [*(s.look.color or ()), *([s.look.opacity] if s.look.color else [])]
        for link in robot.links.values()
        for s in link.visuals
    ]
    joints = [j for j in robot.joints if j.movable]
    sited = [j for j in robot.joints if j.name.endswith("_site")]
    return {
        "links": len(robot.links) - {"xml": len(sited) + 1, "sdf": 1}.get(file[-3:], 0),
        "joints": {j.name: None if j.kind == "continuous" else [j.lower, j.upper] for j in joints},
        "colors": sorted(c for c in colors if c),
        "size_m": _size(points),
        "remarks": robot.remarks,
    }


def reference(root: Path, file: str) -> dict[str, Any]:
    """The same facts from an independent reader."""
    readers = {"xml": _mujoco, "sdf": _drake}
    try:
        return readers.get(file[-3:], _yourdfpy)(root / file)
    except Exception as error:
        return {"error": f"{type(error).__name__}: {str(error)[:200]}"}


def _yourdfpy(path: Path) -> dict[str, Any]:
    import yourdfpy

    robot = yourdfpy.URDF.load(str(path))
    robot.update_cfg(np.zeros(robot.num_actuated_joints))
    shared = {m.name: m for m in robot.robot.materials or []}
    colors = []
    for link in robot.robot.links:
        for visual in link.visuals:
            material = visual.material
            if material is not None and material.color is None:
                material = shared.get(material.name)
            if material is not None and material.color is not None:
                colors.append([float(v) for v in material.color.rgba])
    joints: dict[str, Any] = {}
    for joint in robot.robot.joints:
        if joint.type == "continuous":
            joints[joint.name] = None
        elif joint.type in ("revolute", "prismatic") and joint.limit is not None:
            limits = [joint.limit.lower or 0.0, joint.limit.upper or 0.0]
            # Such limits are none.
            joints[joint.name] = limits if max(map(abs, limits)) < ENDLESS else None
    return {
        "reader": f"yourdfpy {yourdfpy.__version__}",
        "links": len(robot.robot.links),
        "joints": joints,
        "colors": sorted(colors),
        "size_m": np.ptp(robot.scene.bounds, axis=0).round(5).tolist(),
    }


def _mujoco(path: Path) -> dict[str, Any]:
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    for j in range(model.njnt):
        if model.jnt_type[j] in (2, 3):
            data.qpos[model.jnt_qposadr[j]] = 0.0
    mujoco.mj_kinematics(model, data)
    points, colors = [], []
    for g in range(model.ngeom):
        body = model.geom_bodyid[g]
        seen = [k for k in range(model.ngeom) if model.geom_bodyid[k] == body
                and model.geom_group[k] < 3 and not model.geom_contype[k]
                and not model.geom_conaffinity[k]]  # fmt: skip
        groups = {int(model.geom_group[k]) for k in seen}
        if model.geom_group[g] > 2 or (groups and int(model.geom_group[g]) not in groups):
            continue
        rgba, material = model.geom_rgba[g], model.geom_matid[g]
        if material >= 0 and np.allclose(rgba, (0.5, 0.5, 0.5, 1.0)):
            rgba = model.mat_rgba[material]
        mesh, kind = model.geom_dataid[g], model.geom_type[g]
        if rgba[3] == 0.0 or kind < 2:
            continue
        colors.append([float(v) for v in rgba])
        if kind == 7:
            first = model.mesh_vertadr[mesh]
            corners = model.mesh_vert[first : first + model.mesh_vertnum[mesh]]
        else:
            half = np.array(model.geom_aabb[g][3:])
            corners = (
                np.array([(i, j, k) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]) * half
            )
            turn = data.geom_xmat[g].reshape(3, 3)
            if kind != 6:
                corners = _round_corners(kind, model.geom_size[g], turn)
        points.append(corners @ data.geom_xmat[g].reshape(3, 3).T + data.geom_xpos[g])
    joints = {
        model.joint(j).name: [float(v) for v in model.jnt_range[j]]
        if model.jnt_limited[j]
        else None
        for j in range(model.njnt)
        if model.jnt_type[j] in (2, 3)
    }
    return {
        "reader": f"mujoco {mujoco.__version__}",
        # A body with several joints is several links here.
        "links": model.nbody - 1 + sum(max(int(n) - 1, 0) for n in model.body_jntnum),
        "joints": joints,
        "colors": sorted(colors),
        "size_m": _size(points),
    }


def _drake_corners(shape: Any) -> Any:
    """Corners [n, 3] of a shape of Drake."""
    import trimesh
    from pydrake.geometry import Box, Cylinder, Mesh, Sphere

    if isinstance(shape, Mesh):
        mesh = trimesh.load(str(shape.source().path()), process=False, force="mesh")
        corners = mesh.vertices[np.unique(mesh.faces)] * shape.scale3()
        upright = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
        return corners @ upright if shape.extension() in (".gltf", ".glb") else corners
    if isinstance(shape, Box):
        return trimesh.creation.box(shape.size()).vertices
    if isinstance(shape, Cylinder):
        return trimesh.creation.cylinder(shape.radius(), shape.length(), 720).vertices
    if isinstance(shape, Sphere):
        return trimesh.creation.icosphere(5, shape.radius()).vertices
    raise ValueError(f"no corners of {type(shape).__name__}")


def _drake(path: Path) -> dict[str, Any]:
    from pydrake.geometry import Role
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
    from pydrake.multibody.tree import BodyIndex
    from pydrake.systems.framework import DiagramBuilder

    builder = DiagramBuilder()
    plant, graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    parser = Parser(plant, graph)
    packages = parser.package_map()
    packages.Remove("drake_models")
    named = (p for p in path.parents if (p / "package.xml").exists())
    packages.Add("drake_models", str(next(named, path.parent)))
    for folder in (f for p in path.parents[:3] for f in p.iterdir() if f.is_dir()):
        if not packages.Contains(folder.name):
            packages.Add(folder.name, str(folder))
    pattern = r"<(sensor|plugin|collision|light)\b[^>]*?(/>|>.*?</\1>)"
    bare = path.with_name("stripped.sdf")
    bare.write_text(re.sub(pattern, "", path.read_text(), flags=re.DOTALL))
    try:
        parser.AddModels(str(bare))
    finally:
        bare.unlink()
    plant.Finalize()
    context = plant.GetMyContextFromRoot(builder.Build().CreateDefaultContext())
    joints: dict[str, Any] = {}
    for joint in (plant.get_joint(k) for k in plant.GetJointIndices()):
        if joint.type_name() in ("revolute", "prismatic"):
            turn = joint.type_name() == "revolute"
            (joint.set_angle if turn else joint.set_translation)(context, 0.0)
            limits = [*joint.position_lower_limits(), *joint.position_upper_limits()]
            joints[joint.name()] = limits if max(map(abs, limits)) < ENDLESS else None
    scene, points, colors = graph.model_inspector(), [], []
    for body in (plant.get_body(BodyIndex(k)) for k in range(1, plant.num_bodies())):
        frame = plant.GetBodyFrameIdOrThrow(body.index())
        T_world_body = plant.EvalBodyPoseInWorld(context, body)
        for geometry in scene.GetGeometries(frame, Role.kIllustration):
            shape, look = scene.GetShape(geometry), scene.GetIllustrationProperties(geometry)
            if look.HasProperty("phong", "diffuse"):
                rgba = look.GetProperty("phong", "diffuse").rgba
                colors.append([float(v) for v in rgba])
            corners = _drake_corners(shape)
            T_world_shape = T_world_body @ scene.GetPoseInFrame(geometry)
            points.append((T_world_shape @ corners.T).T)
    return {
        "reader": f"drake {version('drake')}",
        "links": plant.num_bodies() - 1,
        "joints": joints,
        "colors": sorted(colors),
        "size_m": _size(points),
    }


def _round_corners(kind: int, size: Any, turn: Any) -> Any:
    """Extreme points of a sphere, capsule, ellipsoid or cylinder along the axes of the world."""
    axes = np.concatenate([np.eye(3), -np.eye(3)]) @ turn
    if kind == 2:
        return axes * size[0]
    if kind == 4:
        scaled = axes * size
        return size * scaled / np.linalg.norm(scaled, axis=1, keepdims=True)
    ends = np.sign(axes[:, 2:]) * np.array([[0.0, 0.0, size[1]]])
    if kind == 3:
        return axes * size[0] + ends
    flat = axes * (1.0, 1.0, 0.0)
    length = np.linalg.norm(flat, axis=1, keepdims=True)
    return size[0] * flat / np.where(length > 1e-12, length, 1.0) + ends


def _size(points: list[Any]) -> list[float]:
    return np.ptp(np.concatenate(points), axis=0).round(5).tolist() if points else [0.0] * 3


def compare(mine: dict[str, Any], other: dict[str, Any]) -> dict[str, str]:
    """Words for what agrees and what differs."""
    if "error" in mine or "error" in other:
        return {"error": f"here: {mine.get('error', 'read')}; other: {other.get('error', 'read')}"}
    joints = other["joints"]
    wrong = [
        name
        for name in {*mine["joints"], *joints}
        if name not in mine["joints"]
        or name not in joints
        or (mine["joints"][name] is None) != (joints[name] is None)
        or (
            joints[name] is not None
            and not np.allclose(mine["joints"][name], joints[name], atol=1e-6)
        )
    ]
    size = np.abs(np.array(mine["size_m"]) - other["size_m"]).max()
    colors = len(mine["colors"]) == len(other["colors"]) and np.allclose(
        np.array(mine["colors"]), np.array(other["colors"]), atol=1e-4
    )
    pairs = {
        "links": (mine["links"], other["links"], mine["links"] == other["links"]),
        "limits": (f"differ: {', '.join(sorted(wrong)[:4])}", len(joints), not wrong),
        "colours": (len(mine["colors"]), len(other["colors"]), colors),
        "size": (mine["size_m"], other["size_m"], size <= TOLERANCE_M),
    }
    return {
        name: f"{theirs} equal" if equal else f"{own}; {theirs}"
        for name, (own, theirs, equal) in pairs.items()
    }


def main() -> None:
    """Compare descriptions and print one row of a table for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("root", type=Path)
    parser.add_argument("files", nargs="+")
    parser.add_argument("--python", default=sys.executable, help="interpreter with the readers")
    parser.add_argument("--reference", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.reference:
        warnings.simplefilter("ignore")
        print(json.dumps(reference(given.root, given.files[0])))
        return
    print("| file | size at zero [m] | links | joint limits | colours | bounding box | remarks |")
    print("|---|---|---|---|---|---|---|")
    for file in given.files:
        command = [given.python, __file__, "--reference", str(given.root), file]
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        lines = done.stdout.strip().splitlines() or ['{"error": "no answer"}']
        mine, other = ours(given.root, file), json.loads(lines[-1])
        found = compare(mine, other)
        size = " x ".join(f"{v:.3f}" for v in mine.get("size_m", [])) or "-"
        words = " | ".join(found.values())
        print(f"| {file} | {size} | {words} | {'; '.join(mine.get('remarks', ()))} |", flush=True)


if __name__ == "__main__":
    main()
