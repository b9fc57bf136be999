"""Element that places one object at a fixed position."""

from dataclasses import replace
from typing import Literal

from gen_data.config.base_model import Strict
from gen_data.core.interfaces import AssetIndex, Element
from gen_data.core.scene import Body, Instance, Scene
from gen_data.core.se3 import SE3


class Pedestal(Strict):
    """An object at a fixed position.

    Attributes:
        name: Unique name in the template.
        asset: Id of the object.
        at_m: Position in the world frame [m].
    """

    type: Literal["stranger_pedestal"] = "stranger_pedestal"
    name: str
    asset: str = "mug?seed=0"
    at_m: tuple[float, float, float] = (0.0, 0.0, 0.5)

    @property
    def follows_others(self) -> bool:
        """False: its place does not depend on other elements."""
        return False

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """Return the scene with the object and its instance."""
        instance_id = max((i.instance_id for i in scene.instances), default=0) + 1
        body = Body(self.name, self.asset, SE3(self.at_m), instance_id=instance_id)
        category = assets.get(self.asset).category
        instance = Instance(instance_id, self.name, category, 0, self.asset)
        return replace(scene, bodies=(*scene.bodies, body), instances=(*scene.instances, instance))


PLUGIN: type[Element] = Pedestal
