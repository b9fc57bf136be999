#!/usr/bin/env bash
# Common guess: a URDF has one geometry, whoever reads it: frames have Z up (REP 103), and a mesh is placed
#   as its file has it.
# What happens: glTF files have Y up. Drake (as RViz since 2025, ros2/rviz pull request 1482) turns Y of the
#   mesh to Z of the link; yourdfpy, which reads by trimesh, places the coordinates of the file unturned.
# Why it matters: the published glTF robots of RobotLocomotion/models (Panda, iiwa, Allegro, UR3e) are drawn
#   with every link lying on its side by the one, and upright by the other; no reader warns.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q drake==1.51.1 yourdfpy==0.0.60 trimesh==5.2.0
cd "$work"
"$work/venv/bin/python" - <<'PY'
from importlib.metadata import version

import numpy as np
import trimesh
import yourdfpy
from pydrake.geometry import GeometrySet, Role
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

# A box of 1 x 2 x 3 m in the axes of the glTF file: 2 m high, because Y is up there.
trimesh.creation.box((1.0, 2.0, 3.0)).export("box.gltf", embed_buffers=True)
mesh = '<geometry><mesh filename="box.gltf"/></geometry>'
open("a.urdf", "w").write(f'<robot name="r"><link name="a"><visual>{mesh}</visual></link></robot>')

unturned = np.ptp(yourdfpy.URDF.load("a.urdf").scene.bounds, axis=0)

builder = DiagramBuilder()
plant, graph = AddMultibodyPlantSceneGraph(builder, 0.0)
Parser(plant, graph).AddModels("a.urdf")
plant.Finalize()
inspector = graph.model_inspector()
shapes = GeometrySet(inspector.GetAllGeometryIds())
(geometry,) = inspector.GetGeometryIds(shapes, Role.kIllustration)
corners = inspector.GetObbInGeometryFrame(geometry)
turn, half = corners.pose().rotation().matrix(), np.asarray(corners.half_width())
turned = 2.0 * np.abs(turn) @ half

print("yourdfpy", version("yourdfpy"), "size of the link [m]:", unturned.round(3))
print("drake", version("drake"), "size of the link [m]:", turned.round(3))
assert np.allclose(unturned, (1.0, 2.0, 3.0)), unturned
assert np.allclose(turned, (1.0, 3.0, 2.0)), turned
PY
