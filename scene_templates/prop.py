"""Single static objects, and jointed objects."""

from dataclasses import replace
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from gen_data.core import interfaces, kinematics, se3
from gen_data.core.scene import Body, Instance, Scene
from gen_data.scene_templates import element


class Prop(element.PlacedElement):
    """A static asset, such as a gantry, a plinth or a tray.

    A jointed object, listed under ``robots`` of an asset folder with a category such as
    ``cabinet``, is one instance whose parts are its links; ``object_states`` moves its joints.

    Attributes:
        asset: Id of the asset, such as ``gantry?size_m=1.6,1,1.8``.
        annotate: Whether to write labels for it.
        hollow: Whether cameras and lamps may be inside its bounding box, as under a gantry; it is
            background then, without an instance.
    """

    type: Literal["prop"] = "prop"
    asset: str = Field(examples=["mug?seed=0"])
    annotate: bool = False
    hollow: bool = False

    @model_validator(mode="after")
    def _is_consistent(self) -> "Prop":
        if self.annotate and self.hollow:
            raise ValueError("annotate and hollow exclude each other")
        return self

    def add(self, scene: Scene, assets: interfaces.AssetIndex) -> Scene:
        """Add a static body and, unless it is background, its instance."""
        if assets.get(self.asset).kind == "robot":
            return self._add_jointed(scene, assets)
        pose = element.stand_upright(assets, self.asset, self.pose(scene))
        if self.hollow:
            return element.add_background(scene, assets, self.name, self.asset, pose)
        return element.add_static(
            scene, assets, self.name, self.asset, pose, annotated=self.annotate
        )

    def _add_jointed(self, scene: Scene, assets: interfaces.AssetIndex) -> Scene:
        """Add a body per visible link at the home positions; the lowest one stands there."""
        thing, number = assets.robot(self.asset), element.next_instance_id(scene)
        poses = kinematics.link_poses(thing, se3.SE3(), thing.home)
        lowest_m = min(
            poses[link].apply(assets.vertices_m(mesh).astype(np.float64))[:, 2].min()
            for link, mesh in thing.visuals.items()
        )
        T_world_base = (self.pose(scene) @ se3.SE3((0.0, 0.0, -float(lowest_m)))).rounded()
        parts = tuple(link for link in thing.links if link in thing.visuals)
        # An instance has the frame of its first body, which should not move with a joint.
        rigid = kinematics.rigid_group(thing, thing.links[0])
        bodies = tuple(
            Body(
                f"{self.name}/{link}",
                thing.visuals[link],
                (T_world_base @ poses[link]).rounded(),
                instance_id=number,
                part_id=parts.index(link) + 1,
                collides=link in thing.collisions and not self.hollow,
            )
            for link in sorted(parts, key=lambda link: link not in rigid)
        )
        category = assets.get(self.asset).category
        instance = Instance(
            number, self.name, category, 0, self.asset, annotated=self.annotate, parts=parts
        )
        return replace(
            scene, bodies=(*scene.bodies, *bodies), instances=(*scene.instances, instance)
        )
