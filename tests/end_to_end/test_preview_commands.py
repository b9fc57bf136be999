"""Preview and information commands."""

import json
import re
import shutil
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

import numpy as np
import psutil
import pytest
from PIL import Image

from tests.end_to_end.running import SMALL, command, environment, gen_data
from tests.tiers import cases
from tests.wheels import needs_rerun


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


def test_contact_sheets_are_png(dataset: Path, tmp_path: Path) -> None:
    sheet = ("contact-sheet", str(dataset), "--n", "1", "--tile-px", "40", "--out")
    done = gen_data(*sheet, "x.jpg", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "gen-data: --out x.jpg: a contact sheet is a PNG; expected x.png\n"

    done = gen_data(*sheet, "x.PNG", cwd=tmp_path)
    assert done.stdout == "x.PNG: 1 tile\n"
    assert [path.name for path in tmp_path.iterdir()] == ["x.PNG"]


@needs_rerun
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


def test_shipped_schema_is_the_generated_one(tmp_path: Path) -> None:
    """Editors complete from configs/schema.json; ``gen-data schema`` prints the same."""
    from gen_data import configs

    done = gen_data("schema", cwd=tmp_path)

    shipped = Path(next(iter(configs.__path__))) / "schema.json"
    assert json.loads(done.stdout) == json.loads(shipped.read_text())


@pytest.mark.slow
def test_doctor_finds_this_machine_fit(tmp_path: Path) -> None:
    """Every check of a machine that runs the tests passes, and one measures its speed."""
    done = gen_data("doctor", cwd=tmp_path)

    assert done.returncode == 0, done.stdout + done.stderr
    assert "FAIL" not in done.stdout
    rate = re.search(r"^ok +speed +([0-9.]+) labelled samples/s", done.stdout, re.MULTILINE)
    assert rate is not None and float(rate[1]) > 0.0


BROKEN_MODULES = {
    "OpenEXR": ("raise ImportError('libIlm.so.9: cannot open shared object file')", "openexr", 6),
    "rerun": ("import os, signal; os.kill(os.getpid(), signal.SIGILL)", "preview", 6),
    "pycocotools": ("", "coco", 6),
    "pyoidn": ("raise OSError('libOpenImageDevice.so: wrong ELF class')", "denoiser", 0),
}
"""Modules that cannot be used: their text, the check that finds them, the exit code."""


@pytest.mark.parametrize("module", BROKEN_MODULES)
def test_doctor_finds_an_engine_that_cannot_be_used(
    tmp_path: Path, module: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One line with the cause and one with the remedy; extras are optional, engines are not."""
    text, check, exit_code = BROKEN_MODULES[module]
    (tmp_path / f"{module}.py").write_text(text)
    # Only the checks: a sample takes long, and is tried above.
    program = (
        "from gen_data.cli import doctor, main\n"
        f"doctor.CHECKS = tuple(c for c in doctor.CHECKS if c.name == {check!r})\n"
        "main.main()\n"
    )
    monkeypatch.setenv("PYTHONPATH", environment(tmp_path)["PYTHONPATH"])

    done = subprocess.run(
        [sys.executable, "-c", program, "doctor"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip

    assert done.returncode == exit_code, done.stdout + done.stderr
    verdict, remedy = done.stdout.splitlines()
    assert verdict.split()[:2] == ["optional" if exit_code == 0 else "FAIL", check]
    assert "pip install" in remedy
    assert "Traceback" not in done.stderr


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


@pytest.mark.slow
@needs_rerun
@pytest.mark.parametrize("signal_number", cases([signal.SIGINT, signal.SIGKILL], {signal.SIGINT}))
def test_a_preview_listens_on_this_machine_only(
    tmp_path: Path, signal_number: signal.Signals
) -> None:
    """The page is served, every socket is on loopback, and none is left after the end."""
    options = ("tabletop.yaml", "--n", "1", "--web", *SMALL)
    with subprocess.Popen(
        command("preview", *options), cwd=tmp_path, env=environment(), text=True,
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        url = process.stdout.readline().split()[1]
        family = [psutil.Process(process.pid), *psutil.Process(process.pid).children(True)]
        hosts = {
            connection.laddr.ip
            for member in family
            for connection in member.net_connections("inet")
            if connection.status == psutil.CONN_LISTEN
        }
        with urllib.request.urlopen(url) as page:
            served = page.read()
        process.send_signal(signal_number)

    assert hosts == {"127.0.0.1"}
    assert b"<html" in served.lower()
    psutil.wait_procs(family, timeout=60)
    assert not any(member.is_running() for member in family)


@needs_rerun
def test_an_address_of_another_machine_is_refused(tmp_path: Path) -> None:
    """192.0.2.1 is reserved for documentation (RFC 5737): no machine has it."""
    done = gen_data("preview", "tabletop.yaml", "--web", "--host", "192.0.2.1", cwd=tmp_path)

    assert done.returncode == 2
    assert "--host 192.0.2.1" in done.stderr and "expected an IPv4 address" in done.stderr
