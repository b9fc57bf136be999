"""Folders as annotation tools and exports of public sets lay them out: boxes meet their images."""

import json
from pathlib import Path
from typing import Any

import pytest

from gen_data.core.errors import ConfigError, StorageError
from gen_data.lab.matching.label_files import RealObject
from gen_data.lab.matching.real_files import find_files
from gen_data.lab.study.real_pictures import read_real
from tests.study.conftest import write_picture

BOX = "0 0.5 0.5 0.25 0.5\n"


def coco(path: Path, *boxes: dict[str, Any], name: str = "1.png", category: str = "cup") -> None:
    """Annotations of one image without a stated size."""
    rows = [{"id": k, "image_id": 1, "category_id": 1, **box} for k, box in enumerate(boxes)]
    path.parent.mkdir(parents=True, exist_ok=True)
    content = {
        "annotations": rows,
        "categories": [{"id": 1, "name": category}],
        "images": [{"id": 1, "file_name": name}],
    }
    path.write_text(json.dumps(content))


def write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def found(folder: Path) -> dict[str, int]:
    """Number of objects of each picture by its path."""
    pictures = read_real(folder, None).pictures
    return {p.path.relative_to(folder).as_posix(): len(p.objects) for p in pictures}


@pytest.mark.parametrize(
    ("label", "image"),
    [
        ("{}/_annotations.coco.json", "{}/1.png"),  # Roboflow
        ("annotations/instances_{}2017.json", "{}2017/1.png"),
        ("annotations/instances_{}.json", "images/{}/1.png"),
        ("annotations/instances_{}.json", "{}/images/1.png"),
    ],
)
def test_cocos_splits_keep_apart_images_of_one_name(label: str, image: str, tmp_path: Path) -> None:
    """The boxes of each split belong to its own image, whichever comes first."""
    for boxes, split in enumerate(("test", "train", "val"), 1):
        box = {"bbox": [1, 1, 5, 5]}
        coco(tmp_path / label.format(split), *[box] * boxes)
        write_picture(tmp_path / image.format(split))
    assert found(tmp_path) == {
        image.format(s): k for k, s in enumerate(("test", "train", "val"), 1)
    }


@pytest.mark.parametrize("other", ["instance", "instances", "depth", "category"])
def test_label_images_of_the_same_names_are_no_photographs(other: str, tmp_path: Path) -> None:
    """An export has a folder for each kind; ``instances_train.json`` names one split."""
    coco(tmp_path / "annotations/instances_train.json", {"bbox": [1, 1, 5, 5]})
    for folder in (f"{other}/train", "train"):
        write_picture(tmp_path / folder / "1.png")
    assert found(tmp_path) == {"train/1.png": 1}


def test_a_split_may_be_a_folder(tmp_path: Path) -> None:
    """The validation set judges, if no split is given."""
    for split in ("train", "valid"):
        coco(tmp_path / split / "_annotations.coco.json", {"bbox": [1, 1, 5, 5]})
        write_picture(tmp_path / split / "1.png")
    for asked, split in (("", "valid"), ("train", "train")):
        (picture,) = read_real(tmp_path, asked).pictures
        assert picture.path == tmp_path / split / "1.png"


def test_an_image_name_of_several_files_is_counted_and_not_guessed(tmp_path: Path) -> None:
    coco(tmp_path / "labels.json", {"bbox": [1, 1, 5, 5]})
    for folder in ("first", "second"):
        write_picture(tmp_path / folder / "1.png")
    with pytest.raises(
        StorageError, match=r": 1 x image whose name several files have \(such as 1\.png\);"
    ):
        read_real(tmp_path)
    coco(tmp_path / "labels.json", {"bbox": [1, 1, 5, 5]}, name="second/1.png")
    assert found(tmp_path) == {"second/1.png": 1}


def test_an_image_in_several_cocos_files_counts_once_with_all_its_objects(tmp_path: Path) -> None:
    """A file of all splits, one of a split, and one of another class."""
    write_picture(tmp_path / "images/1.png")
    same, other = {"bbox": [1, 1, 5, 5]}, {"bbox": [9, 9, 5, 5]}
    coco(tmp_path / "annotations/all.json", same, other)
    coco(tmp_path / "annotations/train.json", same, other)
    coco(tmp_path / "annotations/plates.json", same, category="plate")
    real = read_real(tmp_path, None)
    (picture,) = real.pictures
    assert [(thing.name, thing.box[0]) for thing in picture.objects] == [
        ("cup", 1.0), ("cup", 9.0), ("plate", 1.0),
    ]  # fmt: skip
    assert real.skipped == {"image that is listed again, read once": 2}


@pytest.mark.parametrize("kind", ["images", "categories"])
def test_ids_that_two_rows_of_cocos_file_share_are_refused(kind: str, tmp_path: Path) -> None:
    """Boxes of one image would be in both."""
    path = tmp_path / "labels.json"
    coco(path, {"bbox": [1, 1, 5, 5]})
    content = json.loads(path.read_text())
    content[kind].append({"id": 1, "file_name": "2.png", "name": "plate"})
    path.write_text(json.dumps(content))
    with pytest.raises(StorageError, match=rf"{kind} share an id; expected one each"):
        read_real(tmp_path)


@pytest.mark.parametrize(
    ("stated", "levels"),
    [
        ([0.0, 0.4, 1.0], ["visible", "partly occluded", "largely occluded"]),
        ([0, 1, 2, 3], ["visible", "partly occluded", "largely occluded", ""]),
        ([0, 1, 1], ["visible", "largely occluded", "largely occluded"]),
        ([37, "?", None], ["", "", ""]),
        ([0.4, 10**400], ["partly occluded", ""]),
    ],
)
def test_occlusion_is_a_share_or_a_number_of_kittis_levels(
    stated: list[Any], levels: list[str], tmp_path: Path
) -> None:
    write_picture(tmp_path / "1.png")
    coco(tmp_path / "a.json", *[{"bbox": [1, 1, 5, 5], "occlusion": x} for x in stated])
    (picture,) = read_real(tmp_path).pictures
    assert [thing.occlusion for thing in picture.objects] == levels


@pytest.mark.parametrize(("stated", "share"), [(0.25, 0.25), (1, 1.0), ("0.5", None), (37, None)])
def test_truncation_is_a_share(stated: Any, share: float | None, tmp_path: Path) -> None:
    write_picture(tmp_path / "1.png")
    coco(tmp_path / "a.json", {"bbox": [1, 1, 5, 5], "truncation": stated})
    (picture,) = read_real(tmp_path).pictures
    assert picture.objects[0].truncation == share


@pytest.mark.parametrize(
    "text",
    [
        "train: [images/a, images/b]\nnames: {0: cup}\n",
        "path: .\ntrain: images/a\nval: ../images/b\nnames: [cup]\n",
        "train: list.txt\nval: images/b\nnames: [cup]\n",
    ],
)
def test_yolos_splits_are_the_pictures(text: str, tmp_path: Path) -> None:
    """Pictures of masks and of training runs, and folders left out on purpose, are none of them."""
    write(tmp_path / "data.yaml", text)
    write(tmp_path / "list.txt", "./images/a/1.png\n")
    write(tmp_path / "labels/a/1.txt", BOX)
    write(tmp_path / "labels/b/2.txt", "")
    write(tmp_path / "labels/c/3.txt", BOX * 2)
    write(tmp_path / "labels/classes.txt", "cup\n")
    for name in ("images/a/1", "images/b/2", "images/c/3", "masks/1", "runs/val/confusion"):
        write_picture(tmp_path / f"{name}.png")
    real = read_real(tmp_path, None)
    assert found(tmp_path) == {"images/a/1.png": 1, "images/b/2.png": 0}
    assert real.pictures[0].objects == (RealObject("cup", (24, 12, 40, 36)),)
    assert not real.skipped


def test_a_split_is_one_of_yolos_and_refused_where_there_are_none(tmp_path: Path) -> None:
    """It was ignored: pictures for training judged, too."""
    for folder in ("yolo", "kitti", "voc"):
        write_picture(tmp_path / folder / "image_2/1.png")
    write(tmp_path / "yolo/data.yaml", "train: images/train\nval: images/val\nnames: [cup]\n")
    for split in ("train", "val"):
        write(tmp_path / f"yolo/labels/{split}/1.txt", BOX)
        write_picture(tmp_path / f"yolo/images/{split}/1.png")
    (picture,) = read_real(tmp_path / "yolo", "val").pictures
    assert picture.path == tmp_path / "yolo/images/val/1.png"
    write(tmp_path / "kitti/label_2/1.txt", "Car 0 0 0 1 2 3 4\n")
    write(tmp_path / "voc/image_2/1.xml", VOC.format("1.png"))
    for folder, split in (("kitti", "val"), ("voc", "val"), ("yolo", "test")):
        with pytest.raises(ConfigError, match=rf"no split '{split}'; expected COCO's files"):
            read_real(tmp_path / folder, split)


def test_yolos_labels_of_a_split_without_their_images_are_counted(tmp_path: Path) -> None:
    write(tmp_path / "data.yaml", "train: images/train\nnames: [cup]\n")
    write(tmp_path / "labels/train/1.txt", BOX)
    write(tmp_path / "labels/train/2.txt", BOX)
    write_picture(tmp_path / "images/train/1.png")
    assert read_real(tmp_path).skipped == {"image that is missing (such as 2.png)": 1}


def test_missing_splits_of_yolo_are_named_with_the_nearest_folder(tmp_path: Path) -> None:
    """A misspelt name left its pictures out, or brought in all others, without a word."""
    text = "train: images/trian\nval: {}\nnames: [cup]\n"
    for split in ("train", "val"):
        write(tmp_path / f"labels/{split}/1.txt", BOX)
        write_picture(tmp_path / f"images/{split}/1.png")
    fact = "train of data.yaml: 'images/trian', which is missing (did you mean 'images/train'?)"
    write(tmp_path / "data.yaml", text.format("images/val"))
    assert read_real(tmp_path).skipped == {fact: 1}
    assert found(tmp_path) == {"images/val/1.png": 1}
    write(tmp_path / "data.yaml", text.format("/gone"))
    assert read_real(tmp_path).skipped == {
        f"{fact}; all images below are read": 1,
        "val of data.yaml: '/gone', which is missing; all images below are read": 1,
    }
    assert found(tmp_path) == {"images/train/1.png": 1, "images/val/1.png": 1}


def test_names_that_no_file_can_have_are_those_of_missing_images(tmp_path: Path) -> None:
    """Longer than any file system takes; messages show their beginnings."""
    name = "a" * 3000
    coco(tmp_path / "coco/a.json", name=f"{name}.png")
    write(tmp_path / "yolo/data.yaml", f"train: {name}\nval: list.txt\nnames: [cup]\n")
    write(tmp_path / "yolo/list.txt", f"{name}.png\n")
    write(tmp_path / "voc/1.xml", VOC.format(f"1{name}.png"))
    for layout in ("coco", "yolo", "voc"):
        with pytest.raises(StorageError, match=r"image that is missing \(such as "):
            read_real(tmp_path / layout)


def test_images_of_linked_folders_are_read_once(tmp_path: Path) -> None:
    write_picture(tmp_path / "disk/1.png")
    real = tmp_path / "real"
    write(real / "data.yaml", "names: [cup]\n")
    write(real / "labels/1.txt", BOX)
    (real / "images").symlink_to(tmp_path / "disk", target_is_directory=True)
    (real / "again").symlink_to(real, target_is_directory=True)
    assert found(real) == {"images/1.png": 1}
    assert find_files(real).photos == (real / "images/1.png",)


def test_a_missing_folder_has_no_labels(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"there are no labels; expected"):
        read_real(tmp_path / "gone")


VOC = (
    "<annotation><filename>{}</filename><object><name>cup</name><bndbox><xmin>1.5</xmin>"
    "<ymin>3</ymin><xmax>20.25</xmax><ymax>30</ymax></bndbox></object></annotation>"
)


def test_vocs_images_have_the_names_of_their_annotations(tmp_path: Path) -> None:
    """``filename`` is outdated where files were renamed; the images of both exist."""
    for number, stated in (("1", "2.png"), ("2", "gone.jpg")):
        write_picture(tmp_path / f"JPEGImages/{number}.png")
        write(tmp_path / f"Annotations/{number}.xml", VOC.format(stated))
    assert list(found(tmp_path)) == ["JPEGImages/1.png", "JPEGImages/2.png"]
    assert read_real(tmp_path).pictures[0].objects[0].box == (0.5, 2.0, 20.25, 30.0)


@pytest.mark.parametrize(
    ("layout", "folder"), [("voc", "JPEGImages"), ("kitti", "image_2"), ("yolo", "images")]
)
def test_images_in_other_formats_are_named_where_their_labels_are_read(
    layout: str, folder: str, tmp_path: Path
) -> None:
    """VOC, KITTI and YOLO name images without their format; a JPEG of the name is preferred."""
    write(tmp_path / "Annotations/IMG_1.xml", VOC.format("IMG_1"))
    write(tmp_path / "label_2/IMG_1.txt", "Car 0 0 0 1 2 3 4\n")
    write(tmp_path / "labels/IMG_1.txt", BOX)
    write(tmp_path / "classes.txt", "cup\n")
    write(tmp_path / folder / "IMG_1.HEIC", "content")
    reason = "1 x image: HEIC files are not read: save them as JPEG or PNG"
    with pytest.raises(StorageError, match=reason):
        read_real(tmp_path, layout=layout)
    write_picture(tmp_path / folder / "IMG_1.JPG")
    (picture,) = read_real(tmp_path, layout=layout).pictures
    assert (picture.path.suffix, len(picture.objects)) == (".JPG", 1)


def test_vocs_folders_may_have_folders(tmp_path: Path) -> None:
    for split in ("train", "val"):
        write_picture(tmp_path / f"JPEGImages/{split}/1.png")
        write(tmp_path / f"Annotations/{split}/1.xml", VOC.format(f"{split}/1.png"))
    assert list(found(tmp_path)) == ["JPEGImages/train/1.png", "JPEGImages/val/1.png"]


def test_empty_lines_of_kittis_labels_are_none(tmp_path: Path) -> None:
    write_picture(tmp_path / "image_2/1.png")
    write(tmp_path / "label_2/1.txt", "Car 0 0 0 1 2 3 4\n\nCar 0 0 0 1 2 3 4\n\n")
    assert found(tmp_path) == {"image_2/1.png": 2}
