"""A glTF document of one triangle, to which tests add the data that they read back."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from gen_data.assets.asset_folder import Folder
from gen_data.assets.readers import MeshSource, read_mesh

POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4")
UVS = np.array([[0.0, 0.0], [0.25, 0.0], [0.0, 0.5]], "<f4")
_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
_COMPONENTS = {"f4": 5126, "u1": 5121, "u2": 5123}


class Builder:
    """A glTF document of one triangle, with its buffer next to it."""

    def __init__(self, points: NDArray[Any] = POINTS) -> None:
        self.data = b""
        self.tree: dict[str, Any] = {
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}], "bufferViews": [], "accessors": [],
        }  # fmt: skip
        self.attributes = {"POSITION": self.accessor(points)}
        self.primitive: dict[str, Any] = {"attributes": self.attributes}
        self.tree["meshes"] = [{"primitives": [self.primitive]}]

    def view(self, values: NDArray[Any]) -> int:
        self.data += b"\0" * (-len(self.data) % 4)
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": values.nbytes}
        self.data += values.tobytes()
        self.tree["bufferViews"].append(view)
        return len(self.tree["bufferViews"]) - 1

    def accessor(self, values: NDArray[Any], **more: Any) -> int:
        width = values.shape[1] if values.ndim == 2 else 1
        self.tree["accessors"].append(
            {"bufferView": self.view(values), "componentType": _COMPONENTS[values.dtype.str[1:]],
             "count": len(values), "type": _TYPES[width], **more}
        )  # fmt: skip
        return len(self.tree["accessors"]) - 1

    def textured(self, folder: Path, **reference: Any) -> dict[str, Any]:
        """Add a material with a separate image; returns it."""
        Image.new("RGB", (2, 2), (200, 0, 0)).save(folder / "i.png")
        self.tree |= {"images": [{"uri": "i.png"}], "textures": [{"source": 0}]}
        pbr = {"baseColorTexture": {"index": 0, **reference}, "metallicFactor": 0}
        return self.material(pbrMetallicRoughness=pbr)

    def material(self, **content: Any) -> dict[str, Any]:
        self.tree["materials"] = [{"name": "m", **content}]
        self.primitive["material"] = 0
        return self.tree["materials"][0]

    def read(self, folder: Path) -> MeshSource:
        self.write(folder)
        return read_mesh(Folder(folder), "a.gltf")

    def write(self, folder: Path, name: str = "a") -> None:
        self.tree["buffers"] = [{"byteLength": len(self.data), "uri": f"{name}.bin"}]
        (folder / f"{name}.bin").write_bytes(self.data)
        (folder / f"{name}.gltf").write_text(json.dumps(self.tree))

    def glb(self, buffers: int = 1) -> bytes:
        """The same as a binary glTF file; of several buffers, its chunk is the first."""
        self.tree["buffers"] = [{"byteLength": len(self.data)}] * buffers
        text, data = json.dumps(self.tree).encode(), self.data + b"\0" * (-len(self.data) % 4)
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
        chunks += struct.pack("<II", len(data), 0x004E4942) + data
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
