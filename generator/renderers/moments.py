"""A camera and its world at several instants, and the bands of rows that are seen at each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import warp as wp

from generator.core.instants import at
from generator.core.scene import Camera, Scene
from generator.renderers.kernels import records
from generator.renderers.packing import PackedWorld, moved_world, pack_view, pack_world
from generator.renderers.settings import RenderSettings
from generator.renderers.stock import AssetStock
from generator.renderers.visibility import Seen, see


@dataclass(frozen=True, eq=False, slots=True)
class Studio:
    """What all renderings have in common.

    Attributes:
        stock: Assets.
        settings: How images are made.
        light: What comes from every pixel of a sight through the air [cd/m^2], anti-aliased for
            an exposure value; flat, linear RGB.
    """

    stock: AssetStock
    settings: RenderSettings
    light: Callable[[Sight, float], wp.array]


@dataclass(frozen=True, eq=False, slots=True)
class Moment:
    """A world at one instant, without other sensors, and where the camera is then."""

    scene: Scene
    camera: Camera

    @classmethod
    def of(cls, scene: Scene, camera: Camera) -> Moment:
        """The scene's own instant."""
        return cls(replace(scene, cameras=(camera,), lidars=(), devices=()), camera)

    def later(self, delay_s: float) -> Moment:
        """The same world, and what carries the camera, at another instant."""
        scene = at(self.scene, round(self.scene.time_s + delay_s, 9))
        return Moment(scene, scene.cameras[0])


@dataclass(frozen=True, eq=False, slots=True)
class Band:
    """Rows of an image, ``first <= row < end``, and when they are exposed."""

    first: int
    end: int
    moment: Moment


@dataclass(frozen=True, eq=False, slots=True)
class Sight:
    """What a camera, or a band of its rows, sees; ``seen`` is valid until the next one is drawn."""

    moment: Moment
    world: PackedWorld
    view: records.View
    seen: Seen


def moves(moment: Moment, open_s: float) -> bool:
    """Whether anything differs between the ends of a span of time around a moment."""
    scene = moment.scene
    start_s, end_s = scene.time_s - 0.5 * open_s, scene.time_s + 0.5 * open_s
    travelling = any(t.start_s < end_s and t.end_s > start_s for t in scene.tracks)
    return travelling or any(start_s < change.time_s <= end_s for change in scene.changes)


def sight(
    moment: Moment,
    studio: Studio,
    rows: tuple[int, int] | None = None,
    near: Sight | None = None,
) -> Sight:
    """The surfaces at all pixel centres, or at those of some rows.

    Args:
        moment: What, and from where.
        studio: Assets and settings.
        rows: The first, and the one after the last; None = all.
        near: The same world at another instant: what is the same need not be packed again.
    """
    world = packed(moment, studio, near)
    view = pack_view(moment.camera, studio.stock)
    if rows is not None:
        view = rows_of(view, *rows)
    return Sight(moment, world, view, see(world, view, studio.stock, studio.settings.visibility))


def packed(moment: Moment, studio: Studio, near: Sight | None = None) -> PackedWorld:
    """The world on the device; arguments as of ``sight``."""
    if near is not None and _same_looks(near.moment.scene, moment.scene):
        return moved_world(near.world, moment.scene, moment.camera, studio.stock)
    return pack_world(moment.scene, moment.camera, studio.stock)


def _same_looks(one: Scene, other: Scene) -> bool:
    """Whether bodies have the same meshes and the very same materials."""
    return all(
        a is b or (a.asset == b.asset and a.materials is b.materials)
        for a, b in zip(one.bodies, other.bodies, strict=True)
    )


def rows_of(view: records.View, first: int, end: int) -> records.View:
    """The view whose image is a band of rows of another's."""
    part = records.View()
    for name in records.View.vars:
        setattr(part, name, getattr(view, name))
    part.height = end - first
    part.cy = view.cy - first
    if view.lens != records.PINHOLE:
        part.directions = view.directions[first * view.width : end * view.width]
    return part
