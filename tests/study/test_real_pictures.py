"""Folders of users are read as they are, and what cannot be used is counted."""

import json
from pathlib import Path
from typing import Any

import pytest

from gen_data.core.errors import ConfigError, StorageError
from gen_data.exporters.kitti_boxes import UprightBox
from gen_data.lab.matching.label_files import RealObject
from gen_data.lab.study.real_pictures import check_judges, read_real
from tests.study.conftest import write_coco, write_picture

LABELS = """\
Car 0.00 1 -1.57 10.00 12.00 29.00 31.00 1.5 1.6 3.9 1.0 1.7 20.0 -1.5
Pedestrian 0.00 3 0.10 40.00 5.00 49.00 24.00 1.7 0.6 0.6 4.0 1.7 12.0 0.4
DontCare -1 -1 -10 0.00 0.00 9.00 9.00 -1 -1 -1 -1000 -1000 -1000 -10
"""


@pytest.mark.slow
def test_cocos_boxes_crowds_and_occlusion_are_read(tmp_path: Path) -> None:
    """A hidden fraction has KITTI's level; ids are those of the file."""
    write_coco(
        tmp_path,
        [[{"bbox": [1, 2, 10, 20], "occlusion": 0.7}, {"bbox": [5, 5, 4, 4], "iscrowd": 1}], []],
    )
    real = read_real(tmp_path)
    assert real.category_ids == {"cup": 7, "plate": 3}
    sizes = [(p.image_id, p.size_px, len(p.objects)) for p in real.pictures]
    assert sizes == [(10, (64, 48), 2), (11, (64, 48), 0)]
    assert real.pictures[0].objects == (
        RealObject("cup", (1, 2, 11, 22), False, "largely occluded"),
        RealObject("cup", (5, 5, 9, 9), True, ""),
    )


def test_kittis_inclusive_sides_and_regions_are_read(tmp_path: Path) -> None:
    """Column 29 belongs to the box: it ends at 30. DontCare is ignored for every class."""
    write_picture(tmp_path / "training/image_2/000007.png")
    (tmp_path / "training/label_2").mkdir()
    (tmp_path / "training/label_2/000007.txt").write_text(LABELS)
    real = read_real(tmp_path).restrict(["car", "cyclist"])
    (picture,) = real.pictures
    solid = UprightBox((1.5, 1.6, 3.9), (1.0, 1.7, 20.0), -1.5)
    assert picture.objects == (
        RealObject("car", (10, 12, 30, 32), False, "partly occluded", 0.0, solid),
        RealObject("", (0, 0, 10, 10), True, ""),
    )
    assert real.skipped == {"object of class 'Pedestrian', which the configuration lacks": 1}
    assert real.category_ids == {"car": 1}
    assert [row["iscrowd"] for row in real.to_coco()["annotations"]] == [0, 1]


def test_kittis_scans_belong_to_their_frames_and_missing_ones_are_counted(tmp_path: Path) -> None:
    (tmp_path / "label_2").mkdir()
    (tmp_path / "velodyne").mkdir()
    for name in ("000000", "000001"):
        write_picture(tmp_path / f"image_2/{name}.png")
        (tmp_path / f"label_2/{name}.txt").write_text(LABELS)
    (tmp_path / "velodyne/000001.bin").write_bytes(b"")
    real = read_real(tmp_path)
    assert [p.scan for p in real.pictures] == [None, tmp_path / "velodyne/000001.bin"]
    assert real.skipped == {"scan that is missing": 1}


def test_of_cocos_own_folder_the_instances_are_read(tmp_path: Path) -> None:
    """Beside captions and keypoints; a plan of a data set that lists ``images`` is none of them."""
    source = write_coco(tmp_path / "coco", [[{"bbox": [1, 2, 10, 20]}]])
    (source.parent / "captions_val.json").write_text('{"images": [], "annotations": []}')
    (tmp_path / "plan.json").write_text('{"randomizers": [{"images": ["indoor"]}]}')
    assert read_real(tmp_path).source == source


def test_yolos_boxes_and_polygons_are_read_in_pixels(tmp_path: Path) -> None:
    """Shares of 64 x 48 px; of a polygon its tight box; an image without a file has no object."""
    for number in range(3):
        write_picture(tmp_path / f"images/train/{number}.png")
    (tmp_path / "labels/train").mkdir(parents=True)
    (tmp_path / "data.yaml").write_text("names: {0: cup, 1: plate}\n")
    (tmp_path / "labels/train/0.txt").write_text("1 0.5 0.5 0.25 0.5\n")
    (tmp_path / "labels/train/1.txt").write_text("0 0.25 0 0.5 0.5 0.125 0.75\n")
    (tmp_path / "labels/train/9.txt").write_text("0 0.5 0.5 0.1 0.1\n")
    real = read_real(tmp_path)
    assert [p.objects for p in real.pictures] == [
        (RealObject("plate", (24, 12, 40, 36)),),
        (RealObject("cup", (8, 0, 32, 36)),),
        (),
    ]
    assert (real.layout, real.category_ids) == ("yolo", {"cup": 1, "plate": 2})
    assert real.skipped == {
        "image without a label file, read as one without objects": 1,
        "image that is missing (such as 9.png)": 1,
    }


def test_yolos_rows_with_keypoints_begin_with_the_box(tmp_path: Path) -> None:
    """``kpt_shape`` tells them from polygons, which have as many columns."""
    write_picture(tmp_path / "images/0.png")
    (tmp_path / "labels").mkdir()
    (tmp_path / "data.yaml").write_text("kpt_shape: [1, 2]\nnames: [cup]\n")
    (tmp_path / "labels/0.txt").write_text("0 0.5 0.5 0.25 0.5 0.5 0.5\n")
    (picture,) = read_real(tmp_path).pictures
    assert picture.objects == (RealObject("cup", (24, 12, 40, 36)),)


def test_a_byte_order_mark_and_spaces_are_no_part_of_a_class(tmp_path: Path) -> None:
    """As editors of Windows write both files of YOLO."""
    write_picture(tmp_path / "0.png")
    (tmp_path / "classes.txt").write_bytes("\ufeffcup \r\nplate\r\n\r\n".encode())
    (tmp_path / "0.txt").write_bytes("\ufeff0 0.5 0.5 0.25 0.5\r\n".encode())
    real = read_real(tmp_path)
    assert list(real.category_ids) == ["cup", "plate"]
    assert [thing.name for thing in real.pictures[0].objects] == ["cup"]


def test_paths_of_windows_name_the_same_images(tmp_path: Path) -> None:
    """Files of COCO and VOC with backslashes, from annotation tools."""
    write_picture(tmp_path / "images/0.png")
    box = {"id": 1, "image_id": 1, "category_id": 1, "bbox": [1, 2, 3, 4]}
    content = {"images": [{"id": 1, "file_name": "images\\0.png"}], "annotations": [box],
               "categories": [{"id": 1, "name": "cup"}]}  # fmt: skip
    (tmp_path / "labels.json").write_text(json.dumps(content))
    (picture,) = read_real(tmp_path).pictures
    assert picture.path == tmp_path / "images/0.png"
    (tmp_path / "labels.json").unlink()
    (tmp_path / "a.xml").write_text(
        "<annotation><filename>C:\\data\\0.png</filename><object><name>cup</name><bndbox>"
        "<xmin>2</xmin><ymin>3</ymin><xmax>4</xmax><ymax>6</ymax></bndbox></object></annotation>"
    )
    (tmp_path / "images/0.png").rename(tmp_path / "0.png")
    (picture,) = read_real(tmp_path).pictures
    assert picture.objects == (RealObject("cup", (1, 2, 4, 6)),)


CUPS = {"classes.txt": "cup\nplate\n", "a.png": ""}


@pytest.mark.parametrize(
    ("files", "fact"),
    [
        ({**CUPS, "a.txt": "0 0.5 0.5 0.1 0.1\n2 0.5 0.5 0.1 0.1\n"},
         r"a\.txt:2: not a label in YOLO's format: class 2, expected 0 to 1"),
        ({**CUPS, "a.txt": "0 0.5 0.5 0.1 0.1\n0 0.5 0.5 0.1\n"},
         r"a\.txt:2: not a label in YOLO's format: 4 columns"),
        ({**CUPS, "a.txt": "0 100 100 20 20\n"},
         r"a\.txt:1: .*: its box reaches to 110; expected shares .*: divide pixels by them"),
        ({**CUPS, "a.txt": "0 0.5 x 0.1 0.1\n"}, r"a\.txt:1: .*: column 3 is \"x\"; expected"),
        ({"image_2/1.png": "", "label_2/1.txt": "Car 0 0 0 1 2 3 4\nCar 0 0 0 1 2\n"},
         r"1\.txt:2: not a label in KITTI's format: 6 columns; expected 15, or 8 without a"),
        ({"image_2/1.png": "", "label_2/1.txt": "Car 0 inf 0 1 2 3 4\n"},
         r"1\.txt:1: not a label in KITTI's format: occluded is \"inf\"; expected a number"),
        ({"image_2/1.png": "", "label_2/1.txt": "Car 0 0 0 1 2 3 4 1 a 1\n"},
         r"1\.txt:1: not a label in KITTI's format: width is \"a\"; expected a number"),
        ({"data.yaml": "train: images\nnc: 1\n", "a.png": ""},
         r"data\.yaml: no file of YOLO's classes: there are no 'names'; expected a list, .*cup, "),
        ({"data.yaml": "names: cup\n", "a.png": ""}, r"data\.yaml: .*: names is cup; expected"),
        ({"data.yaml": "names: {1: cup}\n"}, r"data\.yaml: .*: names is \{1: 'cup'\}; expected"),
        ({"data.yaml": "train: images\nnames: [cup\n", "a.png": ""},
         r"data\.yaml: no file of YOLO's classes: line 3: "),
        *(({"Annotations/7.xml": text}, r"7\.xml: not annotations in VOC's format")
          for text in ("<annotation>", "<annotation><object/></annotation>")),
        *(({"annotations/x.json": text}, r"x\.json: not annotations in COCO's format")
          for text in ("[]", "{", '{"images": [], "categories": []}')),
    ],
)  # fmt: skip
def test_a_wrong_label_is_named_by_line(files: dict[str, str], fact: str, tmp_path: Path) -> None:
    """Not a traceback."""
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        if name.endswith(".png"):
            write_picture(tmp_path / name)
        else:
            (tmp_path / name).write_text(text)
    with pytest.raises(StorageError, match=fact):
        read_real(tmp_path)


ROW = {"id": 5, "image_id": 1, "category_id": 1, "bbox": [1, 2, 3, 4]}


@pytest.mark.parametrize(
    ("changes", "fact"),
    [
        ({"annotations": [ROW, {**ROW, "id": 6, "category_id": 77}]},
         "annotations[1] (id 6): category_id is 77; expected the id of a category"),
        ({"annotations": [{**ROW, "image_id": [1]}]},
         "annotations[0] (id 5): image_id is [1]; expected the id of an image"),
        ({"annotations": [{**ROW, "bbox": [1, 2, 3]}]},
         "annotations[0] (id 5): bbox is [1, 2, 3]; expected four numbers: x, y, width, height"),
        ({"annotations": [{**ROW, "bbox": [1, 2, 3, "wide"]}]},
         'annotations[0] (id 5): bbox is [1, 2, 3, "wide"]; expected four numbers: x, y, width, h'),
        ({"annotations": [{"image_id": 1, "category_id": 1}]},
         "annotations[0]: there is no 'bbox'; expected four numbers"),
        ({"annotations": [7]}, "annotations[0] is 7; expected fields in {}"),
        ({"annotations": {}}, "there is no list 'annotations'"),
        ({"categories": [{"name": "cup"}]}, "categories[0]: there is no 'id'; expected a number"),
        ({"images": [{"id": 1, "file_name": "0.png", "width": "wide"}]},
         'images[0] (id 1): width is "wide"; expected a number of pixels'),
    ],
)  # fmt: skip
def test_a_fault_of_cocos_file_is_named_by_row_field_and_value(
    changes: dict[str, Any], fact: str, tmp_path: Path
) -> None:
    content = {"images": [{"id": 1, "file_name": "0.png"}], "annotations": [ROW],
               "categories": [{"id": 1, "name": "cup"}], **changes}  # fmt: skip
    write_picture(tmp_path / "0.png")
    path = tmp_path / "annotations/a.json"
    path.parent.mkdir()
    path.write_text(json.dumps(content))
    with pytest.raises(StorageError) as caught:
        read_real(tmp_path)
    assert str(caught.value).startswith(f"{path}: not annotations in COCO's format: {fact}")


@pytest.mark.parametrize("size", [{}, {"width": 64}, {"width": None, "height": 48}, {"height": 0}])
def test_cocos_images_need_not_state_their_size(size: dict[str, Any], tmp_path: Path) -> None:
    write_coco(tmp_path, [[]], images=[{"id": 10, "file_name": "0.png", **size}])
    real = read_real(tmp_path)
    assert ([p.size_px for p in real.pictures], real.skipped) == ([(64, 48)], {})


def test_boxes_outside_of_their_image_are_counted_and_left_out(tmp_path: Path) -> None:
    """Beyond each side of 64 x 48 px; one that reaches into the image stays as it is."""
    outside = [[64, 5, 9, 9], [5, 48, 9, 9], [-9, 5, 9, 9], [5, -9, 9, 9], [1000, 1000, 50, 50]]
    write_coco(tmp_path / "coco", [[{"bbox": box} for box in [*outside, [60, 40, 9, 9]]]])
    real = read_real(tmp_path / "coco")
    assert [thing.box for thing in real.pictures[0].objects] == [(60, 40, 69, 49)]
    assert real.skipped == {"object outside of its image": 5}
    write_picture(tmp_path / "yolo/a.png")
    (tmp_path / "yolo/classes.txt").write_text("cup\n")
    (tmp_path / "yolo/a.txt").write_text("0 1.5 0.5 0.2 0.2\n0 1 0.5 0.5 0.5\n")
    real = read_real(tmp_path / "yolo")
    assert [thing.box for thing in real.pictures[0].objects] == [(48, 12, 80, 36)]
    assert real.skipped == {"object outside of its image": 1}


VOC = """\
<annotation><filename>7.png</filename><size><width>64</width><height>48</height></size>
<object><name>cup</name><truncated>1</truncated><difficult>0</difficult>
<bndbox><xmin>1</xmin><ymin>3</ymin><xmax>20</xmax><ymax>30</ymax></bndbox></object>
<object><name>cup</name><difficult>1</difficult><occluded>1</occluded>
<bndbox><xmin>5</xmin><ymin>5</ymin><xmax>5</xmax><ymax>5</ymax></bndbox></object></annotation>
"""


def test_vocs_boxes_and_flags_are_read(tmp_path: Path) -> None:
    """Pixels count from 1, the last one included; difficult objects are ignored."""
    folder = tmp_path / "VOCdevkit/VOC2012"
    write_picture(folder / "JPEGImages/7.png")
    (folder / "Annotations").mkdir()
    (folder / "Annotations/7.xml").write_text(VOC)
    real = read_real(tmp_path)
    assert real.layout == "voc"
    assert [p.objects for p in real.pictures] == [
        (
            RealObject("cup", (0, 2, 20, 30), truncation=1.0),
            RealObject("cup", (4, 4, 5, 5), True, "partly occluded"),
        )
    ]


def test_what_cannot_be_used_is_counted_and_the_rest_chosen_evenly(tmp_path: Path) -> None:
    """A missing image, a damaged one, one of another size than COCO's file states, an empty box."""
    box = {"bbox": [1, 2, 10, 20]}
    write_coco(tmp_path, [[box, {"bbox": [1, 2, 0, 20]}], [], [], [box], [box], [], [box]])
    (tmp_path / "images/1.png").unlink()
    (tmp_path / "images/2.png").write_bytes(b"no image")
    write_picture(tmp_path / "images/5.png", (32, 24))
    whole, some = read_real(tmp_path), read_real(tmp_path, None, most=2)
    assert [p.image_id for p in whole.pictures] == [10, 13, 14, 16]
    assert whole.skipped == {
        "image that is missing (such as 1.png)": 1,
        "image that cannot be read (such as 2.png)": 1,
        "object with an empty box": 1,
        "image of another size than its labels state (such as 5.png)": 1,
    }
    assert [p.image_id for p in some.pictures] == [10, 13]
    assert some.skipped == {"picture beyond the largest number": 5, "object with an empty box": 1}
    for k in range(7):
        (tmp_path / f"images/{k}.png").unlink(missing_ok=True)
    with pytest.raises(
        StorageError, match=r"can be used: .*, 7 x image that is missing \(such as 0\.png\);"
    ):
        read_real(tmp_path)


def test_one_picture_and_pictures_without_objects_cannot_judge(tmp_path: Path) -> None:
    """The reasons for which others were left out are listed."""
    write_coco(tmp_path, [[{"bbox": [1, 2, 10, 20]}], []])
    (tmp_path / "images/1.png").unlink()
    with pytest.raises(ConfigError, match=r"1 picture can be .*; skipped: 1 x image that is miss"):
        check_judges(read_real(tmp_path))
    write_coco(tmp_path, [[], [{"bbox": [5, 5, 4, 4], "iscrowd": 1}]])
    with pytest.raises(ConfigError, match="has no labelled object"):
        check_judges(read_real(tmp_path))


def test_a_folder_without_labels_is_refused(tmp_path: Path) -> None:
    """With both layouts that are looked for."""
    with pytest.raises(ConfigError) as caught:
        read_real(tmp_path)
    assert str(caught.value) == (
        f"{tmp_path}: there are no labels; expected annotations/*.json in COCO's format, label_2 "
        "and image_2 in KITTI's, labels and data.yaml in YOLO's, or Annotations and JPEGImages "
        "in VOC's"
    )


def test_other_class_names_and_a_split_without_a_file_are_refused(tmp_path: Path) -> None:
    """And a remedy. The validation set is the default."""
    path = write_coco(tmp_path, [[{"bbox": [1, 2, 10, 20]}]])
    with pytest.raises(ConfigError) as caught:
        read_real(tmp_path).restrict(["car", "tram"])
    assert str(caught.value) == (
        f"{path}: has no object of the classes car, tram; it has cup: give the configuration a "
        "label map with these names"
    )
    write_coco(tmp_path, [[{"bbox": [1, 2, 10, 20]}]])
    source = tmp_path / "annotations/instances_val.json"
    (tmp_path / "annotations/instances_train.json").write_text(source.read_text())
    assert read_real(tmp_path).source == source
    assert read_real(tmp_path, "train").source.name == "instances_train.json"
    with pytest.raises(ConfigError, match="expected one annotation file, or a split that names"):
        read_real(tmp_path, "test")
