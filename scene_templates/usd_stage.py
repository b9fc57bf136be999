"""OpenUSD stages."""

from dataclasses import replace
from typing import Literal

from pydantic import Field

from gen_data.core import interfaces, scene_time, se3
from gen_data.core.scene import Body, Instance, Light, Rig, Scene, StageModel, StagePiece
from gen_data.scene_templates.element import PlacedElement, next_instance_id


class UsdStage(PlacedElement):
    """The stage in a ``.usd``, ``.usda``, ``.usdc`` or ``.usdz`` file of the user's asset folders.

    Attributes:
        asset: Id of the asset: ``user/kitchen`` for ``kitchen.usdc``.
        annotate: Whether prims with semantic labels (UsdSemantics, taxonomy ``category`` or
            ``class``) become labelled instances; otherwise the stage is background.
        lights: Whether to import its lights; a ``lighting`` randomizer replaces them.
        cameras: Whether each of its cameras becomes a rig ``<name>/<prim>`` for a sensor's ``rig``:
            X along the camera's axis, Z up in its image.
        collides: Whether other bodies collide with it and can rest on it.
    """

    type: Literal["usd_stage"] = "usd_stage"
    asset: str = Field(examples=["user/kitchen"])
    annotate: bool = False
    lights: bool = True
    cameras: bool = False
    collides: bool = True

    def add(self, scene: Scene, assets: interfaces.AssetIndex) -> Scene:
        """Add a static body per mesh, ``<name>/<prim>``, its lights and, as rigs, its cameras."""
        stage, pose = assets.stage(self.asset), self.pose(scene)
        first = next_instance_id(scene)
        things = self._make_instances(stage, first) if self.annotate else {}
        bodies = tuple(
            Body(
                f"{self.name}/{piece.name}",
                piece.asset,
                (pose @ piece.T_stage_piece).rounded(),
                instance_id=things[piece.thing].instance_id if piece.thing in things else 0,
                collides=self.collides,
            )
            for piece in stage.pieces
        )
        lights = (
            tuple(self._place_light(light, pose) for light in stage.lights) if self.lights else ()
        )
        rigs = tuple(
            self._make_rig(name, pose @ T_stage_camera, bodies[0])
            for name, T_stage_camera in (stage.cameras if self.cameras else ())
        )
        return replace(
            scene,
            bodies=(*scene.bodies, *bodies),
            instances=(*scene.instances, *things.values()),
            lights=(*scene.lights, *lights),
            rigs=(*scene.rigs, *rigs),
        )

    def _make_instances(self, stage: StageModel, first_id: int) -> dict[str, Instance]:
        first: dict[str, StagePiece] = {}
        for piece in stage.pieces:
            if piece.thing:
                first.setdefault(piece.thing, piece)
        return {
            thing: Instance(first_id + k, f"{self.name}/{thing}", piece.category, 0, piece.asset)
            for k, (thing, piece) in enumerate(first.items())
        }

    def _place_light(self, light: Light, pose: se3.SE3) -> Light:
        return replace(
            light,
            name=f"{self.name}/{light.name}",
            position_m=(pose @ se3.SE3(light.position_m)).translation_m,
            direction=se3.rotate_by_quaternion(pose.quaternion_wxyz, light.direction),
            side=se3.rotate_by_quaternion(pose.quaternion_wxyz, light.side),
        )

    def _make_rig(self, name: str, T_world_camera: se3.SE3, carrier: Body) -> Rig:
        T_body_rig = carrier.T_world_body.inverse() @ T_world_camera @ scene_time.RIG_AXES
        return Rig(f"{self.name}/{name}", carrier.name, T_body_rig)
