"""Occupancy: what is in the voxels of a box around the ego, and what its sensors observe of it.

Voxels come from the geometry, not from points of a scanner: hidden ones are known, and moving
objects leave no trails. Readings tell only which voxels a sensor has observed.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from gen_data.annotations import voxel_samples
from gen_data.annotations.voxel_views import VoxelBox, seen_by_camera, seen_by_scanner
from gen_data.config.base_model import Strict
from gen_data.core import asset_types, capture, errors, interfaces
from gen_data.core.sample import VOXEL_STATES, EgoTruth, Occupancy
from gen_data.core.scene import Body, Scene
from gen_data.core.scene_time import ego_rig
from gen_data.core.se3 import IDENTITY, SE3, Vec3

SAMPLES_PER_VOXEL = 2.0
"""Samples of a surface along the side of a voxel: a disc whose radius is 0.36 of it holds one."""
VOXELS_MAX = 1 << 26
"""2^26 voxels take 0.8 GB in a worker, with the masks of three sensors."""
BYTES_PER_VOXEL = 12
LARGE = 0.5
"""Assets longer than this share of the box are sampled within the box, others whole and once."""
PIECE_VOXELS = 20
SURFACE, INTERIOR = VOXEL_STATES.index("surface"), VOXEL_STATES.index("interior")
LIBRARY_SIZES = 8
"""Pitches for scaled bodies are on a scale of this many steps per octave, the next smaller one."""


class VoxelOccupancy(Strict):
    """Voxels of a box around the ego: state, instance, surface, and which sensors observe them.

    A voxel is ``surface`` if it contains a sample of an object's surface, ``interior`` if it
    contains no surface and a point inside a closed one, else ``free``. Where several objects share
    a voxel, instances win over the unlabelled background, and smaller ones over larger ones. The
    body that carries the sensors is left out.

    A camera observes a voxel if a pixel shows a surface in it, or if the pixel at its centre shows
    something behind it. A scanner observes the voxels that the lines to its returns pass and end
    in. Air that no return came from is not observed.

    Attributes:
        size_m: Of the box, along the axes of the frame.
        voxel_m: Side of a voxel.
        from_m: Lowest corner of the box in its frame; null = the box is centred on the frame's
            origin along X and Y, and begins 1 m below it.
        frame: Name of the scanner whose frame it is; empty = the ego's rig, or the world in scenes
            without one.
    """

    channels: ClassVar[frozenset[capture.Channel]] = frozenset({capture.Channel.RANGE})
    type: Literal["occupancy"] = "occupancy"
    size_m: Vec3 = (80.0, 80.0, 6.4)
    voxel_m: float = Field(0.4, ge=0.001, le=10)
    from_m: Vec3 | None = None
    frame: str = ""

    @model_validator(mode="after")
    def _check(self) -> "VoxelOccupancy":
        if min(self.size_m) < self.voxel_m:
            raise ValueError(f"size_m: {list(self.size_m)} m is less than a voxel along an axis")
        for side_m in self.size_m:
            count = side_m / self.voxel_m
            if abs(count - round(count)) > 1e-6 * count:
                raise ValueError(
                    f"size_m: {side_m:g} m is no multiple of voxel_m, {self.voxel_m:g} m"
                )
        total = math.prod(self.shape)
        if total > VOXELS_MAX:
            raise ValueError(
                f"size_m: {total:,} voxels need {total * BYTES_PER_VOXEL / 1e9:.1f} GB in every"
                f" worker; at most {VOXELS_MAX:,} are possible: raise voxel_m or lower size_m"
            )
        return self

    @property
    def shape(self) -> tuple[int, int, int]:
        """Voxels along X, Y and Z."""
        nx, ny, nz = (round(side_m / self.voxel_m) for side_m in self.size_m)
        return nx, ny, nz

    def annotate_capture(
        self,
        scenes: Mapping[str, Scene],
        assets: interfaces.AssetLibrary,
        capture: capture.Capture,
        truth: EgoTruth,
    ) -> EgoTruth:
        """Fill in ``occupancy``.

        Raises:
            ConfigError: the scene has no scanner of the name ``frame``.
        """
        scene = scenes[""]
        box = VoxelBox(self._pose(scene), self._low_m(), self.voxel_m, self.shape)
        rig = ego_rig(scene)
        own = scene.body(rig.body).instance_id if rig is not None and rig.body else 0
        state, owner, surface = _fill(box, scene, assets, own)
        readings, clouds = capture.readings, capture.clouds
        observed = {name: seen_by_camera(box, scene, readings[name]) for name in sorted(readings)}
        for name in sorted(clouds):
            observed[name] = seen_by_scanner(box, scenes.get(name, scene), clouds[name])
        return replace(
            truth,
            occupancy=Occupancy(
                box.T_world_frame, box.low_m, self.voxel_m, state, owner, surface, observed
            ),
        )

    def _low_m(self) -> Vec3:
        x, y, _ = self.size_m
        return self.from_m or (-0.5 * x, -0.5 * y, -1.0)

    def _pose(self, scene: Scene) -> SE3:
        if self.frame:
            for lidar in scene.lidars:
                if lidar.name == self.frame:
                    return lidar.T_world_lidar
            known = ", ".join(sorted(lidar.name for lidar in scene.lidars)) or "none"
            raise errors.ConfigError(
                f"annotation 'occupancy': frame: there is no scanner '{self.frame}';"
                f" scanners are: {known}"
            )
        rig = ego_rig(scene)
        return scene.rig_pose(rig.name).rounded() if rig is not None else IDENTITY


@dataclass(frozen=True, eq=False, slots=True)
class _Samples:
    """Samples of a body or asset: points [n, 3] [m], slot of the material [n], -1 = inside."""

    points_m: NDArray[np.float32]
    slots: NDArray[np.int16]


def _fill(
    box: VoxelBox, scene: Scene, assets: interfaces.AssetLibrary, own: int
) -> tuple[NDArray[np.uint8], NDArray[np.uint16], NDArray[np.uint8]]:
    """State, instance and surface of all voxels."""
    state, surface = (np.zeros(math.prod(box.shape), np.uint8) for _ in range(2))
    owner = np.zeros(math.prod(box.shape), np.uint16)
    bodies, T_frame_world = _by_rank(scene, own), box.T_world_frame.inverse()
    samples = [(b, s) for b in bodies for s in _samples_of(b, T_frame_world, box, assets)]
    # Later ones overwrite earlier ones: interiors first, then what matters most last.
    for inside in (True, False):
        for body, (voxels, slots) in samples:
            chosen = voxels[(slots < 0) == inside]
            state[chosen] = INTERIOR if inside else SURFACE
            owner[chosen] = body.instance_id
            surface[chosen] = 0 if inside else _surfaces(body, assets)[slots[slots >= 0]]
    return state.reshape(box.shape), owner.reshape(box.shape), surface.reshape(box.shape)


def _by_rank(scene: Scene, own: int) -> Iterator[Body]:
    """Bodies without the carrier's; background first, then instances by falling volume."""
    volumes = {i.instance_id: math.prod(i.box3d.size_m) for i in scene.instances}
    numbers = sorted(volumes, key=lambda k: (-volumes[k], k))
    ranks = {0: -1, **{number: rank for rank, number in enumerate(numbers)}}
    kept = (b for b in scene.bodies if not own or b.instance_id != own)
    return iter(sorted(kept, key=lambda body: ranks[body.instance_id]))


def _samples_of(
    body: Body, T_frame_world: SE3, box: VoxelBox, assets: interfaces.AssetLibrary
) -> Iterator[tuple[NDArray[np.intp], NDArray[np.int16]]]:
    """Voxels of the samples of a body that are in the box, and their slots; none far away."""
    low_m, high_m = assets.bounds_m(body.asset)
    T_frame_body = T_frame_world @ body.T_world_body
    if not box.may_contain(T_frame_body, low_m, high_m, body.scale):
        return
    longest_m = body.scale * max(b - a for a, b in zip(low_m, high_m, strict=True))
    if longest_m > LARGE * box.voxel_m * max(box.shape):
        yield from _samples_in_box(body, T_frame_body, box, assets)
        return
    exact_m = box.voxel_m / SAMPLES_PER_VOXEL / body.scale
    pitch_m = 2.0 ** (math.floor(LIBRARY_SIZES * math.log2(exact_m)) / LIBRARY_SIZES)
    found = _sample_asset(body.asset, pitch_m, assets)
    voxels = box.numbers(T_frame_body, found.points_m, body.scale)
    kept = voxels >= 0
    yield voxels[kept], found.slots[kept]


def _samples_in_box(
    body: Body, T_frame_body: SE3, box: VoxelBox, assets: interfaces.AssetLibrary
) -> Iterator[tuple[NDArray[np.intp], NDArray[np.int16]]]:
    """The same for a body that is long beside the box, such as the ground or a table."""
    mesh = assets.mesh(body.asset)
    vertices = T_frame_body.apply(mesh.vertices_m.astype(np.float64) * body.scale)
    corners = vertices[mesh.faces]
    low_m, high_m = np.asarray(box.low_m), np.asarray(box.high_m)
    pieces, owner = voxel_samples.split_long(corners, PIECE_VOXELS * box.voxel_m, low_m, high_m)
    points, piece = voxel_samples.sample_surface(pieces, box.voxel_m / SAMPLES_PER_VOXEL)
    voxels = box.numbers(IDENTITY, points)
    kept = voxels >= 0
    yield voxels[kept], mesh.face_slots[owner[piece[kept]]].astype(np.int16)
    if voxel_samples.closed(corners):
        inside = voxel_samples.inside_lattice(corners, low_m, box.voxel_m, box.shape)
        voxels = np.flatnonzero(inside)
        yield voxels, np.full(len(voxels), -1, np.int16)


@lru_cache(maxsize=2048)
def _sample_asset(asset: str, pitch_m: float, assets: interfaces.AssetLibrary) -> _Samples:
    """Samples of the surface and the inside of an asset, in its own frame."""
    if not isinstance(assets, interfaces.DerivedArrays):
        return _Samples(**_compute_samples(asset, pitch_m, assets))
    name = f"voxel samples 1 {pitch_m:.6g}"
    return _Samples(**assets.derived(asset, name, lambda: _compute_samples(asset, pitch_m, assets)))


def _compute_samples(
    asset: str, pitch_m: float, assets: interfaces.AssetLibrary
) -> dict[str, NDArray[np.generic]]:
    mesh = assets.mesh(asset)
    corners = mesh.vertices_m.astype(np.float64)[mesh.faces]
    points, triangle = voxel_samples.sample_surface(corners, pitch_m)
    slots = mesh.face_slots[triangle].astype(np.int16)
    kept = voxel_samples.thin_out(points, slots, 0.5 * pitch_m)
    low_m = np.asarray(mesh.bounds_m()[0]) - 0.5 * pitch_m
    size = np.asarray(mesh.bounds_m()[1]) - low_m
    nx, ny, nz = (int(k) for k in np.ceil(size / pitch_m) + 1)
    inside = np.argwhere(voxel_samples.inside_lattice(corners, low_m, pitch_m, (nx, ny, nz)))
    place = np.array([voxel_samples.OFF_LATTICE, voxel_samples.OFF_LATTICE, 0.5])
    within = low_m + (inside + place) * pitch_m
    return {
        "points_m": np.concatenate([points[kept], within]).astype(np.float32),
        "slots": np.concatenate([slots[kept], np.full(len(within), -1, np.int16)]),
    }


def _surfaces(body: Body, assets: interfaces.AssetLibrary) -> NDArray[np.uint8]:
    """Index of the surface of every slot of a body's materials."""
    return _surface_numbers(body.materials or assets.materials(body.asset))


@lru_cache(maxsize=4096)
def _surface_numbers(materials: tuple[asset_types.Material, ...]) -> NDArray[np.uint8]:
    known = {role: number for number, role in enumerate(asset_types.SURFACES)}
    return np.array([known.get(material.role, 0) for material in materials], np.uint8)
