"""Commands that show and tell."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
from PIL import Image

from tests.end_to_end.running import SMALL, gen_data


def test_contact_sheet_of_a_dataset_has_one_tile_per_sample(dataset: Path, tmp_path: Path) -> None:
    """Six samples in three columns of 100 px, four pixels apart."""
    done = gen_data(
        "contact-sheet", str(dataset), "--n", "6", "--columns", "3", "--tile-px", "100",
        "--out", "sheet.png", cwd=tmp_path,
    )  # fmt: skip

    assert done.returncode == 0, done.stderr
    sheet = np.asarray(Image.open(tmp_path / "sheet.png"))
    assert sheet.shape == (4 + 2 * (75 + 4), 4 + 3 * (100 + 4), 3)
    assert sheet.std() > 20


def test_recording_is_accepted_by_rerun(tmp_path: Path) -> None:
    """``rerun rrd verify`` reads what ``preview --save`` wrote."""
    done = gen_data("preview", "tabletop.yaml", "--n", "2", "--save", "x.rrd", *SMALL, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    beside = Path(sys.executable).with_name("rerun")
    rerun = str(beside) if beside.exists() else shutil.which("rerun")
    assert rerun is not None

    verified = subprocess.run(
        [rerun, "rrd", "verify", "x.rrd"], cwd=tmp_path, capture_output=True, text=True, check=False
    )

    assert verified.returncode == 0, verified.stderr


def test_describe_lists_and_explains(tmp_path: Path) -> None:
    """Every plug-in is named; one is explained with its fields."""
    listed = gen_data("describe", cwd=tmp_path)
    explained = gen_data("describe", "lighting", cwd=tmp_path)

    assert "tabletop" not in listed.stdout and "coco, kitti" in listed.stdout
    assert "illuminance_lux" in explained.stdout


def test_shipped_schema_is_the_generated_one(tmp_path: Path) -> None:
    """Editors complete from configs/schema.json; ``gen-data schema`` prints the same."""
    import configs

    done = gen_data("schema", cwd=tmp_path)

    shipped = Path(next(iter(configs.__path__))) / "schema.json"
    assert json.loads(done.stdout) == json.loads(shipped.read_text())


def test_doctor_finds_this_machine_fit(tmp_path: Path) -> None:
    """Every check of a machine that runs the tests passes."""
    done = gen_data("doctor", cwd=tmp_path)

    assert done.returncode == 0, done.stdout + done.stderr
    assert "FAIL" not in done.stdout


def test_a_report_counts_the_annotations_of_a_dataset(dataset: Path, tmp_path: Path) -> None:
    """As many objects as COCO's files list; the page has the same tables."""
    files = sorted((dataset / "coco/annotations").glob("instances_*.json"))
    listed = [json.loads(path.read_text(encoding="utf-8")) for path in files]
    images, objects = (sum(len(part[k]) for part in listed) for k in ("images", "annotations"))

    done = gen_data("report", str(dataset), "--html", "report.html", cwd=tmp_path)

    assert done.returncode == 0, done.stderr
    row = next(line.split() for line in done.stdout.splitlines() if line.split()[:1] == ["all"])
    assert row[1:3] == [str(images), str(objects)]
    assert "Occlusion and truncation" in (tmp_path / "report.html").read_text(encoding="utf-8")
