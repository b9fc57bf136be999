"""A camera and its world at several instants, and the bands of rows that are seen at each."""

from __future__ import annotations

from dataclasses import dataclass, replace

from generator.core.instants import at
from generator.core.scene import Camera, Scene
from generator.renderers.kernels import records
from generator.renderers.packing import PackedWorld, pack_view, pack_world
from generator.renderers.stock import AssetStock
from generator.renderers.visibility import Method, Seen, see


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
    """What a band of rows shows; valid until the next one is drawn."""

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
    moment: Moment, stock: AssetStock, method: Method, rows: tuple[int, int] | None = None
) -> Sight:
    """The surfaces at all pixel centres, or at those of the rows from the first to before the last.

    Args:
        moment: What, and from where.
        stock: Assets.
        method: As in RenderSettings.
        rows: First, and end.
    """
    world = pack_world(moment.scene, moment.camera, stock)
    view = pack_view(moment.camera, stock)
    if rows is not None:
        view = rows_of(view, *rows)
    return Sight(world, view, see(world, view, stock, method))


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
