"""Lookup tables of the directional albedo of GGX lobes."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from gen_data.core.asset_types import Float32

_ENTRIES = 32
_STRATA = 24


@cache
def lobe_albedo() -> Float32:
    """Factors on F0 and F90 by roughness and cosine to the viewer, shape [32, 32, 2].

    Entry ``[i, j]`` is for roughness ``i / 31`` and cosine ``j / 31``; together the two factors
    are the directional albedo of a perfect mirror, single scattering only.

    Source: the split sum of Karis, "Real shading in Unreal Engine 4", 2013, over stratified
    half vectors of GGX, with the masking of
    ``gen_data.renderers.warp.scene.kernels.brdf``.
    """
    # Roughness 0 and grazing view are limits without a defined value.
    nodes = np.clip(np.arange(_ENTRIES) / (_ENTRIES - 1.0), 1e-3, 1.0)
    # Row by row: the intermediate arrays stay in the processor's caches.
    return np.stack([_lobe_row(roughness, nodes) for roughness in nodes.tolist()])


def _lobe_row(roughness: float, cosines: NDArray[np.float64]) -> Float32:
    """Factors of ``lobe_albedo`` for one roughness, shape [n, 2], by cosines [n]."""
    n_v = cosines[:, None]
    strata = (np.arange(_STRATA) + 0.5) / _STRATA
    u1, u2 = (axis.reshape(1, -1) for axis in np.meshgrid(strata, strata, indexing="ij"))
    alpha = roughness**2
    n_h = np.sqrt((1.0 - u1) / (1.0 + (alpha**2 - 1.0) * u1))
    along = np.sqrt(1.0 - n_h**2) * np.cos(np.pi * u2)
    v_h = np.sqrt(1.0 - n_v**2) * along + n_v * n_h
    n_l = 2.0 * v_h * n_h - n_v
    reflected = (n_l > 0.0) & (v_h > 0.0)
    masking = 2.0 * n_l * n_v * (1.0 - alpha) + (n_l + n_v) * alpha
    weight = np.where(reflected, 2.0 * n_l * v_h / np.where(reflected, masking * n_h, 1.0), 0.0)
    fresnel = np.clip(1.0 - v_h, 0.0, 1.0) ** 5
    factors = np.stack([weight * (1.0 - fresnel), weight * fresnel], axis=-1).mean(axis=1)
    return np.asarray(factors.astype(np.float32))


@cache
def smith_albedo() -> Float32:
    """As ``lobe_albedo``, finer, with Smith's exact height-correlated masking: [64, 64, 2].

    Source: sampling of visible normals by Dupuy and Benyoub, "Sampling visible GGX normals with
    spherical caps", HPG 2023, whose weight is the masking alone.
    """
    nodes = np.clip(np.arange(64) / 63.0, 1e-3, 1.0)
    strata = (np.arange(32) + 0.5) / 32.0
    u1, rest = (axis.reshape(1, -1) for axis in np.meshgrid(strata, strata, indexing="ij"))
    # Denser towards the few steep facets, whose light is lost.
    u2, share = 1.0 - rest**3, rest**2 / (rest**2).mean()
    n_v = nodes[:, None]
    table = np.zeros((64, 64, 2), np.float32)
    for row, roughness in enumerate(np.clip(nodes, 0.045, 1.0)):
        alpha = roughness**2
        # The viewer lies in the plane of X and Z.
        x, z = alpha * np.sqrt(1.0 - n_v**2), n_v
        x, z = x / np.hypot(x, z), z / np.hypot(x, z)
        up = (1.0 - u2) * (1.0 + z) - z
        across = np.sqrt(np.maximum(1.0 - up**2, 0.0))
        hx, hy = alpha * (across * np.cos(np.pi * u1) + x), alpha * across * np.sin(np.pi * u1)
        hz = up + z
        size = np.sqrt(hx**2 + hy**2 + hz**2)
        v_h = (np.sqrt(1.0 - n_v**2) * hx + n_v * hz) / size
        n_l = 2.0 * v_h * hz / size - n_v
        roots = [np.sqrt(alpha**2 + (1.0 - alpha**2) * c**2) for c in (n_v, n_l)]
        weight = n_l * (n_v + roots[0]) / (n_l * roots[0] + n_v * roots[1])
        weight = np.where(n_l > 0.0, weight * share, 0.0)
        fresnel = np.clip(1.0 - v_h, 0.0, 1.0) ** 5
        factors = np.stack([weight * (1.0 - fresnel), weight * fresnel], axis=-1)
        table[row] = factors.mean(axis=1)
    return table
