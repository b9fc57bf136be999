"""Scenes, images and files in the form that every renderer of the comparison reads and writes.

Renderers run in separate interpreters, which is why this module imports only NumPy and OpenCV.
"""

import json
import pickle
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

WORLDS_NAME = "worlds.pickle"
DEPTH_UNIT_M = 0.001
NEAR_M, FAR_M = 0.01, 100.0
"""Of renderers with a depth buffer; with a larger ``NEAR_M`` TinyRenderer shadows everything."""


class Lamp(NamedTuple):
    """A ball of light.

    Attributes:
        intensity_cd: Linear RGB [cd].
    """

    position_m: tuple[float, float, float]
    radius_m: float
    intensity_cd: tuple[float, ...]


@dataclass(frozen=True)
class World:
    """One scene.

    Attributes:
        meshes: Path of the OBJ file of each body; they are the same in all worlds of a run.
        T_world_bodies: [bodies, 4, 4].
        ids: Instance id of each body.
        T_world_camera: [4, 4]; camera frame X right, Y down, Z forward.
        size_px: Width and height; the principal point is the centre.
        focal_px: Focal length of both axes.
    """

    meshes: tuple[str, ...]
    T_world_bodies: tuple[list[list[float]], ...]
    ids: tuple[int, ...]
    lamps: tuple[Lamp, ...]
    T_world_camera: list[list[float]]
    size_px: tuple[int, int]
    focal_px: float

    @property
    def T_world_gl(self) -> NDArray[np.float64]:
        """Camera frame of OpenGL: X right, Y up, Z backward."""
        return np.array(self.T_world_camera) @ np.diag([1.0, -1.0, -1.0, 1.0])

    @property
    def vfov_rad(self) -> float:
        """Vertical field of view."""
        return float(2 * np.arctan(self.size_px[1] / (2 * self.focal_px)))

    @property
    def focus_m(self) -> NDArray[np.float64]:
        """Mean position of the bodies: the target of lamps with a direction."""
        return np.array(self.T_world_bodies)[:, :3, 3].mean(axis=0)


class Images(NamedTuple):
    """Output of a renderer.

    Attributes:
        rgb: uint8 [height, width, 3].
        depth_m: Distance along the optical axis, float [height, width]; beyond ``FAR_M`` = nothing.
        ids: Instance ids, [height, width]; 0 = nothing.
    """

    rgb: NDArray[np.uint8]
    depth_m: NDArray[np.floating]
    ids: NDArray[np.integer]


def write_worlds(worlds: Sequence[World], folder: Path) -> None:
    """Write all worlds of a run."""
    (folder / WORLDS_NAME).write_bytes(pickle.dumps(list(worlds)))


def read_worlds(folder: Path) -> list[World]:
    """Read files of ``write_worlds``."""
    worlds: list[World] = pickle.loads((folder / WORLDS_NAME).read_bytes())
    return worlds


def unproject_depth(buffer: NDArray[np.floating]) -> NDArray[np.floating]:
    """Distances [m] of a perspective depth buffer with values in [0, 1]."""
    return NEAR_M * FAR_M / (FAR_M - (FAR_M - NEAR_M) * buffer)


def projection(world: World) -> NDArray[np.float64]:
    """OpenGL's projection matrix of the camera, [4, 4]."""
    width_px, height_px = world.size_px
    matrix = np.zeros((4, 4))
    matrix[0, 0], matrix[1, 1] = 2 * world.focal_px / width_px, 2 * world.focal_px / height_px
    matrix[2, 2] = -(FAR_M + NEAR_M) / (FAR_M - NEAR_M)
    matrix[2, 3] = -2 * FAR_M * NEAR_M / (FAR_M - NEAR_M)
    matrix[3, 2] = -1
    return matrix


def encode_srgb(linear: NDArray[np.floating]) -> NDArray[np.uint8]:
    """8-bit sRGB of linear RGB (IEC 61966-2-1)."""
    clipped = np.clip(linear, 0.0, 1.0)
    curved = np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055)
    return (255 * curved + 0.5).astype(np.uint8)


def write_files(images: Images, folder: Path, number: int) -> None:
    """Write RGB, depth and ids as PNG files, and the boxes of the visible pixels as JSON."""
    depth = np.where(images.depth_m < 0.999 * FAR_M, images.depth_m / DEPTH_UNIT_M, 0)
    ids = images.ids.astype(np.uint16)
    planes = {
        "rgb": images.rgb[..., ::-1],
        "depth": depth.round().astype(np.uint16),
        "instance": ids,
    }
    for name, plane in planes.items():
        path = plane_path(folder, name, number)
        path.parent.mkdir(parents=True, exist_ok=True)
        _, encoded = cv2.imencode(".png", plane, [cv2.IMWRITE_PNG_COMPRESSION, 1])
        path.write_bytes(encoded.tobytes())
    present = np.flatnonzero(np.bincount(ids.ravel()))
    boxes = {int(k): cv2.boundingRect((ids == k).view(np.uint8)) for k in present if k}
    (folder / f"{number}.json").write_text(json.dumps(boxes))


def plane_path(folder: Path, name: str, number: int) -> Path:
    """File of an image, as this project places it."""
    return folder / "color" / name / f"{number:09d}.png"


def mask_agreement(ids: NDArray[np.integer], reference: NDArray[np.integer]) -> float:
    """Mean intersection over union of the masks of all instances in the reference."""
    shares = [
        np.count_nonzero((ids == k) & (reference == k))
        / np.count_nonzero((ids == k) | (reference == k))
        for k in np.unique(reference)
        if k
    ]
    return float(np.mean(shares)) if shares else 1.0
