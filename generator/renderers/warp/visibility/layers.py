"""Surfaces along each pixel's ray, up to the first that nothing is seen through.

Most pixels have one, which the G-buffer holds: rays continue in the others only.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.core.capture import LAYERS, LAYERS_USUAL, Channel
from gen_data.renderers.warp.readback import Readback
from gen_data.renderers.warp.scene import material_packing
from gen_data.renderers.warp.visibility import plates
from gen_data.renderers.warp.visibility.frame_context import CameraView
from gen_data.renderers.warp.visibility.kernels import surface_layers


@dataclass(frozen=True, eq=False, slots=True)
class SparseLabels:
    """Labels of some pixels of an image.

    Attributes:
        pixels: Flat places of the pixels, [n].
        values: By channel, [n, ...].
    """

    pixels: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, np.intp))
    values: Mapping[Channel, NDArray[Any]] = field(default_factory=dict)

    def moved(self, begin: int, count: int, place: int) -> "SparseLabels":
        """The labels of ``count`` pixels from ``begin`` on, as of the pixels from ``place`` on."""
        kept = (self.pixels >= begin) & (self.pixels < begin + count)
        values = {channel: value[kept] for channel, value in self.values.items()}
        return SparseLabels(self.pixels[kept] + (place - begin), values)


def draw_materials(frame: CameraView, image: wp.array) -> None:
    """Material of the first surface at every pixel; see ``LAYER_MATERIALS``."""
    inputs = [frame.world.record, frame.gbuffer.hits, materials_of(frame)]
    frame.launch(surface_layers.label_materials, frame.pixels, inputs, [image])


def trace_behind(frame: CameraView, channels: frozenset[Channel]) -> SparseLabels:
    """Surfaces behind the first one, [n, layers - 1]; none if no channel of layers is requested."""
    wanted, later = channels & LAYERS.keys(), _layers_of(frame) - 1
    if not wanted or not later:
        return SparseLabels()
    listed = list_pixels(frame, (material_packing.SEE_THROUGH,))
    if not len(listed):
        return SparseLabels()
    shape = (len(listed), later)
    found = Readback.allocate(len(listed) * later, (wp.vec2i, float), frame.cache.device)
    outputs = [part.reshape(shape) for part in found.parts]
    frame.launch(surface_layers.trace_behind, len(listed), ray_inputs(frame, listed), outputs)
    hits, z_m = found.numpy()
    pixels = listed.numpy().astype(np.intp)
    bodies, slots = np.moveaxis(hits.reshape(*shape, 2), -1, 0).astype(np.intp)
    there = bodies >= 0
    if frame.context.backdrop is not None:
        there &= ~plates.is_hidden(frame, frame.context.backdrop, pixels, bodies)
    images: dict[Channel, Callable[[], NDArray[Any]]] = {
        Channel.DEPTH_LAYERS: lambda: z_m.reshape(shape),
        Channel.INSTANCE_LAYERS: lambda: instances_of(frame)[bodies],
        Channel.MATERIAL_LAYERS: lambda: materials_of(frame).numpy()[slots],
    }
    return SparseLabels(pixels, {c: np.where(there, images[c](), LAYERS[c]) for c in wanted})


def list_pixels(frame: CameraView, materials: tuple[int, ...]) -> wp.array:
    """Pixels whose first surface has one of two materials, in any order; scratch memory."""
    listed = frame.cache.scratch("pixels by material", frame.pixels, int)
    if not frame.world.layered:
        return listed[:0]
    count = wp.zeros(1, dtype=int, device=frame.cache.device)
    inputs = [frame.world.record, frame.gbuffer.hits, materials_of(frame)]
    wanted = [materials[0], materials[-1]]
    frame.launch(surface_layers.list_pixels, frame.pixels, [*inputs, *wanted], [count, listed])
    return listed[: int(count.numpy()[0])]


def ray_inputs(frame: CameraView, listed: wp.array) -> list[Any]:
    """Inputs of kernels that follow the rays of listed pixels behind the first surface."""
    seen = [frame.gbuffer.hits, frame.gbuffer.z_m]
    materials = [materials_of(frame), material_packing.SEE_THROUGH]
    return [frame.view, frame.world.record, *seen, *materials, listed]


def instances_of(frame: CameraView) -> NDArray[np.uint16]:
    """Instance id of each body, and 0 for number -1."""
    return np.array([*(b.instance_id for b in frame.state.scene.bodies), 0], np.uint16)


def stack_layers(
    frame: CameraView, images: Mapping[Channel, NDArray[Any]], parts: Sequence[SparseLabels]
) -> dict[Channel, NDArray[Any]]:
    """Layers [h, w, k] of the first ones [h, w] among images and later ones in parts of them."""
    stacked = {}
    for channel in images.keys() & LAYERS.keys():
        first = images[channel]
        layers = np.full((_layers_of(frame), first.size), LAYERS[channel], first.dtype)
        layers[0] = first.reshape(-1)
        for part in parts:
            if channel in part.values:
                layers[1:, part.pixels] = part.values[channel].T
        stacked[channel] = np.moveaxis(layers.reshape(-1, *first.shape), 0, -1)
    return stacked


def _layers_of(frame: CameraView) -> int:
    return frame.state.camera.layers or LAYERS_USUAL


def materials_of(frame: CameraView) -> wp.array:
    """Number of each material in ``LAYER_MATERIALS``, on the device."""
    bodies, cache = frame.state.scene.bodies, frame.cache

    def pack() -> wp.array:
        numbers = material_packing.layer_materials(material_packing.body_materials(bodies, cache))
        return wp.array(numbers, dtype=wp.uint16, device=cache.device)

    return cache.layer_materials.get(bodies, pack)
