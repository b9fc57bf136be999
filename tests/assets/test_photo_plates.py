"""Photographs as plates: their horizon is found, given or refused, and their light fits them."""

import math
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from gen_data.assets.checking import check_folder
from gen_data.assets.library import Library, open_library
from gen_data.assets.plates.vanishing_points import NoHorizonError, estimate_camera, find_edges
from gen_data.core.asset_types import UInt8
from gen_data.core.colorimetry import luminance
from gen_data.core.errors import AssetError, ConfigError
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.plates import Plate, ground_illuminance, horizon_px
from gen_data.core.se3 import SE3, look_at

SIZE_PX = (960, 640)
GROUND = "[[200, 630], [760, 630], [600, 420], [420, 420]]"


def tilted(pitch_deg: float, roll_deg: float, height_m: float = 1.6) -> SE3:
    """A camera above the origin that looks along X, upwards by a pitch."""
    target_m = (1.0, 0.0, height_m + math.tan(math.radians(pitch_deg)))
    return look_at((0.0, 0.0, height_m), target_m, math.radians(roll_deg))


def street_lines(pose: SE3, lens: Intrinsics, yaw_deg: float) -> UInt8:
    """Lines of two house fronts and of a house across the street, turned about the vertical."""
    image = np.full((lens.height_px, lens.width_px, 3), 150, np.uint8)
    turn = SE3.about_z(math.radians(yaw_deg))
    ends = [((2, y, z), (60, y, z)) for y in (-6, 7) for z in (0, 3, 5, 8)]
    ends += [((x, y, 0), (x, y, 8)) for y in (-6, 7) for x in np.arange(4.0, 50.0, 3.5)]
    ends += [((40, -6, z), (40, 7, z)) for z in (0, 2, 4, 6)]
    for a, b in ends:
        points = turn.apply(np.linspace(a, b, 60))
        seen = pose.inverse().apply(points)
        seen = lens.project(seen[seen[:, 2] > 0.3])
        if len(seen) > 1:
            # OpenCV puts pixel centres at integers.
            first, last = (tuple((16.0 * (p - 0.5)).round().astype(int)) for p in seen[[0, -1]])
            cv2.line(image, first, last, (30, 30, 30), 2, cv2.LINE_AA, 4)
    return image


def angle_deg(pose: SE3, zenith: np.ndarray) -> float:
    """Angle between an estimated zenith and the true one."""
    up = pose.inverse().rotate(np.array([0.0, 0.0, 1.0]))
    return math.degrees(math.acos(min(float(up @ zenith), 1.0)))


@pytest.mark.parametrize(
    ("pitch_deg", "roll_deg", "yaw_deg", "hfov_deg"),
    [(-8.0, 2.0, 10.0, 70.0), (5.0, -3.0, 25.0, 50.0)],
)
def test_a_street_has_its_horizon(
    pitch_deg: float, roll_deg: float, yaw_deg: float, hfov_deg: float
) -> None:
    pose = tilted(pitch_deg, roll_deg)
    lens = Intrinsics.from_hfov(*SIZE_PX, math.radians(hfov_deg))
    edges = find_edges(street_lines(pose, lens, yaw_deg))
    known = estimate_camera(edges, lens.fx_px)
    assert angle_deg(pose, known.zenith) < 0.1
    assert known.error_rad < math.radians(0.6)
    unknown = estimate_camera(edges, None)
    assert angle_deg(pose, unknown.zenith) < 0.3
    assert unknown.focal_px == pytest.approx(lens.fx_px, rel=0.02)


def test_edges_without_common_directions_are_refused() -> None:
    """Random lines define no horizon, and an even picture has no edges."""
    rng = np.random.default_rng(1)
    image = np.full((640, 960, 3), 150, np.uint8)
    for _ in range(120):
        x, y = (int(v) for v in rng.integers(0, 640, 2))
        dx, dy = (int(v) for v in rng.normal(0.0, 80.0, 2))
        cv2.line(image, (x, y), (x + dx, y + dy), (30, 30, 30), 2, cv2.LINE_AA)
    with pytest.raises(NoHorizonError, match=r"agree on directions|no two directions"):
        estimate_camera(find_edges(image), 700.0)
    with pytest.raises(NoHorizonError, match="0 straight edges"):
        estimate_camera(find_edges(np.full((64, 64, 3), 90, np.uint8)), 70.0)


def library_of(folder: Path, entry: str, image: UInt8 | None = None) -> Library:
    folder.mkdir(exist_ok=True)
    if image is None:
        image = np.full((640, 960, 3), 120, np.uint8)
    Image.fromarray(image).save(folder / "photo.png")
    text = f"licence: CC0-1.0\nplates:\n  - {{file: photo.png, camera_height_m: 1.6, {entry}}}\n"
    (folder / "assets.yaml").write_text(text)
    return open_library([folder], folder / "cache")


def plate_of(folder: Path, entry: str, image: UInt8 | None = None) -> Plate:
    return library_of(folder, entry, image).plate("user/photo")


@pytest.mark.slow
def test_a_given_horizon_is_kept_to_the_pixel(tmp_path: Path) -> None:
    """As two points, and as a height with a slope."""
    given = f"hfov_deg: 65, ground: {GROUND}"
    two = plate_of(tmp_path / "two", f"{given}, horizon: [[0, 300], [960, 330]]")
    assert not two.estimated
    np.testing.assert_allclose(horizon_px(two), [[0.0, 300.0], [960.0, 330.0]], atol=1e-3)
    level = plate_of(tmp_path / "one", f"{given}, horizon: {{height_px: 310, roll_deg: 2}}")
    rise = 480.0 * math.tan(math.radians(2.0))
    np.testing.assert_allclose(
        horizon_px(level), [[0.0, 310.0 - rise], [960.0, 310.0 + rise]], atol=1e-3
    )


@pytest.mark.slow
def test_the_estimate_is_reported_with_its_error(tmp_path: Path) -> None:
    """``gen-data assets check`` shows the horizon; the plate has the pose of the camera."""
    pose, lens = tilted(-6.0, 1.5), Intrinsics.from_hfov(*SIZE_PX, math.radians(65.0))
    library = library_of(
        tmp_path, f"hfov_deg: 65, ground: {GROUND}", street_lines(pose, lens, 12.0)
    )
    plate = library.plate("user/photo")
    assert plate.estimated
    up = plate.T_world_camera.inverse().rotate(np.array([0.0, 0.0, 1.0]))
    assert angle_deg(pose, up) < 0.1
    (finding,) = check_folder(tmp_path, library)
    assert "looks down 6.0 deg and rolls -1.5 deg (estimated within 1.0 deg)" in finding.note
    assert "hfov 65.0 deg" in finding.note


def test_photographs_without_exif_ask_for_the_field_of_view(tmp_path: Path) -> None:
    """A TIFF in floating point, which Pillow does not open."""
    library_of(tmp_path, f"horizon: {{height_px: 310}}, ground: {GROUND}")
    cv2.imwrite(str(tmp_path / "photo.tif"), np.full((640, 960, 3), 0.5, np.float32))
    index = tmp_path / "assets.yaml"
    index.write_text(index.read_text().replace("photo.png", "photo.tif"))
    with pytest.raises(AssetError, match=r"hfov_deg: is unknown, and there is no EXIF focal"):
        open_library([tmp_path], tmp_path / "cache").plate("user/photo")


def test_exif_gives_the_field_of_view(tmp_path: Path) -> None:
    """The 35 mm equivalent has the diagonal angle of view of film, whose diagonal is 43.27 mm."""
    image = Image.fromarray(np.full((640, 960, 3), 120, np.uint8))
    exif = Image.Exif()
    exif.get_ifd(0x8769)[0xA405] = 43
    tmp_path.joinpath("assets.yaml").write_text(
        "licence: CC0-1.0\nplates:\n  - {file: photo.jpg, camera_height_m: 1.6, "
        f"ground: {GROUND}, horizon: {{height_px: 300}}}}\n"
    )
    image.save(tmp_path / "photo.jpg", exif=exif)
    library = open_library([tmp_path], tmp_path / "cache")
    diagonal_px = math.hypot(960, 640)
    assert library.plate("user/photo").focal_px == pytest.approx(
        diagonal_px * 43.0 / 43.2666, rel=1e-4
    )


@pytest.mark.parametrize(
    ("entry", "fault"),
    [
        (f"ground: {GROUND}, hfov_deg: 60", r"photo.png: horizon: no horizon .* give horizon"),
        (f"ground: {GROUND}, horizon: {{height_px: 300}}", r"photo.png: hfov_deg: is unknown"),
        ("ground: [[0, 600], [900, 600], [400, 200]], hfov_deg: 60, horizon: {height_px: 300}",
         r"ground: corner \(400, 200\) is above the horizon"),
        ("ground: [[0, 600], [990, 600], [400, 500]], hfov_deg: 60, horizon: {height_px: 300}",
         r"corner \(990, 600\) is outside the photograph of 960 x 640"),
        (f"ground: {GROUND}, hfov_deg: 60, horizon: {{height_px: 300}}, "
         "lanes: [{center_px: [[400, 600], [400, 100]]}]",
         r"lanes\[0\].center_px: a point is above the horizon"),
    ],
)  # fmt: skip
def test_unusable_photographs_are_refused(tmp_path: Path, entry: str, fault: str) -> None:
    with pytest.raises(AssetError, match=fault):
        plate_of(tmp_path, entry)


def test_a_mask_of_another_size_is_refused_and_wrong_fields_have_a_place(tmp_path: Path) -> None:
    Image.fromarray(np.zeros((8, 8), np.uint8)).save(tmp_path / "mask.png")
    entry = f"ground: {GROUND}, hfov_deg: 60, horizon: {{height_px: 300}}, mask: mask.png"
    with pytest.raises(AssetError, match="8 x 8 px; expected the size of its photograph"):
        plate_of(tmp_path, entry)
    for entry, fault in (
        ("hfov_deg: 60", "ground"),
        (f"ground: {GROUND}, mask: gone.png", "no such file"),
    ):
        with pytest.raises(ConfigError, match=rf"assets.yaml:3:\d+: .*{fault}"):
            plate_of(tmp_path, entry)


def test_surroundings_light_the_ground_as_the_photograph_shows_it(tmp_path: Path) -> None:
    """Illuminance of level ground by the sky, integrated here, matches its albedo."""
    given = f"ground: {GROUND}, hfov_deg: 60, horizon: {{height_px: 300}}, ground_albedo: 0.25"
    image = np.full((640, 960, 3), 200, np.uint8)
    image[300:] = (90, 110, 70)
    sky_only = library_of(tmp_path / "a", given, image)
    sunny = library_of(
        tmp_path / "b", given + ", sun: {azimuth_deg: 0, elevation_deg: 30, share: 0.7}", image
    )
    for library, share in ((sky_only, 1.0), (sunny, 0.3)):
        plate, around = library.plate("user/photo"), library.environment("user/photo")
        height = len(around)
        polar = np.pi * (np.arange(height) + 0.5) / height
        texel = np.sin(polar)[:, None] * (np.pi / height) ** 2
        level = luminance(around.astype(np.float64)) * plate.sky_mean
        lux = float((level * np.maximum(np.cos(polar), 0.0)[:, None] * texel).sum())
        linear = ((np.array([90, 110, 70]) / 255.0 + 0.055) / 1.055) ** 2.4
        expected = np.pi * float(luminance(linear)) / 0.25
        assert ground_illuminance(plate) == pytest.approx(expected, rel=1e-3)
        assert lux == pytest.approx(share * expected, rel=1e-3)
        mean = float((luminance(around.astype(np.float64)) * texel).sum() / (4.0 * np.pi))
        assert mean == pytest.approx(1.0, rel=2e-3)
