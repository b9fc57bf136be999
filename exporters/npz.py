"""Compressed NumPy archives with the same bytes on every machine.

``numpy.savez_compressed`` uses zlib, whose output depends on its build. Sources: PKWARE,
APPNOTE.TXT 6.3.10, sections 4.3.7, 4.3.12 and 4.3.16; ``numpy.lib.format``.
"""

import struct
from collections.abc import Mapping
from io import BytesIO
from typing import Any

import deflate
import numpy as np
from numpy.typing import NDArray

_VERSION, _NO_FLAGS, _DEFLATED = 20, 0, 8
_MIDNIGHT, _FIRST_OF_JANUARY_1980 = 0, 0x21


def npz_bytes(arrays: Mapping[str, NDArray[Any]], level: int) -> bytes:
    """Encode arrays by name as an ``.npz`` file, in the given order.

    Args:
        arrays: At most 65535 arrays of less than 4 GiB; no objects.
        level: libdeflate's compression level, 0 (none), 1 (fastest) to 12.
    """
    parts: list[bytes] = []
    directory: list[bytes] = []
    offset = 0
    for name, array in arrays.items():
        data = npy_bytes(array)
        packed = bytes(deflate.deflate_compress(data, level))
        file_name = f"{name}.npy".encode("ascii")
        common = struct.pack(
            "<HHHHHIIIHH",
            _VERSION, _NO_FLAGS, _DEFLATED, _MIDNIGHT, _FIRST_OF_JANUARY_1980,
            deflate.crc32(data), len(packed), len(data), len(file_name), 0,
        )  # fmt: skip
        place = struct.pack("<HHHII", 0, 0, 0, 0, offset)
        made_by = struct.pack("<H", _VERSION)
        directory.append(b"PK\x01\x02" + made_by + common + place + file_name)
        parts.append(b"PK\x03\x04" + common + file_name + packed)
        offset += len(parts[-1])
    listing = b"".join(directory)
    end = struct.pack("<HHHHIIH", 0, 0, len(parts), len(parts), len(listing), offset, 0)
    return b"".join([*parts, listing, b"PK\x05\x06", end])


def npy_bytes(array: NDArray[Any]) -> bytes:
    """Encode an array, or rows, as a NumPy file, version 1."""
    file = BytesIO()
    np.lib.format.write_array(file, array, version=(1, 0), allow_pickle=False)
    return file.getvalue()
