"""Studies compare, resume, and refuse what cannot be compared."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import gen_data
from gen_data.core.errors import ConfigError, StorageError
from gen_data.lab.study.experiment import Experiment, Variant, perform, prepare
from gen_data.lab.study.study import compare_results, run_study
from gen_data.lab.study.study_command import list_variants
from tests.study.conftest import write_coco
from tests.study.test_adapt import CONFIG

BOXES = [[{"bbox": [4 + k, 4, 20, 20]}, {"bbox": [40, 20 + k % 5, 16, 16]}] for k in range(24)]

TOYS = "labels.map={classes: {toy: [toy block]}}"


def write_results(path: Path, found: float) -> Path:
    """Every object of the first part of the pictures is found, and none of the rest."""
    rows = [
        {"image_id": 10 + k, "category_id": 7, "bbox": row["bbox"], "score": 0.9}
        for k, listed in enumerate(BOXES[: int(found * len(BOXES))])
        for row in listed
    ]
    path.write_text(json.dumps(rows))
    return path


@pytest.mark.slow
def test_results_of_detectors_are_compared_and_the_worst_pictures_shown(tmp_path: Path) -> None:
    """One finds half of the objects, one all, one the same half: better, and no difference."""
    write_coco(tmp_path / "real", BOXES)
    shares = {"old": 0.5, "new": 1.0, "same": 0.5}
    files = {name: write_results(tmp_path / f"{name}.json", x) for name, x in shares.items()}
    findings = compare_results(tmp_path / "real", files, tmp_path / "out")
    variants = findings["variants"]
    assert {name: round(v["ap"]["mean"], 2) for name, v in variants.items()} == {
        "old": 0.5, "new": 1.0, "same": 0.5
    }  # fmt: skip
    assert [v.get("verdict") for v in variants.values()] == [None, "better", "no difference found"]
    assert variants["new"]["difference"]["low"] > 0.2
    assert json.loads((tmp_path / "out/findings.json").read_text()) == json.loads(
        json.dumps(findings)
    )
    groups = {(g["kind"], g["group"]): g for g in findings["groups"]["old"]}
    assert groups["class", "cup"] == {"kind": "class", "group": "cup", "found": 24, "objects": 48}
    assert groups["size", "small"]["objects"] == 48
    # Twelve pictures of the worse detector, none of the perfect one.
    files = {"<old>": files["old"], "new": files["new"]}
    compare_results(tmp_path / "real", files, tmp_path / "out")
    page = (tmp_path / "out/study.html").read_text()
    assert page.count("<figure>") == 12
    assert "&lt;old&gt;" in page
    assert "<old>" not in page
    assert not re.search(r"https?://|<script", page)


def test_options_become_variants() -> None:
    """``each`` stands for every randomizer."""
    variants = list_variants(
        "tabletop.yaml", ("each",), ("randomizers.clutter.count=20",), ("closeup.yaml",), (50,)
    )
    assert variants[0] == Variant("baseline", "tabletop.yaml")
    assert "without orbit" in [variant.name for variant in variants]
    assert variants[-3:] == (
        Variant(
            "randomizers.clutter.count=20",
            "tabletop.yaml",
            overrides=("randomizers.clutter.count=20",),
        ),
        Variant("closeup.yaml", "closeup.yaml"),
        Variant("with 50 real", "tabletop.yaml", real=50),
    )


@pytest.mark.slow
def test_pictures_that_train_a_variant_judge_none(tmp_path: Path) -> None:
    """The same ones are kept for all seeds; their order depends on the seed."""
    config = tmp_path / "small.yaml"
    config.write_text(CONFIG)
    write_coco(tmp_path / "real", BOXES)
    variants = (Variant("baseline", str(config)), Variant("mixed", str(config), real=6))
    prepared = prepare(Experiment(tmp_path / "real", variants))
    judged = {picture.image_id for picture in prepared.judged_pictures()}
    orders = [[p.image_id for p in prepared.training_pictures(6, seed)] for seed in range(4)]
    assert len(judged) == 18
    assert all(len(order) == 6 and not judged & set(order) for order in orders)
    assert len({tuple(order) for order in orders}) > 1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"seeds": 0}, r"seeds: 0; expected at least 1"),
        ({"variants": (Variant("b", "tabletop.yaml", real=13),)}, r"has 24 pictures, of which 13"),
        ({"variants": (Variant("b", "tabletop.yaml"), Variant("s", "tabletop.yaml", (TOYS,)))},
         r"variant 's': has the classes toy, which the baseline lacks"),
    ],
)  # fmt: skip
def test_what_cannot_be_compared_is_refused(
    changes: dict[str, object], message: str, tmp_path: Path
) -> None:
    """Before anything is generated."""
    write_coco(tmp_path / "real", BOXES)
    given = {"variants": (Variant("b", "tabletop.yaml"),), **changes}
    with pytest.raises(ConfigError, match=message):
        prepare(Experiment(tmp_path / "real", **given))  # type: ignore[arg-type]


@pytest.mark.slow
def test_a_folder_of_another_study_is_refused(tmp_path: Path) -> None:
    """Its runs would be taken for those of this one."""
    write_coco(tmp_path / "real", BOXES)
    (tmp_path / "out").mkdir()
    (tmp_path / "out/study.json").write_text("{}")
    prepared = prepare(Experiment(tmp_path / "real", (Variant("b", "tabletop.yaml"),)))
    with pytest.raises(StorageError, match="holds a study with other variants"):
        perform(prepared, tmp_path / "out", 1, print)


SMALL_STUDY = {"without": "lamps", "mix": 4, "n": 8, "seeds": 1, "steps": 12, "size": 64}


@pytest.mark.slow
def test_a_killed_study_goes_on(tmp_path: Path) -> None:
    """After SIGKILL while data are generated, and then while detectors are trained.

    The finished run is kept, and all detections and findings are those of a study that was not
    killed, and had as many processes as variants.
    """
    config = tmp_path / "small.yaml"
    config.write_text(CONFIG)
    gen_data.generate(str(config), 8, out=tmp_path / "real", seed=900, workers=0)
    real, whole, killed = tmp_path / "real/coco", tmp_path / "whole", tmp_path / "killed"
    options = [f"--{name}={value}" for name, value in SMALL_STUDY.items()]
    command = [sys.executable, "-m", "gen_data", "study", str(real), str(config), *options]
    command += ["--workers=1", f"--out={killed}"]
    first, *others = (killed / f"runs/0{k}-0/results.json" for k in range(3))
    written_ns = set()
    for file, text in (("data/01-0/plan.json", "{"), ("runs/01-0/training.log", "step 0:")):
        process = subprocess.Popen(command)
        while not ((killed / file).is_file() and text in (killed / file).read_text()):
            assert process.poll() is None, f"the study ended before {file} had '{text}'"
            time.sleep(0.02)
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        written_ns.add(first.stat().st_mtime_ns)
        assert not any(file.exists() for file in others)
    subprocess.run(command, check=True)
    variants = list_variants(str(config), ("lamps",), (), (), (4,))
    experiment = Experiment(real, variants, n=8, seeds=1, steps=12, size_px=64)
    findings = run_study(experiment, whole, workers=3)
    assert written_ns == {first.stat().st_mtime_ns}
    for name in (*(f"runs/0{k}-0/results.json" for k in range(3)), "findings.json"):
        assert (killed / name).read_bytes() == (whole / name).read_bytes()
    assert findings["pictures"] == 4
    assert not [*whole.glob("data/*"), *killed.glob("data/*")]
