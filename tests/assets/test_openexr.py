"""OpenEXR files of users: primaries, windows, parts, and maps of textures."""

from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
from numpy.typing import NDArray

from gen_data.assets.image_decoding import decode_image, decode_radiance, image_remarks, read_exr
from gen_data.assets.library import open_library
from gen_data.core.errors import AssetError


def part(rgb: NDArray[Any], name: str = "", names: str = "RGB", **header: Any) -> OpenEXR.Part:
    channels = {one: np.ascontiguousarray(rgb[..., k], "f4") for k, one in enumerate(names)}
    head = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **header}
    return OpenEXR.Part(head, channels, name)


def window(x: int, y: int, width: int, height: int) -> tuple[NDArray[Any], NDArray[Any]]:
    return np.array([x, y], "i4"), np.array([x + width - 1, y + height - 1], "i4")


def encoded(folder: Path, *parts: OpenEXR.Part) -> bytes:
    OpenEXR.File(list(parts)).write(str(folder / "made.exr"))
    return (folder / "made.exr").read_bytes()


ACES_AP0 = (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767)
DISPLAY_P3 = (0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.329)
CIE_XYZ = (1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1 / 3, 1 / 3)


@pytest.mark.parametrize(
    ("chromaticities", "stored", "expected"),
    [
        # Grey stays.
        (ACES_AP0, (0.5, 0.5, 0.5), (0.5, 0.5, 0.5)),
        # ACES to linear Rec. 709, as OpenColorIO's ACES configurations have it (Bradford).
        (ACES_AP0, (0.4, 0.3, 0.2), (2.52140 * 0.4 - 1.13400 * 0.3 - 0.38756 * 0.2,
                                     -0.27621 * 0.4 + 1.37259 * 0.3 - 0.09628 * 0.2,
                                     -0.01532 * 0.4 - 0.15299 * 0.3 + 1.16839 * 0.2)),
        # CSS Color 4: linear Display P3 to XYZ and to linear sRGB.
        (DISPLAY_P3, (0.4, 0.3, 0.2), (1.22494 * 0.4 - 0.22494 * 0.3,
                                       -0.04206 * 0.4 + 1.04206 * 0.3,
                                       -0.01964 * 0.4 - 0.07864 * 0.3 + 1.09827 * 0.2)),
        # Red of Display P3 is outside of Rec. 709.
        (DISPLAY_P3, (1.0, 0.0, 0.0), (1.22494, 0.0, 0.0)),
        ((0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329), (0.4, 0.3, 0.2), (0.4, 0.3, 0.2)),
    ],
)  # fmt: skip
def test_colours_of_other_primaries_become_rec709(
    tmp_path: Path,
    chromaticities: tuple[float, ...],
    stored: tuple[float, ...],
    expected: tuple[float, ...],
) -> None:
    rgb = np.broadcast_to(stored, (2, 4, 3))
    data = encoded(tmp_path, part(rgb, chromaticities=chromaticities))
    np.testing.assert_allclose(read_exr(data, "a")[1, 2], expected, atol=2e-4)
    np.testing.assert_allclose(read_exr(data, "a", color=False)[1, 2], stored, rtol=1e-6)


def test_values_of_cie_xyz_become_rec709(tmp_path: Path) -> None:
    """Primaries (1, 0), (0, 1) and (0, 0) with white E: white becomes white."""
    data = encoded(tmp_path, part(np.full((2, 4, 3), 0.7), chromaticities=CIE_XYZ))
    np.testing.assert_allclose(read_exr(data, "a")[0, 0], 0.7, rtol=1e-5)


def test_a_cut_panorama_lies_in_its_display_window(tmp_path: Path) -> None:
    """A data window of 3 x 1 within 6 x 3, at column 2 and row 1, and one that reaches beyond."""
    rgb = np.arange(1.0, 10.0).reshape(1, 3, 3)
    inner = {"displayWindow": window(0, 0, 6, 3), "dataWindow": window(2, 1, 3, 1)}
    data = encoded(tmp_path, part(rgb, **inner))
    expected = np.zeros((3, 6, 3))
    expected[1, 2:5] = rgb[0]
    assert read_exr(data, "a").tolist() == expected.tolist()
    assert decode_radiance(data, "a").shape == (3, 6, 3)
    note = "its data window is not its display window; the rest is black"
    assert image_remarks(data) == (note,)
    outer = {"displayWindow": window(1, 0, 2, 1), "dataWindow": window(0, 0, 3, 1)}
    found = read_exr(encoded(tmp_path, part(rgb, **outer)), "a")
    assert found.tolist() == rgb[:, 1:].tolist()


def test_a_data_window_of_a_whole_panorama_is_read_whole(tmp_path: Path) -> None:
    """OpenEXR's environment maps span their data window (ImfEnvmap.h, LatLongMap)."""
    rgb = np.ones((2, 4, 3))
    data = encoded(tmp_path, part(rgb, displayWindow=window(0, 0, 9, 9)))
    assert read_exr(data, "a").shape == (2, 4, 3)
    assert image_remarks(data) == ("its data window is not its display window; read as the whole",)


def test_the_first_part_with_colours_is_read_and_all_else_is_named(tmp_path: Path) -> None:
    """Depth first, as some renderers write it; A is coverage."""
    depth, rgb = np.full((2, 4, 1), 9.0), np.full((2, 4, 5), 0.25)
    data = encoded(
        tmp_path, part(depth, "depth", "Z"), part(rgb, "beauty", "RGBAZ"), part(rgb, "copy")
    )
    assert read_exr(data, "a").tolist() == np.full((2, 4, 3), 0.25).tolist()
    assert image_remarks(data) == (
        "channels that are not used: Z", "parts that are not read: depth, copy",
    )  # fmt: skip
    with pytest.raises(AssetError, match="has no channels R, G, B, but Z"):
        read_exr(encoded(tmp_path, part(depth, "depth", "Z")), "a")


def test_maps_of_textures_are_numbers_and_colours_are_encoded(tmp_path: Path) -> None:
    """Linear 0.5 is 188 in sRGB, and a roughness of 0.5 is 128; light above 1 is 1."""
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "c.exr").write_bytes(encoded(tmp_path, part(np.full((2, 2, 3), (0.5, 0.0, 7.0)))))
    (folder / "r.exr").write_bytes(encoded(tmp_path, part(np.full((2, 2, 1), 0.5), names="Y")))
    (folder / "n.exr").write_bytes(
        encoded(tmp_path, part(np.full((2, 2, 3), (0.5, 0.75, 1.0)), chromaticities=ACES_AP0))
    )
    (folder / "assets.yaml").write_text(
        "textures: [{id: t, maps: {color: c.exr, normal: n.exr, roughness: r.exr}}]\n"
    )
    found = open_library((folder,), tmp_path / "cache", tmp_path / "no packs").texture("user/t")
    assert found.roughness is not None and found.normal is not None
    assert found.albedo[0, 0].tolist() == [188, 0, 255]
    assert found.normal[0, 0].tolist() == [128, 191, 255]
    assert found.roughness[0, 0] == 128


def test_maps_with_values_below_zero_are_refused(tmp_path: Path) -> None:
    """Normals from -1 to 1 would be cut to half."""
    data = encoded(tmp_path, part(np.full((2, 2, 3), -0.5)))
    with pytest.raises(AssetError, match=r"n\.exr: has values below 0; save it as PNG"):
        decode_image(data, "n.exr")


def test_images_of_meshes_are_no_panoramas_without_an_index(tmp_path: Path) -> None:
    """Next to a mesh, a square file is a texture; cut panoramas are known by their display."""
    folder = tmp_path / "mine"
    folder.mkdir()
    square, sky = np.ones((4, 4, 3)), np.ones((2, 4, 3))
    (folder / "rough.exr").write_bytes(encoded(tmp_path, part(square)))
    (folder / "sky.exr").write_bytes(encoded(tmp_path, part(sky)))
    cut = part(square, displayWindow=window(0, 0, 8, 4))
    (folder / "cut.exr").write_bytes(encoded(tmp_path, cut))

    def skies() -> list[str]:
        library = open_library((folder,), tmp_path / "cache", tmp_path / "no packs")
        return [
            one.asset_id for one in library.find((), "environment") if one.asset_id[:4] == "user"
        ]

    assert skies() == ["user/cut", "user/rough", "user/sky"]
    (folder / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert skies() == ["user/cut", "user/sky"]
