"""A scene, or a sequence of its instants, as a stage.

::

    /World                  default prim
        /<instance>         its frame; labels: category (if annotated), instance_id
            /<body>         at its place in it
                /look       reference to the layer of its mesh
        /Background/<body>  what has no instance
        /Lights, /Cameras
        /Prototypes         classes: meshes with materials other than their own

A body that changes its look has one ``look`` per mesh and set of materials, and shows one at a
time. Step ``k`` of a sequence is time code ``k``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from gen_data.generator.core.asset_types import Material
from gen_data.generator.core.scene import Body, Instance, Scene
from gen_data.generator.core.se3 import IDENTITY, SE3
from gen_data.generator.usd.asset_layer import MESH, bind_materials
from gen_data.generator.usd.cameras import define_camera
from gen_data.generator.usd.lights import define_light, define_sky
from gen_data.generator.usd.material_writer import TextureFinder
from gen_data.generator.usd.prims import (
    open_stage_for_writing,
    scale_pose,
    set_transforms,
    set_values,
    unique_name,
)

WORLD = "/World"
Look = tuple[str, tuple[Material, ...]]
"""Mesh asset, and materials; empty = its own."""


@dataclass(frozen=True, slots=True)
class StageFiles:
    """The files that a stage refers to: made when asked for, named as the stage refers to them.

    Attributes:
        layer: Of an asset.
        textures: Of a texture.
        panorama: Of an environment.
        materials: Not a file: an asset's own materials, one per slot.
    """

    layer: Callable[[str], str]
    textures: TextureFinder
    panorama: Callable[[str], str]
    materials: Callable[[str], tuple[Material, ...]]


def write_stage(path: Path, steps: Sequence[Scene], step_s: float, files: StageFiles) -> None:
    """Write the stage of a sequence; of a single scene if it is given one step.

    Raises:
        StorageError: if it cannot be written.
    """
    with open_stage_for_writing(path, WORLD) as stage:
        if len(steps) > 1:
            stage.SetStartTimeCode(0.0)
            stage.SetEndTimeCode(len(steps) - 1.0)
            stage.SetTimeCodesPerSecond(round(1.0 / step_s, 9))
        writer = _Writer(stage, files)
        writer.bodies(steps)
        writer.lights(steps)
        for camera in steps[0].cameras:
            at = [step.camera(camera.name) for step in steps]
            define_camera(stage, writer.path(f"{WORLD}/Cameras", camera.name), at)


class _Writer:
    """Defines the prims of one stage.

    Remembers which names are taken, and which looks have a prototype already.
    """

    def __init__(self, stage: Any, files: StageFiles) -> None:
        self._stage, self._files = stage, files
        self._taken: dict[str, set[str]] = {
            WORLD: {"Background", "Lights", "Cameras", "Prototypes"}
        }
        self._prototypes: dict[Look, str] = {}

    def path(self, parent: str, name: str) -> str:
        """Path of a child that does not exist yet; the parent is made where it is missing."""
        if not self._stage.GetPrimAtPath(parent):
            self._stage.DefinePrim(parent, "Scope")
        return f"{parent}/{unique_name(name, self._taken.setdefault(parent, set()))}"

    def bodies(self, steps: Sequence[Scene]) -> None:
        """Define every instance with its bodies, and the background."""
        frames: dict[int, tuple[str, Sequence[SE3]]] = {}
        annotated = set()
        for k, instance in enumerate(steps[0].instances):
            poses = [step.instances[k].T_world_instance for step in steps]
            frames[instance.instance_id] = (self._instance(instance, poses), poses)
            if instance.annotated:
                annotated.add(instance.instance_id)
        still = (f"{WORLD}/Background", [IDENTITY] * len(steps))
        for k, body in enumerate(steps[0].bodies):
            parent, parents = frames.get(body.instance_id, still)
            # Tools that attach labels, or look for them, do not enter shared instances.
            shared = body.instance_id not in annotated
            at = [step.bodies[k] for step in steps]
            self._body(parent, parents, at, shared=shared)

    def _instance(self, instance: Instance, poses: Sequence[SE3]) -> str:
        from pxr import UsdSemantics

        path = self.path(WORLD, instance.name)
        prim = self._stage.DefinePrim(path, "Xform")
        set_transforms(prim, [pose.matrix() for pose in poses])
        labels = {"instance_id": str(instance.instance_id)}
        if instance.annotated:
            labels["category"] = instance.category
            if instance.subcategory:
                labels["subcategory"] = instance.subcategory
        for taxonomy, label in sorted(labels.items()):
            UsdSemantics.LabelsAPI.Apply(prim, taxonomy).CreateLabelsAttr([label])
        return path

    def _body(
        self, parent: str, parents: Sequence[SE3], steps: Sequence[Body], *, shared: bool
    ) -> None:
        from pxr import UsdGeom

        path = self.path(parent, steps[0].name)
        prim = self._stage.DefinePrim(path, "Xform")
        set_transforms(
            prim,
            [
                scale_pose(T_world_parent.inverse() @ body.T_world_body, body.scale)
                for T_world_parent, body in zip(parents, steps, strict=True)
            ],
        )
        looks = [self._look_of(body) for body in steps]
        for look in dict.fromkeys(looks):
            child = self._stage.DefinePrim(self.path(path, "look"), "Xform")
            self._refer(child, look)
            child.SetInstanceable(shared)
            if len(set(looks)) > 1:
                tokens = UsdGeom.Tokens
                shown = [tokens.inherited if one == look else tokens.invisible for one in looks]
                set_values(UsdGeom.Imageable(child).CreateVisibilityAttr(), shown)

    def _look_of(self, body: Body) -> Look:
        """What a body looks like, with textures at the size that its scale gives them."""
        own = self._files.materials(body.asset)
        worn = tuple(
            replace(m, texture_scale_m=m.texture_scale_m / body.scale)
            if body.scale != 1.0 and m.texture_scale_m
            else m
            for m in body.materials or own
        )
        return (body.asset, () if worn == own else worn)

    def _refer(self, prim: Any, look: Look) -> None:
        asset, materials = look
        if not materials:
            prim.GetReferences().AddReference(self._files.layer(asset))
            return
        if look not in self._prototypes:
            self._prototypes[look] = self._prototype(asset, materials)
        prim.GetReferences().AddInternalReference(self._prototypes[look])

    def _prototype(self, asset: str, materials: tuple[Material, ...]) -> str:
        path = self.path(f"{WORLD}/Prototypes", asset.rpartition("/")[2])
        prim = self._stage.CreateClassPrim(path)
        prim.SetTypeName("Xform")
        prim.GetReferences().AddReference(self._files.layer(asset))
        bind_materials(
            self._stage, f"{path}/{MESH}", f"{path}/Worn", materials, self._files.textures
        )
        return path

    def lights(self, steps: Sequence[Scene]) -> None:
        """Define the lamps, the sun and the sky."""
        parent = f"{WORLD}/Lights"
        for k, light in enumerate(steps[0].lights):
            path = self.path(parent, light.name)
            define_light(self._stage, path, [step.lights[k] for step in steps])
        sky = steps[0].environment
        if sky.luminance_cd_m2 > 0.0:
            path = self.path(parent, "sky")
            define_sky(self._stage, path, sky, self._files.panorama(sky.image))
