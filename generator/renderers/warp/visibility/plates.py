"""Photographs behind rendered objects: differential rendering on a photograph's ground.

The ground is rendered with and without the objects on it. Its pixels show the photograph times the
ratio of both: shadows, reflections and the light of lamps fall on the photograph; where no surface
is hit, the photograph is unchanged. The foreground marked by a mask covers both.

Source: Debevec, "Rendering synthetic objects into real scenes", SIGGRAPH 1998; with a ratio in
place of his difference, which keeps the texture of the ground in shadows.
"""

from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.core import colorimetry, errors, interfaces, plates, se3
from gen_data.core.asset_types import Float32
from gen_data.core.capture import Channel
from gen_data.core.scene import Camera, Scene, Weather
from gen_data.renderers.warp.visibility.frame_context import Backdrop, CameraView
from gen_data.renderers.warp.visibility.kernels import photographs as kernels

_RATIO_MAX = 16.0
"""Headlights on dark ground multiply its light; more is an error of a nearly black ratio."""
_DARKEST_CD_M2 = np.float32(1e-6 * plates.WHITE_CD_M2)
"""Radiance without objects below which the ground has no ratio."""
_FIREFLY = np.float32(1.3)
"""Largest ratio of a path-traced pixel over the median around it."""
_SAME_PLACE = 1e-5
_FLOW = frozenset({Channel.FLOW_FORWARD, Channel.FLOW_BACKWARD})
_OCCLUDED = frozenset({Channel.FLOW_OCCLUDED_FORWARD, Channel.FLOW_OCCLUDED_BACKWARD})


def open_backdrop(scene: Scene, camera: Camera, assets: interfaces.AssetLibrary) -> Backdrop | None:
    """The photograph behind a scene, without ``unshaded``; None if there is none.

    Raises:
        SampleError: the camera or the light is not the photograph's.
    """
    if not plates.has_plate(scene):
        return None
    photo_id = scene.environment.image
    if scene.weather != Weather():
        raise errors.SampleError(
            "the scene has weather, but a photograph has its own; remove the randomizer weather"
        )
    if assets.get(photo_id).kind != "plate":
        raise errors.SampleError(
            f"environment '{photo_id}': the scene has the ground of a photograph, but other light; "
            "remove the randomizers that change the environment (environment, time_of_day, weather)"
        )
    plate = assets.plate(photo_id)
    _check_camera(camera, plate)
    size = (camera.intrinsics.width_px, camera.intrinsics.height_px)
    # The scale of the environment and of the photograph is the same.
    white = scene.environment.luminance_cd_m2 / plate.sky_mean
    photo = colorimetry.srgb_decode(
        assets.texture(photo_id).albedo.astype(np.float32) / np.float32(255.0)
    )
    mask = None
    if plate.mask:
        image = assets.texture(f"{photo_id}#{plate.mask}").albedo[..., 0]
        mask = _fit((image >= 128).astype(np.float32), plate, size)
    return Backdrop(_fit(photo, plate, size) * np.float32(white), mask, _ground(plate, size))


def without_things(scene: Scene) -> Scene:
    """The ground of a photograph under its own light: no other bodies, and no lamps on them."""
    bodies = tuple(body for body in scene.bodies if plates.is_catcher(body))
    kept = {body.name for body in bodies}
    lights = tuple(light for light in scene.lights if not light.body or light.body in kept)
    tracks = tuple(track for track in scene.tracks if track.body in kept)
    return replace(scene, bodies=bodies, lights=lights, tracks=tracks, changes=())


def show_photo(frame: CameraView, backdrop: Backdrop, radiance: wp.array) -> None:
    """Replace background and ground by the photograph, at pixel centres, in place.

    ``frame`` may be a band of the image's rows.
    """
    assert backdrop.unshaded is not None, "the ground is rendered before what stands on it"
    places = [frame.gbuffer.hits, _kinds(frame), _first_pixel(frame)]
    limits = [float(_DARKEST_CD_M2), _RATIO_MAX]
    inputs = [*places, _photo_on_device(frame, backdrop), backdrop.unshaded, *limits]
    frame.launch(kernels.show_photo, frame.pixels, inputs, [radiance])


def mix_photo(frame: CameraView, backdrop: Backdrop, coverage: Float32, radiance: wp.array) -> None:
    """Replace background and ground in radiance averaged over pixels, in place.

    Args:
        frame: As in ``show_photo``.
        backdrop: The photograph.
        coverage: Share of each pixel that objects cover, [h, w].
        radiance: Mean radiance; pixels on edges mix objects and ground, with the light of the
            ground around them.
    """
    rows, image, is_ground, is_empty = _split(frame, radiance)
    photo, unshaded = backdrop.photo[rows], _unshaded(backdrop)[rows]
    clear = coverage <= 0.0
    ratio = _without_fireflies(_ratio(image, unshaded))
    behind_ratio = np.where(is_empty[..., None], np.float32(1.0), ratio)
    known = (clear & (is_ground | is_empty)).astype(np.float32)
    sums = cv2.boxFilter(behind_ratio * known[..., None], -1, (5, 5), normalize=False)
    count = cv2.boxFilter(known, -1, (5, 5), normalize=False)[..., None]
    around = np.where(count > 0.0, sums / np.maximum(count, 1.0), np.float32(1.0))
    share = np.where(clear, 0.0, 1.0 - coverage)[..., None]
    # The photograph replaces the synthetic background's contribution to the pixel.
    mixed = np.maximum(image - share * unshaded * around, 0.0) + share * photo * around
    shown = np.where(clear[..., None], photo * behind_ratio, mixed)
    radiance.assign(shown.astype(np.float32).reshape(-1, 3))


def restore_photo(frame: CameraView, centres: wp.array, radiance: wp.array) -> None:
    """Undo the anti-aliasing of the photograph itself, in place.

    The edge between its ground and its background is not an edge in the photograph. ``centres`` is
    the radiance before, flat.
    """
    width, height = int(frame.view.width), int(frame.view.height)
    inputs = [frame.gbuffer.hits, _kinds(frame), width, height, centres]
    frame.launch(kernels.restore_photo, (height, width), inputs, [radiance])


def cover_by_foreground(frame: CameraView, backdrop: Backdrop, radiance: wp.array) -> None:
    """Show the photograph where its foreground hides everything else, in place."""
    if backdrop.mask is None:
        return
    mask = frame.cache.latest("photo mask", backdrop.mask.reshape(-1), float)
    inputs = [_first_pixel(frame), mask, _photo_on_device(frame, backdrop)]
    frame.launch(kernels.cover_by_foreground, frame.pixels, inputs, [radiance])


def things_in(frame: CameraView) -> NDArray[np.bool_]:
    """Pixels whose centres show neither background nor the photograph's ground, bool [h, w]."""
    body = frame.gbuffer.hits.numpy().reshape(frame.view.height, frame.view.width, 2)[..., 0]
    catchers = [k for k, b in enumerate(frame.state.scene.bodies) if plates.is_catcher(b)]
    return np.asarray((body >= 0) & ~np.isin(body, catchers))


def hide_labels(frame: CameraView, backdrop: Backdrop, image: wp.array, nothing: Any) -> None:
    """Set a flat label image to nothing where the foreground covers it or no depth is known.

    The depth of the photograph is known on its ground only. ``nothing`` is a value of the image.
    """
    shown = np.where(backdrop.ground, int(kernels.STANDING_GROUND), int(kernels.BACKGROUND))
    shown = np.where(backdrop.hidden, int(kernels.FOREGROUND), shown).astype(np.uint8)
    places = [frame.gbuffer.hits, _kinds(frame), _first_pixel(frame)]
    inputs = [*places, frame.cache.latest("photo places", shown.reshape(-1), wp.uint8), nothing]
    frame.launch(kernels.hide_labels, frame.pixels, inputs, [image])


def is_hidden(
    frame: CameraView, backdrop: Backdrop, pixels: NDArray[np.intp], bodies: NDArray[np.intp]
) -> NDArray[np.bool_]:
    """Whether ``hide_labels`` hides surfaces of bodies [n, k] at pixels [n] of a frame."""
    places = _first_pixel(frame) + pixels
    catches = np.array([plates.is_catcher(b) for b in frame.state.scene.bodies] + [False])
    beside = ~backdrop.ground.reshape(-1)[places]
    covered = backdrop.hidden.reshape(-1)[places]
    return np.asarray(covered[:, None] | (catches[bodies] & beside[:, None]))


def _kinds(frame: CameraView) -> wp.array:
    """Kind of each body with respect to the photograph, by number; the first means no body."""
    bodies = frame.state.scene.bodies
    kinds = [kernels.GROUND if plates.is_catcher(body) else kernels.THING for body in bodies]
    values = np.array([kernels.EMPTY, *kinds], np.int32)
    return frame.cache.latest("photo kinds", values, int)


def _first_pixel(frame: CameraView) -> int:
    """Pixel of the photograph that the first pixel of a frame shows."""
    return int(_rows(frame).start * frame.view.width)


def _photo_on_device(frame: CameraView, backdrop: Backdrop) -> wp.array:
    return frame.cache.latest("photo", backdrop.photo.reshape(-1, 3), wp.vec3)


def hide_flow(backdrop: Backdrop, images: dict[Channel, NDArray[Any]]) -> None:
    """Set the flow of the foreground, which stands still, in place."""
    for channel, image in images.items():
        if channel is Channel.SCENE_FLOW:
            image[backdrop.hidden] = np.nan
        elif channel in _FLOW:
            image[backdrop.hidden & np.isfinite(image).all(axis=-1)] = 0.0
        elif channel in _OCCLUDED:
            image[backdrop.hidden] = 0


def _split(
    frame: CameraView, radiance: wp.array
) -> tuple[slice, Float32, NDArray[np.bool_], NDArray[np.bool_]]:
    """Rows of the band, its radiance, and where it shows the ground and nothing at all."""
    shape = (frame.view.height, frame.view.width)
    body = frame.gbuffer.hits.numpy().reshape(*shape, 2)[..., 0]
    is_empty = body < 0
    is_ground = ~is_empty & ~things_in(frame)
    image = np.asarray(radiance.numpy().reshape(*shape, 3))
    return _rows(frame), image, np.asarray(is_ground), np.asarray(is_empty)


def _rows(frame: CameraView) -> slice:
    """Rows of the image that a frame shows."""
    first = round(frame.state.camera.intrinsics.cy_px - float(frame.view.cy))
    return slice(first, first + int(frame.view.height))


def _unshaded(backdrop: Backdrop) -> Float32:
    assert backdrop.unshaded is not None, "the ground is rendered before what stands on it"
    return np.asarray(backdrop.unshaded.numpy().reshape(backdrop.photo.shape))


def _ratio(image: Float32, unshaded: Float32) -> Float32:
    """Light on the ground divided by its light without objects, by channel, [h, w, 3]."""
    ratio = image / np.maximum(unshaded, _DARKEST_CD_M2)
    ratio = np.where(unshaded > _DARKEST_CD_M2, ratio, np.float32(1.0))
    return np.asarray(np.minimum(ratio, np.float32(_RATIO_MAX)))


def _without_fireflies(ratio: Float32) -> Float32:
    """The ratio limited by the median around each pixel: single bright paths are noise."""
    around = np.stack(
        [cv2.medianBlur(np.ascontiguousarray(c), 5) for c in np.moveaxis(ratio, -1, 0)]
    )
    return np.asarray(np.minimum(ratio, _FIREFLY * np.moveaxis(around, 0, -1)))


def _fit(image: Float32, plate: plates.Plate, size: tuple[int, int]) -> Float32:
    """The part of an image of the photograph's size that the camera shows, at its size."""
    part = plates.crop_to(plate.size_px, *size)
    shown = image[part.y_px : part.y_px + part.height_px, part.x_px : part.x_px + part.width_px]
    if shown.shape[1::-1] == size:
        return np.ascontiguousarray(shown)
    smaller = part.width_px >= size[0]
    method = cv2.INTER_AREA if smaller else cv2.INTER_CUBIC
    return np.asarray(np.maximum(cv2.resize(shown, size, interpolation=method), 0.0))


def _ground(plate: plates.Plate, size: tuple[int, int]) -> NDArray[np.bool_]:
    """Pixels of an image whose centres are inside the ground's corners."""
    part = plates.crop_to(plate.size_px, *size)
    u = part.x_px + (np.arange(size[0]) + 0.5) * part.width_px / size[0]
    v = part.y_px + (np.arange(size[1]) + 0.5) * part.height_px / size[1]
    return plates.is_inside(np.array(plate.ground_px), np.stack(np.meshgrid(u, v), axis=-1))


def _check_camera(camera: Camera, plate: plates.Plate) -> None:
    """Refuse a camera that another randomizer moved: the photograph cannot follow it."""
    expected = plates.fit_camera(camera, plate)
    given, wanted = (_numbers(c) for c in (camera, expected))
    if not np.allclose(given, wanted, rtol=_SAME_PLACE, atol=_SAME_PLACE):
        raise errors.SampleError(
            f"sensor '{camera.name}': it is not where the photograph was taken from, or has "
            "another lens; remove the randomizers that change cameras (camera_pose, "
            "camera_intrinsics, camera_on_lane, rig_calibration)"
        )


def _numbers(camera: Camera) -> se3.Array:
    lens, pose = camera.intrinsics, camera.T_world_camera
    inner = (lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px)
    return np.array([*inner, *pose.translation_m, *pose.rotation().reshape(-1)])
