"""Colours of pictures with embedded profiles become sRGB; normals and masks stay."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from gen_data.assets.checking import check_folder
from gen_data.assets.image_decoding import decode_image, image_remarks
from gen_data.assets.library import open_library
from gen_data.lab.matching import real_files
from gen_data.lab.study import real_pictures
from tests.assets import color_profile_files as profiles
from tests.assets.gltf_builder import UVS, Builder

# CSS Color Module Level 4, section 17 (sample code): lin_P3 and lin_a98rgb to XYZ, XYZ to lin_sRGB.
_XYZ_FROM_P3 = np.array(
    [[608311 / 1250200, 189793 / 714400, 198249 / 1000160],
     [35783 / 156275, 247089 / 357200, 198249 / 2500400],
     [0, 32229 / 714400, 5220557 / 5000800]]
)  # fmt: skip
_XYZ_FROM_ADOBE = np.array(
    [[573536 / 994567, 263643 / 1420810, 187206 / 994567],
     [591459 / 1989134, 6239551 / 9945670, 374412 / 4972835],
     [53769 / 1989134, 351524 / 4972835, 4929758 / 4972835]]
)  # fmt: skip
_SRGB_FROM_XYZ = np.array(
    [[12831 / 3959, -329 / 214, -1974 / 3959],
     [-851781 / 878810, 1648619 / 878810, 36519 / 878810],
     [705 / 12673, -2585 / 12673, 705 / 667]]
)  # fmt: skip
_COLORS = np.array(
    [[[200, 100, 50], [30, 160, 60], [90, 90, 90], [255, 255, 255], [0, 0, 0], [255, 0, 0]]],
    np.uint8,
)


def encode_srgb(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    clipped = np.clip(linear, 0.0, 1.0)
    power = 1.055 * np.maximum(clipped, 1e-9) ** (1.0 / 2.4) - 0.055
    return 255.0 * np.where(clipped <= 0.0031308, 12.92 * clipped, power)


def decode_srgb(levels: NDArray[Any]) -> NDArray[np.float64]:
    v = levels / 255.0
    return np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)


def saved(image: Image.Image, kind: str = "PNG", **options: object) -> bytes:
    stream = io.BytesIO()
    image.save(stream, kind, **options)
    return stream.getvalue()


DISPLAY_P3 = profiles.rgb_profile(profiles.DISPLAY_P3, profiles.srgb_curve())
ADOBE_RGB = profiles.rgb_profile(profiles.ADOBE_RGB, 2.19921875)


@pytest.mark.parametrize("name", ["Display P3", "Adobe RGB"])
def test_photographs_of_wide_colours_become_srgb(name: str) -> None:
    """To half a level, by the matrices of CSS Color 4; colours outside of sRGB are clipped."""
    if name == "Display P3":
        profile, matrix = DISPLAY_P3, _XYZ_FROM_P3
        linear = decode_srgb(_COLORS)
    else:
        profile, matrix, linear = ADOBE_RGB, _XYZ_FROM_ADOBE, (_COLORS / 255.0) ** (563 / 256)
    expected = encode_srgb(linear @ matrix.T @ _SRGB_FROM_XYZ.T)
    data = saved(Image.fromarray(_COLORS), icc_profile=profile)
    found = decode_image(data, "a.png", color=True)
    np.testing.assert_allclose(found, expected, atol=0.6)
    assert np.abs(found.astype(int) - _COLORS).max() > 20
    assert image_remarks(data) == ()
    # Normals, roughness and masks are numbers, not colours.
    assert decode_image(data, "a.png").tolist() == _COLORS.tolist()


def test_pixels_of_srgb_stay_with_any_profile_of_it() -> None:
    """Also in WebP."""
    profile = profiles.rgb_profile(profiles.REC709, profiles.srgb_curve())
    for kind, options in (("PNG", {}), ("WEBP", {"lossless": True})):
        data = saved(Image.fromarray(_COLORS), kind, icc_profile=profile, **options)
        assert decode_image(data, "a", color=True).tolist() == _COLORS.tolist()


def test_transparency_and_orientation_stay_with_a_profile() -> None:
    """Turned by 180 degrees; the profile leaves alpha alone."""
    rgba = np.dstack([_COLORS, np.arange(0, 240, 40, dtype=np.uint8)[None]])
    exif = Image.Exif()
    exif[0x0112] = 3
    data = saved(Image.fromarray(rgba), icc_profile=DISPLAY_P3, exif=exif)
    plain = saved(Image.fromarray(_COLORS), icc_profile=DISPLAY_P3)
    found = decode_image(data, "a.png", alpha=True, color=True)
    assert found[..., 3].tolist() == [[200, 160, 120, 80, 40, 0]]
    assert found[0, ::-1, :3].tolist() == decode_image(plain, "a.png", color=True)[0].tolist()


def test_grey_pictures_follow_their_gamma() -> None:
    """Gamma 1.0 of 128: half of white's light is sRGB 188."""
    data = saved(Image.new("L", (2, 2), 128), icc_profile=profiles.grey_profile(1.0))
    expected = encode_srgb(np.array([128 / 255.0]))[0]
    np.testing.assert_allclose(decode_image(data, "a", color=True)[0, 0], expected, atol=0.6)


def lab_to_srgb(lab: tuple[float, float, float]) -> NDArray[np.float64]:
    """By CIE 15 (white D50) and the Bradford matrix of CSS Color 4 from D50 to D65."""
    fy = (lab[0] + 16.0) / 116.0
    f = np.array([fy + lab[1] / 500.0, fy, fy - lab[2] / 200.0])
    xyz = np.where(f > 6 / 29, f**3, 3 * (6 / 29) ** 2 * (f - 4 / 29)) * profiles.D50
    to_d65 = np.array(
        [[0.955473421488075, -0.02309845494876471, 0.06325924320057072],
         [-0.0283697093338637, 1.0099953980813041, 0.021041441191917323],
         [0.012314014864481998, -0.020507649298898964, 1.330365926242124]]
    )  # fmt: skip
    return encode_srgb(_SRGB_FROM_XYZ @ to_d65 @ xyz)


def test_inks_of_cmyk_become_their_measured_colours() -> None:
    """Full and half cyan and magenta of a JPEG; paper becomes white and full ink black."""
    inks = np.zeros((2, 2, 2, 2, 3))
    inks[..., 0] = 100.0
    inks[1] = (60.0, -30.0, -40.0)
    inks[:, 1] = (50.0, 60.0, 0.0)
    inks[..., 1, :] = 0.0
    profile = profiles.ink_profile(inks)
    for cmyk, lab in (
        ((255, 0, 0, 0), (60.0, -30.0, -40.0)), ((0, 255, 0, 0), (50.0, 60.0, 0.0)),
        ((0, 0, 0, 0), (100.0, 0.0, 0.0)), ((0, 0, 0, 255), (0.0, 0.0, 0.0)),
    ):  # fmt: skip
        data = saved(Image.new("CMYK", (8, 8), cmyk), "JPEG", quality=100, icc_profile=profile)
        found = decode_image(data, "a.jpg", color=True)[0, 0]
        np.testing.assert_allclose(found, lab_to_srgb(lab), atol=2.0)


UNUSED = "its colour profile is damaged; its values count as sRGB"


@pytest.mark.parametrize(
    ("mode", "profile", "remark"),
    [("RGB", b"no profile", UNUSED), ("RGB", DISPLAY_P3[:300], UNUSED),
     ("RGB", profiles.grey_profile(1.0), "its colour profile is of GRAY; not applied"),
     ("CMYK", None, "CMYK without a colour profile; its inks count as ideal")],
    ids=["text", "cut", "of grey", "none"],
)  # fmt: skip
def test_profiles_that_cannot_be_used_are_named(
    mode: str, profile: bytes | None, remark: str
) -> None:
    """Values stay as stored."""
    image = Image.new(mode, (8, 8), 100)
    data = saved(image, "TIFF", icc_profile=profile)
    assert image_remarks(data) == (remark,)
    assert decode_image(data, "a", color=True).tolist() == np.array(image.convert("RGB")).tolist()


def test_colours_that_only_exif_states_are_named() -> None:
    """Cameras set to Adobe RGB write 65535, uncalibrated, and no profile (DCF 2.0); 1 is sRGB."""
    for space, remarks in ((65535, 1), (1, 0)):
        exif = Image.Exif()
        exif.get_ifd(0x8769)[0xA001] = space
        data = saved(Image.new("RGB", (8, 8)), "JPEG", exif=exif)
        assert len(image_remarks(data)) == remarks


ORANGE = (200, 100, 50)
AS_P3 = tuple(encode_srgb(_SRGB_FROM_XYZ @ _XYZ_FROM_P3 @ decode_srgb(np.array(ORANGE))))
"""The colour above in Display P3, as sRGB: (214.9, 92.6, 31.0)."""


def test_own_textures_have_the_colours_of_their_profiles_and_normals_stay(tmp_path: Path) -> None:
    """Of images alone and of maps; only colours have remarks."""
    folder = tmp_path / "mine"
    folder.mkdir()
    for name, profile in (("photo.png", DISPLAY_P3), ("bad.png", b"no profile")):
        Image.new("RGB", (4, 4), ORANGE).save(folder / name, icc_profile=profile)
    (folder / "assets.yaml").write_text(
        "textures: [{id: one, file: photo.png}, {id: bad, file: bad.png},"
        " {id: maps, maps: {color: photo.png, emission: bad.png, normal: copy.png}}]\n"
    )
    Image.new("RGB", (4, 4), ORANGE).save(folder / "copy.png", icc_profile=DISPLAY_P3)
    library = open_library((folder,), tmp_path / "cache", tmp_path / "no packs")
    maps = library.texture("user/maps")
    for found, color in (
        (library.texture("user/one").albedo, AS_P3), (maps.albedo, AS_P3), (maps.normal, ORANGE),
        (maps.emission, ORANGE),
    ):  # fmt: skip
        assert found is not None
        np.testing.assert_allclose(found[0, 0], color, atol=0.6)
    notes = {one.asset_id: one.warnings[:-1] for one in check_folder(folder, library)}
    named = (f"{folder / 'bad.png'}: {UNUSED}",)
    assert notes == {"user/one": (), "user/bad": named, "user/maps": named}
    assert library.remarks("user/bad", read=False) is not None


def test_images_of_meshes_have_the_colours_of_their_profiles_except_in_gltf(tmp_path: Path) -> None:
    """Readers must ignore profiles (glTF 2.0, "Images"); MTL states nothing."""
    folder = tmp_path / "mine"
    folder.mkdir()
    builder = Builder()
    builder.attributes["TEXCOORD_0"] = builder.accessor(UVS)
    builder.textured(folder)
    builder.write(folder)
    (folder / "m.mtl").write_text("newmtl m\nmap_Kd i.png\n")
    (folder / "b.obj").write_text(
        "mtllib m.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"
    )
    Image.new("RGB", (4, 4), ORANGE).save(folder / "i.png", icc_profile=DISPLAY_P3)
    library = open_library((folder,), tmp_path / "cache", tmp_path / "no packs")
    for name, color in (("a", ORANGE), ("b", AS_P3)):
        texture = library.texture(library.mesh(f"user/{name}").materials[0].texture)
        np.testing.assert_allclose(texture.albedo[0, 0], color, atol=0.6)


def test_backdrops_have_the_colours_of_their_profiles(tmp_path: Path) -> None:
    """The photograph, and the reflectance of the ground that is measured in it, linear."""
    Image.new("RGB", (960, 640), ORANGE).save(tmp_path / "a.png", icc_profile=DISPLAY_P3)
    ground = "[[0, 640], [300, 400], [660, 400], [960, 640]]"
    (tmp_path / "assets.yaml").write_text(
        f"plates: [{{file: a.png, camera_height_m: 1.6, hfov_deg: 65, ground: {ground},"
        " horizon: {height_px: 310}}]\n"
    )
    library = open_library((tmp_path,), tmp_path / "cache", tmp_path / "no packs")
    np.testing.assert_allclose(library.texture("user/a").albedo[0, 0], AS_P3, atol=0.6)
    linear = decode_srgb(np.array(AS_P3))
    np.testing.assert_allclose(library.plate("user/a").ground_color, linear, atol=0.005)


def test_photographs_of_match_and_study_have_the_colours_of_their_profiles(tmp_path: Path) -> None:
    """A damaged profile is named in both."""
    for name, profile in (("a.png", DISPLAY_P3), ("b.png", b"no profile")):
        path = tmp_path / "images" / name
        path.parent.mkdir(exist_ok=True)
        Image.new("RGB", (80, 80), ORANGE).save(path, icc_profile=profile)
        (tmp_path / "images" / name).with_suffix(".txt").write_text("0 0.5 0.5 0.25 0.5\n")
    (tmp_path / "classes.txt").write_text("cup\n")
    inventory = real_files.Inventory()
    photos = list(real_files.read_photos(real_files.find_files(tmp_path), 9, inventory))
    for photo, color in zip(photos, (AS_P3, ORANGE), strict=True):
        np.testing.assert_allclose(photo.rgb[0, 0], color, atol=0.6)
    assert inventory.notes["photographs"] == f"2 of 80 x 80 px; 1: {UNUSED}"
    real = real_pictures.read_real(tmp_path)
    assert real.skipped == {f"image that is read, but: {UNUSED}": 1}
    first = real_pictures.read_image(real.pictures[0].path)
    np.testing.assert_allclose(first[0, 0], AS_P3, atol=0.6)
