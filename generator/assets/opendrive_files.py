"""Road networks from files: their surface as an asset, and their lanes."""

from __future__ import annotations

from gen_data.generator.assets.asset_folder import Folder
from gen_data.generator.assets.importer import ImportedMesh
from gen_data.generator.assets.roads.network_surface import network_solid
from gen_data.generator.core.scene import Lane
from gen_data.generator.roads.opendrive import Network, read_opendrive
from gen_data.generator.roads.opendrive_lanes import network_lanes


def import_road_network(folder: Folder, relative: str) -> ImportedMesh:
    """The surface of an OpenDRIVE file's roads. Raises AssetError if it is unfit."""
    solid = network_solid(_network(folder, relative))
    return ImportedMesh(solid.mesh, solid.collision, {}, solid.keypoints)


def road_network_lanes(folder: Folder, relative: str) -> tuple[Lane, ...]:
    """The lanes of an OpenDRIVE file, in the frame of its surface. Raises AssetError."""
    return network_lanes(_network(folder, relative))


def _network(folder: Folder, relative: str) -> Network:
    return read_opendrive(folder.read(relative), str(folder.root / relative))
