"""Every texture family: it tiles, repeats exactly, and its variants differ."""

import ast
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from PIL import ImageFont

from gen_data import content
from gen_data.content.procedural import TEXTURES
from gen_data.content.procedural.packaging import can_size
from gen_data.content.procedural.textures.texture_images import color, mix_colors
from gen_data.core.asset_types import TextureData
from gen_data.core.noise import fbm, perlin, quick_perlin, worley
from gen_data.core.streams import Streams
from tests.tiers import sampled

PRINTED = {"label", "front_label", "can_label", "carton", "milk_label", "book_cover"}
FOOD = {"apple_skin", "citrus_peel", "banana_peel", "pear_skin", "ball_cover"}
FRUIT = {"fruit_skin", "fruit_cut"}
SKIN = {"hand_skin"}
DEVICES = {"phone_screen", "key_legends"}
TABLEWARE = {"ceramic_decor", "drink_surface"}
RELIEF = (
    "brick", "brushed_metal", "cardboard", "carpet", "citrus_peel", "concrete", "fabric",
    "floor_tiles", "leather", "paint", "painted_metal", "plaster", "screed", "tiles", "wood_grain",
    "wood_planks",
)  # fmt: skip
TILING = sorted(set(TEXTURES) - PRINTED - FOOD - FRUIT - SKIN - TABLEWARE - DEVICES)


@cache
def texture(name: str, seed: int) -> TextureData:
    """A variant of a family, built once for all tests."""
    return TEXTURES[name].build(seed)


@pytest.fixture(params=sampled(sorted(TEXTURES), 6), scope="module")
def made(request: pytest.FixtureRequest) -> tuple[str, TextureData]:
    return request.param, texture(request.param, 0)


def test_images_are_8_bit_of_one_size_and_show_something(made: tuple[str, TextureData]) -> None:
    """Albedo, roughness and normals have the shapes of the contract."""
    texture = made[1]
    height, width, _ = texture.albedo.shape
    assert texture.albedo.dtype == np.uint8
    assert (height, width) in ((512, 512), (256, 512))
    assert texture.roughness is None or texture.roughness.shape == (height, width)
    assert texture.normal is None or texture.normal.shape == (height, width, 3)
    # No image is a single colour, nor white or black all over.
    albedo = made[1].albedo.astype(np.float64)
    assert albedo.std(axis=(0, 1)).max() > 0.8
    assert 8 < albedo.mean() < 250


@pytest.mark.parametrize("name", RELIEF)
def test_normals_point_out_of_the_surface(name: str) -> None:
    """Unit vectors within 8 bits, blue side up, level on average."""
    image = texture(name, 0).normal
    assert image is not None
    normal = image.astype(np.float64) / 127.5 - 1.0
    assert np.allclose((normal**2).sum(axis=2), 1.0, atol=0.03)
    assert normal[..., 2].min() > 0.05
    assert np.abs(normal[..., :2].mean(axis=(0, 1))).max() < 0.03


@pytest.mark.parametrize("name", sampled(TILING, 3))
@pytest.mark.parametrize("seed", [0, 1])
def test_surfaces_tile_without_a_seam(name: str, seed: int) -> None:
    """The step across the image's border barely exceeds the largest steps inside."""
    made = texture(name, seed)
    images = [made.albedo, made.normal if made.normal is not None else made.albedo]
    for image in images:
        for axis in (0, 1):
            values = np.moveaxis(image.astype(np.float64), axis, 0)
            steps = np.abs(values - np.roll(values, 1, axis=0)).mean(axis=(1, 2))
            assert steps[0] <= max(2.0 * np.quantile(steps[1:], 0.9), 1.1 * steps[1:].max())


@pytest.mark.parametrize("name", sampled(sorted(TEXTURES), 6))
def test_equal_seeds_make_equal_images_and_others_differ(name: str) -> None:
    """A texture is a pure function of its seed."""
    again = TEXTURES[name].build(0)
    images = [made.albedo.tobytes() for made in (again, *(texture(name, s) for s in range(3)))]
    assert images[0] == images[1]
    assert len(set(images)) == 3


def median_wavelength_mm(slope: np.ndarray, repeat_m: float) -> float:
    """Of variation down an image: half of the power spectrum belongs to longer waves."""
    power = (np.abs(np.fft.rfft(slope - slope.mean(), axis=0)) ** 2).sum(axis=1)[1:]
    middle = int(np.searchsorted(np.cumsum(power), 0.5 * power.sum()))
    return 1000.0 * repeat_m / (middle + 1)


@pytest.mark.parametrize(
    ("name", "repeat_m", "most_mm"),
    [("leather", 0.2, 3.0), ("fabric", 0.15, 1.5), ("carpet", 0.5, 7.5)],
)
def test_relief_is_as_fine_as_on_real_surfaces(name: str, repeat_m: float, most_mm: float) -> None:
    """Slopes change with pebbles and yarns of 1 to 2 mm, tufts of 3 to 5 mm."""
    for seed in range(4):
        normal = texture(name, seed).normal
        assert normal is not None
        assert median_wavelength_mm(normal[..., 1].astype(np.float64), repeat_m) < most_mm


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "repeat_m", "most_mm"), [("wood_grain", 0.5, 20.0), ("terrazzo", 0.6, 40.0)]
)
def test_figure_is_as_fine_as_on_real_surfaces(name: str, repeat_m: float, most_mm: float) -> None:
    """Rings are 2 to 5 mm apart, 5 to 25 mm in cathedrals; chips are 3 to 16 mm wide."""
    greys = [texture(name, seed).albedo.astype(np.float64).mean(axis=2) for seed in range(16)]
    found = [median_wavelength_mm(grey, repeat_m) for grey in greys]
    assert np.median(found) < most_mm


@pytest.mark.parametrize("name", ["concrete", "screed"])
@pytest.mark.parametrize("seed", sampled(range(16), 8))
def test_concrete_is_grey_and_even(name: str, seed: int) -> None:
    """Channels agree within 4 %; tones vary by a few percent, holes and joints are few."""
    albedo = texture(name, seed).albedo.astype(np.float64)
    grey = albedo.mean(axis=2)
    channels = albedo.mean(axis=(0, 1))
    assert np.ptp(channels) < 0.04 * channels.mean()
    assert grey.std() < 0.06 * grey.mean()
    assert (grey < 0.8 * grey.mean()).mean() < 0.02


def test_brand_of_a_can_is_on_its_upper_front() -> None:
    """Letters are in the upper middle of the image: v up, the front at u = 1/2."""
    for seed in range(3):
        albedo = texture("can_label", seed).albedo.astype(np.int64).sum(axis=2)
        strokes = np.abs(np.diff(albedo, axis=1)) > 90
        brand, gap = strokes[30:110, 180:332], strokes[30:110, 138:146]
        assert brand.mean() > 0.01 > gap.mean()
        assert can_size(seed).radius_m < 0.05


@pytest.mark.parametrize("cells", [(2, 3), (3, 5), (192, 96)])
def test_quick_noise_is_gradient_noise_up_to_rounding(cells: tuple[int, int]) -> None:
    quick, slow = (
        make(cells, Streams(seed=1, scene=0).rng("test"), 512) for make in (quick_perlin, perlin)
    )

    assert np.abs(slow).max() > 0.4
    np.testing.assert_allclose(quick, slow, atol=2e-6)


def test_noise_is_zero_at_lattice_points_repeats_and_has_true_distances() -> None:
    """Gradient noise vanishes where gradients sit; its range is about [-1, 1]."""
    noise = perlin((4, 8), Streams(seed=1, scene=0).rng("test"), 512)
    near_lattice = noise[::128, ::64]
    assert np.abs(near_lattice).max() < 0.05
    assert 0.4 < np.abs(noise).max() < 1.3
    # One more row would be the first row: the step across the seam is an ordinary step.
    rng = Streams(seed=2, scene=0).rng("test")
    for noise in (fbm((3, 5), 4, rng), worley((7, 4), rng).nearest):
        for axis in (0, 1):
            steps = np.abs(noise - np.roll(noise, 1, axis=axis)).mean(axis=1 - axis)
            assert steps[0] < 1.5 * steps[1:].max()
    # Nearest and second nearest over all points and their periodic copies.
    seed = Streams(seed=3, scene=0)
    points = worley((5, 6), seed.rng("w"), size_px=64)
    place = 0.5 + (seed.rng("w").random((2, 5, 6)) - 0.5)
    y = (np.arange(5)[:, None] + place[0]).ravel()
    x = (np.arange(6)[None, :] + place[1]).ravel()
    copies = [(y + 5 * i, x + 6 * j) for i in (-1, 0, 1) for j in (-1, 0, 1)]
    all_y, all_x = (np.concatenate([c[k] for c in copies]) for k in (0, 1))
    row, column = (np.arange(64) + 0.5) * 5 / 64, (np.arange(64) + 0.5) * 6 / 64
    away = np.sqrt((row[:, None, None] - all_y) ** 2 + (column[None, :, None] - all_x) ** 2)
    assert np.allclose(points.nearest, np.sort(away, axis=2)[..., 0], atol=1e-4)


@pytest.mark.slow
def test_every_printed_character_has_a_glyph() -> None:
    """Words of tables are in ASCII, for OpenCV 4 has no other letters; others are in Pillow's font.

    That font draws the same box for every character that it lacks.
    """
    (folder,) = map(Path, content.__path__)
    lines = (line for p in folder.rglob("*.yaml") for line in p.read_text("utf-8").splitlines())
    foreign = {w for line in lines for w in line.partition("# ")[0].split() if not w.isascii()}
    trees = (ast.parse(p.read_text("utf-8")) for p in folder.rglob("*.py"))
    literals = {n.value for tree in trees for n in ast.walk(tree) if isinstance(n, ast.Constant)}
    # Docstrings of several lines have sources with other letters.
    words = {w for w in literals if isinstance(w, str) and "\n" not in w}
    font = ImageFont.load_default(size=20)
    glyphs = {c: bytes(font.getmask(c)) for c in {*"".join(words), "\uffff"}}
    box = glyphs.pop("\uffff")
    assert foreign == set()
    assert {c for c, glyph in glyphs.items() if glyph == box} == set()


def test_colors_are_mixed_by_weights_of_rows() -> None:
    """Of one column, as of the ends of a peel: the last row has the second colour."""
    image = np.full((3, 4, 3), 0.25, np.float32)
    weights = np.array([[0.0], [0.5], [2.0]], np.float32)

    mixed = mix_colors(image, color("#ff0000"), weights)

    assert mixed.shape == (3, 4, 3)
    np.testing.assert_allclose(mixed[:, 0, 0], [0.25, 0.625, 1.0])
    np.testing.assert_allclose(mixed[2, :, 1:], 0.0)
