"""Scenes as the two stages of randomizers leave them, made ready for sensors and labels."""

from collections.abc import Mapping
from dataclasses import replace

from gen_data.core.interfaces import AssetLibrary
from gen_data.core.scene import Outcome, Scene
from gen_data.core.scene_time import place_sensors
from gen_data.pipeline.finalize_scene import finalize_scene
from gen_data.pipeline.lift_scene import lift_scene
from gen_data.pipeline.separate_pieces import separate_pieces


def finish_settled(scene: Scene, assets: AssetLibrary, category_ids: Mapping[str, int]) -> Scene:
    """The scene that its views share: settled by physics, then with a body for every piece."""
    finished = finalize_scene(separate_pieces(scene), assets, category_ids)
    if scene.recovery is None:
        return finished
    other = finish_settled(scene.twin(1), assets, category_ids)
    return replace(finished, recovery=Outcome(other.articulations, other.tracks))


def finish_view(
    scene: Scene,
    assets: AssetLibrary,
    category_ids: Mapping[str, int],
    before: tuple[Scene, Scene] | None = None,
) -> Scene:
    """A drawn view at time 0, on its relief, with all sensors in their places.

    Args:
        scene: The view as drawn.
        assets: Meshes of its bodies.
        category_ids: Ids of all categories, by name.
        before: Another view as drawn, and finished. Bodies and instances that both share are not
            measured again, and are the same objects in both, which renderers pack once.
    """
    if scene.relief is None:
        return place_sensors(scene)
    lifted = lift_scene(scene, assets)
    if before is not None:
        drawn, known = before
        still = (drawn.instances, drawn.box3d, known.bodies, known.tracks)
        if still == (scene.instances, scene.box3d, lifted.bodies, lifted.tracks):
            lifted = replace(lifted, bodies=known.bodies, instances=known.instances)
            return place_sensors(lifted)
    return place_sensors(finalize_scene(lifted, assets, category_ids))
