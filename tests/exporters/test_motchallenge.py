"""MOTChallenge: rows, sequence files and classes."""

import configparser
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gen_data.exporters.motchallenge import MotChallenge, mot_class
from tests.exporters.drives import drive_info, stems


def test_mot_rows_count_from_1_and_sequences_describe_them(exported: Any, samples: Any) -> None:
    """Frames, ids and pixels; boxes are around the visible pixels."""
    folder = exported(MotChallenge()) / "street-val/street-0001"
    rows = [line.split(",") for line in (folder / "gt/gt.txt").read_text().splitlines()]
    assert stems(folder / "img1") == [f"{k:06d}" for k in range(1, 5)]
    assert [row[0] for row in rows if row[1] == "2"] == ["1", "2", "3", "4"]
    for row in rows:
        truth = samples[4 + int(row[0]) - 1].truth["left"]
        (thing,) = (t for t in truth.objects if t.instance.instance_id == int(row[1]))
        assert thing.box is not None
        assert list(map(int, row[2:6])) == [
            thing.box.x_min + 1, thing.box.y_min + 1, thing.box.width_px, thing.box.height_px
        ]  # fmt: skip
        assert float(row[8]) == pytest.approx(thing.visible_fraction, abs=1e-6)
    assert {(row[1], row[6], row[7]) for row in rows} == {("1", "0", "3"), ("2", "1", "1")}
    # seqinfo.ini by an ini reader; the list of sequences has TrackEval's header.
    folder = exported(MotChallenge())
    ini = configparser.ConfigParser()
    ini.read(folder / "street-train/street-0000/seqinfo.ini")
    assert dict(ini["Sequence"]) == {
        "name": "street-0000",
        "imdir": "img1",
        "framerate": "10",
        "seqlength": "4",
        "imwidth": "160",
        "imheight": "120",
        "imext": ".png",
    }
    assert (folder / "seqmaps/street-val.txt").read_text() == "name\nstreet-0001\n"


@pytest.mark.parametrize(
    ("category", "facts", "number"),
    [("person", (), 1), ("pedestrian", (("pose", "sitting"),), 7),
     ("motorcycle", (("rider", "yes"),), 2), ("motorcycle", (("rider", "no"),), 5),
     ("bicycle", (), 4), ("bus", (), 3), ("crate", (), 0)],
)  # fmt: skip
def test_mot_classes(category: str, facts: Any, number: int, world: Any) -> None:
    """Numbers of MOT16's table 5; 0 has no rows."""
    thing = replace(world.instance(1, "car", 0.0, 0.0, 0.0), category=category, attributes=facts)
    assert mot_class(thing) == number


def trackeval_scores(dataset: Any, sequence: str, name: str) -> dict[str, float]:
    """HOTA, MOTA and IDF1 of one class over all sequences."""
    import trackeval

    quiet = {"PRINT_CONFIG": False}
    off = ("PRINT_RESULTS", "PRINT_CONFIG", "TIME_PROGRESS", "OUTPUT_SUMMARY", "OUTPUT_DETAILED",
           "PLOT_CURVES", "USE_PARALLEL")  # fmt: skip
    options = {**dict.fromkeys(off, False), "BREAK_ON_ERROR": True, "LOG_ON_ERROR": None}
    evaluator = trackeval.Evaluator(options)
    metrics = trackeval.metrics
    judges = [metrics.HOTA(quiet), metrics.CLEAR(quiet), metrics.Identity(quiet)]
    results, _ = evaluator.evaluate([dataset], judges)
    (tracked,) = results.values()
    row = tracked["truth"][sequence][name]
    return {
        "HOTA": float(row["HOTA"]["HOTA"].mean()),
        "MOTA": float(row["CLEAR"]["MOTA"]),
        "IDF1": float(row["Identity"]["IDF1"]),
    }


PERFECT = pytest.approx({"HOTA": 1.0, "MOTA": 1.0, "IDF1": 1.0}, abs=1e-9)


def gt_rows(folder: Path) -> list[list[str]]:
    """Columns of the rows of the only sequence of a split."""
    (path,) = folder.glob("*/gt/gt.txt")
    return [line.split(",") for line in path.read_text().splitlines()]


def pedestrian_scores(folder: Path, rows: Any, tmp_path: Path) -> dict[str, float]:
    """Scores of tracks with the frames, ids and boxes of rows of the truth."""
    import trackeval

    (sequence,) = (path.name for path in folder.iterdir())
    data = tmp_path / "trackers/truth/data"
    data.mkdir(parents=True, exist_ok=True)
    lines = [f"{','.join(row[:6])},1,-1,-1,-1" for row in rows]
    (data / f"{sequence}.txt").write_text("\n".join(lines))
    options = {"GT_FOLDER": str(folder), "TRACKERS_FOLDER": str(tmp_path / "trackers"),
               "OUTPUT_FOLDER": str(tmp_path / "results"), "SKIP_SPLIT_FOL": True,
               "SEQ_INFO": {sequence: 4}, "PRINT_CONFIG": False}  # fmt: skip
    dataset = trackeval.datasets.MotChallenge2DBox(options)
    return trackeval_scores(dataset, sequence, "pedestrian")


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("split", ["train", "val"])
def test_trackeval_scores_the_truth_as_perfect(exported: Any, tmp_path: Path, split: str) -> None:
    """And tracks that exchange their identities half way as worse."""
    folder = exported(MotChallenge()) / f"street-{split}"
    people = [row for row in gt_rows(folder) if row[6:8] == ["1", "1"]]
    assert len(people) >= 3
    exchanged = [[k, "77" if k in "34" else number, *rest] for k, number, *rest in people]
    assert pedestrian_scores(folder, people, tmp_path) == PERFECT
    assert pedestrian_scores(folder, exchanged, tmp_path)["IDF1"] < 0.9


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_trackeval_does_not_punish_tracks_on_ignored_objects(
    world: Any, samples: Any, tmp_path: Path
) -> None:
    """A tracker follows the pedestrian through all frames, of which labels ignore the second."""

    def flagged(things: Any) -> Any:
        return tuple(replace(t, ignored=t.instance.instance_id == 2) for t in things)

    frames = [world.with_objects(s, flagged) if s.index == 1 else s for s in samples[:4]]
    world.export(MotChallenge(), drive_info(world), frames, tmp_path)
    folder = tmp_path / "dataset/street-train"
    followed = [row for row in gt_rows(folder) if row[1] == "2"]
    assert [row[6:8] for row in followed] == [["1", "1"], ["0", "8"], ["1", "1"], ["1", "1"]]
    assert pedestrian_scores(folder, followed, tmp_path) == PERFECT
