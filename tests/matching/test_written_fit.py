"""Files of a fit: valid configurations, or none at all."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from gen_data.assemble.config import load_config, parse_config
from gen_data.core.errors import ConfigError, StorageError
from gen_data.lab.matching import api, match
from gen_data.lab.matching.matched_yaml import format_config
from gen_data.lab.matching.quantities import CAMERA, base
from gen_data.lab.matching.real_files import Inventory
from gen_data.lab.matching.results import FittedField, Match, Part
from gen_data.sensors.camera.rgb_camera import RgbCamera

FITTED = {"exposure": 0.5, "tone": 1.25, "white balance": 0.3, "saturation": 0.75, "blur": 0.5,
          "noise": 3000, "read noise": 12}  # fmt: skip


def fitted(source: str) -> Match:
    """Every quantity of the first camera of a configuration with a value."""
    config = load_config(source)
    camera = next(one for one in config.sensors if isinstance(one, RgbCamera))
    number = config.sensors.index(camera)
    values = {k: v for q in CAMERA for k, v in q.fields(FITTED[q.name]).items()}
    fields = [
        FittedField(base.FieldChange("sensors", number, f"image_pipeline.{key}", value), ())
        for key, value in {**values, "jpeg_quality": 90}.items()
    ]
    fields = [*match.default_preset(config, camera, fields), *fields]
    return Match(Path("real"), source, config.resolved, Inventory(), 8, (Part((), (), (*fields,)),))


@pytest.mark.parametrize(
    ("source", "preset"), [("photo_plates.yaml", "photograph"), ("closeup.yaml", "phone")]
)
def test_fitted_fields_keep_the_preset_of_the_camera(source: str, preset: str) -> None:
    """A plate camera has ``photograph`` only while nothing is set; others state theirs."""
    before = next(one for one in load_config(source).sensors if isinstance(one, RgbCamera))
    assert before.image_pipeline.preset == preset
    text = format_config(fitted(source), Path("matched.yaml"))
    after = parse_config(text, "matched.yaml", "matched").sensors
    pipeline = next(one for one in after if isinstance(one, RgbCamera)).image_pipeline
    assert pipeline.preset == before.image_pipeline.preset
    assert pipeline.tone == before.image_pipeline.tone
    assert pipeline.contrast.to_yaml() == 1.25
    assert pipeline.image_sensor is not None
    assert pipeline.image_sensor.full_well_e == 3000


def test_an_invalid_fit_is_refused_before_it_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The message names the user's file and the field; the folder stays empty."""
    found = fitted("closeup.yaml")
    (part,) = found.parts
    wrong = FittedField(base.FieldChange("sensors", 0, "image_pipeline.contrast", 99), ())
    found = replace(found, parts=(replace(part, fields=(wrong,)),))
    monkeypatch.setattr(match, "match_recordings", lambda *_, **__: found)
    with pytest.raises(ConfigError) as refused:
        api.match("real", "closeup.yaml", tmp_path / "out" / "matched.yaml")
    assert str(refused.value).startswith("closeup.yaml: nothing is written")
    assert "sensors[0].image_pipeline.contrast: " in str(refused.value)
    assert "matched.yaml" not in str(refused.value)
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


def test_a_fit_in_another_folder_extends_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By a path that starts from the new file."""
    (tmp_path / "mine.yaml").write_text("extends: closeup.yaml\n")
    source = str(tmp_path / "mine.yaml")
    monkeypatch.setattr(match, "match_recordings", lambda *_, **__: fitted(source))
    api.match("real", source, tmp_path / "new" / "matched.yaml")
    assert "\nextends: ../mine.yaml\n" in (tmp_path / "new/matched.yaml").read_text()
    assert load_config(str(tmp_path / "new/matched.yaml")).general == load_config(source).general


@pytest.mark.parametrize("ending", [".yaml", ".json", ".html"])
def test_a_file_that_exists_is_replaced_on_request_only(
    ending: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each of the three files may be another one of the user; it is refused before the fit."""
    monkeypatch.setattr(match, "match_recordings", lambda *_, **__: fitted("closeup.yaml"))
    own = (tmp_path / "matched.yaml").with_suffix(ending)
    own.write_text("my own")
    with pytest.raises(
        StorageError, match=rf"{ending}: exists; choose another --out, or .*--force"
    ):
        api.match("real", "closeup.yaml", tmp_path / "matched.yaml")
    assert ([*tmp_path.iterdir()], own.read_text()) == ([own], "my own")
    api.match("real", "closeup.yaml", tmp_path / "matched.yaml", force=True)
    assert len([*tmp_path.iterdir()]) == 3
    assert own.read_text() != "my own"


def test_an_unwritable_place_is_refused_before_the_fit(tmp_path: Path) -> None:
    """The folder of recordings, which does not exist, is not looked at."""
    (tmp_path / "file").write_text("")
    with pytest.raises(StorageError, match=r"file: Not a directory; choose another --out"):
        api.match("real", "closeup.yaml", tmp_path / "file/matched.yaml")
