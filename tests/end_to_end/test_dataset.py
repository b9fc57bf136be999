"""The main use case, from the command line to files that third-party readers accept."""

import json
import os
import shutil
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
from PIL import Image

from tests.end_to_end.running import SMALL, command, digest, environment, gen_data

MAIN_JOB = ("--config", "tabletop.yaml", "--n", "15", "--seed", "1", *SMALL)


def test_dataset_is_complete_and_verifies(dataset: Path) -> None:
    """Manifest, checksums, licences and both formats are there, and every byte is accounted for."""
    for name in ("plan.json", "manifest.json", "SHA256SUMS", "LICENSES-ASSETS.md", "coco", "kitti"):
        assert (dataset / name).exists(), name

    done = gen_data("verify", str(dataset), "--full", cwd=dataset)

    assert done.returncode == 0, done.stderr


def test_two_workers_write_the_same_bytes(dataset: Path, tmp_path: Path) -> None:
    """Which worker makes which shard leaves no trace outside run/."""
    done = gen_data(*MAIN_JOB, "--workers", "2", "--out", "two", cwd=tmp_path)

    assert done.returncode == 0, done.stderr
    assert digest(tmp_path / "two") == digest(dataset)


def test_killed_run_resumes_to_the_same_bytes(dataset: Path, tmp_path: Path) -> None:
    """After SIGKILL to the whole process group, the same command resumes."""
    arguments = command(*MAIN_JOB, "--workers", "1", "--out", "killed")
    process = subprocess.Popen(
        arguments,
        cwd=tmp_path,
        env=environment(),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    deadline_s = time.monotonic() + 300
    while not list((tmp_path / "killed" / "shards").glob("*.json")):
        assert process.poll() is None, "the run ended before it could be killed"
        assert time.monotonic() < deadline_s
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    assert not (tmp_path / "killed" / "manifest.json").exists()

    done = gen_data(*MAIN_JOB, "--workers", "1", "--out", "killed", cwd=tmp_path)

    assert done.returncode == 0, done.stderr
    assert digest(tmp_path / "killed") == digest(dataset)


def test_every_object_is_labelled_where_it_is_seen(dataset: Path) -> None:
    """COCO boxes are the tight boxes of the instance images, and no visible object is left out."""
    found = 0
    for path in sorted((dataset / "coco" / "annotations").glob("instances_*.json")):
        coco = json.loads(path.read_text())
        for image in coco["images"]:
            index = image["scene"] * 5 + image["view"]
            shard = dataset / "shards" / f"{index // 5:06d}" / "color" / "instance"
            ids = np.asarray(Image.open(shard / f"{index:09d}.png"))
            for annotation in (a for a in coco["annotations"] if a["image_id"] == image["id"]):
                rows, columns = np.nonzero(ids == annotation["instance_id"])
                x, y = int(columns.min()), int(rows.min())
                box = [x, y, int(columns.max()) - x + 1, int(rows.max()) - y + 1]
                assert (annotation["bbox"], annotation["area"]) == (box, len(rows))
                found += 1
    assert found > 30


def test_licences_name_what_was_used_and_nothing_else(dataset: Path) -> None:
    from gen_data.runner.stored import StoredSamples

    used, stored = set(), StoredSamples(dataset)
    for scene in (stored.kept_scene(index).scene for index in range(stored.n)):
        used |= {b.asset for b in scene.bodies if not b.name.startswith("arm/")}
        used |= {m.texture for b in scene.bodies for m in b.materials if m.texture}
        used |= {a.asset for a in scene.articulations} | {scene.environment.image}
    rows = (dataset / "LICENSES-ASSETS.md").read_text().splitlines()[4:]
    listed = {name for row in rows for name in row.split("|")[4].strip().split(", ")}

    assert listed == {asset.partition("#")[0].partition("?")[0] for asset in used}


def test_a_damaged_data_set_is_repaired_from_its_own_plan(dataset: Path, tmp_path: Path) -> None:
    """An image with another byte, a damaged plan, and a foreign file."""
    shutil.copytree(dataset, tmp_path / "one")
    damaged = tmp_path / "one/shards/000001/color/rgb/000000007.png"
    damaged.write_bytes(damaged.read_bytes()[:-1] + b"\0")

    (tmp_path / "one/plan.json").write_text("{")
    (tmp_path / "one/notes.txt").write_text("mine")

    done = gen_data("repair", "one", "--workers", "1", cwd=tmp_path)

    assert done.returncode == 0, done.stderr
    assert digest(tmp_path / "one") == digest(dataset)
    quarantine = tmp_path / "one/run/quarantine"
    assert (quarantine / "0-000001/color/rgb" / damaged.name).exists()
    assert (quarantine / "0-plan.json").read_text() == "{"
    assert (quarantine / "0-notes.txt").exists()
