"""Damages of a finished data set whose checksums were all made again, and the claims that fail.

The same as the table of ``docs/certificates.md``. All samples are generated again.
"""

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import gen_data
from gen_data.lab.certificate.certificate import Certificate
from gen_data.lab.certificate.finding import Status
from tests.certificate.sealing import SMALL, edit_lines, reseal

pytestmark = [
    pytest.mark.slow,
    pytest.mark.usefixtures("open3d"),
    # pycocotools' decoder predates numpy 2's __array__(copy=...).
    pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning"),
]

N = 12
SHARD = "shards/000000"
COCO = "coco/annotations/instances_train.json"


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Six scenes of two views, in three splits."""
    folder = tmp_path_factory.mktemp("damages") / "table"
    gen_data.generate("tabletop.yaml", N, out=folder, workers=0, seed=1, **SMALL)
    return folder


def certify(folder: Path) -> Certificate:
    return gen_data.certify(folder, samples=N, rays=100, scenes=N // 2)


def edit_json(path: Path, change: Callable[[dict[str, Any]], None]) -> None:
    plain = json.loads(path.read_bytes())
    change(plain)
    path.write_text(json.dumps(plain, separators=(",", ":"), sort_keys=True) + "\n")


def edit_labels(folder: Path, index: int, change: Callable[[dict[str, Any]], None]) -> None:
    path = folder / SHARD / "labels.jsonl"
    edit_lines(path, lambda number, row: change(row) if number == index else None)


def edit_scene(folder: Path, index: int, change: Callable[[dict[str, Any]], None]) -> None:
    path = folder / SHARD / "scenes.jsonl"
    edit_lines(path, lambda number, row: change(row["scene"]) if number == index else None)


def replace_everywhere(folder: Path, pictures: dict[bytes, bytes]) -> None:
    """Replace files with these contents by others, in shards and exports."""
    for path in folder.rglob("*.png"):
        if (data := path.read_bytes()) in pictures:
            path.unlink()
            path.write_bytes(pictures[data])


def change_class(folder: Path) -> None:
    """The class of one instance in labels: that of another one, the arm."""

    def change(row: dict[str, Any]) -> None:
        arm, thing, *_ = (i for i in row["instances"] if i["annotated"])
        for key in ("category", "category_id"):
            thing[key] = arm[key]

    edit_labels(folder, 3, change)


def move_label_box(folder: Path) -> None:
    """A 2D box in labels, by a pixel."""

    def change(row: dict[str, Any]) -> None:
        row["truth"]["color"]["objects"][0]["box"]["x_max"] += 1

    edit_labels(folder, 3, change)


def move_export_box(folder: Path) -> None:
    """A box of an export, by a pixel."""

    def change(coco: dict[str, Any]) -> None:
        next(a for a in coco["annotations"] if a["bbox"][0] >= 1)["bbox"][0] -= 1

    edit_json(folder / COCO, change)


def drop_export_box(folder: Path) -> None:
    """An object of an export: both directions are compared."""
    edit_json(folder / COCO, lambda coco: coco["annotations"].pop())


def mirror_export_picture(folder: Path) -> None:
    path = next((folder / "coco").glob("*/000000007_color.png"))
    mirrored = cv2.imread(str(path))[:, ::-1]
    path.unlink()
    cv2.imwrite(str(path), mirrored)


def exchange_pictures(folder: Path) -> None:
    first, second = ((folder / f"{SHARD}/color/rgb/00000000{k}.png").read_bytes() for k in (2, 9))
    replace_everywhere(folder, {first: second, second: first})


def brighten_picture(folder: Path) -> None:
    """One picture, in shards and exports alike, by four per cent."""
    data = (folder / f"{SHARD}/color/rgb/000000005.png").read_bytes()
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    brighter = np.clip(np.rint(image * 1.04), 0, 255).astype(np.uint8)
    replace_everywhere(folder, {data: cv2.imencode(".png", brighter)[1].tobytes()})


def widen_range(folder: Path) -> None:
    """The range of a randomizer in the plan."""

    def change(plan: dict[str, Any]) -> None:
        (lens,) = (r for r in plan["config"]["randomizers"] if r["name"] == "lens")
        lens["hfov_deg"] = {"uniform": [20, 100]}

    edit_json(folder / "plan.json", change)


def lengthen(camera: dict[str, Any]) -> None:
    """Five per cent more focal length."""
    camera["intrinsics"]["fx_px"] *= 1.05


def change_focal_length_in_labels(folder: Path) -> None:
    """The focal length of one image, in labels."""
    edit_labels(folder, 3, lambda row: lengthen(row["truth"]["color"]["camera"]))


def change_focal_length(folder: Path) -> None:
    """The focal length of one image, in labels and in the stored scene."""
    change_focal_length_in_labels(folder)
    edit_scene(folder, 3, lambda scene: lengthen(scene["cameras"][0]))


def move_body(folder: Path) -> None:
    """A body of a stored scene, by five centimetres."""

    def change(scene: dict[str, Any]) -> None:
        scene["bodies"][-1]["T_world_body"]["translation_m"][0] += 0.05

    edit_scene(folder, 2, change)


def exchange_instances(folder: Path) -> None:
    """All numbers of instances, by one: ids are compared, and not only depths."""
    for path in folder.glob("shards/*/color/instance/*.png"):
        image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        cv2.imwrite(str(path), np.where(image > 0, image + 1, 0).astype(np.uint16))


def move_points(folder: Path) -> None:
    """Laser points, by three centimetres towards the sky of the scanner."""
    for path in folder.glob("shards/*/pseudo_lidar/**/*.npy"):
        points = np.load(path)
        points["position_m"][:, 2] += 0.03
        np.save(path, points)


def copy_scene(folder: Path) -> None:
    """The bodies of a scene in another one, of another split."""
    path = folder / SHARD / "scenes.jsonl"
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    other = next(k for k in range(2, 16, 2) if rows[k]["split"] != rows[0]["split"])
    bodies = rows[0]["scene"]["bodies"]
    edit_lines(path, lambda k, row: row["scene"].update(bodies=bodies) if k == other else None)


def scale_depth(folder: Path) -> None:
    """All depth, by two per cent."""
    for path in folder.glob("shards/*/color/depth/*.png"):
        image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        cv2.imwrite(str(path), np.rint(image * 1.02).astype(np.uint16))


def truncate_scan(folder: Path) -> None:
    """Half of the points of a scan."""
    path = next(folder.glob(f"{SHARD}/pseudo_lidar/points/000000004.npy"))
    points = np.load(path)
    path.unlink()
    np.save(path, points[: len(points) // 2])


def add_to_export(folder: Path) -> None:
    """A picture that no label mentions, in an export."""
    shutil.copyfile(next((folder / "coco").glob("*/*_color.png")), folder / "coco/train/extra.png")


def add_to_shard(folder: Path) -> None:
    """A file in a shard that no sample has."""
    (folder / SHARD / "color/rgb/notes.txt").write_text("extra\n")


def edit_card(folder: Path) -> None:
    path = folder / "README.md"
    path.write_text(path.read_text().replace(str(N), str(N + 1)))


AGAIN = {"written again", "generated again"}
RAYS = {"pixels", "laser points"}
"""Claims that find a body elsewhere, or another one, if enough rays meet it."""
DAMAGES: dict[Callable[[Path], None], tuple[set[str], set[str], dict[str, str]]] = {
    change_class: ({"samples", "exports", *AGAIN}, set(), {}),
    move_label_box: ({"samples", "boxes and masks", "exports", *AGAIN}, set(),
                     {"boxes and masks": "sample 3, color"}),
    move_export_box: ({"exports", "written again"}, set(),
                      {"exports: coco": r"sample \d+, color: .*expected"}),
    drop_export_box: ({"exports", "written again"}, set(),
                      {"exports: coco": r"sample \d+, color: .*is missing"}),
    mirror_export_picture: (
        {"exports", "written again"},
        set(),
        {"exports: coco": "sample 7, color: its picture differs from the data set's$"},
    ),
    exchange_pictures: (
        {"generated again"},
        set(),
        {"generated again": "sample 2: .*first difference in stage render.*\nsample 9: "},
    ),
    brighten_picture: ({"generated again"}, set(), {}),
    widen_range: ({"draws", *AGAIN}, set(), {}),
    change_focal_length_in_labels: ({"pixels", *AGAIN}, set(), {}),
    change_focal_length: ({"pixels", "draws", *AGAIN}, set(), {}),
    move_body: ({"draws", "generated again"}, RAYS, {}),
    copy_scene: ({"splits", "draws", *AGAIN}, RAYS, {"splits": r"scenes 0 \(\w+\) and \d+ "}),
    scale_depth: ({"pixels", *AGAIN}, set(),
                  {"pixels: color": ".*a ray does not meet the stated surface"}),
    move_points: (
        {"laser points", "generated again"}, set(),
        {"laser points: pseudo_lidar": ".*a ray does not meet instance"},
    ),
    exchange_instances: ({"pixels"}, {"samples", "boxes and masks", "exports", *AGAIN}, {}),
    truncate_scan: ({"samples", "generated again"}, set(), {}),
    add_to_export: (
        {"written again"},
        set(),
        {"written again": "coco/train/extra.png: is extra: the samples give no such file$"},
    ),
    add_to_shard: ({"written again"}, set(), {}),
    edit_card: ({"written again"}, set(), {}),
}  # fmt: skip
"""Claims that fail, claims that may fail, and evidence of some (a pattern of its begin)."""


@pytest.mark.parametrize("damage", DAMAGES, ids=lambda damage: damage.__name__)
def test_a_damage_fails_the_claims_that_name_it(
    small: Path, tmp_path: Path, damage: Callable[[Path], None]
) -> None:
    """Besides these, the log of the run contradicts every damage."""
    copy = Path(shutil.copytree(small, tmp_path / "copy"))
    damage(copy)
    reseal(copy)
    least, more, evidence = DAMAGES[damage]
    findings = list(certify(copy).findings(Status.FAILED))
    failed = {claim.name for claim, _ in findings}
    assert {"run log", *least} <= failed
    assert failed <= {"run log", *least, *more}
    said = {f"{claim.name}: {f.subject}".rstrip(": "): f.evidence for claim, f in findings}
    for name, start in evidence.items():
        assert re.match(start, "\n".join(said[name]), re.DOTALL), said[name]


def test_without_damage_every_claim_passes_or_has_too_few_values(small: Path) -> None:
    """What the damages are compared with."""
    failed = [claim.name for claim, _ in certify(small).findings(Status.FAILED)]
    assert failed == []
