"""Photographs as backdrops."""

from typing import Literal

from pydantic import Field

from gen_data.core import errors, interfaces, streams
from gen_data.core.plates import find_plates, is_catcher, show_plate
from gen_data.core.scene import Scene
from gen_data.randomizers.base import RandomizerBase, check_known, choose


class PhotoPlate(RandomizerBase):
    """Draws the photograph of the element ``plate`` of the same name.

    Its ground, light, lanes and camera come with it: list this randomizer before the ones that
    place objects on the ground.

    Attributes:
        photos: Ids or tags of photographs (``plates`` in ``assets.yaml``).
    """

    type: Literal["plate"] = "plate"
    stage: Literal["scene"] = "scene"
    photos: tuple[str, ...] = Field(("rendered",), min_length=1)

    def possible_assets(self, assets: interfaces.AssetIndex) -> tuple[str, ...]:
        """Ids of the photographs to draw from."""
        return find_plates(assets.find((), "plate"), self.photos, f"randomizers.{self.name}.photos")

    def check(self, scene: Scene, assets: interfaces.AssetIndex) -> None:
        """Check that the element exists and that every photograph can be used.

        Raises:
            ConfigError: there is no such element, or no such photograph.
            AssetError: no horizon was found in one.
        """
        self._check_element(scene)
        for photo in self.possible_assets(assets):
            show_plate(scene, self.name, photo, assets.plate(photo))

    def __call__(self, scene: Scene, assets: interfaces.AssetIndex, rng: streams.Rng) -> Scene:
        """Return the scene with a drawn photograph."""
        self._check_element(scene)
        photo = choose(self.possible_assets(assets), rng)
        return show_plate(scene, self.name, photo, assets.plate(photo))

    def _check_element(self, scene: Scene) -> None:
        known = [body.name for body in scene.bodies if is_catcher(body)]
        if not known:
            raise errors.ConfigError(
                f"randomizers.{self.name}.name: the template has no plate; add an element "
                f"{{type: plate, name: {self.name}}}"
            )
        check_known(self.name, known, f"randomizers.{self.name}.name: there is no plate")
