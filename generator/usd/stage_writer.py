"""Export of a scene, or a sequence of its instants, as a stage.

::

    /World                  default prim
        /<instance>         its frame; labels: category (if annotated), instance_id
            /<body>         its pose in that frame
                /look       reference to the layer of its mesh
        /Background/<body>  bodies without an instance
        /Lights, /Cameras
        /Prototypes         classes: meshes with overridden materials

A body whose appearance changes has one ``look`` per mesh and set of materials, of which one is
visible at a time. Step ``k`` of a sequence is time code ``k``; images of a camera with
``genData:timeOffset`` were taken that many time codes later.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from gen_data.core import asset_types, se3
from gen_data.core.scene import Body, Instance, Scene
from gen_data.usd import cameras, prims
from gen_data.usd.asset_layer import MESH, TextureFinder, bind_materials
from gen_data.usd.lights import define_light, define_sky

WORLD = "/World"
Look = tuple[str, tuple[asset_types.Material, ...]]
"""Mesh asset, and materials; empty = the asset's own."""


@dataclass(frozen=True, slots=True)
class StageFiles:
    """Providers of the files that a stage refers to, created on demand; all return relative paths.

    Attributes:
        layer: Layer of an asset.
        textures: Images of a texture.
        panorama: Image of an environment.
        materials: An asset's own materials, one per slot (no file).
    """

    layer: Callable[[str], str]
    textures: TextureFinder
    panorama: Callable[[str], str]
    materials: Callable[[str], tuple[asset_types.Material, ...]]


def write_stage(
    path: Path,
    instants: Sequence[Scene],
    step_s: float,
    files: StageFiles,
    offsets_s: Mapping[str, float],
) -> None:
    """Write the stage of a sequence, or of a single scene.

    Args:
        path: File of the stage.
        instants: A scene at several instants, in order of time.
        step_s: Time between time codes.
        files: Files that the stage refers to.
        offsets_s: Delay of the images of a camera after their step; 0 for cameras without one.

    Raises:
        StorageError: if it cannot be written.
    """
    with prims.open_stage_for_writing(path, WORLD) as stage:
        codes = [round(scene.time_s / step_s, 9) for scene in instants]
        if len(codes) > 1:
            stage.SetStartTimeCode(codes[0])
            stage.SetEndTimeCode(codes[-1])
            stage.SetTimeCodesPerSecond(round(1.0 / step_s, 9))
        writer = _Writer(stage, files, codes)
        writer.bodies(instants)
        writer.lights(instants)
        for camera in instants[0].cameras:
            at = [scene.camera(camera.name) for scene in instants]
            offset = round(offsets_s.get(camera.name, 0.0) / step_s, 9)
            place = writer.path(f"{WORLD}/Cameras", camera.name)
            cameras.define_camera(stage, place, at, codes, offset)


class _Writer:
    """Writer of the prims of one stage; keeps track of used names and existing prototypes."""

    def __init__(self, stage: Any, files: StageFiles, codes: Sequence[float]) -> None:
        self._stage, self._files, self._codes = stage, files, codes
        self._taken: dict[str, set[str]] = {
            WORLD: {"Background", "Lights", "Cameras", "Prototypes"}
        }
        self._prototypes: dict[Look, str] = {}

    def path(self, parent: str, name: str) -> str:
        """Unused path for a new child; a missing parent is created."""
        if not self._stage.GetPrimAtPath(parent):
            self._stage.DefinePrim(parent, "Scope")
        return f"{parent}/{prims.unique_name(name, self._taken.setdefault(parent, set()))}"

    def bodies(self, steps: Sequence[Scene]) -> None:
        frames: dict[int, tuple[str, Sequence[se3.SE3]]] = {}
        annotated = set()
        for k, instance in enumerate(steps[0].instances):
            poses = [step.instances[k].T_world_instance for step in steps]
            frames[instance.instance_id] = (self._instance(instance, poses), poses)
            if instance.annotated:
                annotated.add(instance.instance_id)
        still = (f"{WORLD}/Background", [se3.IDENTITY] * len(steps))
        for k, body in enumerate(steps[0].bodies):
            parent, parents = frames.get(body.instance_id, still)
            # Labelling tools do not enter shared instances.
            shared = body.instance_id not in annotated
            at = [step.bodies[k] for step in steps]
            self._body(parent, parents, at, shared=shared)

    def _instance(self, instance: Instance, poses: Sequence[se3.SE3]) -> str:
        from pxr import UsdSemantics

        path = self.path(WORLD, instance.name)
        prim = self._stage.DefinePrim(path, "Xform")
        prims.set_transforms(prim, [pose.matrix() for pose in poses], self._codes)
        labels = {"instance_id": str(instance.instance_id)}
        if instance.annotated:
            labels["category"] = instance.category
            if instance.subcategory:
                labels["subcategory"] = instance.subcategory
        for taxonomy, label in sorted(labels.items()):
            UsdSemantics.LabelsAPI.Apply(prim, taxonomy).CreateLabelsAttr([label])
        return path

    def _body(
        self, parent: str, parents: Sequence[se3.SE3], steps: Sequence[Body], *, shared: bool
    ) -> None:
        from pxr import UsdGeom

        path = self.path(parent, steps[0].name)
        prim = self._stage.DefinePrim(path, "Xform")
        placed = zip(parents, steps, strict=True)
        poses = [
            (T_world_parent.inverse() @ b.T_world_body, b.scale) for T_world_parent, b in placed
        ]
        matrices = [prims.scale_pose(pose, scale) for pose, scale in poses]
        prims.set_transforms(prim, matrices, self._codes)
        looks = [self._find_look(body) for body in steps]
        for look in dict.fromkeys(looks):
            child = self._stage.DefinePrim(self.path(path, "look"), "Xform")
            self._refer(child, look)
            child.SetInstanceable(shared)
            if len(set(looks)) > 1:
                tokens = UsdGeom.Tokens
                shown = [tokens.inherited if one == look else tokens.invisible for one in looks]
                visibility = UsdGeom.Imageable(child).CreateVisibilityAttr()
                prims.set_values(visibility, shown, self._codes)

    def _find_look(self, body: Body) -> Look:
        """Mesh and materials of a body, with texture scales adapted to the body's scale."""
        own = self._files.materials(body.asset)
        materials = tuple(
            replace(m, texture_scale_m=m.texture_scale_m / body.scale)
            if body.scale != 1.0 and m.texture_scale_m
            else m
            for m in body.materials or own
        )
        return (body.asset, () if materials == own else materials)

    def _refer(self, prim: Any, look: Look) -> None:
        asset, materials = look
        if materials and look not in self._prototypes:
            self._prototypes[look] = self._prototype(asset, materials)
        if materials:
            prim.GetReferences().AddInternalReference(self._prototypes[look])
        else:
            prim.GetReferences().AddReference(self._files.layer(asset))

    def _prototype(self, asset: str, materials: tuple[asset_types.Material, ...]) -> str:
        path = self.path(f"{WORLD}/Prototypes", asset.rpartition("/")[2])
        prim = self._stage.CreateClassPrim(path)
        prim.SetTypeName("Xform")
        prim.GetReferences().AddReference(self._files.layer(asset))
        bind_materials(
            self._stage, f"{path}/{MESH}", f"{path}/Worn", materials, self._files.textures
        )
        return path

    def lights(self, steps: Sequence[Scene]) -> None:
        parent = f"{WORLD}/Lights"
        for k, light in enumerate(steps[0].lights):
            path = self.path(parent, light.name)
            at = [step.lights[k] for step in steps]
            define_light(self._stage, path, at, self._codes)
        sky = steps[0].environment
        if sky.luminance_cd_m2 > 0.0:
            path = self.path(parent, "sky")
            define_sky(self._stage, path, sky, self._files.panorama(sky.image))
