"""Panoramas of users: Radiance and OpenEXR; invalid light is refused with one clear error."""

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from gen_data.assets.image_decoding import decode_radiance
from gen_data.assets.library import open_library
from gen_data.content.packs.panoramas import encode_radiance
from gen_data.core.errors import AssetError


def pixels(height: int = 8) -> np.ndarray:
    """Some light, brighter from above, in three colours; exact in Radiance's eight bits."""
    rows = np.repeat(np.linspace(4.0, 1.0, height)[:, None], 2 * height, axis=1)
    return (np.round(rows[..., None] * (1.0, 0.5, 0.25) * 32.0) / 32.0).astype(np.float32)


def exr_file(rgb: np.ndarray, names: str = "RGB") -> bytes:
    channels = {name: np.ascontiguousarray(rgb[..., k]) for k, name in enumerate(names)}
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with tempfile.NamedTemporaryFile(suffix=".exr") as file:
        OpenEXR.File(header, channels).write(file.name)
        return Path(file.name).read_bytes()


def with_texel(value: float) -> np.ndarray:
    rgb = pixels()
    rgb[5, 3, 1] = value
    return rgb


def test_openexr_and_radiance_hold_the_same_light_and_ringing_below_zero_is_dark() -> None:
    """The same panorama of mean luminance 1 from both, to the precision of Radiance (1 %)."""
    exr, hdr = (decode_radiance(made(pixels()), "a") for made in (exr_file, encode_radiance))
    np.testing.assert_allclose(exr, hdr, rtol=0.01)
    np.testing.assert_allclose(exr[0, 0] / exr[0, 0, 0], (1.0, 0.5, 0.25), rtol=1e-6)
    rows = np.cos(np.pi * np.arange(9) / 8)
    mean = ((exr @ (0.2126, 0.7152, 0.0722)).mean(axis=1) * 0.5 * (rows[:-1] - rows[1:])).sum()
    assert mean == pytest.approx(1.0, rel=1e-6)
    # Filters leave values a little below zero next to a sun; they count as zero.
    rgb = with_texel(-1e-5)
    assert decode_radiance(exr_file(rgb), "sky")[5, 3, 1] == 0.0


UNREADABLE = [b"", b"\x89PNG\r\n\x1a\n" + bytes(64), b"no image at all",
              b"\xff\xd8\xff" + bytes(90)]  # fmt: skip


@pytest.mark.hostile
@pytest.mark.parametrize(
    ("make", "said", "kind"),
    [
        *((make, said, "environment") for make, said in (
            (lambda: exr_file(with_texel(float("nan"))), "row 5, column 3 is nan"),
            (lambda: exr_file(with_texel(float("inf"))), "row 5, column 3 is inf"),
            (lambda: exr_file(with_texel(-2.0)), "row 5, column 3 is -2"),
            (lambda: exr_file(0.0 * pixels()), "black"),
            (lambda: exr_file(pixels()[:, :8]), "8 x 8 px; a panorama is twice as wide as high"),
            (lambda: exr_file(pixels()[..., :2], "RG"), "has no channels R, G, B"),
            (lambda: exr_file(pixels(64))[:600], "unreadable OpenEXR image"),
            (lambda: exr_file(pixels())[:4] + bytes(200), "unreadable OpenEXR image"),
            (lambda: exr_file(np.ones((1, 17000, 3), np.float32)), "at most 16384 a side"),
            (lambda: encode_radiance(pixels())[:-100], "unreadable panorama"),
            (lambda: encode_radiance(0.0 * pixels()), "black"),
            (lambda: b"#?RADIANCE\n\nnonsense", "neither Radiance nor OpenEXR"),
            *((lambda data=data: data, "neither Radiance nor OpenEXR") for data in UNREADABLE[:2]),
        )),
        *((lambda data=data: data, "unreadable image", "texture") for data in UNREADABLE),
    ],
)  # fmt: skip
def test_what_is_no_image_is_refused_and_nothing_is_kept(
    tmp_path: Path, make: Callable[[], bytes], said: str, kind: str
) -> None:
    folder, cache = tmp_path / "mine", tmp_path / "cache"
    folder.mkdir()
    file = {"environment": "it.exr", "texture": "it.png"}[kind]
    (folder / file).write_bytes(make())
    (folder / "assets.yaml").write_text(f"{kind}s:\n  - {{id: it, file: {file}}}\n")
    library = open_library((folder,), cache, tmp_path / "no packs")
    with pytest.raises(AssetError, match=rf"{file}: ") as refused:
        getattr(library, kind)("user/it")
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)
    assert not [path for path in cache.rglob("*") if path.is_file()]


def test_a_panorama_of_the_user_lights_as_one_of_the_packs(tmp_path: Path) -> None:
    """An OpenEXR file in a user's folder is an environment by its id."""
    (tmp_path / "sky.exr").write_bytes(exr_file(pixels(16)))
    (tmp_path / "assets.yaml").write_text(
        "environments:\n  - {id: sky, file: sky.exr, tags: [outdoor]}\n"
    )
    library = open_library((tmp_path,), tmp_path / "cache", tmp_path / "no packs")
    assert [a.asset_id for a in library.find(("outdoor",), "environment")].count("user/sky") == 1
    assert library.environment("user/sky").shape == (16, 32, 3)
