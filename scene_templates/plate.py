"""Photographs as backdrops: ground and light as in the photograph, and its camera."""

from dataclasses import replace
from typing import Literal

from pydantic import Field

from gen_data.config.base_model import NAME_PATTERN
from gen_data.core import asset_types, interfaces, plates, se3
from gen_data.core.scene import Body, Camera, Scene
from gen_data.scene_templates.element import Element, parametric_id

_GROUND_M, _GROUND_SCALE = (100.0, 100.0), 6.0
"""The ground is a plane of 600 m: the largest asset, enlarged."""


class PlateElement(Element):
    """A photograph as backdrop; the randomizer ``plate`` of the same name draws another one.

    Its ground shows the photograph, with shadows and reflections of objects on it. The ground
    is a surface of the element's name for ``objects``; the photograph's lanes are for
    ``lane_objects``. List it before both.

    Attributes:
        photos: Ids or tags of photographs (``plates`` in ``assets.yaml``); the nominal scene has
            the first.
        camera: Name of the sensor, a ``plate_camera``, that looks as the photograph's camera.
    """

    type: Literal["plate"] = "plate"
    photos: tuple[str, ...] = Field(("rendered",), min_length=1)
    camera: str = Field("color", pattern=NAME_PATTERN)

    def add(self, scene: Scene, assets: interfaces.AssetIndex) -> Scene:
        """Add the ground, its surface and lanes, the light, and a camera of the whole photograph.

        Raises:
            ConfigError: there is no such photograph, or nothing can stand on its ground.
            AssetError: no horizon was found in it.
        """
        field = f"elements.{self.name}.photos"
        photo = plates.find_plates(assets.find((), "plate"), self.photos, field)[0]
        plate = assets.plate(photo)
        catcher = (asset_types.Material(role=plates.CATCHER),)
        ground = parametric_id("plane", size_m=_GROUND_M)
        body = Body(self.name, ground, se3.SE3(), _GROUND_SCALE, materials=catcher)
        camera = Camera(self.camera, plate.T_world_camera, plate.intrinsics, plates.EV100)
        scene = replace(scene, bodies=(*scene.bodies, body), cameras=(*scene.cameras, camera))
        return plates.show_plate(scene, self.name, photo, plate)
