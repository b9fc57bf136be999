"""Preparation of everything that a configuration can use, ahead of its first run.

Runs make an asset when a scene first needs it, and keep it in the cache folder. Images of
containers and nodes of clusters take that folder along instead.
"""

from collections.abc import Callable

from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.core.scene import Scene
from gen_data.randomizers.base import RandomizerBase
from gen_data.runner.identity import possible_assets

Announce = Callable[[str, int, int], None]
"""Called with the id of the asset that comes next, its number from 0, and the number of all."""


def prepare_assets(factory: PipelineFactory, announce: Announce) -> int:
    """Make and store the assets of a configuration, with textures, hierarchies, collision shapes.

    Kernels of the renderer are compiled, too. Stored assets are only read. Ids with values that
    each scene draws, of skies and roads for example, are without number and are left out.

    Returns:
        Number of assets.

    Raises:
        AssetError: an asset cannot be made or read.
        ConfigError: the configuration refers to something that does not exist.
    """
    listed = list_assets(factory)
    solid = {asset_id for scene in factory.nominal for asset_id in _solid(scene)}
    library = factory.library
    with factory() as pipeline:
        for number, asset_id in enumerate(listed):
            announce(asset_id, number, len(listed))
            pipeline.prepare_asset(asset_id, collides=asset_id in solid)
            if library.get(asset_id).kind == "object":
                library.bounds_m(asset_id)
    return len(listed)


def list_assets(factory: PipelineFactory) -> tuple[str, ...]:
    """Ids of the objects, links of robots, panoramas and textures of a configuration, sorted.

    Textures that objects bring along come with them and are not listed.

    Raises:
        ConfigError: the configuration refers to something that does not exist.
    """
    library = factory.library
    ids = {asset.asset_id for asset in possible_assets(factory)}
    ids |= {scene.environment.image for scene in factory.nominal}
    for asset_id in [one for one in ids if library.get(one).kind == "robot"]:
        ids |= {*library.robot(asset_id).visuals.values()}
    for config in factory.config.probes:
        for randomizer in config.randomizers:
            if isinstance(randomizer, RandomizerBase):
                ids |= {*randomizer.possible_textures(library)}
    return tuple(sorted(ids))


def _solid(scene: Scene) -> set[str]:
    """Ids of the objects that fall or stop others, without links of robots."""
    links = tuple(f"{arm.name}/" for arm in scene.articulations)
    fixed = {b.asset for b in scene.bodies if b.collides and not b.name.startswith(links)}
    return fixed | {asset for group in scene.groups if group.surfaces for asset in group.assets}
