"""Secondary hits of laser rays: behind glass and by reflection in mirrors.

Few rays hit a pane, a mirror or a puddle; only these are traced further, after all first hits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.generator.core.asset_types import SURFACES
from gen_data.generator.core.capture import SecondaryHits
from gen_data.generator.core.scene import Scene
from gen_data.generator.renderers.warp.device_cache import DeviceCache
from gen_data.generator.renderers.warp.lidar.kernels import lidar_rays as kernels
from gen_data.generator.renderers.warp.scene.material_packing import BodyMaterials
from gen_data.generator.renderers.warp.visibility.label_images import category_ids

PUDDLE_MIN = 0.05
"""Smallest share of standing water that reflects."""

Labels = tuple[NDArray[np.uint16], NDArray[np.uint16], NDArray[np.uint8]]


@dataclass(frozen=True, eq=False, slots=True)
class HitLabels:
    """Lookup tables from body and material to labels; the first entry is the background's."""

    instances: NDArray[np.uint16]
    categories: NDArray[np.uint16]
    surfaces: NDArray[np.uint8]

    @classmethod
    def of(cls, scene: Scene, per_body: Sequence[BodyMaterials]) -> HitLabels:
        """Tables of a scene with the given materials of its bodies."""
        instances = [0, *(body.instance_id for body in scene.bodies)]
        nothing = np.zeros(1, np.uint8)
        return cls(
            np.array(instances, np.uint16),
            np.array([0, *category_ids(scene)], np.uint16),
            np.concatenate([nothing, *(entry.roles for entry in per_body)]),
        )

    def at(self, hits: NDArray[np.int32]) -> Labels:
        """Instance, category and surface of (body, material) pairs [n, 2]."""
        bodies, materials = hits[:, 0] + 1, hits[:, 1] + 1
        return self.instances[bodies], self.categories[bodies], self.surfaces[materials]


@dataclass(frozen=True, eq=False, slots=True)
class FirstHits:
    """First hits of all rays: ranges and (body, material) on the device, hits also on the host.

    Attributes:
        normals: Normals at mirrors, on the device, lidar frame.
        puddles: Share of standing water at each ray's end; None if everything is dry.
    """

    ranges_m: wp.array
    on_device: wp.array
    normals: wp.array
    hits: NDArray[np.int32]
    puddles: NDArray[np.float32] | None


def trace_secondary(
    inputs: Sequence[Any],
    first: FirstHits,
    order: NDArray[np.int32] | None,
    infrared: NDArray[np.void],
    labels: HitLabels,
    cache: DeviceCache,
) -> SecondaryHits | None:
    """Secondary hits of all rays; None without any.

    Args:
        inputs: Inputs of the kernel that found the first hits.
        first: The first hits.
        order: Order of the beams.
        infrared: Infrared records of the materials.
        labels: Label tables of the scene.
        cache: Cache of the renderer.
    """
    material = first.hits[:, 1]
    clear = np.append(infrared["clear"] > 0.0, False)[material]
    mirror = np.append(infrared["mirror"] > 0.0, False)[material]
    if first.puddles is not None:
        mirror = mirror | (first.puddles > PUDDLE_MIN)
    found = []
    panes, mirrors = (_select_rays(which, order) for which in (clear, mirror))
    if len(panes):
        given = [wp.array(panes, dtype=int, device=cache.device), first.ranges_m]
        found.append(_launch(kernels.trace_behind_panes, [*inputs, *given], panes, labels, cache))
    if len(mirrors):
        water = np.zeros(len(mirrors), np.float32)
        if first.puddles is not None:
            water = np.where(first.puddles[mirrors] > PUDDLE_MIN, first.puddles[mirrors], 0.0)
        given = [
            wp.array(mirrors, dtype=int, device=cache.device),
            first.ranges_m,
            first.on_device,
            first.normals,
            wp.array(water, dtype=float, device=cache.device),
        ]
        seen = _launch(kernels.trace_mirrors, [*inputs, *given], mirrors, labels, cache)
        seen[3][:], seen[4][:], seen[5][:] = 0, 0, SURFACES.index("mirrored")
        found.append(seen)
    if not found:
        return None
    return SecondaryHits(*(np.concatenate(parts) for parts in zip(*found, strict=True)))


def _select_rays(which: NDArray[np.bool_], order: NDArray[np.int32] | None) -> NDArray[np.int32]:
    """Numbers of the marked rays, with neighbouring beams adjacent."""
    if order is None or not which.any():
        return np.flatnonzero(which).astype(np.int32)
    subrays = len(which) // len(order)
    rays = order if subrays == 1 else (subrays * order[:, None] + np.arange(subrays)).ravel()
    return rays[which[rays]].astype(np.int32, copy=False)


def _launch(
    kernel: wp.Kernel,
    inputs: Sequence[Any],
    selected: NDArray[np.int32],
    labels: HitLabels,
    cache: DeviceCache,
) -> list[NDArray[Any]]:
    """Fields of SecondaryHits for the selected rays that hit something."""
    count = len(selected)
    ranges_m, reflectances = (wp.zeros(count, dtype=float, device=cache.device) for _ in range(2))
    hits_ = wp.zeros(count, dtype=wp.vec2i, device=cache.device)
    outputs = [ranges_m, reflectances, hits_]
    wp.launch(kernel, inputs[0].threads, list(inputs), outputs, device=cache.device)
    hits = hits_.numpy()
    there = hits[:, 0] >= 0
    seen = (ranges_m.numpy()[there], reflectances.numpy()[there])
    return [selected[there].astype(np.int64), *seen, *labels.at(hits[there])]
