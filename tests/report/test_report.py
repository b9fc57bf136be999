"""Reports of data sets written by hand, where every share can be counted on paper."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from gen_data.cli.report_command import report
from gen_data.core.errors import StorageError
from gen_data.report import report_tables
from gen_data.report.label_files import SCANS_MAX, Label, Picture, Points, read_records, read_scans
from gen_data.report.label_statistics import Survey, collect_statistics


def annotation(number: int, image_id: int, category_id: int, **keys: Any) -> dict[str, Any]:
    """A car, or a person, 5 m ahead and 12 m to the right: 13 m away."""
    return {
        "id": number,
        "image_id": image_id,
        "category_id": category_id,
        "bbox": [3, 4, 30, 20],
        "attributes": {"name": "it", "asset": "it"},
        "occlusion": 0.0,
        "truncation": 0.0,
        "visible_fraction": 1.0,
        "box3d": {"center_m": [12.0, 1.0, 5.0], "size_m": [4.0, 1.6, 1.5]},
        **keys,
    }


def write_coco(folder: Path, split: str, stem: str, n: int, rows: list[dict[str, Any]]) -> None:
    head = {"categories": [{"id": 1, "name": "car"}, {"id": 2, "name": "person"}]}
    images = ",\n".join(json.dumps({"id": k}) for k in range(1, n + 1))
    lines = ",\n".join(map(json.dumps, rows))
    text = f'{json.dumps(head)[:-1]},\n"images":[\n{images}\n],\n"annotations":[\n{lines}\n]}}\n'
    path = folder / f"coco/annotations/{stem}_{split}.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8", newline="\n")


@pytest.fixture
def street(tmp_path: Path) -> Path:
    """Three cars and a sitting person in two of three images; one car half hidden, one cut off."""
    rows = [annotation(1, 1, 1),
            annotation(2, 1, 1, occlusion=0.4, visible_fraction=0.6, bbox=[0, 0, 60, 45]),
            annotation(3, 2, 1, truncation=0.2, bbox=[0, 0, 60, 45]),
            annotation(4, 2, 2, attributes={"pose": "sit"}, occlusion=0.9)]  # fmt: skip
    write_coco(tmp_path, "train", "instances", 3, rows)
    points = [0, 0, 0, 5.0, 5.0, 1, 6.0, 6.0, 2, 7.0, 7.0, 2]
    write_coco(tmp_path, "train", "person_keypoints", 3, [rows[3] | {"keypoints": points}])
    return tmp_path


def row_of(made: tuple[report_tables.Table, ...], title: str, name: str) -> dict[str, str]:
    """The cells of a row by their columns; KITTI's own columns are numbered."""
    (table,) = (t for t in made if t.title == title)
    (row,) = (r for r in table.rows if r[0] == name)
    return {f"{h} {k}" if h == "KITTI" else h: c for k, (h, c) in enumerate(zip(table.header, row))}  # noqa: B905


def test_cocos_files_are_read_an_object_at_a_time_and_histograms_lose_nothing(street: Path) -> None:
    """Distance is over the ground; the pose makes the type; points are counted by state."""
    found = list(read_records(street))
    assert [r for r in found if isinstance(r, Picture)] == [
        Picture("train", str(k)) for k in (1, 2, 3)
    ]
    labels = [r for r in found if isinstance(r, Label)]
    assert labels[1] == Label(
        ("train", "1"), "car", "Car", 60, 45, 1, 0.0, 0.6, 13.0, (4.0, 1.6, 1.5), "it"
    )
    assert (labels[3].kind, labels[3].occlusion_level) == ("Person_sitting", 2)
    assert [r for r in found if isinstance(r, Points)] == [Points("person", (1, 1, 2))]
    # Values beyond the last edge are in the last bin.
    found = collect_statistics(read_records(street))
    found.numbers[("car", "Car")].extend([5000.0, 4000.0, 0, 0, 1, 999.0, 4, 2, 1])
    made = report_tables.make_histograms(found)
    for histogram in made[1:]:
        assert histogram.counts["car"].sum() == 4
        assert len(histogram.counts["car"]) == len(histogram.edges) - 1
    assert made[0].counts["images"].tolist()[:3] == [1, 0, 2]


def test_diversity_counts_variants_and_what_was_not_annotated_is_blank() -> None:
    """Four cars of one family, one half of them alike: 2/4, 1/4, 1/4 have 1.5 bits."""
    ids = ["car?seed=1", "car?seed=1", "car?seed=2", "car?seed=3", "user/van", "user/van"]
    labels = [Label(("train", "1"), "car", "Car", 9, 9, asset=asset) for asset in ids]
    survey = collect_statistics([*labels, Label(("train", "1"), "dog", "Misc", 9, 9)])
    (table,) = (one for one in report_tables.make_tables(survey) if one.title == "Diversity")
    assert table.header == ("category", "family", "objects", "variants", "entropy bits")
    # All: 2/6, 1/6, 1/6, 2/6, so 2/3 log2 3 + 1/3 log2 6 = 1.9183 bits.
    assert table.rows == (("car", "all", "6", "4", "1.92"), ("car", "car", "4", "3", "1.50"))
    survey = collect_statistics([Label(("train", "1"), "Car", "Car", 9, 9)])
    assert "Diversity" not in {one.title for one in report_tables.make_tables(survey)}
    # A data set of boxes only has sizes still; without its types KITTI does not match.
    made = report_tables.make_tables(
        collect_statistics([Picture("train", "1"), Label(("train", "1"), "mug", "Misc", 10, 20)])
    )
    hidden = row_of(made, "Occlusion and truncation", "mug")
    assert set(hidden.values()) == {"mug", "-"}
    assert row_of(made, "Distance and size", "mug")["height m"] == "-"
    assert [t.title for t in made][-1] == "Distance and size"
    found = collect_statistics([Picture("train", "1")])
    assert row_of(report_tables.make_tables(found), "Images", "train")["empty"] == "100.0 %"
    assert report_tables.make_histograms(found)[0].counts["images"].sum() == 1


def test_kittis_files_are_read_where_there_is_no_coco(tmp_path: Path) -> None:
    """Pixels are inclusive; DontCare is not an object; h w l become l w h."""
    labels = tmp_path / "kitti/training/label_2"
    labels.mkdir(parents=True)
    (tmp_path / "kitti/ImageSets").mkdir()
    (tmp_path / "kitti/ImageSets/val.txt").write_text("000007\n")
    (labels / "000007.txt").write_text(
        "Car 0.10 2 0.50 10.00 20.00 39.00 39.00 1.5 1.6 4.0 12.0 1.0 5.0 1.0\n"
        "DontCare -1 -1 -10 1.00 1.00 2.00 2.00 -1 -1 -1 -1000 -1000 -1000 -10\n"
    )
    picture, label = read_records(tmp_path)
    assert picture == Picture("val", "000007")
    assert label == Label(
        ("val", "000007"), "Car", "Car", 30, 20, 2, 0.1, None, 13.0, (4.0, 1.6, 1.5)
    )


KITTI, COCO = "kitti/training/label_2/000007.txt", "coco/annotations/instances_val.json"


@pytest.mark.parametrize(
    ("path", "text", "message"),
    [("notes.txt", "", r"there are no labels.*exported as coco or kitti"),
     (KITTI, "Car 0 0 0\n", r"000007.txt:1: not the 15 columns"),
     (KITTI, "Car a 0 0 1 1 2 2 1 1 1 1 1 1 1\n", r"000007.txt:1: not the 15 columns"),
     (COCO, '{\n "images": [],\n "annotations": []\n}', "not written by gen-data")],
    ids=["no labels", "few columns", "a letter", "another layout, to be read whole"],
)  # fmt: skip
def test_a_bad_label_is_named_by_line(tmp_path: Path, path: str, text: str, message: str) -> None:
    (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / path).write_text(text)
    if path == KITTI:
        (tmp_path / "kitti/ImageSets").mkdir()
        (tmp_path / "kitti/ImageSets/val.txt").write_text("000007\n")
    with pytest.raises(StorageError, match=message):
        list(read_records(tmp_path))


def test_tables_count_what_was_written(street: Path) -> None:
    """Two of four objects in each of two images, one image empty."""
    made = report_tables.make_tables(collect_statistics(read_records(street)))
    images = row_of(made, "Images", "all")
    assert (images["images"], images["objects"], images["empty"]) == ("3", "4", "33.3 %")
    assert images["objects/image"] == "1.3"
    assert row_of(made, "Objects", "car")["share"] == "75.0 %"
    hidden = row_of(made, "Occlusion and truncation", "car")
    assert [hidden[k] for k in ("occluded 0", "1", "2")] == ["66.7 %", "33.3 %", "0.0 %"]
    assert hidden["truncated"] == "33.3 %"
    # The first is too small for all three, the second hidden, the third cut off.
    assert [hidden[d.name] for d in report_tables.DIFFICULTIES] == ["0.0 %", "66.7 %", "66.7 %"]
    assert row_of(made, "Distance and size", "person")["distance m"] == "13.0 / 13.0 / 13.0"
    points = row_of(made, "Keypoints", "person")
    assert (points["visible"], points["hidden"]) == ("50.0 %", "25.0 %")
    car = row_of(made, "Compared with KITTI", "Car")
    assert (car["objects"], car["per image"], car["length m"]) == ("3", "1.00", "4.00")
    assert (car["KITTI 2"], car["KITTI 4"], car["KITTI 10"]) == ("28742", "3.84", "3.88")
    assert row_of(made, "Compared with KITTI", "Person_sitting")["objects"] == "1"


def test_the_difficulties_are_those_of_the_devkit_and_counts_need_little_memory() -> None:
    """40, 25 and 25 px; levels 0, 1, 2; 15, 30 and 50 % outside: limits belong to the level."""
    columns = {"height_px": np.array([40.0, 39.9, 25.0, 24.9, 90.0]),
               "occlusion_level": np.array([0.0, 0.0, 1.0, 0.0, 2.0]),
               "truncation": np.array([0.15, 0.0, 0.3, 0.0, 0.5])}  # fmt: skip
    levels = report_tables.DIFFICULTIES
    counted = [report_tables.counts_at(columns, level).tolist() for level in levels]
    assert counted == [
        [True, False, False, False, False],
        [True, True, True, False, False],
        [True, True, True, False, True],
    ]
    # 51,865 labelled objects in all, 11,295 of which are DontCare regions.
    assert sum(kind.objects for kind in report_tables.TYPES.values()) == 51_865 - 11_295
    # A million objects are 72 MB.
    label = Label(("train", "1"), "mug", "Misc", 10, 20)
    found: Survey = collect_statistics(label for _ in range(1000))
    assert found.numbers[("mug", "Misc")].buffer_info()[1] == 9000


def test_the_command_prints_tables_and_writes_a_page(street: Path, tmp_path: Path) -> None:
    html = tmp_path / "out/report.html"
    done = CliRunner().invoke(report, [str(street), "--html", str(html)])
    assert done.exit_code == 0, done.output
    assert "Occlusion and truncation" in done.output
    assert "Compared with KITTI" in html.read_text(encoding="utf-8")


def write_scan(folder: Path, name: str, rows: list[int], labels: str) -> None:
    """A point per row, every other one with reflectance 0."""
    points = np.zeros((len(rows), 4), "<f4")
    points[1::2, 3] = 0.5
    for part in ("velodyne", "velodyne_labels", "label_2"):
        (folder / "training" / part).mkdir(parents=True, exist_ok=True)
    points.tofile(folder / f"training/velodyne/{name}.bin")
    (np.array(rows, "<u4") << 16).astype("<u4").tofile(
        folder / f"training/velodyne_labels/{name}.label"
    )
    (folder / f"training/label_2/{name}.txt").write_text(labels, encoding="utf-8")


CAR_ROWS = """\
Car 0.00 0 0.00 1.00 1.00 9.00 9.00 1.50 1.60 4.00 3.00 1.70 4.00 0.00
Pedestrian 0.00 0 0.00 1.00 1.00 9.00 9.00 1.50 1.60 4.00 3.00 1.70 14.00 0.00
Car 0.00 1 0.00 1.00 1.00 9.00 9.00 1.50 1.60 4.00 3.00 1.70 14.00 0.00
Car 0.00 0 0.00 1.00 1.00 9.00 9.00 1.50 1.60 4.00 12.00 1.70 16.00 0.00
"""


def test_points_on_cars_are_counted_by_distance(tmp_path: Path) -> None:
    """Two cars in view, 5 m and 20 m away, with three points and none."""
    write_scan(tmp_path / "kitti", "000000", [1, 1, 1, 2, 3, 0], CAR_ROWS)
    (scan,) = read_scans(tmp_path)
    whole, cars = report_tables.make_scan_tables([scan])
    assert (scan.points, scan.dark) == (6, 3)
    assert scan.cars == ((5.0, 3), (20.0, 0))
    assert (whole.rows[0][1:4], whole.rows[0][-1]) == (("6", "120000", "104450"), "50.00 %")
    assert [row[1] for row in cars.rows] == ["1", "0", "1", "0", "0", "0", "0", "0"]
    assert cars.rows[0][2] == "3.0" and cars.rows[2][4] == "100.0 %"


def test_of_many_scans_some_are_read(tmp_path: Path) -> None:
    """Evenly chosen, from the first on; none of a data set without a scanner."""
    assert list(read_scans(tmp_path)) == [] and report_tables.make_scan_tables([]) == ()
    for k in range(SCANS_MAX + 1):
        write_scan(tmp_path, f"{k:06d}", [0] * (k + 1), "")
    read = [scan.points for scan in read_scans(tmp_path)]
    assert read == list(range(1, SCANS_MAX + 2, 2))


def test_a_scan_whose_labels_do_not_fit_is_refused(tmp_path: Path) -> None:
    write_scan(tmp_path, "000007", [0, 0], "")
    (tmp_path / "training/velodyne/000007.bin").write_bytes(b"1234")
    with pytest.raises(StorageError, match=r"000007.label: not a scan"):
        list(read_scans(tmp_path))
