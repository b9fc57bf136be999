#!/usr/bin/env bash
# Common guess: a GLB has Y up and metres, as glTF 2.0 states (3.4); a converter from STEP, whose CAD programs
#   have Z up, turns Z to Y, or puts a rotation on the root node.
# Behaviour: cascadio converts millimetres to metres and sRGB to linear colours, but keeps the axes: the
#   height of a part is along Z of the GLB, and no node turns it.
# Why it matters: a viewer, or an importer that turns every glTF from Y up, shows the part lying on its back, and
#   labels have two of its three sizes exchanged; a reader must treat these GLB files unlike all others.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q cascadio==0.1.1 numpy==2.4.6
cd "$work"
"$work/venv/bin/python" - <<'PY'
import json
import struct
from importlib.metadata import version

import cascadio

# A wall, 10 mm wide along X and 30 mm high along Z: one face between four edges.
rows = [
    "(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))",
    "(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))",
    "(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())",
    "UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-07),#1,'','')",
    "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#4))"
    "GLOBAL_UNIT_ASSIGNED_CONTEXT((#1,#2,#3))REPRESENTATION_CONTEXT('',''))",
]


def add(text):
    rows.append(text)
    return f"#{len(rows)}"


def three(entity, values):
    return add(f"{entity}('',({','.join(f'{v:.6E}' for v in values)}))")


corners = [(0, 0, 0), (10, 0, 0), (10, 0, 30), (0, 0, 30)]
vertices = [add(f"VERTEX_POINT('',{three('CARTESIAN_POINT', c)})") for c in corners]
edges = []
for k, a in enumerate(corners):
    b = corners[(k + 1) % 4]
    along = three("DIRECTION", [y - x for x, y in zip(a, b)])
    line = add(f"LINE('',{three('CARTESIAN_POINT', a)},{add(f'''VECTOR('',{along},1.)''')})")
    curve = add(f"EDGE_CURVE('',{vertices[k]},{vertices[(k + 1) % 4]},{line},.T.)")
    edges.append(add(f"ORIENTED_EDGE('',*,*,{curve},.T.)"))
bound = add(f"FACE_OUTER_BOUND('',{add(f'''EDGE_LOOP('',({','.join(edges)}))''')},.T.)")
origin, z, x = three("CARTESIAN_POINT", (0, 0, 0)), (0, 0, 1), three("DIRECTION", (1, 0, 0))
plane = add(f"PLANE('',{add(f'''AXIS2_PLACEMENT_3D('',{origin},{three('DIRECTION', (0, -1, 0))},{x})''')})")
shell = add(f"OPEN_SHELL('',({add(f'''ADVANCED_FACE('',({bound}),{plane},.T.)''')}))")
surface = add(f"SHELL_BASED_SURFACE_MODEL('',({shell}))")
frame = add(f"AXIS2_PLACEMENT_3D('',{origin},{three('DIRECTION', z)},{x})")
shape = add(f"MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',({frame},{surface}),#5)")
field = add("APPLICATION_CONTEXT('automotive design')")
part = add(f"PRODUCT('wall','wall','',({add(f'''PRODUCT_CONTEXT('',{field},'mechanical')''')}))")
edition = add(f"PRODUCT_DEFINITION_FORMATION('','',{part})")
context = add(f"PRODUCT_DEFINITION_CONTEXT('part definition',{field},'design')")
defined = add(f"PRODUCT_DEFINITION('design','',{edition},{context})")
add(f"SHAPE_DEFINITION_REPRESENTATION({add(f'''PRODUCT_DEFINITION_SHAPE('','',{defined})''')},{shape})")
body = "".join(f"#{k}={row};\n" for k, row in enumerate(rows, 1))
with open("wall.step", "w") as file:
    file.write(
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n"
        f"FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\nENDSEC;\nDATA;\n{body}ENDSEC;\nEND-ISO-10303-21;\n"
    )

cascadio.step_to_glb("wall.step", "wall.glb")
data = open("wall.glb", "rb").read()
(length,) = struct.unpack("<I", data[12:16])
tree = json.loads(data[20 : 20 + length])
accessor = tree["meshes"][0]["primitives"][0]["attributes"]["POSITION"]
low, high = (tree["accessors"][accessor][key] for key in ("min", "max"))
size = [round(b - a, 6) for a, b in zip(low, high)]
turned = [node for node in tree["nodes"] if node.keys() & {"rotation", "matrix"}]
print("cascadio", version("cascadio"), "size in the GLB [m]:", size, "turned nodes:", turned)
assert size == [0.01, 0.0, 0.03], size
assert not turned, turned
print("as described")
PY
