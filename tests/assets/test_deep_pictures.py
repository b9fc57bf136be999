"""Pictures of users: turned by EXIF, with more than eight bits, in odd orders and layers."""

import io
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from gen_data.assets.image_decoding import (
    decode_image,
    decode_radiance,
    image_remarks,
    read_exr,
)
from gen_data.core.errors import AssetError


def encoded(image: Image.Image, kind: str, **options: object) -> bytes:
    stream = io.BytesIO()
    image.save(stream, kind, **options)
    return stream.getvalue()


@pytest.mark.parametrize("orientation", range(1, 9))
def test_pictures_are_upright_as_exif_says(orientation: int) -> None:
    """Red at the top left of an upright picture of 24 x 16, stored in all eight ways.

    Source: CIPA DC-008 (Exif 2.32), tag 0x0112: the place of row 0 and column 0.
    """
    upright = np.zeros((16, 24, 3), np.uint8)
    upright[:8, :12] = (255, 0, 0)
    turned = upright.swapaxes(0, 1)
    stored = {
        1: upright, 2: upright[:, ::-1], 3: upright[::-1, ::-1], 4: upright[::-1],
        5: turned, 6: turned[::-1], 7: turned[::-1, ::-1], 8: turned[:, ::-1],
    }  # fmt: skip
    exif = Image.Exif()
    exif[0x0112] = orientation
    picture = Image.fromarray(np.ascontiguousarray(stored[orientation]))
    data = encoded(picture, "PNG", exif=exif)
    assert decode_image(data, "a.png").tolist() == upright.tolist()


def test_sixteen_bits_become_eight_and_floating_point_counts_to_1() -> None:
    """Grey 0, 257 and 65535 are 0, 1 and 255: PNG and TIFF, grey and colour."""
    grey = np.array([[0, 257, 65535]], np.uint16)
    for kind in ("PNG", "TIFF"):
        data = encoded(Image.fromarray(grey), kind)
        assert decode_image(data, "a")[0, :, 0].tolist() == [0, 1, 255]
    color = np.repeat(grey[..., None], 3, axis=2)
    color[0, 1] = (0, 257, 65535)
    done, data = cv2.imencode(".tiff", color)
    assert done
    # OpenCV counts blue, green, red.
    assert decode_image(data.tobytes(), "a")[0, 1].tolist() == [255, 1, 0]
    # 0, 0.5 and 1, and beyond.
    values = np.array([[0.0, 0.5, 1.0, 7.0]], np.float32)
    levels = decode_image(encoded(Image.fromarray(values), "TIFF"), "a")[0, :, 0]
    assert levels.tolist() == [0, 128, 255, 255]


@pytest.mark.parametrize(("kind", "remarks"), [("TIFF", 1), ("WEBP", 1), ("PNG", 1), ("MPO", 0)])
def test_files_of_several_pictures_show_the_first_and_the_others_are_named(
    kind: str, remarks: int
) -> None:
    """Pages and animations; telephones add depth or previews to an MPO file."""
    first, second = (Image.new("RGB", (8, 8), color) for color in ("red", "blue"))
    data = encoded(first, kind, save_all=True, append_images=[second])
    assert decode_image(data, "a")[4, 4].tolist() == pytest.approx((255, 0, 0), abs=5)
    assert image_remarks(data) == ("of 2 pictures, the first is used",) * remarks


def radiance(rows: int, columns: int, resolution: str, image: np.ndarray) -> bytes:
    """An uncompressed Radiance file whose scan lines are the rows of [rows, columns, 3]."""
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{resolution}\n".encode()
    exponent = np.full((rows, columns, 1), 129, np.uint8)
    mantissa = np.rint(image.reshape(rows, columns, 3) * 128.0).astype(np.uint8)
    return head + np.concatenate([mantissa, exponent], axis=2).tobytes()


@pytest.mark.parametrize(
    ("first", "second"),
    [("-Y", "+X"), ("+Y", "+X"), ("-Y", "-X"), ("+Y", "-X"), ("+X", "-Y"), ("-X", "+Y")],
)
def test_radiance_files_of_all_orders_show_the_same(first: str, second: str) -> None:
    """2 x 4: bright at the top left. Source: Ward, "Real pixels", Graphics Gems II, 1991."""
    shown = np.full((2, 4, 3), 0.25)
    shown[0, 0] = 1.0
    stored = shown[::-1] if "+Y" in (first, second) else shown
    stored = stored[:, ::-1] if "-X" in (first, second) else stored
    stored = stored.swapaxes(0, 1) if first[1] == "X" else stored
    rows, columns = stored.shape[:2]
    data = radiance(rows, columns, f"{first} {rows} {second} {columns}", stored)
    found = decode_radiance(data, "a.hdr")
    assert np.unravel_index(found[..., 0].argmax(), (2, 4)) == (0, 0)
    assert found[0, 0, 0] / found[1, 3, 0] == pytest.approx(4.0, rel=0.02)


def test_radiance_in_xyz_is_refused_in_words() -> None:
    data = radiance(2, 4, "-Y 2 +X 4", np.ones((2, 4, 3))).replace(b"rgbe", b"xyze")
    with pytest.raises(AssetError, match="holds CIE XYZ"):
        decode_radiance(data, "a.hdr")


@pytest.mark.parametrize(
    ("names", "expected"),
    [(("R", "G", "B"), (0.1, 0.2, 0.3)),
     (("ViewLayer.Combined.R", "ViewLayer.Combined.G", "ViewLayer.Combined.B"), (0.1, 0.2, 0.3)),
     (("r", "g", "b"), (0.1, 0.2, 0.3)), (("Y",), (0.1, 0.1, 0.1))],
    ids=["plain", "Blender's layer", "lower case", "grey"],
)  # fmt: skip
def test_openexr_by_names(
    tmp_path: Path, names: tuple[str, ...], expected: tuple[float, ...]
) -> None:
    exr = pytest.importorskip("OpenEXR")
    values = {name: np.full((2, 4), 0.1 * (k + 1), np.float32) for k, name in enumerate(names)}
    values["ViewLayer.Depth.Z"] = np.ones((2, 4), np.float32)
    header = {"compression": exr.ZIP_COMPRESSION, "type": exr.scanlineimage}
    with exr.File(header, values) as file:
        file.write(str(tmp_path / "a.exr"))
    found = read_exr((tmp_path / "a.exr").read_bytes(), "a.exr")
    assert found[1, 2] == pytest.approx(expected)
