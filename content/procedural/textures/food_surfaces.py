"""Surfaces of prepared food: crumb, crust, icing, melted cheese, sauces. They tile."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gen_data.assets.family import check_option
from gen_data.config.data_files import load_table
from gen_data.content.procedural.textures.texture_images import color, mix_colors, texture
from gen_data.core.asset_types import Float32, TextureData
from gen_data.core.noise import SIZE_PX, fbm, smoothstep, worley
from gen_data.core.variant_rng import in_turn, variant_rng

_PACKAGE = "gen_data.content.procedural"
# Noise is computed at this size and repeated in detail by its octaves; see SIZE_PX.
_NOISE_PX = 256


@dataclass(frozen=True, slots=True)
class FoodSurface:
    """A kind of surface; shares in [0, 1].

    Attributes:
        grounds: Colours, of which seeds take one in turn.
        patch, share: Colour of patches and the share they cover.
        cells: Patches along a side of the image.
        pores, pore_cells: Darkness and number along a side of holes in crumb.
        relief: Factor on the height.
        specks, speck: Number and colour of herbs, seeds, fat.
        browned, brown: Share and colour of the part that the oven has browned.
    """

    grounds: tuple[str, ...]
    patch: str
    share: float
    cells: int
    relief: float
    pores: float = 0.0
    pore_cells: int = 40
    specks: int = 0
    speck: str = "#000000"
    browned: float = 0.0
    brown: str = "#8a4a1c"


SURFACES: Mapping[str, FoodSurface] = load_table(_PACKAGE, "food_surfaces", FoodSurface)


def food_surface(seed: int, kind: str = "bread") -> TextureData:
    """A surface of ``SURFACES``, 512 x 512. Raises AssetError if there is no such kind."""
    check_option("food_surface", "kind", kind, tuple(SURFACES))
    style, rng = SURFACES[kind], variant_rng(f"food_surface/{kind}", seed)
    ground = color(in_turn(style.grounds, seed))
    broad = fbm((style.cells, style.cells), 3, rng, size_px=_NOISE_PX)
    fine = fbm((4 * style.cells, 4 * style.cells), 2, rng, size_px=_NOISE_PX)
    patches = smoothstep(0.9 - 1.6 * style.share, 1.5 - 1.6 * style.share, broad + 0.3 * fine + 0.4)
    albedo = mix_colors(ground, color(style.patch), 0.85 * patches)
    height = 0.9 * broad + 0.4 * fine
    if style.pores:
        holes = smoothstep(0.5, 0.15, worley((style.pore_cells,) * 2, rng, 1.0, _NOISE_PX).nearest)
        holes = holes * smoothstep(-0.6, 0.5, fine)
        albedo = albedo * (1.0 - style.pores * holes)[..., None]
        height = height - 2.0 * holes
    if style.browned:
        spots = fbm((style.cells - 3, style.cells - 3), 2, rng, size_px=_NOISE_PX)
        oven = smoothstep(1.0 - 1.4 * style.browned, 1.6 - 1.4 * style.browned, spots + 0.5)
        albedo = mix_colors(albedo, color(style.brown), 0.9 * oven)
    if style.specks:
        side = max(4, round((2.0 * style.specks) ** 0.5))
        points = worley((side, side), rng, 1.0, _NOISE_PX)
        size = points.of_each(rng.random(points.count))
        dots = smoothstep(0.34, 0.2, points.nearest + 0.5 * size)
        albedo = mix_colors(albedo, color(style.speck), 0.85 * dots)
    albedo = albedo * (1.0 + 0.05 * fine)[..., None]
    return texture(_doubled(albedo), None, 0.5 * _doubled(height), style.relief)


def _doubled(image: Float32) -> Float32:
    """The image at full size: pixels twice, then smoothed; it still tiles."""
    scale = SIZE_PX // len(image)
    large = image.repeat(scale, axis=0).repeat(scale, axis=1)
    for axis in (0, 1):
        large = 0.5 * large + 0.25 * (np.roll(large, 1, axis) + np.roll(large, -1, axis))
    smooth: Float32 = large.astype(np.float32)
    return smooth
