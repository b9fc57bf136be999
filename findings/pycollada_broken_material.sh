#!/usr/bin/env bash
# Common guess: Collada(file, ignore=[DaeBrokenRefError]) of pycollada skips what is broken, and no more:
#   a mesh whose material names a missing surface keeps its triangles.
# What happens: the material is skipped; then the instance of the geometry that uses it fails to load,
#   and is skipped as a whole. The scene is empty, and nothing is raised.
# Why it matters: trimesh and yourdfpy read meshes of robots this way. The published anymal_foot.dae of
#   ANYmal B has such a material, so that the robot is drawn and measured without its feet.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q pycollada==0.9.3
"$work/venv/bin/python" - <<'PY'
import io

import collada
from collada.common import DaeBrokenRefError, DaeUnsupportedError

TEXT = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="1"/><up_axis>Z_UP</up_axis></asset>
<library_effects><effect id="e"><profile_COMMON>
<newparam sid="s"><surface type="2D"><init_from>i</init_from></surface></newparam>
<newparam sid="t"><sampler2D><source>%s</source></sampler2D></newparam>
<technique sid="common"><lambert><diffuse><color>1 0 0 1</color></diffuse></lambert></technique>
</profile_COMMON></effect></library_effects>
<library_images><image id="i"><init_from>i.png</init_from></image></library_images>
<library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="9">0 0 0 1 0 0 0 1 0</float_array><technique_common>
<accessor source="#a" count="3" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1" material="x"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p>
</triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="w"><node id="n"><instance_geometry url="#g">
<bind_material><technique_common><instance_material symbol="x" target="#m"/></technique_common>
</bind_material></instance_geometry></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#w"/></scene></COLLADA>"""


def read(surface: str) -> tuple[int, int, int]:
    data = io.BytesIO((TEXT % surface).encode())
    document = collada.Collada(data, ignore=[DaeBrokenRefError, DaeUnsupportedError])
    shown = len(list(document.scene.objects("geometry")))
    return len(document.materials), len(document.geometries), shown


print("pycollada", collada.__version__)
print("sampler names an existing surface (materials, geometries, instances):", read("s"))
print("sampler names a missing surface   (materials, geometries, instances):", read("none"))
assert read("s") == (1, 1, 1), read("s")
assert read("none") == (0, 1, 0), read("none")
PY
