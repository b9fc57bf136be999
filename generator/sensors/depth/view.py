"""Views of a scene by a depth camera: from its position and from a position next to it."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.core import asset_types, capture, colorimetry, interfaces, se3, streams
from gen_data.core.scene import Camera, Lidar, Scene


@dataclass(frozen=True, eq=False, slots=True)
class Measured:
    """Images of a depth camera.

    Attributes:
        z_m: Measured depth along the optical axis, float32 [h, w]; inf = a hole.
        infrared: Infrared image under the device's own light, uint16 [h, w].
    """

    z_m: asset_types.Float32
    infrared: NDArray[np.uint16]


@dataclass(frozen=True, eq=False, slots=True)
class Hits:
    """First hits of the rays through pixels, lit from the rays' origin; [h, w, subrays].

    Attributes:
        range_m: Along the ray; inf = no hit.
        z_m: Along the optical axis; inf.
        reflectance: As in ``LidarHits``: infrared, including incidence; 0.
        cosine: Cosine of the angle of incidence; 0.
    """

    range_m: asset_types.Float32
    z_m: asset_types.Float32
    reflectance: asset_types.Float32
    cosine: asset_types.Float32


@dataclass(frozen=True, eq=False, slots=True)
class View:
    """A scene and the camera whose depth is measured."""

    scene: Scene
    renderer: interfaces.Renderer
    camera: Camera

    @property
    def focal_px(self) -> float:
        """Horizontal focal length."""
        return self.camera.intrinsics.fx_px

    def beside(self, right_m: float) -> Camera:
        """The same camera, shifted to its right."""
        pose = self.camera.T_world_camera @ se3.SE3((right_m, 0.0, 0.0))
        return replace(self.camera, T_world_camera=pose)

    def trace(self, right_m: float = 0.0, subrays: int = 1) -> Hits:
        """Trace the rays through all pixels, one each or 7 spread over a pixel's footprint.

        Eye and light source are ``right_m`` to the right of the camera.
        """
        lens = self.camera.intrinsics
        shape = (lens.height_px, lens.width_px)
        rays = np.nan_to_num(lens.pixel_rays()).reshape(-1, 3).astype(np.float32)
        pose = self.beside(right_m).T_world_camera
        beams = capture.LidarRays(rays, 1.0 / lens.fx_px, subrays, np.inf)
        hits = self.renderer.scan(self.scene, Lidar(self.camera.name, "", se3.SE3(), pose), beams)
        shape3 = (*shape, subrays)
        z_m = hits.range_m * rays[:, 2:]
        images = (hits.range_m, z_m, hits.reflectance, hits.incidence_cos)
        return Hits(*(np.asarray(image, np.float32).reshape(shape3) for image in images))

    def z_depth_m(self, right_m: float) -> asset_types.Float32:
        """Depth image from a position to the right of the camera, float32 [h, w]; inf = nothing."""
        return self._render(right_m, capture.Channel.Z_DEPTH)

    def luminance_cd_m2(self, right_m: float) -> asset_types.Float32:
        """Luminance of the scene in ambient light, float32 [h, w]."""
        return colorimetry.luminance(self._render(right_m, capture.Channel.RADIANCE))

    def _render(self, right_m: float, channel: capture.Channel) -> asset_types.Float32:
        seen = self.renderer.render(self.scene, self.beside(right_m), frozenset({channel}))
        return np.asarray(seen.channels[channel], np.float32)


def smooth_noise(rng: streams.Rng, shape: tuple[int, int], sigma_px: float) -> asset_types.Float32:
    """Gaussian noise of variance 1 with correlated neighbours, float32 [h, w]."""
    reach = int(np.ceil(3.0 * sigma_px))
    height, width = shape
    # Drawn beyond the image, for the same statistics at its border.
    white = rng.standard_normal((height + 2 * reach, width + 2 * reach), dtype=np.float32)
    weights = cv2.getGaussianKernel(2 * reach + 1, sigma_px)
    weights = weights / np.sqrt(np.sum(weights**2))
    noise = cv2.sepFilter2D(white, cv2.CV_32F, weights, weights)
    return np.asarray(noise[reach : reach + height, reach : reach + width], np.float32)
