"""Texture sampling four pixels at a time equals sampling each pixel alone."""

import numpy as np
import warp as wp

from gen_data.renderers.warp.device import open_device
from gen_data.renderers.warp.native_code import native
from gen_data.renderers.warp.scene.kernels.records import TextureRecord, World
from gen_data.renderers.warp.scene.kernels.texture_sampling import Sampler, make_sampler, texel_at

Values = wp.types.vector(length=7, dtype=wp.float32)
"""Albedo, roughness and tangent-space normal."""

_SIZE = 64
_POINTS = 4096


@wp.func_native(
    native("scene/kernels/sample_quad.h")
    + """
    for (int k = 0; k < 4; k += QUAD) {
        Floats u, v;
        for (int lane = 0; lane < QUAD; ++lane) {
            put(u, lane, at.data[first + k + lane][0]);
            put(v, lane, at.data[first + k + lane][1]);
        }
        const Sample s = sample(textures.data[0], sampler, u, v, true);
        for (int lane = 0; lane < QUAD; ++lane) {
            for (int c = 0; c < 3; ++c) {
                values.data[first + k + lane][c] = get(s.albedo[c], lane);
                values.data[first + k + lane][4 + c] = get(s.bump[c], lane);
            }
            values.data[first + k + lane][3] = get(s.roughness, lane);
        }
    }
"""
)
def sample_quad(
    textures: wp.array[TextureRecord],
    sampler: Sampler,
    at: wp.array[wp.vec2],
    first: int,
    values: wp.array[Values],
) -> None: ...


@wp.kernel
def sample_each(
    world: World, level: float, at: wp.array[wp.vec2], values: wp.array[Values]
) -> None:
    """Sample a texture at one point per thread."""
    i = wp.tid()
    texel = texel_at(world, 0, make_sampler(world, 0, level), at[i][0], at[i][1], True)
    for c in range(3):
        values[i][c] = texel.albedo[c]
        values[i][4 + c] = texel.bump[c]
    values[i][3] = texel.roughness


@wp.kernel
def sample_four(
    world: World, level: float, at: wp.array[wp.vec2], values: wp.array[Values]
) -> None:
    """Sample a texture at four points per thread."""
    i = wp.tid()
    sample_quad(world.textures, make_sampler(world, 0, level), at, 4 * i, values)


def _random_texture(rng: np.random.Generator) -> TextureRecord:
    sizes = [_SIZE >> level for level in range(7)]
    offsets = np.cumsum([0, *(size * size for size in sizes[:-1])])
    texels = sum(size * size for size in sizes)
    record = TextureRecord()
    for name in ("texels", "bumps"):
        setattr(record, name, wp.array(rng.integers(0, 2**32, texels, np.uint32), dtype=wp.uint32))
    record.offsets = wp.array(offsets, dtype=wp.int32)
    record.width = record.height = _SIZE
    record.levels = len(sizes)
    return record


def test_four_pixels_sampled_at_once_equal_each_sampled_alone() -> None:
    """Values agree exactly at any point, also far outside the texture and on texel borders."""
    device = open_device("cpu")
    rng = np.random.default_rng(5)
    at = rng.uniform(-3.0, 3.0, (_POINTS, 2)).astype(np.float32)
    at[:500] = rng.integers(-200, 200, (500, 2)) / np.float32(2 * _SIZE)
    at[500:600] *= 1.0e7
    with wp.ScopedDevice(device):
        world = World()
        texture = _random_texture(rng)  # The array holds its address, and does not keep it alive.
        world.textures = wp.array([texture], dtype=TextureRecord)
        points = wp.array(at, dtype=wp.vec2)
        for level in (0.0, 0.4, 1.9, 2.5, 6.0):
            each, four = (wp.zeros(_POINTS, dtype=Values) for _ in range(2))
            wp.launch(sample_each, _POINTS, [world, level, points, each])
            wp.launch(sample_four, _POINTS // 4, [world, level, points, four])
            np.testing.assert_array_equal(four.numpy(), each.numpy())
