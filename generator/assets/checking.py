"""Checks of the assets in a user's folder: usability, size, unit and orientation."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gen_data.assets.folder_index import METRES_PER_UNIT, IndexedAsset, MeshEntry, user_folder
from gen_data.assets.library import Library
from gen_data.core import kinematics, plates, se3
from gen_data.core.errors import AssetError

NO_LICENCE = "no licence is given"
_SMALLEST_M, _LARGEST_M = 0.001, 20.0
"""Longest edges outside this range suggest a wrong unit."""


@dataclass(frozen=True)
class Finding:
    """Result of checking one asset.

    Attributes:
        category: Empty for images.
        triangles: 0 for images.
        size_m: Edges of its bounding box, for robots in the home position; None for images.
        unit: Source of the scale to metres; empty for images.
        up: Axis of the file that points up; empty if the file itself states it.
        error: Reason why it cannot be used; empty if it can.
        warnings: Doubtful properties.
        note: Measurements, for photographs.
    """

    asset_id: str
    kind: str
    category: str
    triangles: int = 0
    size_m: se3.Vec3 | None = None
    unit: str = ""
    up: str = ""
    error: str = ""
    warnings: tuple[str, ...] = ()
    note: str = ""


def check_folder(root: Path, library: Library) -> Iterator[Finding]:
    """Import every asset of a folder and report on it.

    Args:
        root: A user's folder.
        library: A library that includes this folder.

    Raises:
        AssetError: if the folder cannot be read.
        ConfigError: if its index is wrong.
    """
    for one in user_folder(root):
        try:
            yield _inspect(one, library)
        except AssetError as error:
            yield Finding(one.asset_id, one.kind, one.category(), error=str(error))
        except RuntimeError as error:
            # A reader failed in its process; the other files are still checked.
            reason = (str(error).strip().splitlines() or ["unknown"])[-1][:200]
            text = f"{one.place()}: its reader failed ({reason}); export it again"
            yield Finding(one.asset_id, one.kind, one.category(), error=text)


def _inspect(one: IndexedAsset, library: Library) -> Finding:
    """Import an asset. Raises AssetError if it cannot be used."""
    origin = () if one.origin.licence not in ("", "unknown") else (NO_LICENCE,)
    if one.kind == "plate":
        return _inspect_plate(one, library, (*_list_remarks(one, library), *origin))
    if one.kind in ("texture", "environment"):
        (library.texture if one.kind == "texture" else library.environment)(one.asset_id)
        doubts = (*_list_remarks(one, library), *origin)
        return Finding(one.asset_id, one.kind, "", warnings=doubts)
    measure = _measure_robot if one.kind == "robot" else _measure_object
    triangles, low, high = measure(one, library)
    size_m = (high[0] - low[0], high[1] - low[1], high[2] - low[2])
    _open_images(one, library)
    doubts = (*_find_doubts(one, max(size_m)), *_far_keypoints(one, low, high))
    warnings = (*doubts, *_list_remarks(one, library), *origin)
    found = (triangles, size_m, _describe_unit(one), _describe_up(one))
    return Finding(one.asset_id, one.kind, one.category(), *found, warnings=warnings)


def _list_remarks(one: IndexedAsset, library: Library) -> Iterator[str]:
    for remarks in library.remarks(one.asset_id) or ():
        yield from (f"{remarks.file}: {text}" for text in remarks.unused)


def _open_images(one: IndexedAsset, library: Library) -> None:
    """Open every image of an asset's materials. Raises AssetError if one is missing or unreadable.

    Textures are read when something is rendered, which may be hours after the start of a run.
    """
    if one.kind == "robot":
        names = sorted(library.robot(one.asset_id).visuals.values())
    else:
        names = [one.asset_id]
    for name in names:
        for texture in sorted({m.texture for m in library.materials(name)} - {""}):
            library.texture(texture)


def _inspect_plate(one: IndexedAsset, library: Library, doubts: tuple[str, ...]) -> Finding:
    plate = library.plate(one.asset_id)
    library.environment(one.asset_id)
    (_, left_px), (_, right_px) = plates.horizon_px(plate)
    source = ""
    if plate.estimated:
        # Two standard deviations.
        source = f" (estimated within {2.0 * math.degrees(plate.horizon_error_rad):.1f} deg)"
    tilt_deg, roll_deg = map(math.degrees, plates.tilt_and_roll(plate))
    hfov = math.degrees(2.0 * math.atan(0.5 * plate.size_px[0] / plate.focal_px))
    _, (length_m, width_m) = plates.ground_rectangle(plate)
    note = (
        f"horizon from row {left_px:.0f} to row {right_px:.0f} px, camera looks down "
        f"{tilt_deg:.1f} deg and rolls {roll_deg:.1f} deg{source}, hfov {hfov:.1f} deg, "
        f"room for objects {length_m:.1f} m x {width_m:.1f} m"
    )
    return Finding(one.asset_id, one.kind, "", note=note, warnings=doubts)


def _measure_object(one: IndexedAsset, library: Library) -> tuple[int, se3.Vec3, se3.Vec3]:
    library.convex_parts(one.asset_id)
    return (len(library.mesh(one.asset_id).faces), *library.bounds_m(one.asset_id))


def _measure_robot(one: IndexedAsset, library: Library) -> tuple[int, se3.Vec3, se3.Vec3]:
    """Number of triangles and bounding box of a robot in its home position."""
    robot = library.robot(one.asset_id)
    poses = kinematics.link_poses(robot, se3.SE3(), robot.home)
    for asset_id in robot.collisions.values():
        library.convex_parts(asset_id)
    if not robot.visuals:
        raise AssetError(
            f"asset '{one.asset_id}': no link has visual geometry; give one a <visual>"
        )
    meshes = {link: library.mesh(asset_id) for link, asset_id in robot.visuals.items()}
    points = np.concatenate(
        [poses[k].apply(mesh.vertices_m.astype(np.float64)) for k, mesh in meshes.items()]
    )
    x, y, z = (float(v) for v in points.min(axis=0))
    far_x, far_y, far_z = (float(v) for v in points.max(axis=0))
    triangles = sum(len(mesh.faces) for mesh in meshes.values())
    return triangles, (x, y, z), (far_x, far_y, far_z)


def _describe_unit(one: IndexedAsset) -> str:
    entry = one.entry
    if not isinstance(entry, MeshEntry):
        return "m"
    if entry.size_m is not None:
        return "size_m"
    if entry.scale != 1.0:
        return f"{entry.scale:g} m"
    if entry.file.lower().endswith((".3mf", ".step", ".stp", ".usdz", ".usda", ".usdc", ".usd")):
        return entry.unit or "of the file"
    return entry.unit or "m (assumed)"


def _describe_up(one: IndexedAsset) -> str:
    """Up axis by the entry or by the format's convention."""
    entry = one.entry
    if not isinstance(entry, MeshEntry):
        return "z"
    if entry.up is None and Path(entry.file).suffix.lower().startswith((".usd", ".dae")):
        return ""
    return entry.up or f"{entry.up_axis()} (assumed)"


def _far_keypoints(one: IndexedAsset, low: se3.Vec3, high: se3.Vec3) -> Iterator[str]:
    """Keypoints farther from the bounding box [m] than it is long, as with a wrong unit."""
    longest_m = max(np.subtract(high, low))
    for point in one.entry.keypoints if isinstance(one.entry, MeshEntry) else ():
        nearest_m = np.clip(point.position_m, low, high)
        away_m = float(np.linalg.norm(nearest_m - point.position_m))
        if away_m > longest_m:
            yield (
                f"keypoint '{point.name}' is {away_m:.3g} m away from the object, which is "
                f"{longest_m:.3g} m long; expected metres in the finished frame"
            )


def _find_doubts(one: IndexedAsset, longest_m: float) -> Iterator[str]:
    if not isinstance(one.entry, MeshEntry) or one.entry.file.lower().endswith(".xodr"):
        return
    if longest_m > _LARGEST_M and _describe_unit(one) == "m (assumed)":
        options = (f"{u} ({METRES_PER_UNIT[u] * longest_m:.4g} m)" for u in ("mm", "cm", "in"))
        yield f"{longest_m:.4g} m long; its unit may be {', '.join(options)}"
    elif longest_m < _SMALLEST_M:
        yield f"{longest_m:.2g} m long; is its unit right?"
