"""Examples in the documentation of sensors are valid configurations."""

import importlib
import inspect
import re
import textwrap

import pytest
import yaml

from gen_data.sensors import TABLE


@pytest.mark.parametrize("kind", ["gnss", "imu", "odometer"])
def test_the_example_of_a_navigation_sensor_is_valid_and_names_its_columns(kind: str) -> None:
    """The YAML block validates, and the fields that the text names are columns of the reading."""
    text = inspect.getdoc(importlib.import_module(TABLE.load(kind).__module__)) or ""
    block = re.search(r"::\n\n((?:    .*\n)+)", text)
    assert block is not None
    (entry,) = yaml.safe_load(textwrap.dedent(block.group(1)))["sensors"]
    sensor = TABLE.load(entry["type"]).model_validate(entry)  # type: ignore[attr-defined]
    assert f'sample.measurements["{sensor.name}"]' in text
    columns = {column.name for column in TABLE.load(kind).columns}
    fields = re.findall(r"``(\w+_(?:s|m|deg|s2|rad))``", text)
    assert fields
    assert set(fields) <= columns
