"""Every shipped configuration renders, exports and verifies, from the command line.

Images, sweeps and sequences are reduced: the paths through the program stay the same.
"""

import subprocess
from pathlib import Path

import pytest

from gen_data import configs
from gen_data.assemble.config import load_config
from gen_data.core.interfaces import Modality, Sensor
from gen_data.runner.verify import verify
from tests.contracts.stage_digests import find_change
from tests.end_to_end.running import gen_data
from tests.tiers import sampled

CONFIGS = sorted(path.stem for path in Path(configs.__path__[0]).glob("*.yaml"))


def reduced(name: str) -> list[str]:
    spec = load_config(name)
    texts = ["shard_size=1"]
    if "tier" in spec.resolved["render"]:
        texts.append("render.samples=1")
    for number, sensor in enumerate(spec.sensors):
        texts += [f"sensors[{number}].{text}" for text in smaller(sensor)]
    return [word for text in texts for word in ("--set", text)]


def smaller(sensor: Sensor) -> list[str]:
    """Settings of a sensor with an eighth of the pixels or beams."""
    size_px = getattr(sensor, "size_px", None)
    if size_px is None:
        return []
    width_px, height_px = (max(64, 4 * (side // 16)) for side in size_px)
    return [f"size_px=[{width_px}, {height_px}]"]


def generate_reduced(name: str, folder: Path) -> subprocess.CompletedProcess[str]:
    options = ("--n", "1", "--workers", "0", "--out", "out", *reduced(name))
    return gen_data("--config", name, *options, cwd=folder)


@pytest.mark.slow
@pytest.mark.parametrize("name", CONFIGS)
def test_one_sample_is_rendered_exported_and_verified(name: str, tmp_path: Path) -> None:
    """Every exporter writes files, and all files agree with the manifest.

    The stages of the sample are the stored ones (``tests/contracts/stage_digests.py``).
    """
    made = generate_reduced(name, tmp_path)
    assert made.returncode == 0, made.stdout + made.stderr
    spec = load_config(name)

    verify(tmp_path / "out", full=True)
    for exporter in spec.exporters:
        files = [p for p in (tmp_path / "out" / exporter.type).rglob("*") if p.is_file()]
        assert files, exporter.type
    for sensor in (s.describe() for s in spec.sensors):
        folder = {Modality.LIDAR: "points", Modality.DEVICE: "rows"}.get(sensor.modality)
        channels = [folder] if folder else [channel.value for channel in sensor.channels]
        for channel in channels:
            pattern = f"shards/*/{sensor.name}/{channel}/000000000.*"
            assert list((tmp_path / "out").glob(pattern)), pattern
    changed = find_change(name, tmp_path / "out")
    assert not changed, f"{name}: the first stage with other contents is: {changed}"


@pytest.mark.parametrize("name", sampled(CONFIGS, 6))
def test_no_sensor_of_a_sequence_reads_before_its_first_instant(name: str) -> None:
    """Nothing moves before it: velocities of moving things would be 0."""
    config = load_config(f"{name}.yaml")
    offsets_s = [getattr(sensor, "time_offset_s", 0.0) for sensor in config.sensors]

    assert config.general.steps_per_scene == 1 or min(offsets_s) >= 0.0
