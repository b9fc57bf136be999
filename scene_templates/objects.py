"""A group of objects on surfaces."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

from pydantic import Field, model_validator

from generator.config.strict import Strict
from generator.core.errors import ConfigError
from generator.core.interfaces import AssetIndex
from generator.core.scene import Body, Instance, ObjectGroup, Placement, Scene, Surface
from generator.core.se3 import SE3
from scene_templates.element import Element, extent_m, next_instance_id, surfaces_of


class AssetChoice(Strict):
    """Which assets a group may draw from: all that fit any of the lists.

    Attributes:
        tags: Assets that carry every one of these tags.
        any_of: Assets that carry at least one of these tags.
        ids: Assets by id; a family name stands for all of its variants.
        exclude: Tags or categories that are left out.
    """

    tags: tuple[str, ...] = ()
    any_of: tuple[str, ...] = ()
    ids: tuple[str, ...] = ()
    exclude: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _says_something(self) -> AssetChoice:
        if not (self.tags or self.any_of or self.ids):
            raise ValueError("expected tags, any_of or ids")
        return self

    def resolved(self, assets: AssetIndex, field: str) -> tuple[str, ...]:
        """Ids of all that fit, sorted.

        Raises:
            ConfigError: nothing fits.
            AssetError: an id is unknown.
        """
        found = {a.asset_id: a for a in assets.find(self.tags)} if self.tags else {}
        for tag in self.any_of:
            found |= {a.asset_id: a for a in assets.find((tag,))}
        for asset_id in self.ids:
            family = [a for a in assets.find(()) if a.asset_id.partition("?")[0] == asset_id]
            members = family or [assets.get(asset_id)]
            found |= {a.asset_id: a for a in members}
        kept = sorted(
            asset_id
            for asset_id, asset in found.items()
            if not {asset.category, *asset.tags} & set(self.exclude)
        )
        if not kept:
            raise ConfigError(f"{field}: no asset fits; expected other tags or ids")
        return tuple(kept)


class Objects(Element):
    """Objects on one or several surfaces; the ``objects`` randomizer of the same name draws them.

    Attributes:
        on: Name of a surface, or of an element with several (a shelf).
        count: How many there are nominally.
        assets: Which there may be.
        placement: drop: fall from above; scatter: stand apart; grid: stand in rows; stack: in
            towers.
        annotate: Whether labels are written for them.
    """

    type: Literal["objects"] = "objects"
    on: str
    count: int = Field(8, ge=0, le=500)
    assets: AssetChoice
    placement: Placement = "drop"
    annotate: bool = True

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """The group, and its objects in rows on the first surface."""
        surfaces = surfaces_of(scene, self.on, f"elements.{self.name}.on")
        group = ObjectGroup(
            name=self.name,
            surfaces=tuple(s.name for s in surfaces),
            assets=self.assets.resolved(assets, f"elements.{self.name}.assets"),
            count=self.count,
            placement=self.placement,
            annotated=self.annotate,
        )
        scene = replace(scene, groups=(*scene.groups, group))
        for number in range(self.count):
            asset = group.assets[(number * len(group.assets)) // max(self.count, 1)]
            scene = self._with_nominal(scene, assets, surfaces[number % len(surfaces)], asset)
        return scene

    def _with_nominal(
        self, scene: Scene, assets: AssetIndex, surface: Surface, asset: str
    ) -> Scene:
        """One more object, in the next cell of a grid that fills the surface."""
        number = sum(1 for body in scene.bodies if body.group == self.name)
        columns = max(1, round((self.count * surface.size_m[0] / surface.size_m[1]) ** 0.5))
        rows = -(-self.count // columns)
        row, column = divmod(number, columns)
        x = surface.size_m[0] * ((column + 0.5) / columns - 0.5)
        y = surface.size_m[1] * ((row + 0.5) / rows - 0.5)
        z = 0.5 * extent_m(assets, asset)[2]
        entry = assets.get(asset)
        instance_id = next_instance_id(scene)
        body = Body(
            name=f"{self.name}/{number}",
            asset=asset,
            T_world_body=(surface.T_world_surface @ SE3((x, y, z))).rounded(),
            instance_id=instance_id,
            group=self.name,
            motion="dynamic",
            mass_kg=entry.mass_kg,
        )
        instance = Instance(
            instance_id, body.name, entry.category, 0, asset, annotated=self.annotate
        )
        return replace(scene, bodies=(*scene.bodies, body), instances=(*scene.instances, instance))
