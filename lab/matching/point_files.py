"""Points of laser scans in common files: positions [m] and intensities.

KITTI's ``.bin`` has four float32 a point (x, y, z, intensity), nuScenes' ``.pcd.bin`` five. PCD
(PCL, "The PCD file format") and PLY (Turk, 1994) state their columns; binary files must be little
endian and uncompressed.
"""

import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gen_data.core.se3 import Array

HEADER_MAX = 16_384
_PLY_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2",
    "ushort": "u2", "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
_INTENSITIES = ("intensity", "reflectance", "reflectivity", "i", "scalar_intensity")


def read_point_file(path: Path) -> Array:
    """Points as x, y, z [m] and intensity as written, float64 [n, 4].

    Raises:
        ValueError: it has another layout; the text states the fact.
        OSError: it cannot be read.
    """
    data = path.read_bytes()
    if path.suffix == ".pcd":
        return _columns(_read_pcd(data))
    if path.suffix == ".ply":
        return _columns(_read_ply(data))
    width = 5 if path.name.endswith(".pcd.bin") else 4
    if len(data) % (4 * width):
        raise ValueError(f"{len(data)} bytes are not {width} float32 a point")
    return np.frombuffer(data, "<f4").reshape(-1, width)[:, :4].astype(np.float64)


def _read_pcd(data: bytes) -> NDArray[np.void]:
    words: dict[str, list[str]] = {}
    body = 0
    for line in data[:HEADER_MAX].splitlines(keepends=True):
        body += len(line)
        key, *rest = line.decode("ascii", "replace").split() or [""]
        words[key] = rest
        if key == "DATA":
            break
    else:
        raise ValueError("a PCD file without DATA")
    try:
        names, sizes, kinds = words["FIELDS"], words["SIZE"], words["TYPE"]
        counts, points = words.get("COUNT", ["1"] * len(names)), int(words["POINTS"][0])
    except (KeyError, IndexError):
        raise ValueError("a PCD file without FIELDS, SIZE, TYPE or POINTS") from None
    layout = np.dtype([
        (name, f"<{kind.lower()}{size}", (int(count),)) if count != "1"
        else (name, f"<{kind.lower()}{size}")
        for name, size, kind, count in zip(names, sizes, kinds, counts, strict=True)
    ])  # fmt: skip
    return _records(data[body:], layout, points, words["DATA"][0] == "ascii", words["DATA"][0])


def _read_ply(data: bytes) -> NDArray[np.void]:
    end = data.find(b"end_header", 0, HEADER_MAX)
    if not data.startswith(b"ply") or end < 0:
        raise ValueError("no header of PLY")
    body = data.index(b"\n", end) + 1
    lines = [line.split() for line in data[:end].decode("ascii", "replace").splitlines()]
    encoding = next((line[1] for line in lines if line[:1] == ["format"]), "")
    start = next((k for k, line in enumerate(lines) if line[:1] == ["element"]), None)
    if start is None or lines[start][1] != "vertex":
        raise ValueError("a PLY file that does not begin with vertices")
    fields = []
    for line in lines[start + 1 :]:
        if line[:1] == ["element"]:
            break
        if line[:1] == ["property"]:
            if line[1] not in _PLY_TYPES:
                raise ValueError(f"a PLY property of type {line[1]}")
            fields.append((line[2], f"<{_PLY_TYPES[line[1]]}"))
    points, text = int(lines[start][2]), encoding == "ascii"
    return _records(data[body:], np.dtype(fields), points, text, encoding)


def _records(
    body: bytes, layout: np.dtype[np.void], points: int, is_text: bool, encoding: str
) -> NDArray[np.void]:
    """Records of a body; ValueError if shorter than its header states, or encoded otherwise."""
    if is_text:
        table = np.loadtxt(io.BytesIO(body), max_rows=points, ndmin=2)
        records = np.zeros(len(table), layout)
        for column, name in enumerate(layout.names or ()):
            records[name] = table[:, column]
        return records
    if encoding not in ("binary", "binary_little_endian"):
        raise ValueError(f"encoded as {encoding}; expected ascii or little-endian binary")
    if len(body) < points * layout.itemsize:
        raise ValueError(f"shorter than its {points} points")
    return np.frombuffer(body, layout, count=points)


def _columns(records: NDArray[np.void]) -> Array:
    names = {name.lower(): name for name in records.dtype.names or ()}
    intensity = next((names[name] for name in _INTENSITIES if name in names), None)
    if not {"x", "y", "z"} <= names.keys() or intensity is None:
        raise ValueError(f"columns {', '.join(names)}; expected x, y, z and intensity")
    picked = [names["x"], names["y"], names["z"], intensity]
    return np.column_stack([records[name].astype(np.float64) for name in picked])
