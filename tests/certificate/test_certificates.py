"""Certificates of a good data set, and of copies with each damage that claims exclude."""

import errno
import json
import os
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import gen_data
from gen_data.cli.main import cli
from gen_data.core.distribution import install_command
from gen_data.core.errors import CertificationError, ConfigError, StorageError, VerificationError
from gen_data.lab.certificate import certificate, readers
from gen_data.lab.certificate.certificate import Certificate, describe_failures
from gen_data.lab.certificate.claims import CLAIMS, Claim
from gen_data.lab.certificate.finding import Finding, Status
from gen_data.runner.verify import verify
from tests.certificate.sealing import SMALL, edit_lines, reseal
from tests.wheels import needs_open3d

QUICK = {"samples": 2, "rays": 400, "scenes": 0}
"""A scope for claims that need no scene drawn again."""


@pytest.fixture(scope="session")
def certified(dataset: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    copy = Path(shutil.copytree(dataset, tmp_path_factory.mktemp("good") / "table"))
    gen_data.certify(copy, samples=4, rays=200, scenes=32)
    return copy


def findings(certificate: Certificate) -> dict[str, Finding]:
    return {
        f"{claim.name}: {finding.subject}".rstrip(": "): finding
        for claim, finding in certificate.findings()
    }


def failed(certificate: Certificate) -> set[str]:
    return {claim.name for claim, _ in certificate.findings(Status.FAILED)}


@pytest.mark.slow
@needs_open3d
def test_a_good_set_passes_every_claim_and_figures_count_what_was_checked(certified: Path) -> None:
    """Also the one on distributions, whose false-alarm rate is 0.001 for any seed."""
    certificate = json.loads((certified / "CERTIFICATE.json").read_bytes())
    statuses = {
        (claim["name"], finding["subject"]): finding["status"]
        for claim in certificate["claims"]
        for finding in claim["findings"]
    }
    assert certificate["holds"] is True
    assert certificate["dataset"]["samples"] == 64
    assert statuses == dict.fromkeys(
        [
            *((name, "") for name in ("files", "run log", "samples", "boxes and masks", "draws")),
            *(("exports", "coco"), ("pixels", "color"), ("laser points", "pseudo_lidar")),
            *((name, "") for name in ("written again", "generated again", "distributions")),
            ("splits", ""),
        ],
        "passed",
    )
    # Four images of 200 pixels; the images of all 64 samples in COCO, which score 1.
    plain = json.loads((certified / "CERTIFICATE.json").read_bytes())
    figures = {c["name"]: c["findings"][0]["figures"] for c in plain["claims"]}
    assert (figures["pixels"]["images"], figures["pixels"]["pixels"]) == (4, 800)
    assert figures["exports"]["images"] == figures["exports"]["pictures"] == 64
    # None of 4 differs: 1 - 0.01 ** (1 / 4), by the binomial distribution.
    assert figures["generated again"]["differing share, at most (99 %)"] == 0.68377
    assert figures["exports"]["AP of boxes"] == figures["exports"]["AP of masks"] == 1.0
    assert figures["draws"]["scenes"] == figures["splits"]["scenes"] == 32
    assert figures["distributions"]["false-alarm rate of all tests"] == 0.001


@pytest.mark.slow
def test_certificates_have_the_same_bytes_again_and_the_date_they_are_given(
    certified: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Clocks have no influence; SOURCE_DATE_EPOCH counts seconds since 1970 began."""
    copy = Path(shutil.copytree(certified, certified.parent / "again"))
    command = ["certify", str(copy), "--samples", "2", "--rays", "50", "--scenes", "0"]
    first = gen_data.certify(copy, samples=2, rays=50, scenes=0).to_bytes()
    cli.main(command, standalone_mode=False)
    again = (copy / "CERTIFICATE.json").read_bytes()
    monkeypatch.setenv("SOURCE_DATE_EPOCH", str(86_400 * 365))
    cli.main(command, standalone_mode=False)
    dated = (copy / "CERTIFICATE.json").read_bytes()
    assert first == again
    assert dated == first.replace(b'"date": ""', b'"date": "1971-01-01"')
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "yesterday")
    with pytest.raises(ConfigError, match="SOURCE_DATE_EPOCH"):
        cli.main(command, standalone_mode=False)


@pytest.mark.slow
def test_a_certificate_is_no_part_of_the_data_set_and_verify_repeats_it(
    certified: Path, dataset: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Verification accepts it, and the identity is what it was."""
    assert verify(certified, full=True) == verify(dataset, full=True)
    # Only with --deep.
    cli.main(["verify", str(certified), "--deep"], standalone_mode=False)
    cli.main(["verify", str(certified)], standalone_mode=False)
    deep, quick = capsys.readouterr().out.splitlines()
    assert "the certificate's claims hold again" in deep
    assert "certificate" not in quick
    # Its content security policy permits its own style sheet only.
    page = (certified / "CERTIFICATE.html").read_text()
    assert "default-src 'none'" in page and "<script" not in page
    assert "script-src" not in page and "http" not in page.replace("http-equiv", "")
    for text in ("Certificate of tabletop", "No scene is in two splits.", "Limits"):
        assert text in page


def exchange_photographs(copy: Path) -> None:
    """Exchange those of the samples 2 and 9, in exports, too."""
    first, second = (copy / f"shards/000000/color/rgb/{k:09d}.png" for k in (2, 9))
    pictures = first.read_bytes(), second.read_bytes()
    links = [[p for p in copy.rglob("*.png") if p.read_bytes() == data] for data in pictures]
    for paths, data in zip(links, reversed(pictures), strict=True):
        for path in paths:
            path.write_bytes(data)
    reseal(copy)


@pytest.mark.slow
def test_the_log_of_the_run_tells_exchanged_photographs(dataset: Path, tmp_path: Path) -> None:
    """All samples are covered; a data set without the log is not checked."""
    copy = Path(shutil.copytree(dataset, tmp_path / "copy"))
    exchange_photographs(copy)
    certificate = gen_data.certify(copy, samples=0, scenes=0)
    shutil.rmtree(copy / "run")
    without_run = gen_data.certify(copy, samples=0, scenes=0)
    assert failed(certificate) == {"run log"}
    evidence = findings(certificate)["run log"].evidence
    assert evidence[0].startswith("shard 0, samples 0 to 15: its record is not the one")
    assert "which was sealed" in evidence[1]
    assert findings(without_run)["run log"].status is Status.NOT_CHECKED
    assert failed(without_run) == set()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["kitti/notes.txt", "notes.txt"])
def test_a_file_that_no_exporter_writes_is_named(damaged: Callable[[], Path], name: str) -> None:
    """Its checksum is in the manifest, and no reader looks at it."""
    copy = damaged()
    (copy / name).parent.mkdir(exist_ok=True)
    (copy / name).write_bytes(b"extra")
    reseal(copy)
    certificate = gen_data.certify(copy, samples=0, scenes=0)
    assert failed(certificate) == {"written again"}
    assert findings(certificate)["written again"].evidence == (
        f"{name}: is extra: the samples give no such file",
    )


@pytest.mark.slow
def test_a_parameter_that_was_not_drawn_as_declared_is_named(tmp_path: Path) -> None:
    """The plan declares a distribution; the scenes were made with a constant."""
    folder = tmp_path / "constant"
    changes = {**SMALL, "overrides": (*SMALL["overrides"], "randomizers.lens.hfov_deg=60")}
    with pytest.warns(gen_data.ConfigWarning, match="empty"):
        gen_data.generate("tabletop.yaml", 2, out=folder, workers=0, seed=1, **changes)
    plan = json.loads((folder / "plan.json").read_bytes())
    (lens,) = (r for r in plan["config"]["randomizers"] if r["name"] == "lens")
    assert lens["hfov_deg"] == 60
    lens["hfov_deg"] = {"uniform": [52, 68]}
    text = json.dumps(plan, separators=(",", ":"), sort_keys=True, ensure_ascii=False)
    (folder / "plan.json").write_text(text + "\n")
    reseal(folder)
    certificate = gen_data.certify(folder, samples=0, scenes=1)
    assert failed(certificate) == {"run log", "written again", "draws"}
    assert "cameras[0].intrinsics" in findings(certificate)["draws"].evidence[0]
    assert findings(certificate)["distributions"].status is Status.NOT_CHECKED


@pytest.mark.slow
def test_a_scene_in_two_splits_is_named(damaged: Callable[[], Path]) -> None:
    """Labels and kept scenes agree on it, and so do all checksums."""
    copy = damaged()

    def move(number: int, row: dict[str, Any]) -> None:
        if number == 5:
            row["split"] = "test" if row["split"] != "test" else "train"

    for name in ("labels.jsonl", "scenes.jsonl"):
        edit_lines(copy / "shards/000000" / name, move)
    reseal(copy)

    certificate = gen_data.certify(copy, **QUICK)

    assert "splits" in failed(certificate)
    assert findings(certificate)["splits"].evidence[0].startswith("scene 2: sample 4 is in ")


@pytest.mark.slow
def test_files_that_are_not_the_manifests_fail_alone(damaged: Callable[[], Path]) -> None:
    """One byte of one photograph."""
    copy = damaged()
    path = copy / "shards/000002/color/rgb/000000040.png"
    data = bytearray(path.read_bytes())
    data[-20] ^= 1
    path.write_bytes(data)
    certificate = gen_data.certify(copy, **QUICK)
    assert failed(certificate) == {"files"}
    assert "shards/000002/color/rgb/000000040.png (sample 40)" in describe_failures(certificate)[0]
    assert certificate.count(Status.PASSED) == 0


@pytest.mark.slow
def test_the_command_exits_with_8_and_names_what_failed(
    damaged: Callable[[], Path], capsys: pytest.CaptureFixture[str]
) -> None:
    """Both documents are written all the same."""
    copy = damaged()
    (copy / "coco/annotations/instances_train.json").unlink()
    with pytest.raises(CertificationError, match="instances_train") as error:
        cli.main(["certify", str(copy), "--samples", "0", "--scenes", "0"], standalone_mode=False)
    assert error.value.exit_code == 8
    assert "failed      files" in capsys.readouterr().out
    assert (copy / "CERTIFICATE.html").is_file()
    assert not json.loads((copy / "CERTIFICATE.json").read_bytes())["holds"]


@pytest.mark.slow
def test_what_is_not_installed_is_not_checked(
    damaged: Callable[[], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The reason names the remedy; nothing counts as passed."""
    unknown = replace(readers.READERS["coco"], package="no-such-reader")
    monkeypatch.setattr("gen_data.lab.certificate.exports.READERS", {"coco": unknown}, raising=True)
    finding = findings(gen_data.certify(damaged(), samples=0, scenes=0))["exports: coco"]
    assert finding.status is Status.NOT_CHECKED
    assert install_command("certify") in finding.reason


@pytest.mark.slow
def test_verify_refuses_figures_that_come_out_differently(certified: Path, tmp_path: Path) -> None:
    """A certificate that says it saw more than it did."""
    copy = Path(shutil.copytree(certified, tmp_path / "copy"))
    path = copy / "CERTIFICATE.json"
    plain = json.loads(path.read_bytes())
    (claim,) = (c for c in plain["claims"] if c["name"] == "pixels")
    claim["findings"][0]["figures"]["pixels"] = 10_000
    path.write_text(json.dumps(plain))
    with pytest.raises(VerificationError, match="pixels: color: figures were"):
        cli.main(["verify", str(copy), "--deep"], standalone_mode=False)


@pytest.mark.slow
@pytest.mark.parametrize("content", ["other", "{}", "no JSON"])
def test_verify_refuses_a_certificate_of_another_data_set_and_none_at_all(
    certified: Path, damaged: Callable[[], Path], content: str
) -> None:
    """It names the remedy, which is not a repair of the data set."""
    copy = damaged()
    text = (certified / "CERTIFICATE.json").read_text() if content == "other" else content
    (copy / "CERTIFICATE.json").write_text(text)
    (copy / "README.md").write_text("another data set\n")
    reseal(copy)
    with pytest.raises(VerificationError, match="gen-data certify") as error:
        cli.main(["verify", str(copy)], standalone_mode=False)
    assert "gen-data repair" not in str(error.value)
    assert ("certifies the data set" in str(error.value)) == (content == "other")


@pytest.mark.slow
def test_a_data_set_that_grows_loses_its_certificate(certified: Path, tmp_path: Path) -> None:
    """What was certified is no more."""
    copy = Path(shutil.copytree(certified, tmp_path / "copy"))
    gen_data.generate("tabletop.yaml", 66, out=copy, workers=0, seed=1, **SMALL)
    assert not list(copy.glob("CERTIFICATE*"))


@pytest.mark.slow
def test_an_export_of_a_certified_set_is_certified_too(certified: Path, tmp_path: Path) -> None:
    """Readers of several formats; the certificate of the source is not copied."""
    pytest.importorskip("tfrecord")
    pytest.importorskip("webdataset")
    folder = tmp_path / "formats"
    gen_data.export(certified, ["webdataset", "tfrecord", "hdf5", "usd"], folder, workers=0)
    assert not list(folder.glob("CERTIFICATE*"))
    found = findings(gen_data.certify(folder, samples=0, scenes=0))
    exported = {name: f for name, f in found.items() if name.startswith("exports")}
    assert {f.status for f in exported.values()} == {Status.PASSED}
    assert len(exported) == 4
    assert exported["exports: webdataset"].figures["AP of masks"] == 1.0


@pytest.mark.parametrize("arguments", [{"samples": -1}, {"alpha": 0.0}, {"scenes": -3}])
def test_impossible_numbers_are_refused(tmp_path: Path, arguments: dict[str, Any]) -> None:
    """With the name of the argument."""
    with pytest.raises(ConfigError, match=next(iter(arguments))):
        gen_data.certify(tmp_path, **arguments)


def test_a_folder_without_a_data_set_is_refused(tmp_path: Path) -> None:
    """Nothing is written."""
    with pytest.raises((VerificationError, StorageError), match="not a finished data set"):
        gen_data.certify(tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_images_on_photographs_are_not_judged(tmp_path: Path) -> None:
    """The foreground of a photograph hides things, and is no geometry that a ray could meet."""
    folder = tmp_path / "plates"
    gen_data.generate("photo_plates.yaml", 1, out=folder, workers=0, seed=5)
    certificate = gen_data.certify(folder, samples=1, rays=50, scenes=0)
    assert findings(certificate)["pixels: color"].status is Status.NOT_CHECKED
    assert certificate.holds


@pytest.mark.slow
@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EIO, errno.EACCES, errno.EROFS])
@pytest.mark.parametrize("claim", ["files", "samples", "written again"])
def test_a_refusing_disk_says_nothing_about_the_data(
    claim: str, number: int, dataset: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither a failed claim nor a certificate."""

    def check(examined: object) -> list[Finding]:
        try:
            raise OSError(number, os.strerror(number), "disk")
        except OSError as error:
            raise StorageError("cannot be read") from error

    chosen = [replace(one, place="x:y") for one in CLAIMS if one.name == claim]
    monkeypatch.setattr(certificate, "CLAIMS", tuple(chosen))
    monkeypatch.setattr(Claim, "check", lambda self, examined: check(examined))
    with pytest.raises(StorageError, match=f"claim '{claim}' was not checked: cannot be read"):
        gen_data.certify(dataset, **QUICK)
    assert not (dataset / "CERTIFICATE.json").exists()
