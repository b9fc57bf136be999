"""Reflectance of specular lobes under uniform light."""

from __future__ import annotations

import numpy as np

from generator.core.geometry import Float32

_ENTRIES = 32
_STRATA = 24


def lobe_albedo() -> Float32:
    """Factors on F0 and F90 by roughness and cosine to the viewer, shape [32, 32, 2].

    Entry ``[i, j]`` is for roughness ``i / 31`` and cosine ``j / 31``; together the two factors
    are the directional albedo of a perfect mirror, single scattering only.

    Source: the split sum of Karis, "Real shading in Unreal Engine 4", 2013, over stratified
    half vectors of GGX, with the masking of ``generator.renderers.kernels.brdf``.
    """
    # The ends themselves are limits without a value of their own.
    nodes = np.clip(np.arange(_ENTRIES) / (_ENTRIES - 1.0), 1e-3, 1.0)
    roughness, n_v = nodes[:, None, None], nodes[None, :, None]
    strata = (np.arange(_STRATA) + 0.5) / _STRATA
    u1, u2 = (axis.reshape(1, 1, -1) for axis in np.meshgrid(strata, strata, indexing="ij"))
    alpha = roughness**2
    n_h = np.sqrt((1.0 - u1) / (1.0 + (alpha**2 - 1.0) * u1))
    along = np.sqrt(1.0 - n_h**2) * np.cos(np.pi * u2)
    v_h = np.sqrt(1.0 - n_v**2) * along + n_v * n_h
    n_l = 2.0 * v_h * n_h - n_v
    reflected = (n_l > 0.0) & (v_h > 0.0)
    masking = 2.0 * n_l * n_v * (1.0 - alpha) + (n_l + n_v) * alpha
    weight = np.where(reflected, 2.0 * n_l * v_h / np.where(reflected, masking * n_h, 1.0), 0.0)
    fresnel = np.clip(1.0 - v_h, 0.0, 1.0) ** 5
    factors = np.stack([(weight * (1.0 - fresnel)), (weight * fresnel)], axis=-1).mean(axis=2)
    table: Float32 = factors.astype(np.float32)
    return table
