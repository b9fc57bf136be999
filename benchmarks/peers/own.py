"""This project's renderer, without and with everything else that a sample takes."""

import pickle
import shutil
from pathlib import Path

from benchmarks.peers.worker import Round, output_folder
from benchmarks.peers.workload import VIEWS_NAME, Views, read_config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.core.sample import Sample
from gen_data.pipeline import Pipeline
from gen_data.runner.shard import drop_pixels, write_images, write_records


def open_renderer(folder: Path) -> Round:
    """Render the settled views: the work of the other renderers, and the boxes as JSON lines."""
    views: Views = pickle.loads((folder / VIEWS_NAME).read_bytes())
    factory = PipelineFactory(read_config(folder, full=False), len(views))
    pipeline, out = factory(), output_folder(folder, "ours")

    def write_all() -> None:
        _write_shard(pipeline, [pipeline.read_sensors(v, sensors, 0) for v, sensors in views], out)

    return write_all


def open_pipeline(folder: Path) -> Round:
    """Draw, settle, render and annotate new scenes; write images, every label and COCO."""
    views: Views = pickle.loads((folder / VIEWS_NAME).read_bytes())
    factory = PipelineFactory(read_config(folder, full=True), len(views))
    pipeline, out = factory().__enter__(), output_folder(folder, "ours, full samples")

    def write_all() -> None:
        _write_shard(pipeline, [pipeline.sample(k) for k in range(len(views))], out)

    return write_all


def _write_shard(pipeline: Pipeline, samples: list[Sample], out: Path) -> None:
    shutil.rmtree(out)
    out.mkdir()
    for sample in samples:
        write_images(pipeline.info, sample, out)
        write_records(sample, None, out)
    for exporter in pipeline.exporters.values():
        exporter.write_shard(pipeline.info, [drop_pixels(s) for s in samples], out)
