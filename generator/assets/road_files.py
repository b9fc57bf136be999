"""Road networks from files: their surface as an asset, and their lanes."""

from __future__ import annotations

from generator.assets.folder import Folder
from generator.assets.importer import Imported
from generator.assets.roads.network import network_solid
from generator.core.scene import Lane
from generator.roads.network import network_lanes
from generator.roads.opendrive import Network, read_opendrive


def import_road_network(folder: Folder, relative: str) -> Imported:
    """The surface of an OpenDRIVE file's roads. Raises AssetError if it is unfit."""
    solid = network_solid(_network(folder, relative))
    return Imported(solid.mesh, solid.collision, {}, solid.keypoints)


def road_network_lanes(folder: Folder, relative: str) -> tuple[Lane, ...]:
    """The lanes of an OpenDRIVE file, in the frame of its surface. Raises AssetError."""
    return network_lanes(_network(folder, relative))


def _network(folder: Folder, relative: str) -> Network:
    return read_opendrive(folder.read(relative), str(folder.root / relative))
