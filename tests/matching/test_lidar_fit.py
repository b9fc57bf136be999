"""Recovery of a scanner's parameters from scans that were made with known ones."""

import pytest

from gen_data.lab.matching.lidar_fit import fit_lidar
from gen_data.lab.matching.results import Part
from gen_data.lab.matching.simulation import rescan
from gen_data.sensors.lidar.scan_pattern import LidarModel
from tests.matching.scenes import RESPONSE, illuminations, scanner

TRUTH = scanner(
    white_intensity=0.25, window=0.7, range_m=(0.5, 30.0), response={**RESPONSE, "dark": 0.2}
)


@pytest.fixture(scope="module")
def fitted() -> Part:
    """A fit of 40 scenes to 60 scans of other scenes."""
    real = [rescan(one, TRUTH) for one in illuminations(range(100, 160), TRUTH)]
    return fit_lidar(illuminations(range(40), scanner(response=RESPONSE)), real, 1)


@pytest.mark.parametrize(
    ("name", "truth", "tolerance"),
    [("reflectance gain", 0.25, 0.01), ("dark returns", 0.2, 0.01), ("dropout", 0.7, 0.02),
     ("range", 30.0, 0.5)],
)  # fmt: skip
def test_parameters_are_recovered(fitted: Part, name: str, truth: float, tolerance: float) -> None:
    """Within a tolerance, from a start at 0.4, 0.05, 1 and 100 m."""
    (found,) = (one for one in fitted.quantities if one.name == name)
    assert found.mean == pytest.approx(truth, abs=tolerance)
    assert found.low is not None
    assert found.high is not None
    assert found.low <= truth <= found.high


def test_a_data_sheet_is_written_whole(fitted: Part) -> None:
    """It is valid by itself, with the lasers of the configuration's own."""
    written = {one.change.field: one.change.value for one in fitted.fields}
    sheet = scanner(**{key: _tuples(value) for key, value in written["model"].items()}).device
    assert isinstance(sheet, LidarModel)
    assert sheet.elevations_deg == scanner().device.elevations_deg
    assert sheet.white_intensity == pytest.approx(0.25, abs=0.01)
    assert sheet.response is not None
    assert sheet.response.dark == pytest.approx(0.2, abs=0.01)
    assert sheet.response.half == RESPONSE["half"]
    assert 0.0 < written["window"] < 1.0


def _tuples(value: object) -> object:
    return tuple(value) if isinstance(value, list) else value


def test_a_limit_beyond_everything_is_not_determined() -> None:
    """Nothing reflects beyond 60 m: no scan tells a limit of 90 m from one of 100 m."""
    sensor = scanner(range_m=(0.5, 90.0))
    real = [rescan(one, sensor) for one in illuminations(range(100, 112), sensor)]
    part = fit_lidar(illuminations(range(12), scanner(range_m=(0.5, 100.0))), real, 0)
    (found,) = (one for one in part.quantities if one.name == "range")
    assert not found.is_fitted or (found.high is not None and found.high > 55.0)


def test_data_sheets_without_response_have_no_dark_returns_and_ideal_ones_no_fit() -> None:
    """The reason is in the row, and the others are fitted."""
    part = fit_lidar(
        illuminations(range(12), scanner()),
        [rescan(one, one.sensor) for one in illuminations(range(100, 112), scanner())],
        0,
    )
    by_name = {one.name: one for one in part.quantities}
    assert "no response" in by_name["dark returns"].note
    assert not by_name["dark returns"].is_fitted
    assert by_name["reflectance gain"].mean == pytest.approx(0.4, abs=0.03)
    # It misses no return and reports no errors.
    ideal = scanner().model_copy(update={"ideal": True})
    real = [rescan(one, TRUTH) for one in illuminations([100], TRUTH)]
    part = fit_lidar(illuminations([1], ideal), real, 0)
    assert {one.note for one in part.quantities} == {"the scanner is ideal"}
