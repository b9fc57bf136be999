"""Contract of every shipped template and configuration."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from jsonschema import Draft202012Validator

from gen_data import configs, scene_templates
from gen_data.assemble.config import Config, load_config
from gen_data.assemble.config_schema import config_schema
from gen_data.assemble.pipeline_factory import nominal_scene
from gen_data.assets.library import open_library
from gen_data.config.yaml_tree import load_yaml
from gen_data.core.errors import LayoutRejected
from gen_data.core.interfaces import Stage
from gen_data.core.scene import Body, Scene
from gen_data.core.scene_time import place_sensors
from gen_data.core.serialization import canonical_json
from gen_data.core.streams import Streams
from tests.libraries import library
from tests.tiers import cases, sampled, slow

CONFIGS = sorted(path.stem for path in Path(configs.__path__[0]).glob("*.yaml"))
QUICK = ("bin_picking", "tabletop")
"""Configurations of which the default run draws scenes; ``tests/traffic`` draws streets."""
TEMPLATES = sorted(path.stem for path in Path(scene_templates.__path__[0]).glob("*.yaml"))


@cache
def spec(name: str) -> Config:
    return load_config(name)


@cache
def scene_of(name: str) -> Scene:
    return nominal_scene(spec(name), spec(name).probes[0], library())


@cache
def validator() -> Draft202012Validator:
    return Draft202012Validator(config_schema())


def box_m(body: Body) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of a body in the world [m], from the corners of its own box."""
    low, high = (np.array(corner) * body.scale for corner in library().bounds_m(body.asset))
    signs = np.array([[a, b, c] for a in (0, 1) for b in (0, 1) for c in (0, 1)])
    corners = body.T_world_body.apply(low + signs * (high - low))
    return corners.min(axis=0), corners.max(axis=0)


def randomized(name: str, streams: Streams) -> Scene | None:
    """One attempt at a scene, without physics; None where a randomizer found no valid draw."""
    scene = scene_of(name)
    for randomizer in sorted(spec(name).probes[0].randomizers, key=lambda r: r.stage == Stage.VIEW):
        try:
            scene = randomizer(scene, library(), streams.rng(randomizer.name))
        except LayoutRejected:
            return None
    return scene


@slow
def test_every_template_is_used_by_a_configuration() -> None:
    """Shipped files can be loaded; one without a template lists its elements itself."""
    used = {spec(name).general.template for name in CONFIGS}
    assert {template for template in used if template} == set(TEMPLATES)


@pytest.mark.parametrize("name", TEMPLATES)
def test_template_has_a_comment_that_tells_what_it_is(name: str) -> None:
    """The first line of the file, in words."""
    first = (Path(scene_templates.__path__[0]) / f"{name}.yaml").read_text().splitlines()[0]

    assert first.startswith("# ")
    assert len(first) > 20
    assert load_yaml(Path(scene_templates.__path__[0]) / f"{name}.yaml").get("elements") is not None


@pytest.mark.parametrize("name", CONFIGS)
def test_configuration_tells_editors_its_schema(name: str) -> None:
    """The modeline that editors complete by."""
    text = (Path(configs.__path__[0]) / f"{name}.yaml").read_text()

    assert text.startswith("# yaml-language-server: $schema=schema.json\n")


@pytest.mark.parametrize("name", sampled(CONFIGS, 6))
def test_configuration_satisfies_the_schema_that_editors_check_it_against(name: str) -> None:
    """jsonschema, an independent validator, finds no error in any file that is shipped."""
    document = load_yaml(Path(configs.__path__[0]) / f"{name}.yaml").plain()

    assert not [error.json_path for error in validator().iter_errors(document)]


@pytest.mark.parametrize("name", cases(CONFIGS, QUICK))
def test_nominal_objects_stand_on_their_surfaces_inside_the_room(name: str) -> None:
    """Over one of the group's rectangles, at its height or higher, below its ceiling."""
    scene = scene_of(name)
    groups = {group.name: group for group in scene.groups}
    for body in (b for b in scene.bodies if b.group):
        low, high = box_m(body)
        surfaces = [scene.surface(s) for s in groups[body.group].surfaces]
        over = [
            s
            for s in surfaces
            if (np.abs(0.5 * (low + high) - s.T_world_surface.translation_m)[:2]
                <= np.array(s.size_m) / 2).all()
            and low[2] - s.T_world_surface.translation_m[2] >= -1e-6
            and high[2] - s.T_world_surface.translation_m[2] <= s.clearance_m
        ]  # fmt: skip

        assert over
        assert (low >= scene.interior_m[0] - np.array([0.15, 0.15, 0.15])).all()
        assert (high <= scene.interior_m[1] + np.array([0.15, 0.15, 0.15])).all()


@pytest.mark.parametrize("name", cases(CONFIGS, QUICK))
def test_nominal_scene_is_the_same_every_time(name: str) -> None:
    again = nominal_scene(spec(name), spec(name).probes[0], open_library(()))

    assert canonical_json(again) == canonical_json(scene_of(name))


@pytest.mark.parametrize("name", cases(CONFIGS, QUICK))
def test_randomizers_draw_valid_scenes(name: str) -> None:
    """Two scenes: unique names and ids, cameras and lamps in the room, few refused attempts."""
    attempts = 0
    for scene_index in range(2):
        scene = None
        while scene is None:
            attempts += 1
            assert attempts <= 8
            scene = randomized(name, Streams(1, scene_index, attempt=attempts))
        low, high = (np.array(corner) for corner in scene.interior_m)
        places = [light.position_m for light in scene.lights if light.kind != "sun"]
        placed = place_sensors(scene).cameras
        places += [camera.T_world_camera.translation_m for camera in placed]

        assert all(((low <= place) & (place <= high)).all() for place in map(np.array, places))
        assert len({body.name for body in scene.bodies}) == len(scene.bodies)
        assert len({i.instance_id for i in scene.instances}) == len(scene.instances)
