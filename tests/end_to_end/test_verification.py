"""verify --deep, --regenerate and repro on a rendered data set."""

import json
import shutil
from pathlib import Path

import pytest

from gen_data.api.reproduce import reproduce
from gen_data.cli.main import cli
from gen_data.core.errors import ConfigError, VerificationError
from gen_data.runner.deep_verify import find_invalid_samples, find_irreproducible_samples


def test_a_good_set_passes_every_check(dataset: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Every sample is decoded; one is generated again; the report is JSON on request."""
    cli.main(
        ["verify", str(dataset), "--deep", "--regenerate", "1", "--json"], standalone_mode=False
    )

    report = json.loads(capsys.readouterr().out)
    assert report["ok"]
    assert (report["deviations"], report["samples"]) == ([], 15)
    assert len(report["checks"]) == 2


def test_labels_that_were_sealed_wrong_are_found(dataset: Path, tmp_path: Path) -> None:
    """Checksums agree with such labels; decoding and generating them again does not."""
    copy = Path(shutil.copytree(dataset, tmp_path / "copy"))
    path = copy / "shards/000001/labels.jsonl"
    lines = path.read_text().splitlines()
    labels = json.loads(lines[2])
    labels["truth"]["color"]["objects"][0]["visible_px"] += 7
    lines[2] = json.dumps(labels, separators=(",", ":"), sort_keys=True)
    path.write_text("\n".join(lines) + "\n")

    invalid = list(find_invalid_samples(copy))
    again = list(find_irreproducible_samples(copy, [7]))

    assert {f.samples for f in invalid} == {"sample 7"}
    assert "visible_px" in invalid[0].text
    assert [f.samples for f in again] == ["sample 7"]
    assert "stage labels" in again[0].text


def test_a_sample_is_reproduced_alone(dataset: Path) -> None:
    """Also from a folder that only has the plan; there is nothing to compare with then."""
    result = reproduce(dataset, 8)

    assert result.stored
    assert result.difference is None
    assert result.changes == ()
    with pytest.raises(ConfigError, match="expected 0 to 14"):
        reproduce(dataset, 15)


def test_verify_lists_deviations_as_json_and_exits_with_7(
    dataset: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each one with kind, path and samples."""
    copy = Path(shutil.copytree(dataset, tmp_path / "copy"))
    (copy / "shards/000000/color/rgb/000000001.png").unlink()
    (copy / "empty").mkdir()

    with pytest.raises(VerificationError, match="gen-data repair"):
        cli.main(["verify", str(copy), "--json"], standalone_mode=False)

    report = json.loads(capsys.readouterr().out)
    assert not report["ok"]
    kinds = {d["path"]: (d["kind"], d["samples"]) for d in report["deviations"]}
    assert kinds["shards/000000/color/rgb/000000001.png"] == ("missing", "sample 1")
    assert kinds["empty"] == ("extra", "")
