"""Lost, doubled and late readings in formats."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gen_data.core.capture import Capture
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import DatasetInfo, Modality
from gen_data.core.sample import Sample
from gen_data.exporters import TABLE
from gen_data.exporters.base import _held_once, check_delivery
from gen_data.pipeline.delivered import delivered
from tests.exporters.drives import drive_info
from tests.exporters.test_exporter_contract import files, given
from tests.tiers import sampled

ROOT = Path(__file__).parents[2]
LOST = {1: {"imu", "right"}, 2: {"left", "color", "arm"}, 4: {"top"}, 5: {"right", "left"}}
"""Sensors whose reading is lost, by sample."""


EVERY_IMAGE = {"lerobot", "rlds"}
"""Formats whose frames have an image of every camera."""
MARKED = {"language": "two images", "lerobot": "every camera", "rlds": "every camera"}


def with_record(sample: Sample, names: set[str], record: dict[str, Any]) -> Sample:
    """The sample with the record of the delivery of some sensors."""

    def marked(readings: Any) -> Any:
        return {
            name: replace(r, faults={"delivery": record}) if name in names else r
            for name, r in readings.items()
        }

    capture = sample.capture
    kinds = (capture.readings, capture.clouds, capture.tables)
    return replace(sample, capture=Capture(*map(marked, kinds)))


def without(sample: Sample, names: set[str]) -> Sample:
    """The sample of sensors of which some do not read at this step."""

    def kept(readings: Any) -> Any:
        return {name: reading for name, reading in readings.items() if name not in names}

    capture, frame = sample.capture, sample.frame
    if frame is not None and frame.tracks is not None:
        tracks = replace(frame.tracks, sensors=kept(frame.tracks.sensors))
        frame = replace(frame, tracks=tracks)
    kinds = (capture.readings, capture.clouds, capture.tables)
    return replace(
        sample,
        capture=Capture(*map(kept, kinds)),
        truth=kept(sample.truth),
        instants=kept(sample.instants),
        frame=frame,
    )


def with_faults(info: DatasetInfo, *kinds: str) -> DatasetInfo:
    return replace(info, sensors=tuple(replace(s, faults=kinds) for s in info.sensors))


@pytest.mark.parametrize("name", sampled(sorted({*TABLE.names()} - EVERY_IMAGE), 4))
def test_lost_readings_are_missing_as_of_sensors_that_do_not_read(
    name: str, world: Any, tmp_path: Path
) -> None:
    """Formats that show the truth have all readings."""
    exporter = TABLE.load(name)()
    info, samples = given(exporter, world)
    lost = [with_record(s, LOST.get(s.index, set()), {"lost": True}) for s in samples]
    truth = getattr(exporter, "shows_truth", False)
    expected = lost if truth else [without(s, LOST.get(s.index, set())) for s in samples]
    line = delivered(exporter, exporter, with_faults(info, "lost"))
    found = files(world.export(line, info, lost, tmp_path / "lost"))
    assert found == files(world.export(exporter, info, expected, tmp_path / "expected"))


def refused(name: str, info: DatasetInfo) -> str:
    """The message of the exporter about a data set; empty if it takes it."""
    exporter = TABLE.load(name)()
    try:
        check_delivery(exporter, info)
        exporter.check(info)
    except ConfigError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("name", TABLE.names())
def test_formats_refuse_deliveries_that_they_cannot_express(name: str, world: Any) -> None:
    """Only MCAP has doubled images and scans; formats without such a sensor take both."""
    info, _ = given(TABLE.load(name)(), world)
    stated = TABLE.load(name).conventions
    has_images = bool(stated.pixel_centre or stated.box or stated.lens)
    has_scans = bool(stated.ring or stated.intensity) or name == "lidar_flow"
    truth = name in ("rerun", "usd")
    for kind, faults in (("lost", name in MARKED), ("doubled", has_images or has_scans)):
        expected = faults and not truth and not (kind == "doubled" and name == "mcap")
        message = refused(name, with_faults(info, kind))
        assert (f"faults.delivery.{kind}: " in message) == expected, message
        assert not expected or f"exporter '{name}': sensor '" in message
        assert not expected or "set it to 0" in message
    assert "faults." not in refused(name, info)


def test_the_page_of_faults_states_what_each_format_does_with_lost_and_doubled_readings() -> None:
    """Every format is in one row of the table, which states whose copies are refused."""
    page = (ROOT / "docs/faults.md").read_text("utf-8")
    rows = [line.strip("|").split("|") for line in page.splitlines() if line.startswith("| `")]
    stated = {
        name: (lost.strip().split(":")[0], doubled.strip())
        for first, lost, doubled, _ in (row for row in rows if len(row) == 4)
        for name in re.findall(r"`(\w+)`", first)
    }
    expected = {}
    for name in TABLE.names():
        kinds = _held_once(TABLE.load(name)())
        images, scans = Modality.CAMERA in kinds, Modality.LIDAR in kinds
        copies = {(True, True): "refused, images and scans", (True, False): "images refused",
                  (False, True): "scans refused", (False, False): "-"}[images, scans]  # fmt: skip
        expected[name] = ("missing", copies)
    expected |= dict.fromkeys(MARKED, ("refused", "refused"))
    expected |= dict.fromkeys(("rerun", "usd"), ("shown", "shown once"))
    nothing = ("have no images and scans", "-")
    expected |= dict.fromkeys(("map_vectors", "opendrive", "tables"), nothing)
    expected["mcap"] = ("missing", "two equal messages")
    assert stated == expected


def test_mcap_has_arrivals_as_log_times_and_doubled_readings_twice(
    world: Any, tmp_path: Path
) -> None:
    """Late by 0.25 s, and a clock that is 0.05 s behind."""
    reader = pytest.importorskip("mcap.reader")
    record = {"doubled": True, "arrived_s": 0.45}
    samples = world.drive()
    wrong = with_record(samples[2], {"left", "top"}, record)
    slow = {"clock": {"reported_s": 0.15}}
    readings = {
        n: replace(r, faults={**r.faults, **slow}) if r.faults else r
        for n, r in wrong.capture.readings.items()
    }
    wrong = replace(wrong, capture=replace(wrong.capture, readings=readings))

    def messages(folder: str, third: Sample) -> list[tuple[str, int, int, bytes]]:
        drive = [*samples[:2], third, samples[3]]
        made = world.export(TABLE.load("mcap")(), drive_info(world), drive, tmp_path / folder)
        with (made / "train/street-000000.mcap").open("rb") as file:
            read = list(reader.make_reader(file).iter_messages(log_time_order=False))
        first_ns = min(m.log_time for _, _, m in read)
        return [
            (c.topic, m.log_time - first_ns, m.publish_time - first_ns, m.data) for _, c, m in read
        ]

    clean, found = messages("clean", samples[2]), messages("wrong", wrong)
    assert [m[1] for m in found] == sorted(m[1] for m in found)
    third_ns = 200_000_000
    for topic in {m[0] for m in clean} - {"/tf"}:
        before, after = ([m for m in read if m[0] == topic] for read in (clean, found))
        if not topic.startswith(("/camera/left", "/lidar/top")):
            assert after == before
            continue
        published_ns = 150_000_000 if topic.startswith("/camera") else third_ns
        late = [m for m in after if m[1] != m[2]]
        assert [m[1:3] for m in late] == [(450_000_000, published_ns)] * 2
        assert late[0] == late[1]
        assert [m for m in after if m[1] == m[2]] == [m for m in before if m[1] != third_ns]
