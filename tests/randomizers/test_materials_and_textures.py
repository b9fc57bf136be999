"""Colours, finishes, textures and the background; and weights of objects."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from gen_data.assets.library import open_library
from gen_data.config.distributions import Constant, Probability, Uniform
from gen_data.config.problems import Problems
from gen_data.config.validation import validate
from gen_data.config.yaml_tree import parse_yaml
from gen_data.core.asset_types import Material
from gen_data.core.errors import ConfigError
from gen_data.core.scene import Body, Instance, ObjectGroup, Scene
from gen_data.randomizers import TABLE
from gen_data.randomizers.backdrop import Backdrop
from gen_data.randomizers.base import RandomizerBase
from gen_data.randomizers.colors import Colors
from gen_data.randomizers.materials import Materials
from gen_data.randomizers.physics_properties import PhysicsProperties
from gen_data.randomizers.textures import Textures
from tests.randomizers.doubles import PRINTED, FakeAssets, rng_of

ALWAYS, HALF = Constant(True), Probability(0.5)
ROOM_SLOTS = ("floor", "ceiling", "walls", "skirting", "door", "frames", "window")


def scene_with(*assets: str) -> Scene:
    """A room, a table, and these objects in the group ``clutter``."""
    objects = tuple(
        Body(f"clutter/{k}", asset, instance_id=k + 2, group="clutter", motion="dynamic",
             mass_kg=0.3)
        for k, asset in enumerate(assets)
    )  # fmt: skip
    room = Body("room", "room?size_m=5,4,2.8")
    table = Body("table", "table?size_m=1.2,0.8,0.74", instance_id=1)
    group = ObjectGroup("clutter", (), tuple(sorted(set(assets))), len(assets), "drop")
    instances = tuple(Instance(k + 1, f"i{k}", "thing", 0, "") for k in range(len(assets) + 1))
    return Scene("test", bodies=(room, table, *objects), instances=instances, groups=(group,))


def after(randomizer: RandomizerBase, scene: Scene, scene_index: int = 0) -> Scene:
    return randomizer(scene, FakeAssets(), rng_of(randomizer.name, scene_index))


def changed(before: Scene, now: Scene) -> set[str]:
    return {a.name for a, b in zip(before.bodies, now.bodies, strict=True) if a != b}


MAKERS: list[Callable[[tuple[str, ...]], RandomizerBase]] = [
    lambda targets: Colors(name="c", targets=targets, probability=ALWAYS),
    lambda targets: Materials(name="m", targets=targets, probability=ALWAYS),
    lambda targets: Textures(name="t", targets=targets, textures=("wood",), probability=ALWAYS),
]
looks = pytest.mark.parametrize("made", MAKERS, ids=["colors", "materials", "textures"])


@looks
def test_looks_change_objects_unless_other_targets_are_named(
    made: Callable[[tuple[str, ...]], RandomizerBase],
) -> None:
    """Without targets: all objects. With targets: groups or bodies of these names."""
    scene = scene_with("brick", "bottle")

    assert changed(scene, after(made(()), scene)) == {"clutter/0", "clutter/1"}
    assert changed(scene, after(made(("table",)), scene)) == {"table"}
    assert changed(scene, after(made(("table", "clutter")), scene)) == {
        "table",
        "clutter/0",
        "clutter/1",
    }


@looks
def test_what_is_printed_stays_as_it_is(made: Callable[[tuple[str, ...]], RandomizerBase]) -> None:
    """A can with a printed and a plain slot: only the plain one changes."""
    now = after(made(()), scene_with("can?seed=1")).body("clutter/0")

    assert now.materials[0] == PRINTED
    assert now.materials[1] != Material()


@pytest.mark.parametrize("kind", [Colors, Materials, Textures])
def test_excluded_objects_keep_their_looks(kind: type[RandomizerBase]) -> None:
    """By tag or category; the others change."""
    wood = {"textures": ("wood",)} if kind is Textures else {}
    scene = scene_with("brick", "ball", "bottle")
    made = kind(name="k", probability=ALWAYS, exclude=("toy", "bottle"), **wood)  # type: ignore[call-arg]

    assert changed(scene, after(made, scene)) == {"clutter/0"}


@looks
def test_unknown_target_is_named(made: Callable[[tuple[str, ...]], RandomizerBase]) -> None:
    with pytest.raises(ConfigError, match=r"targets: there is no 'tabel'.*did you mean 'table'"):
        after(made(("tabel",)), scene_with("brick"))


@looks
def test_geometry_and_labels_are_left(made: Callable[[tuple[str, ...]], RandomizerBase]) -> None:
    """Looks are looks: poses, assets, instances stay."""
    scene = scene_with("brick", "bottle")
    now = after(made(("table", "clutter")), scene)

    assert [replace(body, materials=()) for body in now.bodies] == list(scene.bodies)
    assert now.instances == scene.instances


@pytest.mark.parametrize("randomizer", [
    Textures(name="t", textures=("masonry", "wood")),
    Backdrop(name="b", floor=("wood",), walls=("masonry",)),
], ids=lambda randomizer: randomizer.type)  # fmt: skip
def test_a_plan_lists_the_texture_files_of_a_user_but_not_generated_textures(
    tmp_path: Path, randomizer: RandomizerBase
) -> None:
    """The release of gen-data identifies the textures that it generates."""
    Image.new("RGB", (4, 4)).save(tmp_path / "brick_wall.png")
    (tmp_path / "assets.yaml").write_text(
        "textures:\n  - {id: brick_wall, file: brick_wall.png, tags: [masonry]}\n"
    )

    assert randomizer.possible_assets(open_library([tmp_path])) == ("user/brick_wall",)


def test_probability_is_the_share_of_objects_that_change() -> None:
    """400 bricks, one half, within four sigma."""
    scene = scene_with(*["brick"] * 400)
    painted = changed(scene, after(Colors(name="c", probability=HALF), scene))

    assert abs(len(painted) - 200) < 40


def test_painted_objects_have_one_plain_colour_in_range() -> None:
    """Every slot of an object takes the same colour, without texture."""
    colors = Colors(name="c", probability=ALWAYS, saturation=Constant(0.0), value=Constant(0.5))
    now = after(colors, scene_with("brick")).body("clutter/0")

    assert now.materials[0].base_color == pytest.approx((0.21404,) * 3, abs=1e-5)
    assert now.materials[0].texture == ""


def test_finishes_stay_in_their_ranges() -> None:
    """Roughness and specular as drawn; metal is all or nothing."""
    finish = Materials(name="m", probability=ALWAYS, roughness=Uniform(0.2, 0.3),
                       metallic=HALF, specular=Uniform(0.6, 0.7))  # fmt: skip
    now = after(finish, scene_with(*["brick"] * 60))
    materials = [body.materials[0] for body in now.bodies if body.group]

    assert all(0.2 <= m.roughness <= 0.3 and 0.6 <= m.specular <= 0.7 for m in materials)
    assert {m.metallic for m in materials} == {0.0, 1.0}


def test_coats_and_glass_come_only_where_they_are_asked_for() -> None:
    """Shares within four sigma; clear objects are not metal; the other draws stay as they were."""
    scene = scene_with(*["brick"] * 400)
    plain = Materials(name="m", probability=ALWAYS)
    made = Materials(name="m", probability=ALWAYS, coated=Probability(0.3), clear=HALF,
                     coat=Constant(0.8), coat_roughness=Uniform(0.1, 0.2),
                     transmission=Uniform(0.7, 0.9), ior=Uniform(1.3, 1.6), solid=HALF)  # fmt: skip

    materials = [body.materials[0] for body in after(made, scene).bodies if body.group]
    coated = [m for m in materials if m.coat]
    clear = [m for m in materials if m.transmission]

    assert abs(len(coated) - 120) < 37 and abs(len(clear) - 200) < 40
    assert all(m.coat == 0.8 and 0.1 <= m.coat_roughness <= 0.2 for m in coated)
    assert all(0.7 <= m.transmission <= 0.9 and 1.3 <= m.ior <= 1.6 for m in clear)
    assert {m.metallic for m in clear} == {0.0} and {m.thin for m in clear} == {True, False}
    first = after(made, scene).body("clutter/0").materials[0]
    default = after(plain, scene).body("clutter/0").materials[0]
    assert (first.roughness, first.specular) == (default.roughness, default.specular)
    assert (default.coat, default.transmission, default.opacity) == (0.0, 0.0, 1.0)


def test_textures_cover_the_slots_that_were_named() -> None:
    """A table's top and not its legs; the repeat is as drawn."""
    cover = Textures(name="t", targets=("table",), textures=("plaster",), probability=ALWAYS,
                     slots=(0,), scale_m=Constant(0.4))  # fmt: skip
    top, legs = after(cover, scene_with()).body("table").materials

    assert top.texture.startswith("texture/plaster?seed=")
    assert (top.texture_scale_m, top.base_color) == (0.4, (1.0, 1.0, 1.0))
    assert legs == Material()


def test_textures_are_drawn_from_families_and_tags() -> None:
    """A family and a tag together, nothing else."""
    cover = Textures(name="t", textures=("plaster", "floor"), probability=ALWAYS)
    now = after(cover, scene_with(*["brick"] * 80))
    families = {body.materials[0].texture.partition("?")[0] for body in now.bodies if body.group}

    assert families == {"texture/plaster", "texture/concrete", "texture/wood_planks"}


@pytest.mark.parametrize("kind", [Colors, Materials, Textures])
def test_a_listed_randomizer_changes_every_target_unless_told_otherwise(kind: Any) -> None:
    """The default of ``probability`` is 1."""
    fields = {"textures": ["wood"]} if kind is Textures else {}
    randomizer = kind.model_validate_json(json.dumps({"name": "r", **fields}))
    scene = scene_with(*["brick"] * 40)

    assert len(changed(scene, after(randomizer, scene))) == 40


@pytest.mark.parametrize("kind", ["colors", "materials", "textures", "vehicle_paint"])
@pytest.mark.parametrize(
    ("written", "mean"),
    [("0", 0), ("1", 1), ("0.0", 0), ("1.0", 1), ("0.3", 0.3), ("true", 1), ("false", 0),
     ("{probability: 1}", 1), ("{probability: 1.0}", 1), ("{probability: 0}", 0)],
)  # fmt: skip
def test_a_probability_is_a_number_or_a_flag(kind: str, written: str, mean: float) -> None:
    """Whole or not, both ends included."""
    problems = Problems()
    textures = "textures: [wood], " if kind == "textures" else ""
    text = f"{{name: r, {textures}probability: {written}}}"
    randomizer = validate(parse_yaml(text, "x.yaml"), TABLE.load(kind), problems)
    problems.raise_if_any()

    found = randomizer.probability
    assert (found.p if isinstance(found, Probability) else found.value) == mean
    assert isinstance(randomizer.probability.draw(rng_of()), bool)


@pytest.mark.parametrize(("written", "fact"), [
    ("1.5", "probability needs a number in [0, 1], got 1.5"),
    ("-1", "probability needs a number in [0, 1], got -1"),
    ("yes", "expected a probability in [0, 1], true or false, got 'yes' (did you mean true?)"),
])  # fmt: skip
def test_an_impossible_probability_is_told_with_its_place(written: str, fact: str) -> None:
    """At the value's column."""
    problems = Problems()
    validate(parse_yaml(f"{{name: r, probability: {written}}}", "x.yaml"), Colors, problems)

    (problem,) = problems.sorted()
    assert (str(problem.position), problem.fact) == ("x.yaml:1:24", fact)


def test_backdrop_changes_floor_and_walls_only() -> None:
    """Ceiling, door and window of the room stay; no object and no table is touched."""
    scene = scene_with("brick")
    for scene_index in range(10):
        now = after(Backdrop(name="room", painted=HALF), scene, scene_index)
        slots = dict(zip(ROOM_SLOTS, now.body("room").materials, strict=True))

        assert changed(scene, now) == {"room"}
        assert slots["floor"].texture
        assert slots["walls"] != Material()
        assert all(
            slots[name] == Material() for name in ROOM_SLOTS if name not in {"floor", "walls"}
        )


def test_walls_are_painted_or_covered() -> None:
    """Paint has no texture; a covering has."""
    painted = after(Backdrop(name="room", painted=Constant(True)), scene_with())
    covered = after(Backdrop(name="room", painted=Constant(False)), scene_with())
    walls = ROOM_SLOTS.index("walls")

    assert painted.body("room").materials[walls].texture == ""
    assert covered.body("room").materials[walls].texture.startswith("texture/")


def test_weights_and_friction_change_for_what_falls_only() -> None:
    """Mass by the factor, friction and restitution in their ranges; the table stays."""
    properties = PhysicsProperties(
        name="p", mass_factor=Constant(2.0), friction=Uniform(0.3, 0.4), restitution=Constant(0.2)
    )
    scene = scene_with("brick", "bottle")
    now = after(properties, scene)

    assert changed(scene, now) == {"clutter/0", "clutter/1"}
    for body in now.bodies:
        if body.group:
            assert body.mass_kg == pytest.approx(0.6)
            assert 0.3 <= body.friction <= 0.4
            assert body.restitution == 0.2


def test_prints_replaces_printed_images_of_named_categories_only() -> None:
    """The label of a bottle; plain materials and other categories stay as they are."""
    scene = scene_with("brick", "bottle")
    category = FakeAssets().get("bottle").category
    own = FakeAssets().materials("bottle")

    def prints(*categories: str) -> Scene:
        given = {"name": "p", "textures": ("wood",), "prints": True, "categories": categories}
        return after(Textures(**given, probability=ALWAYS), scene)

    assert changed(scene, prints("mug")) == set()
    made = prints(category).body("clutter/1").materials
    assert changed(scene, prints(category)) == {"clutter/1"}
    for before, now in zip(own, made, strict=True):
        assert (before != now) == bool(before.printed and before.texture)
        if before != now:
            assert now.texture_scale_m == 0.0
