"""From a photograph and its entry in ``assets.yaml`` to a Plate and its surroundings."""

import io
import itertools
import math
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.assets.asset_folder import Folder
from gen_data.assets.folder_index import LevelHorizon, PlateEntry, PlateLane
from gen_data.assets.image_decoding import decode_image
from gen_data.assets.plates import vanishing_points
from gen_data.assets.plates.surroundings import surroundings
from gen_data.core import asset_types, colorimetry, errors, intrinsics, plates, scene, se3

_EXIF_IFD, _FOCAL_35MM = 0x8769, 0xA405
_FILM_DIAGONAL_MM = math.hypot(36.0, 24.0)
_SMALL_PX = 512
"""Long side of the image from which colours are measured."""
_LANE_STEP_M = 2.0


def import_plate(folder: Folder, entry: PlateEntry) -> plates.Plate:
    """Plate of a photograph.

    Raises:
        AssetError: it is unreadable, no horizon is found, or its ground is not on the ground.
    """
    place = str(folder.root / entry.file)
    data = folder.read(entry.file)
    rgb = decode_image(data, place, color=True)
    plate = locate_camera(entry, data, rgb, place)
    _check_ground(plate, place)
    hidden = _read_mask(folder, entry, plate)
    lanes = tuple(_lane(plate, lane, k, place) for k, lane in enumerate(entry.lanes))
    color = _ground_color(plate, rgb, hidden, place)
    return surroundings(replace(plate, lanes=lanes, ground_color=color), rgb)[0]


def locate_camera(
    entry: PlateEntry, data: bytes, rgb: asset_types.UInt8, place: str
) -> plates.Plate:
    """Plate of a photograph with its camera only; its ground may be above the horizon.

    Args:
        entry: Entry of the photograph.
        data: Content of its file, for its EXIF data.
        rgb: Its pixels, uint8 [h, w, 3].
        place: Name of the file in messages.

    Raises:
        AssetError: no horizon is found, or the field of view is unknown.
    """
    height_px, width_px = rgb.shape[:2]
    if entry.hfov_deg is None:
        focal_px = exif_focal_px(data, width_px, height_px)
    else:
        focal_px = 0.5 * width_px / math.tan(math.radians(0.5 * entry.hfov_deg))
    try:
        zenith, focal_px, estimate = _find_zenith(entry, rgb, focal_px)
        pose = plates.upright_pose(zenith, entry.camera_height_m)
    except ValueError as error:
        fact = "hfov_deg" if focal_px is None and entry.horizon is not None else "horizon"
        raise errors.AssetError(f"{place}: {fact}: {error}") from None
    return plates.Plate(
        size_px=(width_px, height_px),
        focal_px=round(focal_px, 6),
        T_world_camera=pose,
        ground_px=entry.ground,
        ground_albedo=entry.ground_albedo,
        ground_roughness=entry.ground_roughness,
        sun=_sun(entry),
        mask=entry.mask,
        estimated=estimate is not None,
        horizon_error_rad=round(estimate.error_rad, 6) if estimate else 0.0,
    )


def exif_focal_px(data: bytes, width_px: int, height_px: int) -> float | None:
    """Focal length by the EXIF data of a photograph of this size; None = they do not have it."""
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(io.BytesIO(data)) as image:
            exif = image.getexif()
    except UnidentifiedImageError:  # A format without EXIF data, such as OpenEXR.
        return None
    film_mm = float(exif.get_ifd(_EXIF_IFD).get(_FOCAL_35MM, 0) or 0)
    # The 35 mm equivalent has the same diagonal angle of view (CIPA DCG-001).
    return film_mm * math.hypot(width_px, height_px) / _FILM_DIAGONAL_MM if film_mm > 0 else None


def _find_zenith(
    entry: PlateEntry, rgb: asset_types.UInt8, focal_px: float | None
) -> tuple[NDArray[np.float64], float, vanishing_points.CameraEstimate | None]:
    """Zenith in the camera frame, focal length, and the estimate if the horizon is one.

    Raises:
        ValueError: the horizon or the focal length is unknown; the text has the remedy.
    """
    height_px, width_px = rgb.shape[:2]
    horizon = entry.horizon
    if horizon is None:
        try:
            found = vanishing_points.estimate_camera(vanishing_points.find_edges(rgb), focal_px)
        except vanishing_points.NoHorizonError as error:
            given = "" if focal_px is not None else " and hfov_deg"
            raise ValueError(
                f"no horizon was found: {error}; give horizon, two of its points or its "
                f"height_px{given}"
            ) from None
        return found.zenith, found.focal_px, found
    if focal_px is None:
        raise ValueError("is unknown, and there is no EXIF focal length; give it")
    if isinstance(horizon, LevelHorizon):
        rise = math.tan(math.radians(horizon.roll_deg)) * 0.5 * width_px
        horizon = ((0.0, horizon.height_px - rise), (float(width_px), horizon.height_px + rise))
    center = (0.5 * width_px, 0.5 * height_px)
    camera = intrinsics.Intrinsics(width_px, height_px, focal_px, focal_px, *center)
    return plates.zenith_from_horizon(camera, *horizon), focal_px, None


def _sun(entry: PlateEntry) -> plates.PlateSun | None:
    sun = entry.sun
    if sun is None:
        return None
    angles = (math.radians(sun.azimuth_deg), math.radians(sun.elevation_deg))
    return plates.PlateSun(*angles, sun.share)


def _check_ground(plate: plates.Plate, place: str) -> None:
    """Refuse a ground with a corner outside the photograph or not on the ground plane."""
    width_px, height_px = plate.size_px
    points = plates.ground_points(plate, np.array(plate.ground_px))
    for (x, y), point in zip(plate.ground_px, points, strict=True):
        if not (0.0 <= x <= width_px and 0.0 <= y <= height_px):
            fault = f"is outside the photograph of {width_px} x {height_px} px"
        elif not np.isfinite(point).all():
            fault = f"is above the horizon, or farther away than {plates.FARTHEST_M:g} m"
        else:
            continue
        raise errors.AssetError(f"{place}: ground: corner ({x:g}, {y:g}) {fault}; move it")
    try:
        plates.ground_rectangle(plate)
    except ValueError as error:
        raise errors.AssetError(f"{place}: ground: {error}; move its corners") from None


def _read_mask(folder: Folder, entry: PlateEntry, plate: plates.Plate) -> NDArray[np.bool_] | None:
    """Pixels of the foreground; None if there is no mask."""
    if not entry.mask:
        return None
    place = str(folder.root / entry.mask)
    pixels = decode_image(folder.read(entry.mask), place)
    if pixels.shape[1::-1] != plate.size_px:
        raise errors.AssetError(
            f"{place}: {pixels.shape[1]} x {pixels.shape[0]} px; expected the size of its "
            f"photograph, {plate.size_px[0]} x {plate.size_px[1]} px"
        )
    return np.asarray(pixels[..., 0] >= 128)


def _lane(plate: plates.Plate, entry: PlateLane, number: int, place: str) -> scene.Lane:
    """A lane on the ground, with points at most 2 m apart."""
    corners = plates.ground_points(plate, np.array(entry.center_px))
    if not np.isfinite(corners).all():
        raise errors.AssetError(
            f"{place}: lanes[{number}].center_px: a point is above the horizon, or farther away "
            f"than {plates.FARTHEST_M:g} m; move it"
        )
    points = [corners[0]]
    for a, b in itertools.pairwise(corners):
        steps = max(math.ceil(math.hypot(*(b - a)) / _LANE_STEP_M), 1)
        points += [a + (b - a) * (k / steps) for k in range(1, steps + 1)]
    center = tuple((round(float(x), 6), round(float(y), 6), 0.0) for x, y in points)
    return scene.Lane(str(number), entry.kind, center, entry.width_m)


def _ground_color(
    plate: plates.Plate, rgb: asset_types.UInt8, hidden: NDArray[np.bool_] | None, place: str
) -> se3.Vec3:
    """Median colour of the visible ground, linear RGB."""
    width_px, height_px = plate.size_px
    scale = min(_SMALL_PX / max(plate.size_px), 1.0)
    size = (max(round(width_px * scale), 1), max(round(height_px * scale), 1))
    small = cv2.resize(rgb, size, interpolation=cv2.INTER_AREA)
    u = (np.arange(size[0]) + 0.5) * width_px / size[0]
    v = (np.arange(size[1]) + 0.5) * height_px / size[1]
    inside = plates.is_inside(np.array(plate.ground_px), np.stack(np.meshgrid(u, v), axis=-1))
    if hidden is not None:
        inside &= ~hidden[v.astype(int)[:, None], u.astype(int)[None]]
    if not inside.any():
        raise errors.AssetError(f"{place}: ground: the mask hides all of it, or it is too small")
    linear = colorimetry.srgb_decode(small[inside].astype(np.float64) / 255.0)
    red, green, blue = (round(max(float(part), 1e-4), 6) for part in np.median(linear, axis=0))
    return (red, green, blue)
