"""Randomizer that replaces the asset of one object."""

from dataclasses import replace
from typing import Literal

from gen_data.config.base_model import Strict
from gen_data.core.interfaces import AssetIndex, Randomizer, Stage
from gen_data.core.scene import Scene
from gen_data.core.streams import Rng


class Swap(Strict):
    """Draws another asset for one object.

    Attributes:
        name: Key of the random stream.
        target: Name of the body to change.
        tags: Tags that an asset must have, all of them.
    """

    type: Literal["stranger_swap"] = "stranger_swap"
    name: str
    target: str
    tags: tuple[str, ...]

    @property
    def stage(self) -> Stage:
        """Before physics, since the shape changes."""
        return Stage.BUILD

    @property
    def motion_duration_s(self) -> None:
        """None: nothing moves."""

    def possible_assets(self, assets: AssetIndex) -> tuple[str, ...]:
        """Ids of all assets with these tags."""
        return tuple(asset.asset_id for asset in assets.find(self.tags))

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """Return the scene with a drawn asset on the target and its instance."""
        options = self.possible_assets(assets)
        drawn = options[int(rng.integers(len(options)))]
        body = replace(scene.body(self.target), asset=drawn)
        instances = tuple(
            replace(i, asset=drawn, category=assets.get(drawn).category)
            if i.instance_id == body.instance_id
            else i
            for i in scene.instances
        )
        return replace(scene.with_bodies(body), instances=instances)


PLUGIN: type[Randomizer] = Swap
