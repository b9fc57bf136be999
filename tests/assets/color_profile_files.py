"""ICC profiles made of primaries, a gamma, or inks.

Source: ICC.1:2001-04 (version 2): header, tag table, types XYZ, curv, desc, text and mft1.
"""

import struct
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

D50 = np.array([0.9642, 1.0, 0.8249])
_BRADFORD = np.array(
    [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]]
)
DISPLAY_P3 = ((0.680, 0.320), (0.265, 0.690), (0.150, 0.060))
ADOBE_RGB = ((0.64, 0.33), (0.21, 0.71), (0.15, 0.06))
REC709 = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06))
D65 = (0.3127, 0.3290)


def rgb_profile(
    primaries: Sequence[tuple[float, float]], curve: NDArray[np.float64] | float
) -> bytes:
    """Profile of a display with white D65; ``curve`` is a gamma or samples of linear light."""
    columns = _adapted_primaries(primaries)
    tags = {f"{name}XYZ": _xyz(columns[:, k]) for k, name in enumerate("rgb")}
    tags |= {f"{name}TRC": _curve(curve) for name in "rgb"}
    return _profile(b"mntr", b"RGB ", b"XYZ ", tags)


def grey_profile(gamma: float) -> bytes:
    """Profile of grey images."""
    return _profile(b"mntr", b"GRAY", b"XYZ ", {"kTRC": _curve(gamma)})


def ink_profile(lab_of_inks: NDArray[np.float64]) -> bytes:
    """Profile of CMYK: CIELAB [2, 2, 2, 2, 3] of no and full ink, linear between them."""
    scaled = lab_of_inks * (2.55, 1.0, 1.0) + (0.0, 128.0, 128.0)
    table = np.rint(scaled).astype(np.uint8).tobytes()
    ramp = bytes(range(256))
    identity = struct.pack(">9i", *(65536 * int(k % 4 == 0) for k in range(9)))
    lut = b"mft1" + bytes(4) + bytes([4, 3, 2, 0]) + identity + ramp * 4 + table + ramp * 3
    return _profile(b"prtr", b"CMYK", b"Lab ", {f"A2B{k}": lut for k in range(3)})


def srgb_curve() -> NDArray[np.float64]:
    """Samples of IEC 61966-2-1's transfer function."""
    v = np.arange(1024) / 1023.0
    return np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)


def _adapted_primaries(primaries: Sequence[tuple[float, float]]) -> NDArray[np.float64]:
    """XYZ of full red, green and blue as columns, from white D65 to D50 by Bradford's transform."""
    whole = np.array([[x / y, 1.0, (1.0 - x - y) / y] for x, y in (*primaries, D65)]).T
    white = whole[:, 3]
    columns = whole[:, :3] * np.linalg.solve(whole[:, :3], white)
    gains = (_BRADFORD @ D50) / (_BRADFORD @ white)
    adapted: NDArray[np.float64] = np.linalg.solve(_BRADFORD, gains[:, None] * _BRADFORD) @ columns
    return adapted


def _xyz(values: NDArray[np.float64]) -> bytes:
    return b"XYZ " + bytes(4) + struct.pack(">3i", *(round(v * 65536) for v in values))


def _curve(curve: NDArray[np.float64] | float) -> bytes:
    samples = [round(curve * 256)] if isinstance(curve, float) else np.rint(curve * 65535).tolist()
    return b"curv" + struct.pack(f">4xI{len(samples)}H", len(samples), *map(int, samples))


def _profile(device: bytes, space: bytes, connection: bytes, tags: Mapping[str, bytes]) -> bytes:
    text = b"made by a test\0"
    tags = {
        "desc": b"desc" + struct.pack(">4xI", len(text)) + text + bytes(79),
        "cprt": b"text" + bytes(4) + text,
        "wtpt": _xyz(D50),
        **tags,
    }
    at, table, content = 128 + 4 + 12 * len(tags), struct.pack(">I", len(tags)), b""
    for name, data in tags.items():
        table += name.encode() + struct.pack(">II", at + len(content), len(data))
        content += data + bytes(-len(data) % 4)
    head = struct.pack(">I4sI4s4s4s", at + len(content), bytes(4), 0x02400000, device, space,
                       connection)  # fmt: skip
    date = struct.pack(">6H", 2026, 1, 1, 0, 0, 0)
    white = struct.pack(">3i", *(round(v * 65536) for v in D50))
    head += date + b"acsp" + bytes(28) + white
    return head.ljust(128, b"\0") + table + content
