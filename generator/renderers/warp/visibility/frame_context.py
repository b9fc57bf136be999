"""Rendering contexts: a camera and its world at several instants, and bands of image rows."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.core import asset_types, interfaces, scene_time
from gen_data.core.scene import Camera, Scene
from gen_data.renderers.warp.device import launch
from gen_data.renderers.warp.scene import device_cache, scene_packing, struct_dtypes
from gen_data.renderers.warp.scene.kernels import records
from gen_data.renderers.warp.settings import RenderSettings
from gen_data.renderers.warp.visibility.gbuffer import GBuffer, find_visible


@dataclass(frozen=True, eq=False, slots=True)
class Backdrop:
    """A photograph as a camera's image shows it.

    Attributes:
        photo: Radiance [cd/m^2], linear RGB, float32 [h, w, 3].
        mask: Share of each pixel that the foreground covers, float32 [h, w]; None = no foreground.
        ground: Pixels that show ground on which objects may stand, bool [h, w].
        unshaded: Radiance of the ground without objects on it, flat, on the device; None until it
            is rendered.
    """

    photo: asset_types.Float32
    mask: asset_types.Float32 | None
    ground: NDArray[np.bool_]
    unshaded: wp.array | None = None

    @property
    def hidden(self) -> NDArray[np.bool_]:
        """Pixels that show the foreground, bool [h, w]."""
        if self.mask is None:
            return np.zeros(self.ground.shape, np.bool_)
        return np.asarray(self.mask >= 0.5)


class LightTracer(Protocol):
    """Finds light along paths, in place of the realtime tier."""

    def light(self, frame: "CameraView") -> wp.array:
        """Radiance of all pixels through the air [cd/m^2], linear RGB, flat; scratch memory."""
        ...


@dataclass(frozen=True, eq=False, slots=True)
class RenderContext:
    """Assets and settings that all renderings share.

    Attributes:
        paths: The path tracer; None in the realtime tier.
        backdrop: The photograph behind the scene; None if there is none.
        find_tones: Finds the range in which pixels on edges are means of tones; None = of radiance.
    """

    cache: device_cache.DeviceCache
    settings: RenderSettings
    paths: LightTracer | None = None
    backdrop: Backdrop | None = None
    find_tones: interfaces.FindTones | None = None


@dataclass(frozen=True, eq=False, slots=True)
class CameraState:
    """A world at one instant, without other sensors, and the camera's pose at that instant."""

    scene: Scene
    camera: Camera

    @classmethod
    def of(cls, scene: Scene, camera: Camera) -> "CameraState":
        """State at the scene's own instant."""
        return cls(replace(scene, cameras=(camera,), lidars=(), devices=()), camera)

    def later(self, delay_s: float) -> "CameraState":
        """State of the same world and camera at another instant."""
        scene = scene_time.scene_at(self.scene, round(self.scene.time_s + delay_s, 9))
        return CameraState(scene, scene.cameras[0])


@dataclass(frozen=True, eq=False, slots=True)
class RowBand:
    """Rows of an image, ``first <= row < end``, and the state at their exposure."""

    first: int
    end: int
    state: CameraState


@dataclass(frozen=True, eq=False, slots=True)
class CameraView:
    """A rendered image or band of rows; ``gbuffer`` is valid until the next is rendered."""

    state: CameraState
    world: scene_packing.PackedWorld
    view: records.View
    gbuffer: GBuffer
    context: RenderContext

    @property
    def cache(self) -> device_cache.DeviceCache:
        """Assets and scratch memory."""
        return self.context.cache

    @property
    def settings(self) -> RenderSettings:
        """Settings of the renderer."""
        return self.context.settings

    @property
    def pixels(self) -> int:
        """Number of pixels."""
        return int(self.view.width * self.view.height)

    @property
    def inputs(self) -> list[Any]:
        """View, World and GBufferRecord, the first inputs of most kernels."""
        return [self.view, self.world.record, self.gbuffer.record]

    def launch(
        self, kernel: wp.Kernel, dim: Any, inputs: Sequence[Any], outputs: Sequence[Any] = ()
    ) -> None:
        """Run a kernel on the renderer's device."""
        launch(kernel, dim, inputs, outputs, device=self.cache.device)


def is_moving(state: CameraState, open_s: float) -> bool:
    """Whether anything differs between the ends of an interval around a state."""
    scene = state.scene
    start_s, end_s = scene.time_s - 0.5 * open_s, scene.time_s + 0.5 * open_s
    travelling = any(t.start_s < end_s and t.end_s > start_s for t in scene.tracks)
    return travelling or any(start_s < change.time_s <= end_s for change in scene.changes)


def render_view(
    state: CameraState,
    context: RenderContext,
    rows: tuple[int, int] | None = None,
    reference: CameraView | None = None,
) -> CameraView:
    """Find the surfaces at all pixel centres, or in some rows (the end is exclusive).

    ``reference`` is the same world at another instant, whose assets need not be packed again.
    """
    world = pack_state(state, context, reference)
    view = scene_packing.pack_view(state.camera, context.cache)
    if rows is not None:
        view = crop_rows(view, *rows)
    gbuffer = find_visible(world, view, context.cache, context.settings.visibility)
    return CameraView(state, world, view, gbuffer, context)


def pack_state(
    state: CameraState, context: RenderContext, reference: CameraView | None = None
) -> scene_packing.PackedWorld:
    """Pack the world onto the device; arguments as for ``render_view``."""
    if reference is not None and _has_same_assets(reference.state.scene, state.scene):
        return scene_packing.repack_moved(reference.world, state.scene, state.camera, context.cache)
    return scene_packing.pack_world(state.scene, state.camera, context.cache)


def _has_same_assets(one: Scene, other: Scene) -> bool:
    return all(
        a is b or (a.asset == b.asset and a.materials is b.materials)
        for a, b in zip(one.bodies, other.bodies, strict=True)
    )


def crop_rows(view: records.View, first: int, end: int) -> records.View:
    """The view of a band of an image's rows."""
    part = struct_dtypes.copy_struct(view, records.View)
    part.height = end - first
    part.cy = view.cy - first
    if view.lens != records.PINHOLE:
        part.directions = view.directions[first * view.width : end * view.width]
    return part
