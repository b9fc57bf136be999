"""Bytes between host and device, and waits: ``python -m benchmarks.bench_device_traffic``.

Counts the transfers of a GPU frame by frame, by calling function; requires no GPU. On the CPU
device, where host and device share one memory, every array that is read by the host or made from
host data is counted as a transfer. Visibility is found by rays, as on a GPU. Kernel arguments (less
than 1 kB each) are not counted.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, Literal

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.core.capture import Channel, LidarHits, LidarRays, SensorReading
from gen_data.core.interfaces import Renderer
from gen_data.core.scene import Camera, Lidar, Scene
from gen_data.pipeline.checked_renderer import CheckedRenderer
from gen_data.renderers.warp.renderer import WarpRenderer

_RENDERER = "gen_data.renderers.warp."
_UPLOADERS = frozenset({"to_device", "_upload", "constant"})
"""Functions that upload on behalf of their callers."""
_ASSETS = ("scene.device_assets.", "scene.environment_maps.", "lidar.infrared_materials.")
"""Modules that prepare an asset when a scene first uses it."""
AS_ON_GPU = ("render.visibility=rays",)
"""Overrides that make the CPU device take the path of a GPU."""


@dataclass(eq=False)
class Traffic:
    """Transfers by the function of the renderer that asked for them.

    Attributes:
        down: Bytes from the device to the host.
        up: Bytes from the host to the device.
        waits: Reads of device memory, each of which waits for the device.
    """

    down: Counter[str] = field(default_factory=Counter)
    up: Counter[str] = field(default_factory=Counter)
    waits: Counter[str] = field(default_factory=Counter)
    _inside: bool = False

    def record(self, direction: Literal["down", "up"], nbytes: int) -> None:
        """Count one transfer; empty ones do not take place."""
        if not nbytes:
            return
        caller = _caller()
        getattr(self, direction)[caller] += nbytes
        if direction == "down":
            self.waits[caller] += 1

    @contextmanager
    def once(self) -> Iterator[bool]:
        """Whether this is the outermost of nested transfers, which count as one."""
        outermost, self._inside = not self._inside, True
        try:
            yield outermost
        finally:
            self._inside = not outermost


def _caller() -> str:
    """Module and function of the renderer that requests a transfer."""
    frame: Any = sys._getframe(2)
    while frame is not None:
        module, function = frame.f_globals.get("__name__", ""), frame.f_code.co_name
        if module.startswith(_RENDERER) and function not in _UPLOADERS and "<" not in function:
            return f"{module.removeprefix(_RENDERER)}.{function}"
        frame = frame.f_back
    return "elsewhere"


@contextmanager
def counted_traffic() -> Iterator[Traffic]:
    """Count all transfers within the context."""
    import warp as wp

    from gen_data.renderers.warp.scene import device_assets

    assets: Any = device_assets
    traffic = Traffic()
    make, read, assign, clone = wp.array.__init__, wp.array.numpy, wp.array.assign, wp.clone
    upload = assets._upload

    def counted_make(self: Any, data: Any = None, *args: Any, **kwargs: Any) -> None:
        with traffic.once() as outermost:
            make(self, data, *args, **kwargs)
        if outermost and data is not None:
            traffic.record("up", _nbytes(self))

    def counted_read(self: Any, **kwargs: Any) -> Any:
        traffic.record("down", _nbytes(self))
        return read(self, **kwargs)

    def counted_assign(self: Any, source: Any) -> None:
        with traffic.once() as outermost:
            assign(self, source)
        if outermost:
            traffic.record("up", _nbytes(self))

    def counted_clone(source: Any, *args: Any, **kwargs: Any) -> Any:
        with traffic.once() as outermost:
            copy = clone(source, *args, **kwargs)
        if outermost:
            # The renderer clones arrays of the host only.
            traffic.record("up", _nbytes(source))
        return copy

    def counted_upload(values: Any, *args: Any) -> Any:
        with traffic.once():
            uploaded = upload(values, *args)
        traffic.record("up", values.nbytes)
        return uploaded

    wp.array.__init__, wp.array.numpy, wp.array.assign = counted_make, counted_read, counted_assign
    wp.clone, assets._upload = counted_clone, counted_upload
    try:
        yield traffic
    finally:
        wp.array.__init__, wp.array.numpy, wp.array.assign = make, read, assign
        wp.clone, assets._upload = clone, upload


def _nbytes(values: Any) -> int:
    """Bytes of an array's elements: transfers of strided arrays are packed first."""
    import warp as wp

    return int(values.size) * int(wp.types.type_size_in_bytes(values.dtype))


@dataclass(frozen=True, eq=False)
class Frame:
    """Transfers of one reading.

    Attributes:
        name: Configuration, sample, sensor.
        requested: Bytes of the channels, silhouettes or laser hits that were asked for.
        given: Bytes of the directions and origins of a scan's rays.
    """

    name: str
    traffic: Traffic
    requested: int
    given: int = 0

    @property
    def down(self) -> int:
        """Bytes from the device beyond those requested; less than 0 if masks cross as bits."""
        return _without_assets(self.traffic.down) - self.requested

    @property
    def assets(self) -> int:
        """Bytes of assets that the device did not have."""
        return self.traffic.up.total() - _without_assets(self.traffic.up)

    @property
    def up(self) -> int:
        """Bytes to the device beyond assets and rays."""
        return max(_without_assets(self.traffic.up) - self.given, 0)

    @property
    def waits(self) -> int:
        """Reads of device memory, other than while an asset is uploaded."""
        return _without_assets(self.traffic.waits)


def _without_assets(counts: Counter[str]) -> int:
    return sum(count for caller, count in counts.items() if not caller.startswith(_ASSETS))


class CountingRenderer:
    """A renderer that counts the transfers of every reading.

    Attributes:
        frames: Counts by frame.
        label: Prefix of the names of the next frames.
    """

    def __init__(self, renderer: Renderer) -> None:
        self._renderer = renderer
        self.frames: list[Frame] = []
        self.label = ""

    def render(self, scene: Scene, camera: Camera, channels: frozenset[Channel]) -> SensorReading:
        """As of Renderer."""
        with counted_traffic() as traffic:
            reading = self._renderer.render(scene, camera, channels)
        images = sum(image.nbytes for image in reading.channels.values())
        # Masks cross at their size, before the host crops them.
        masks = sum(outline.mask.nbytes for outline in reading.silhouettes.values())
        self.frames.append(Frame(f"{self.label} {camera.name}", traffic, images + masks))
        return reading

    def scan(self, scene: Scene, lidar: Lidar, beams: LidarRays) -> LidarHits:
        """As of Renderer."""
        with counted_traffic() as traffic:
            hits = self._renderer.scan(scene, lidar, beams)
        rays = (beams.directions, beams.origins_m)
        given = sum(values.nbytes for values in rays if values is not None)
        name = f"{self.label} {lidar.name}"
        self.frames.append(Frame(name, traffic, _hit_bytes(hits), given))
        return hits


def _hit_bytes(hits: LidarHits) -> int:
    """Bytes of the hits of rays: three floats per ray, and the numbers of body and material."""
    behind = 0 if hits.detours is None else len(hits.detours.ray)
    return int(hits.range_m.size * (3 * 4 + 2 * 4) + behind * (2 * 4 + 2 * 4))


def count_frames(config: str, samples: int, *overrides: str) -> list[Frame]:
    """Frames of the first samples of a shipped configuration."""
    spec = load_config(config, seed=1, overrides=(*AS_ON_GPU, *overrides))
    with open_pipeline(spec) as pipeline:
        checked = pipeline.renderer
        assert isinstance(checked, CheckedRenderer)
        renderer = checked.renderer
        assert isinstance(renderer, WarpRenderer)
        # A GPU has separate memory.
        renderer._cache.shares_memory = False
        counting = CountingRenderer(renderer)
        pipeline.__dict__["renderer"] = counting
        for index in range(samples):
            counting.label = f"{config.removesuffix('.yaml')} {index}"
            pipeline.sample(index)
    return counting.frames


CASES: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("tabletop.yaml", ("views_per_scene=3",)),
    ("street.yaml", ("views_per_scene=3",)),
    ("kitti_rig.yaml", ()),
)


def main() -> None:
    """Print the table, and on request the callers."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=3)
    parser.add_argument("--callers", action="store_true", help="list transfers by function")
    parser.add_argument("--configs", nargs="*", help="others than tabletop, street and kitti_rig")
    args = parser.parse_args()
    cases = [(name, ()) for name in args.configs] if args.configs else CASES
    print(
        f"{'[kB]':<32} {'requested':>10} {'other down':>10} {'assets':>10} {'other up':>10} waits"
    )
    for config, overrides in cases:
        for frame in count_frames(config, args.samples, *overrides):
            sizes = (frame.requested, frame.down, frame.assets, frame.up)
            row = " ".join(f"{size / 1e3:>10.1f}" for size in sizes)
            print(f"{frame.name:<32} {row} {frame.waits:>5}")
            if args.callers:
                print(format_callers(frame.traffic))


def format_callers(traffic: Traffic) -> str:
    """Transfers by function, the largest first."""
    lines = []
    for direction in ("down", "up"):
        for caller, nbytes in getattr(traffic, direction).most_common():
            waits = f" {traffic.waits[caller]}x" if direction == "down" else ""
            lines.append(f"  {direction:>4} {nbytes / 1e3:10.1f} {caller}{waits}")
    return "\n".join(lines)


if __name__ == "__main__":
    main()
