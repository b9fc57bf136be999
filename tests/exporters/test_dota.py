"""DOTA's layout as its development kit reads it."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gen_data.exporters.dota import Dota


def parse_dota(path: Path) -> list[dict[str, Any]]:
    """Objects of a label file: lines of nine or ten words, others are headers.

    As the web page of DOTA describes the format: corners, category, difficult.
    """
    objects = []
    for line in path.read_text("utf-8").splitlines():
        words = line.split(" ")
        if len(words) < 9:
            continue
        numbers = [float(w) for w in words[:8]]
        corners = list(zip(numbers[::2], numbers[1::2], strict=True))
        objects.append({"corners": corners, "name": words[8], "difficult": words[9]})
    return objects


def assert_truth(world: Any, folder: Path, below: float) -> None:
    """Corners within a tenth of a pixel, and difficult if a share of them is hidden.

    Every image has a label file of its name, which begins with source and resolution.
    """
    for sample in world.samples:
        stem = f"{sample.index:09d}_color"
        label = folder / sample.split / f"labelTxt/{stem}.txt"
        assert (folder / sample.split / f"images/{stem}.png").exists()
        assert label.read_text("utf-8").splitlines()[:2] == ["imagesource:gen-data", "gsd:null"]
        listed = parse_dota(label)
        truth = [t for t in sample.truth["color"].objects if t.box is not None]
        assert len(listed) == len(truth)
        for row, thing in zip(listed, truth, strict=True):
            for corner, expected in zip(row["corners"], thing.oriented_box, strict=True):
                assert corner == pytest.approx(expected, abs=0.051)
            assert row["name"] == thing.instance.category
            assert row["difficult"] == str(int(thing.visible_fraction < below))


@pytest.mark.parametrize("below", [0.4, 0.95])
def test_objects_are_those_of_the_truth(world: Any, tmp_path: Path, below: float) -> None:
    """Some objects of the world are difficult at the larger limit, some are not."""
    folder = world.export(Dota(difficult_below=below), world.info(7), world.samples, tmp_path)
    assert_truth(world, folder, below)
    shares = [t.visible_fraction for s in world.samples for t in s.truth["color"].objects]
    assert min(shares) < 0.95 <= max(shares)


def test_spaces_are_left_out(world: Any, tmp_path: Path) -> None:
    """A category of two words is one word."""
    car = world.samples[0].truth["color"].objects[0]
    bus = replace(car, instance=replace(car.instance, category="school bus"))
    sample = world.with_objects(world.samples[0], lambda _: (bus,))
    folder = world.export(Dota(), world.info(1), [sample], tmp_path)
    (row,) = parse_dota(folder / "train/labelTxt/000000000_color.txt")
    assert row["name"] == "school-bus"
