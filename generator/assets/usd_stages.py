"""Content of an OpenUSD stage: placement of its meshes, lights and cameras."""

from dataclasses import replace
from pathlib import PurePosixPath

from gen_data.assets import asset_folder, importer
from gen_data.assets.folder_index import Entry, MeshEntry
from gen_data.assets.readers.usd import ARCHIVE, open_stage
from gen_data.core import errors, scene, se3
from gen_data.usd.stage_reader import SUFFIXES


def is_stage(entry: Entry) -> bool:
    """Whether an entry's file is a stage."""
    suffix = PurePosixPath(entry.file).suffix.lower()
    return isinstance(entry, MeshEntry) and suffix in (*SUFFIXES, ARCHIVE)


def stage_model(folder: asset_folder.Folder, entry: MeshEntry, asset_id: str) -> scene.StageModel:
    """Read a stage, oriented and scaled by its entry.

    Raises:
        AssetError: if it cannot be read, or the entry gives a size instead of a scale.
    """
    place = str(folder.root / entry.file)
    if entry.size_m is not None:
        raise errors.AssetError(f"{place}: size_m does not apply to a stage; give scale")
    matrix = importer.upright_transform(entry)
    T_model_stage = se3.SE3.from_matrix(matrix)
    entry = entry.model_copy(update={"origin": "center"})
    pieces = []
    with open_stage(folder, entry.file) as file:
        for piece in file.pieces():
            soup = file.source((piece,), materials=False).soup.transformed(matrix)
            _, shift = importer.scale_and_shift(soup, entry, f"{place}: {piece.name}")
            x, y, z = (float(-v) for v in shift)
            named = (piece.label.prim, piece.label.category) if piece.label else ("", "")
            asset = f"{asset_id}/{piece.name}"
            pieces.append(scene.StagePiece(piece.name, asset, se3.SE3((x, y, z)), *named))
        lights, cameras = file.stage.lights(), file.stage.cameras()
    scale = entry.metres_per_unit()
    return scene.StageModel(
        tuple(pieces),
        tuple(_transform_light(light, T_model_stage, scale) for light in lights),
        tuple((name, _scale_translation(T_model_stage @ pose, scale)) for name, pose in cameras),
    )


def _transform_light(light: scene.Light, T_model_stage: se3.SE3, scale: float) -> scene.Light:
    """Transform a light to the model's frame.

    Intensity grows with the square of the scale, which keeps the illuminance of the scaled scene.
    """
    place = _scale_translation(T_model_stage @ se3.SE3(light.position_m), scale)
    return replace(
        light,
        position_m=place.translation_m,
        direction=se3.rotate_by_quaternion(T_model_stage.quaternion_wxyz, light.direction),
        side=se3.rotate_by_quaternion(T_model_stage.quaternion_wxyz, light.side),
        size_m=(light.size_m[0] * scale, light.size_m[1] * scale),
        intensity_cd=light.intensity_cd * scale * scale,
        radius_m=light.radius_m * scale,
    )


def _scale_translation(pose: se3.SE3, scale: float) -> se3.SE3:
    x, y, z = pose.translation_m
    return replace(pose, translation_m=(scale * x, scale * y, scale * z))
