"""STL, binary and ASCII (3D Systems, "StereoLithography Interface Specification", 1989)."""

from __future__ import annotations

import numpy as np

from gen_data.generator.assets.asset_folder import Folder
from gen_data.generator.assets.readers.mesh_source import MeshSource, check_face_count
from gen_data.generator.assets.triangle_soup import Float64, TriangleSoup
from gen_data.generator.core.errors import AssetError

_HEADER_BYTES = 84
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read_stl(folder: Folder, relative: str, _materials: bool) -> MeshSource:
    """Read an STL file; its redundant facet normals are ignored.

    Raises:
        AssetError: if the file is neither a complete binary nor an ASCII STL.
    """
    data = folder.read(relative)
    # Binary files may also begin with "solid"; only the size is decisive.
    count = int.from_bytes(data[80:_HEADER_BYTES], "little")
    if len(data) >= _HEADER_BYTES and len(data) == _HEADER_BYTES + _RECORD.itemsize * count:
        check_face_count(count, str(folder.root / relative))
        records = np.frombuffer(data, dtype=_RECORD, offset=_HEADER_BYTES)
        return MeshSource(TriangleSoup.of(records["corners"].astype(np.float64)))
    corners = _parse_ascii(data) if data.lstrip()[:5].lower() == b"solid" else None
    if corners is None:
        raise AssetError(
            f"{folder.root / relative}: neither a complete binary nor an ASCII STL; export it again"
        )
    return MeshSource(TriangleSoup.of(corners))


def _parse_ascii(data: bytes) -> Float64 | None:
    words = [line.split() for line in data.lower().split(b"\n")]
    try:
        rows = [[float(x) for x in w[1:4]] for w in words if w and w[0] == b"vertex"]
        return np.array(rows, dtype=np.float64).reshape(-1, 3, 3)
    except ValueError:
        return None
