"""The stage agrees with the labels; read by OpenUSD's own classes."""

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pxr import Sdf, Tf, Usd, UsdGeom, UsdLux, UsdSemantics, UsdShade, UsdUtils, UsdValidation

from gen_data.assets.library import Library, open_library
from gen_data.core.capture import Capture, Channel
from gen_data.core.errors import StorageError
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.lens import Lens
from gen_data.core.motion import StateChange
from gen_data.core.sample import Sample
from gen_data.core.scene import Rig, Scene
from gen_data.core.scene_time import place_sensors, scene_at
from gen_data.exporters.usd import Usd as UsdExporter
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.usd.prims import open_stage_for_writing
from tests.usd.worlds import STEP_S, STEPS, exported, off_centre_camera, table_world


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Library:
    return open_library(cache_dir=tmp_path_factory.mktemp("cache"), packs=Path("/nonexistent"))


@pytest.fixture(scope="module")
def sequence(library: Library, tmp_path_factory: pytest.TempPathFactory) -> Any:
    path = exported(table_world(library), library, tmp_path_factory.mktemp("out"), steps=STEPS)
    return Usd.Stage.Open(str(path))


def labelled_boxes(stage: Any, camera_path: str, code: int, width_px: int, height_px: int) -> Any:
    """By instance id: x_min, y_min, x_max, y_max of all its points, by OpenUSD's own frustum."""
    frustum = UsdGeom.Camera(stage.GetPrimAtPath(camera_path)).GetCamera(code).frustum
    view = np.array(frustum.ComputeViewMatrix() * frustum.ComputeProjectionMatrix())
    found: dict[int, Any] = {}
    for prim in Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies()):
        if (
            not prim.IsA(UsdGeom.Mesh)
            or UsdGeom.Imageable(prim).ComputeVisibility(code) != "inherited"
        ):
            continue
        owner = prim
        while owner and not owner.HasAPI(UsdSemantics.LabelsAPI):
            owner = owner.GetParent()
        if not owner:
            continue
        number = int(UsdSemantics.LabelsAPI(owner, "instance_id").GetLabelsAttr().Get()[0])
        points = np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get(), float)
        world = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(code))
        clip = np.c_[points, np.ones(len(points))] @ world @ view
        u = (clip[:, 0] / clip[:, 3] + 1) / 2 * width_px
        v = (1 - clip[:, 1] / clip[:, 3]) / 2 * height_px
        found[number] = np.array([u.min(), v.min(), u.max(), v.max()])
    return found


@pytest.mark.parametrize("step", range(STEPS))
def test_the_stages_camera_has_the_label_boxes(sequence: Any, library: Library, step: int) -> None:
    """Points seen through the stage's camera span the rendered silhouettes within half a pixel."""
    camera = off_centre_camera()
    scene = scene_at(table_world(library), step * STEP_S)
    reading = WarpRenderer(library, "cpu").render(scene, camera, frozenset({Channel.AMODAL}))
    k = camera.intrinsics
    boxes = labelled_boxes(sequence, "/World/Cameras/color", step, k.width_px, k.height_px)
    assert sorted(boxes) == [1, 2, 3, 4]
    for number, silhouette in reading.silhouettes.items():
        height, width = silhouette.mask.shape
        x, y = silhouette.x_px, silhouette.y_px
        assert boxes[number] == pytest.approx([x, y, x + width, y + height], abs=0.5)


def test_every_validator_of_openusd_accepts_it(sequence: Any) -> None:
    """Stage, geometry, shading, lights and their dependencies."""
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    errors = UsdValidation.ValidationContext(validators).Validate(sequence)
    assert [error.GetMessage() for error in errors] == []
    path = sequence.GetRootLayer().realPath
    assert UsdUtils.ComputeAllDependencies(path)[2] == []
    assert UsdGeom.GetStageMetersPerUnit(sequence) == 1.0
    assert UsdGeom.GetStageUpAxis(sequence) == "Z"
    assert (sequence.GetStartTimeCode(), sequence.GetEndTimeCode()) == (0.0, STEPS - 1.0)
    assert sequence.GetTimeCodesPerSecond() == 10.0


DAMAGES: dict[str, Callable[[Any], Any]] = {
    "another up axis": lambda stage: UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y),
    "centimetres": lambda stage: UsdGeom.SetStageMetersPerUnit(stage, 0.01),
    "an asset is missing": lambda stage: (
        stage.GetPrimAtPath("/World/clutter_0").GetReferences().AddReference("./nowhere.usdc")
    ),
    "slower": lambda stage: stage.SetTimeCodesPerSecond(24.0),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_damage_is_found(sequence: Any, tmp_path: Path, damage: str) -> None:
    """The check above is able to fail."""
    path = Path(sequence.GetRootLayer().realPath)
    shutil.copytree(path.parent, tmp_path / "copy")
    stage = Usd.Stage.Open(str(tmp_path / "copy" / path.name))
    test_every_validator_of_openusd_accepts_it(stage)
    DAMAGES[damage](stage)
    stage.Save()
    with pytest.raises(AssertionError):
        test_every_validator_of_openusd_accepts_it(stage)


def test_lights_are_photometric_and_a_bodys_materials_replace_its_meshs(sequence: Any) -> None:
    """900 cd of a ball of 8 cm are 900 / (pi 0.08^2) nits; 4000 lx of a sun stay 4000 lx."""
    lamp = UsdLux.SphereLight(sequence.GetPrimAtPath("/World/Lights/lamp"))
    sun = UsdLux.DistantLight(sequence.GetPrimAtPath("/World/Lights/sun"))
    spot = UsdLux.ShapingAPI(sequence.GetPrimAtPath("/World/Lights/spot"))
    assert lamp.GetIntensityAttr().Get() == pytest.approx(44762.3, rel=1e-5)
    assert sun.GetNormalizeAttr().Get() and sun.GetIntensityAttr().Get() == 4000.0
    shone = UsdGeom.Xformable(sun).ComputeLocalToWorldTransform(0).TransformDir((0, 0, -1))
    assert list(shone) == pytest.approx([0.6, 0.0, -0.8])
    assert spot.GetShapingConeAngleAttr().Get() == pytest.approx(np.degrees(0.6))
    sky = UsdGeom.Xformable(sequence.GetPrimAtPath("/World/Lights/sky"))
    up = sky.ComputeLocalToWorldTransform(0).TransformDir((0, 1, 0))
    assert list(up) == pytest.approx([0.0, 0.0, 1.0])
    # The image's centre: +Z of USD's sky, +X of ours, turned by 0.4 rad.
    centre = sky.ComputeLocalToWorldTransform(0).TransformDir((0, 0, 1))
    assert list(centre) == pytest.approx([np.cos(0.4), np.sin(0.4), 0.0])
    # The red body is red in every part, and no image is left of its materials.
    reds = 0
    for prim in Usd.PrimRange(
        sequence.GetPrimAtPath("/World/clutter_0"), Usd.TraverseInstanceProxies()
    ):
        if prim.IsA(UsdGeom.Mesh) or prim.IsA(UsdGeom.Subset):
            material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
            surface = material.ComputeSurfaceSource()[0]
            color = surface.GetInput("diffuseColor")
            assert not color.HasConnectedSource()
            assert list(color.Get()) == pytest.approx([0.7, 0.05, 0.05])
            reds += 1
    assert reds >= 1


def test_a_body_that_changes_its_look_shows_one_at_a_time(library: Library, tmp_path: Path) -> None:
    """A step of a walk: another mesh from an instant on."""
    scene = table_world(library)
    scene = replace(scene, changes=(StateChange(STEP_S, "clutter/2", "ball?seed=5"),))
    stage = Usd.Stage.Open(str(exported(scene, library, tmp_path, steps=STEPS)))
    looks = stage.GetPrimAtPath("/World/clutter_2/clutter_2").GetChildren()
    shown = [
        [UsdGeom.Imageable(look).ComputeVisibility(code) for look in looks] for code in range(STEPS)
    ]
    assert shown[0] == ["inherited", "invisible"]
    assert shown[1] == shown[2] == ["invisible", "inherited"]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["usda", "usdc"])
def test_other_processes_write_the_same_bytes(kind: str, library: Library, tmp_path: Path) -> None:
    """Text and binary layers, images and all."""
    here = exported(table_world(library), library, tmp_path / "a", format=kind)
    program = (
        "import sys; from pathlib import Path\n"
        "from gen_data.assets.library import open_library\n"
        "from tests.usd.worlds import exported, table_world\n"
        "cache, packs = Path(sys.argv[1]) / 'cache', Path('/nonexistent')\n"
        "library = open_library(cache_dir=cache, packs=packs)\n"
        "exported(table_world(library), library, Path(sys.argv[1]), format=sys.argv[2])\n"
    )
    root = Path(__file__).parents[2]
    subprocess.run([sys.executable, "-c", program, str(tmp_path / "b"), kind], cwd=root, check=True)
    there = tmp_path / "b" / "usd"
    names = sorted(p.relative_to(here.parent) for p in here.parent.rglob("*") if p.is_file())
    assert names == sorted(p.relative_to(there) for p in there.rglob("*") if p.is_file())
    for name in names:
        assert (here.parent / name).read_bytes() == (there / name).read_bytes(), name


def test_a_scene_without_motion_has_no_time_codes(library: Library, tmp_path: Path) -> None:
    scene: Scene = table_world(library)
    stage = Usd.Stage.Open(str(exported(scene, library, tmp_path, format="usda")))
    assert not stage.HasAuthoredTimeCodeRange()
    attributes = [a for p in stage.Traverse() for a in p.GetAttributes()]
    assert attributes and not any(a.ValueMightBeTimeVarying() for a in attributes)


@pytest.mark.parametrize("steps", [1, STEPS])
def test_an_offset_camera_has_its_poses(library: Library, tmp_path: Path, steps: int) -> None:
    """It rides on a body that moves by 0.2 m/s along X; all poses are offset alike."""
    world = table_world(library)
    camera = replace(off_centre_camera(), rig="mover")
    scene = replace(world, cameras=(camera,), rigs=(Rig("mover", "clutter/0"),))
    path = exported(place_sensors(scene), library, tmp_path, steps=steps, time_offset_s=0.04)
    stage = Usd.Stage.Open(str(path))
    prim = stage.GetPrimAtPath("/World/Cameras/color")
    offset = prim.GetAttribute("genData:timeOffset").Get()
    mover = stage.GetPrimAtPath("/World/clutter_0")

    def x_m(of: Any, code: float) -> float:
        return UsdGeom.Xformable(of).ComputeLocalToWorldTransform(code).ExtractTranslation()[0]

    assert offset == pytest.approx(0.4)
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0.0, steps - 1 + offset)
    for step in range(steps):
        # The last step's image is taken after the last knot, when the body is at rest.
        moved_m = min(0.02 * (step + 0.4), 0.02 * (STEPS - 1))
        for thing in (prim, mover):
            assert x_m(thing, step + offset) - x_m(thing, 0.0) == pytest.approx(moved_m, abs=2e-6)


LENSES = {"kannala_brandt": Lens("kannala_brandt", (0.01, -0.002, 0.0, 0.0003), 1.5),
          "brown_conrady": Lens("brown_conrady", (0.1, 0.0, 0.001, 0.0, 0.0, 0.0, 0.0, 0.0)),
          "equirectangular": Lens("equirectangular")}  # fmt: skip


@pytest.mark.parametrize("model", LENSES)
def test_every_lens_is_beside_the_pinhole(library: Library, tmp_path: Path, model: str) -> None:
    """The four coefficients of a fisheye, which look like a vector, too."""
    camera = off_centre_camera()
    bent = replace(camera, intrinsics=replace(camera.intrinsics, lens=LENSES[model]))
    scene = replace(table_world(library), cameras=(bent,))
    stage = Usd.Stage.Open(str(exported(scene, library, tmp_path)))
    prim = stage.GetPrimAtPath("/World/Cameras/color")
    assert prim.GetAttribute("genData:lens:model").Get() == model
    stated = prim.GetAttribute("genData:lens:coefficients").Get()
    assert tuple(stated or ()) == LENSES[model].coefficients
    assert prim.GetAttribute("genData:lens:halfField").Get() == LENSES[model].half_field_rad
    assert UsdGeom.Camera(prim).GetFocalLengthAttr().Get() == pytest.approx(300.0 / 2048)


def test_only_storage_is_blamed_for_a_file_that_cannot_be_written(tmp_path: Path) -> None:
    """A mistake in the content keeps its own error."""
    with (
        pytest.raises(StorageError, match="space and rights"),
        open_stage_for_writing(tmp_path / "a.unknown", "/World"),
    ):
        pass
    with (
        pytest.raises(Tf.ErrorException),
        open_stage_for_writing(tmp_path / "a.usda", "/World") as one,
    ):
        one.GetDefaultPrim().CreateAttribute("a", Sdf.ValueTypeNames.Double).Set("text")


def test_a_sequence_is_written_where_it_begins(library: Library, tmp_path: Path) -> None:
    """Shards may end within a sequence: the one with its first step holds the whole stage."""
    scene = table_world(library)
    info = DatasetInfo("t", 7, 6, 1, (), (), steps_per_scene=3, step_s=STEP_S)
    steps = [scene_at(scene, k * STEP_S) for k in range(3)]
    samples = [
        Sample(k, k // 3, 0, "train", steps[k % 3], Capture({}), {}, step_index=k % 3)
        for k in range(6)
    ]
    exporter = UsdExporter().with_assets(library)
    for number, part in enumerate((samples[:2], samples[2:4], samples[4:])):
        exporter.write_shard(info, part, tmp_path / str(number))
    shards = [tmp_path / str(number) for number in range(3)]
    exporter.finalize(info, shards, tmp_path / "usd")
    assert [p.name for p in sorted((tmp_path / "usd").glob("*.usdc"))] == [
        "000000000.usdc",
        "000000003.usdc",
    ]
    rows = [json.loads(line) for line in (tmp_path / "usd/stages.jsonl").read_text().splitlines()]
    assert [(row["index"], row["steps"]) for row in rows] == [(0, 3), (3, 3)]
    assert not list((shards[2] / "usd").glob("*.usdc"))
