"""STL, binary and ASCII (3D Systems, "StereoLithography Interface Specification", 1989)."""

import numpy as np

from gen_data.assets.asset_folder import Folder
from gen_data.assets.readers.mesh_source import WHITE, MeshSource, check_face_count
from gen_data.assets.triangle_soup import Float64, MaterialSlot, TriangleSoup
from gen_data.core.colorimetry import srgb_decode
from gen_data.core.errors import AssetError

_HEADER_BYTES = 84
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_MAX_TRAILING_BYTES = 4096
"""More bytes after the last record of a binary file suggest that its count is false."""


def read_stl(folder: Folder, relative: str, materials: bool) -> MeshSource:
    """Read an STL file; its redundant facet normals are ignored.

    Raises:
        AssetError: if the file is neither a complete binary nor an ASCII STL.
    """
    data = folder.read(relative)
    place = str(folder.root / relative)
    # Binary files may also begin with "solid"; only the size is decisive.
    count = int.from_bytes(data[80:_HEADER_BYTES], "little")
    end = _HEADER_BYTES + _RECORD.itemsize * count
    text = data.removeprefix(b"\xef\xbb\xbf").lstrip()
    is_ascii = text[:5].lower() == b"solid" and b"facet" in text[:1024].lower()
    trailing = len(data) - end
    if len(data) >= _HEADER_BYTES and (
        trailing == 0 or (0 < trailing <= _MAX_TRAILING_BYTES and count and not is_ascii)
    ):
        check_face_count(count, place)
        records = np.frombuffer(data, _RECORD, count, _HEADER_BYTES)
        remarks = (f"{trailing} bytes after its last facet are not read",) if trailing else ()
        soup = TriangleSoup.of(records["corners"].astype(np.float64))
        colors = _read_colors(data[:80], records["attribute"]) if materials else None
        if colors is not None:
            slot = MaterialSlot(material=WHITE, from_file=True)
            soup = TriangleSoup.of(soup.corners, slot, np.repeat(colors[:, None], 3, axis=1))
        return MeshSource(soup, {}, remarks)
    if not is_ascii and text[:5].lower() != b"solid":
        raise AssetError(f"{place}: neither a complete binary nor an ASCII STL; export it again")
    return MeshSource(TriangleSoup.of(_parse_ascii(text, place)))


def _parse_ascii(data: bytes, place: str) -> Float64:
    """Corners [m, 3, 3]. Raises AssetError if a facet is incomplete or ``endsolid`` is missing."""
    rows: list[list[float]] = []
    facets, solids = 0, 0
    for number, line in enumerate(data.lower().replace(b"\r", b"\n").split(b"\n"), start=1):
        words = line.split()
        if not words:
            continue
        try:
            if words[0] == b"vertex":
                rows.append([float(word) for word in words[1:4]])
                if len(rows[-1]) != 3:
                    raise ValueError("a vertex without three numbers")
            elif words[0] == b"facet":
                facets += 1
            elif words[0] in (b"endfacet", b"endloop", b"endsolid") and len(rows) != 3 * facets:
                raise ValueError("a facet without three vertices")
            solids += (words[0] == b"solid") - (words[0] == b"endsolid")
        except ValueError as error:
            raise AssetError(
                f"{place}:{number}: malformed STL ({error}); export it again"
            ) from None
    if len(rows) != 3 * facets or solids > 0:
        raise AssetError(f"{place}: cut off: 'endsolid' is missing; export it again")
    return np.array(rows, dtype=np.float64).reshape(-1, 3, 3)


def _read_colors(header: bytes, attribute: np.ndarray) -> Float64 | None:
    """Linear RGB [m, 3] of facets; None if the file has none.

    Source: the two conventions in use, 15 bits in the attribute. VisCAM and SolidView: bit 15 marks
    a valid colour, red in the highest five bits. Magics, which writes ``COLOR=`` to the header: bit
    15 unset marks a valid colour, red in the lowest bits; other facets have the header's colour.
    """
    at = header.find(b"COLOR=")
    magics = 0 <= at <= 70
    valid = (attribute & 0x8000 == 0) if magics else (attribute & 0x8000 != 0)
    if not magics and not valid.any():
        return None
    bits = [(attribute >> shift & 31).astype(np.float64) / 31.0 for shift in (0, 5, 10)]
    srgb = np.stack(bits if magics else bits[::-1], axis=1)
    whole = np.frombuffer(header, np.uint8, 3, at + 6) / 255.0 if magics else np.full(3, 0.8)
    colors: Float64 = srgb_decode(np.where(valid[:, None], srgb, whole))
    return colors
