"""Surfaces behind pixels without an instance, held against the geometry of a street."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.core.asset_types import Material, MeshData
from gen_data.core.capture import Channel
from gen_data.core.scene import Body
from gen_data.exporters.background_surfaces import SURFACES, read_surfaces
from gen_data.exporters.image_files import write_media

EDGE_M = 1.3
"""Asphalt is to the left (y) of this, grass to the right."""


class Ground:
    """A library of one mesh: a large plane of asphalt and grass, with a line on the asphalt."""

    def materials(self, asset_id: str) -> tuple[Material, ...]:
        return tuple(Material(role=role) for role in ("asphalt", "grass", "marking"))

    def mesh(self, asset_id: str) -> MeshData:
        strips = [(EDGE_M, 300.0), (-300.0, EDGE_M), (2.0, 2.5)]
        points = [(x, y, 0.0) for low, high in strips for x in (-300.0, 300.0) for y in (low, high)]
        faces = (4 * np.arange(3)[:, None, None] + [[0, 2, 1], [1, 2, 3]]).reshape(-1, 3)
        empty = np.zeros((12, 2), np.float32)
        vertices = np.array(points, np.float32)
        slots = np.repeat(np.arange(3, dtype=np.int32), 2)
        return MeshData(
            vertices, faces.astype(np.int32), vertices * 0, empty, slots, self.materials("")
        )


def surfaces(world: Any, folder: Path, **changes: Any) -> tuple[Any, NDArray[Any]]:
    """A sample of the street on that ground, and the surfaces of its image."""
    sample = world.samples[0]
    scene = replace(sample.scene, bodies=(Body("ground", "ground"),))
    info = world.info(1, depth_scale_m=1 / 256, **changes)
    write_media(info, sample, folder)
    ids, found = read_surfaces(info, replace(sample, scene=scene), "color", folder, Ground())
    np.testing.assert_array_equal(ids, sample.capture.readings["color"].channels[Channel.INSTANCE])
    return sample, found


def test_ground_and_sky_are_the_rays_and_unknown_without_depth(world: Any, tmp_path: Path) -> None:
    """Except within the resolution of the map along borders."""
    sample, found = surfaces(world, tmp_path)
    reading = sample.capture.readings["color"]
    rays = sample.truth["color"].camera.intrinsics.pixel_rays()
    free = reading.channels[Channel.INSTANCE] == 0
    down = free & (rays[..., 1] > 0)
    # The camera is 1.6 m above the origin and looks along world X: world y is minus camera x.
    with np.errstate(divide="ignore"):
        y_m = -rays[..., 0] * 1.6 / rays[..., 1]
        near = down & (1.6 * rays[..., 2] / rays[..., 1] < 60.0)
    number = SURFACES.index
    clear = near & (np.abs(y_m - EDGE_M) > 0.06) & (np.abs(np.abs(y_m - 2.25) - 0.25) > 0.06)
    expected = np.where(y_m > EDGE_M, number("asphalt"), number("grass"))
    expected = np.where(np.abs(y_m - 2.25) < 0.25, number("marking"), expected)
    assert clear.sum() > 2000
    assert set(np.unique(expected[clear])) == {1, 2, 5}
    np.testing.assert_array_equal(found[clear], expected[clear])
    assert (found[free & (rays[..., 1] < 0)] == number("sky")).all()
    assert (found[~free] == 0).all()
    # Instances have a place in the image only.
    media = {"color": (Channel.RGB, Channel.INSTANCE)}
    _, found = surfaces(world, tmp_path / "flat", media=media)
    assert not found.any()
