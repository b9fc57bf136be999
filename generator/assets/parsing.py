"""Parsing of an asset's files to plain arrays; these functions run in the sandbox.

Each checks that the bytes it parsed have the digests under which its result is stored.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from gen_data.assets import importer, robot_formats, usd_stages
from gen_data.assets.asset_arrays import encode_text, pack_imported
from gen_data.assets.asset_cache import Arrays
from gen_data.assets.asset_folder import Folder
from gen_data.assets.folder_index import MeshEntry, PlateEntry, RobotEntry
from gen_data.assets.image_decoding import decode_image, decode_radiance, image_remarks
from gen_data.assets.robot_models import describe_robot
from gen_data.core import errors, plates, serialization
from gen_data.usd.stage_reader import layer_references

T = TypeVar("T")
Digests = Mapping[str, str]
"""``{path in the folder: sha256}`` of an asset's files."""
_TEXT = "text"


def parse_object(
    root: Path, digests: Digests, entry: MeshEntry, asset_id: str, piece: str
) -> Arrays:
    """Import an object, or a piece of a stage (``importer.import_object``)."""
    folder = Folder(root)
    return _checked(
        folder, digests, pack_imported(importer.import_object(folder, entry, asset_id, piece))
    )


def parse_robot(root: Path, digests: Digests, entry: RobotEntry) -> Arrays:
    """Read ``RobotDescription.parts`` of a robot, for ``unpack_value``."""
    folder = Folder(root)
    return _checked(folder, digests, _pack_value(describe_robot(folder, entry).parts()))


def parse_described_files(root: Path, digests: Digests, file: str) -> Arrays:
    """List the files that a description of links and joints consists of, for ``unpack_value``.

    They are hashed after it; ``digests`` has none yet.
    """
    del digests
    return _pack_value(robot_formats.read_description(Folder(root), file).files())


def parse_link(root: Path, digests: Digests, entry: RobotEntry, robot_id: str, link: str) -> Arrays:
    """Import a link of a robot (``importer.import_link``)."""
    folder = Folder(root)
    robot = describe_robot(folder, entry)
    return _checked(
        folder, digests, pack_imported(importer.import_link(folder, entry, robot_id, robot, link))
    )


def parse_road_network(root: Path, digests: Digests, file: str) -> Arrays:
    """Import the surface of a road network."""
    folder = Folder(root)
    return _checked(folder, digests, pack_imported(importer.import_road_network(folder, file)))


def parse_lanes(root: Path, digests: Digests, file: str) -> Arrays:
    """Read the lanes of a road network, and its unused contents, for ``unpack_value``."""
    folder = Folder(root)
    return _checked(folder, digests, _pack_value(importer.road_network_content(folder, file)))


def parse_stage(root: Path, digests: Digests, entry: MeshEntry, asset_id: str) -> Arrays:
    """Read pieces, lights and cameras of a stage, for ``unpack_value``."""
    folder = Folder(root)
    return _checked(folder, digests, _pack_value(usd_stages.stage_model(folder, entry, asset_id)))


def parse_image(root: Path, digests: Digests, name: str, channels: str) -> Arrays:
    """Decode an image to ``{channels: pixels}``.

    ``channels`` is rgb or rgba for colours as sRGB, stored for values as they are, or radiance.
    """
    folder = Folder(root)
    data, place = folder.read(name), str(root / name)
    pixels: Any = (
        decode_radiance(data, place)
        if channels == "radiance"
        else decode_image(data, place, alpha=channels != "rgb", color=channels != "stored")
    )
    return _checked(folder, digests, {channels: pixels})


def parse_image_remarks(root: Path, digests: Digests, images: Mapping[str, str]) -> Arrays:
    """List the unused contents of images, ``{name: channels}``, for ``unpack_value``."""
    folder = Folder(root)
    found = [
        importer.FileRemarks(name, image_remarks(folder.read(name), color=channels != "stored"))
        for name, channels in images.items()
    ]
    return _checked(folder, digests, _pack_value([one for one in found if one.unused]))


def parse_plate(root: Path, digests: Digests, entry: PlateEntry) -> Arrays:
    """Read a photograph's plate, for ``unpack_value``."""
    from gen_data.assets.plates.plate_import import import_plate

    folder = Folder(root)
    return _checked(folder, digests, _pack_value(import_plate(folder, entry)))


def parse_surroundings(root: Path, digests: Digests, file: str, plate: plates.Plate) -> Arrays:
    """Continue a photograph to all sides: ``{"radiance": pixels}``."""
    from gen_data.assets.plates.surroundings import surroundings

    folder = Folder(root)
    rgb = decode_image(folder.read(file), str(root / file), color=True)
    return _checked(folder, digests, {"radiance": surroundings(plate, rgb)[1]})


def parse_layer_references(root: Path, digests: Digests, file: str) -> Arrays:
    """List the files that a layer of a stage refers to, for ``unpack_value``."""
    folder = Folder(root)
    return _checked(folder, digests, _pack_value(layer_references(folder.path(file))))


def unpack_value(kind: type[T], arrays: Arrays) -> T:
    """Restore the value of a function above that does not return geometry."""
    return serialization.from_plain(kind, json.loads(arrays[_TEXT].tobytes()))


def _pack_value(value: object) -> Arrays:
    return {_TEXT: encode_text(serialization.canonical_json(value))}


def _checked(folder: Folder, digests: Digests, arrays: Arrays) -> Arrays:
    """The arrays. Raises AssetError if a parsed file differs from the one that was hashed."""
    for name, digest in folder.digests.items():
        if digests.get(name, digest) != digest:
            raise errors.AssetError(f"{folder.root / name}: changed while it was read; start again")
    return {name: np.ascontiguousarray(array) for name, array in arrays.items()}
