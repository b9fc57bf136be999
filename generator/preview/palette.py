"""Colour maps for depth, positions, flow and fractions."""

import numpy as np
from numpy.typing import NDArray


def color_depth(z_depth_m: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Convert a depth image [h, w] to grey, near = bright, uint8 [h, w, 3]; black = nothing."""
    seen = np.isfinite(z_depth_m)
    grey = np.zeros(z_depth_m.shape, np.uint8)
    if seen.any():
        near, far = depth_ends(z_depth_m)
        scale = (far - z_depth_m[seen]) / max(float(far - near), 1e-6)
        grey[seen] = np.clip(40 + 215 * scale, 40, 255).astype(np.uint8)
    return np.repeat(grey[..., None], 3, axis=2)


def depth_ends(z_depth_m: NDArray[np.floating]) -> tuple[np.floating, np.floating]:
    """Depths [m] of the brightest and of the darkest grey: 1st and 99th percentile of the image.

    It shows something: at least one value is finite.
    """
    near, far = np.quantile(z_depth_m[np.isfinite(z_depth_m)], [0.01, 0.99])
    return near, far


def grey_infrared(infrared: NDArray[np.uint16]) -> NDArray[np.uint8]:
    """Convert an infrared image [h, w] to grey with gamma 2.2, uint8 [h, w, 3]; 1 % saturates."""
    white = max(float(np.quantile(infrared, 0.99)), 1.0)
    grey = np.round(255.0 * np.clip(infrared / white, 0.0, 1.0) ** (1.0 / 2.2)).astype(np.uint8)
    return np.repeat(grey[..., None], 3, axis=2)


def color_flow(flow_px: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Colour a flow image [h, w, 2] by the flow colour wheel, uint8 [h, w, 3]; black = none.

    The hue is the direction, red to the right and yellow downwards; the saturation is the length,
    full at the 99th percentile (at least 1 px), and darker beyond.
    Source: Baker et al., "A database and evaluation methodology for optical flow", IJCV 92, 2011.
    """
    u, v = (flow_px[..., k].astype(np.float64) for k in (0, 1))
    known = np.isfinite(u) & np.isfinite(v)
    u, v = np.where(known, u, 0.0), np.where(known, v, 0.0)
    length = np.sqrt(u * u + v * v)
    longest = max(float(np.quantile(length[known], 0.99)) if known.any() else 0.0, 1.0)
    share = (length / longest)[..., None]
    wheel = _flow_wheel()
    place = (np.arctan2(-v, -u) / np.pi + 1.0) * 0.5 * (len(wheel) - 1)
    first = np.floor(place).astype(np.int64)
    part = (place - first)[..., None]
    hue = (1.0 - part) * wheel[first] + part * wheel[(first + 1) % len(wheel)]
    color = np.where(share <= 1.0, 1.0 - share * (1.0 - hue), 0.75 * hue)
    return np.asarray(np.where(known[..., None], np.floor(255.0 * color), 0.0), np.uint8)


def _flow_wheel() -> NDArray[np.float64]:
    """Hues from red through yellow, green, cyan, blue and magenta, spaced by discernibility."""
    ends = np.array([[1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1], [1, 0, 1]], float)
    counts = (15, 6, 4, 11, 13, 6)
    ramps = [
        one + (other - one) * (np.arange(n) / n)[:, None]
        for one, other, n in zip(ends, np.roll(ends, -1, axis=0), counts, strict=True)
    ]
    return np.concatenate(ramps)


def color_shares(shares: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Colour fractions [n] from blue (0) through green to red (1), clipped, uint8 [n, 3].

    The hue runs from 240 degrees to 0 at full saturation.
    """
    hue = 4.0 * (1.0 - np.clip(shares, 0.0, 1.0).astype(np.float64))
    ramps = [np.abs(hue - 3.0) - 1.0, 2.0 - np.abs(hue - 2.0), 2.0 - np.abs(hue - 4.0)]
    return np.asarray(np.round(255.0 * np.clip(np.stack(ramps, -1), 0, 1)), np.uint8)
