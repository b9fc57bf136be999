"""A data set without one of its samples, in every command that reads it."""

import json
from pathlib import Path

import pytest

import gen_data
from gen_data.cli.main import cli
from gen_data.core.errors import SampleIndexError, SamplesSkipped
from gen_data.core.sample import Sample
from gen_data.pipeline.pipeline import Pipeline
from gen_data.runner.deep_verify import find_invalid_samples
from gen_data.runner.verify import verify

TINY = [
    "sensors.color.size_px=[48, 32]",
    "shard_size=2",
    "randomizers.clutter.count=2",
    "splits={train: 1}",
]
FAILS = 1


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Samples 0, 2 and 3 of a table; a plug-in fails on sample 1."""
    made = tmp_path_factory.mktemp("lacking") / "set"
    whole = Pipeline.sample

    def sample(self: Pipeline, index: int) -> Sample:
        if index == FAILS:
            raise ZeroDivisionError("in a plug-in")
        return whole(self, index)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Pipeline, "sample", sample)
        summary = gen_data.generate(
            "tabletop.yaml", 4, out=made, workers=0, overrides=[*TINY, "skip_failed=true"]
        )
    assert [failure.index for failure in summary.failed] == [FAILS]
    return made


@pytest.mark.slow
def test_the_plan_is_that_of_a_run_without_the_options(folder: Path) -> None:
    """They are options of the run, also as keys of the configuration."""
    config = json.loads((folder / "plan.json").read_text())["config"]

    assert not {"skip_failed", "sample_timeout_s"} & config.keys()


def test_the_data_set_and_its_loader_have_the_other_samples_and_all_are_valid(folder: Path) -> None:
    """Their numbers are the plan's; each comes once per epoch."""
    data = gen_data.open(folder)

    assert len(data) == 3
    assert [sample.index for sample in data] == [0, 2, 3]
    assert [sample.index for sample in data[1:]] == [2, 3]
    with pytest.raises(SampleIndexError):
        data[3]

    loader = gen_data.Loader(gen_data.open(folder), number_of, batch_size=1)

    assert [batch[0] for batch in loader] == [0, 2, 3]

    assert verify(folder, full=True).samples == 3
    assert list(find_invalid_samples(folder)) == []


def number_of(sample: gen_data.Sample) -> int:
    return sample.index


@pytest.mark.parametrize("form", ["coco", "yolo", "voc"])
def test_an_export_lacks_the_same_sample(folder: Path, form: str, tmp_path: Path) -> None:
    """It is finished, and names it."""
    summary = gen_data.export(folder, [form], tmp_path / "out", workers=0)

    assert [failure.index for failure in summary.failed] == [FAILS]
    assert len(gen_data.open(tmp_path / "out")) == 3
    assert verify(tmp_path / "out", full=True).samples == 3


def test_a_rerendering_lacks_the_same_sample(folder: Path, tmp_path: Path) -> None:
    summary = gen_data.rerender(
        folder, tmp_path / "out", overrides=["sensors.color.hfov_deg=50"], workers=0
    )

    assert [failure.index for failure in summary.failed] == [FAILS]
    assert [sample.index for sample in gen_data.open(tmp_path / "out")] == [0, 2, 3]


def test_the_command_has_its_own_exit_code(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["-c", "tabletop.yaml", "-n", "4", "--out", str(folder), "-w", "0", "--skip-failed"]
    for override in TINY:
        command += ["--set", override]
    with pytest.raises(SamplesSkipped, match="1 samples could not be made") as skipped:
        cli.main(command, standalone_mode=False)

    assert skipped.value.exit_code == 10
    assert "1 (sample: ZeroDivisionError)" in capsys.readouterr().err


def test_repair_makes_the_whole_data_set(folder: Path, tmp_path: Path) -> None:
    """The sample can be made now. Last, as it changes the folder."""
    summary = gen_data.generate(
        "tabletop.yaml", 4, out=folder, workers=0, overrides=TINY, repair=True
    )

    assert summary.failed == ()
    assert len(gen_data.open(folder)) == 4


@pytest.mark.parametrize("limit_s", [0.0, -1.0, float("nan"), float("inf")])
def test_a_time_limit_that_is_none_is_refused(limit_s: float, tmp_path: Path) -> None:
    with pytest.raises(
        gen_data.GenDataError, match="is not a time limit; expected seconds above 0"
    ):
        gen_data.generate("tabletop.yaml", 1, out=tmp_path, workers=0, sample_timeout_s=limit_s)


@pytest.mark.slow
def test_a_surface_that_is_too_small_is_named_with_the_best_attempt() -> None:
    """500 objects on a table of 1.3 m x 0.9 m."""
    crowded = gen_data.Dataset("tabletop.yaml", n=1, overrides=["randomizers.clutter.count=500"])
    best = r"Best: attempt \d+: \d+ of 500 objects of 'clutter' found a place on 'table'"
    with pytest.raises(gen_data.GenDataError, match=best):
        crowded[0]
