"""Umbrellas in rain."""

from typing import Literal

from pydantic import Field

from gen_data.assets.asset_ids import AssetId, parse_asset_id
from gen_data.config import distributions as dist
from gen_data.core import interfaces, members, streams
from gen_data.core.scene import ObjectGroup, Scene
from gen_data.randomizers import base, pedestrian_poses

_WALKS, _STANDS = "walk_umbrella", "stand_umbrella"


class Umbrellas(base.RandomizerBase):
    """Lets people open umbrellas in rain; list it after their groups and after the weather.

    Those who walk or stand and hold nothing else may have one.

    Attributes:
        targets: Names of groups of people.
        opened: Whether somebody has opened an umbrella, in rain of at least ``rain_mm_h``.
        rain_mm_h: In lighter rain, umbrellas are fewer in proportion; without rain there are none.
    """

    type: Literal["umbrellas"] = "umbrellas"
    targets: tuple[str, ...] = ("people",)
    # Assumed, 0.3 to 0.8: others wear hoods, or run.
    opened: dist.Flag = dist.Probability(0.55)
    rain_mm_h: float = Field(2.5, gt=0, le=500)

    def check(self, scene: Scene, assets: interfaces.AssetIndex) -> None:
        """Raise ConfigError if a target is not a group of the template."""
        del assets
        groups: dict[str, ObjectGroup] = {group.name: group for group in scene.groups}
        for name in self.targets:
            where = f"randomizers.{self.name}.targets: the template has no object group"
            base.check_known(name, groups, where)

    def __call__(self, scene: Scene, assets: interfaces.AssetIndex, rng: streams.Rng) -> Scene:
        """Return the scene with people under umbrellas; the same scene without rain."""
        share = min(1.0, scene.weather.rain_mm_h / self.rain_mm_h)
        if share <= 0.0:
            return scene
        opened: dict[str, str] = {}
        for body in scene.bodies:
            if body.group not in self.targets:
                continue
            wanted = self.opened.draw(rng) and float(rng.uniform()) < share
            pose = dict(assets.get(body.asset).attributes).get("pose", "")
            if wanted and pose in pedestrian_poses.free_handed_poses():
                opened[body.name] = _under_umbrella(body.asset, pose)
        return members.change_assets(scene, opened)


def _under_umbrella(asset: str, pose: str) -> str:
    """The same person with an open umbrella; who walks keeps the phase of the stride."""
    parsed = parse_asset_id(asset)
    held = _WALKS if pose in pedestrian_poses.moving_poses() else _STANDS
    return str(AssetId(parsed.name, {**parsed.parameters, "pose": held}))
