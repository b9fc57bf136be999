"""``gen-data doctor``: checks of all engines on this machine.

Each check loads a library and uses it once, in a separate process: a crash, as on an
unsupported processor, is one failed check.
"""

import hashlib
import multiprocessing
import os
import platform
import shutil
import subprocess
import tempfile
import time
import zlib
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import packages_distributions, version
from importlib.util import find_spec
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import click

from gen_data.core import errors, optional_packages, processes, system_calls, temporary_folders
from gen_data.core.distribution import DISTRIBUTION, install_command
from gen_data.core.version import __version__

FILES_MIN = 64
MEMORY_MIN_BYTES = 2_000_000_000
BENCHMARK_S = 3.0
"""Duration of the benchmark."""
REINSTALL = "reinstall it: pip install --force-reinstall --no-deps {}"


@dataclass(frozen=True)
class Check:
    """One check.

    Attributes:
        name: One word.
        attempt: Runs the check; returns a short finding, or raises any exception.
        remedy: Advice for the user in case of failure.
        required: A failure means that the installation is broken.
    """

    name: str
    attempt: Callable[[], str]
    remedy: str
    required: bool = True


@click.command()
def doctor() -> None:
    """Check this machine: load and try every engine; generate samples, and tell how fast.

    Exit code 6 if a required check fails.
    """
    failed = [check.name for check in CHECKS if not _passes(check) and check.required]
    if failed:
        raise errors.SampleError(f"doctor: {', '.join(failed)} failed; see above")


def _passes(check: Check) -> bool:
    started_s = time.perf_counter()
    works, finding = _attempt_in_process(check)
    if works:
        click.echo(f"ok        {check.name:<9} {finding} ({time.perf_counter() - started_s:.1f} s)")
    else:
        verdict = "FAIL    " if check.required else "optional"
        click.echo(f"{verdict}  {check.name:<9} {finding}\n{'':<20}{check.remedy}")
    return works


def _attempt_in_process(check: Check) -> tuple[bool, str]:
    """Run a check in a new process; returns success, and the finding or the error."""
    context = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_report, args=(check, sender))
    process.start()
    sender.close()
    try:
        works, finding = receiver.recv()
    except EOFError:
        process.join()
        return False, f"its process ended with exit code {process.exitcode}"
    process.join()
    return works, finding


def _report(check: Check, sender: Connection) -> None:
    try:
        with processes.silence_stdio():
            finding = check.attempt()
        sender.send((True, finding))
    except errors.GenDataError as error:
        sender.send((False, str(error)))
    except Exception as error:
        sender.send((False, f"{type(error).__name__}: {error}"))


def _expect(condition: bool, fact: str) -> None:
    if not condition:
        raise errors.SampleError(fact)


def _try_python() -> str:
    import numpy as np

    _expect(float(np.arange(5.0).sum()) == 10.0, "NumPy cannot add")
    ours = f"gen-data {__version__}"
    return f"{ours}, Python {platform.python_version()}, NumPy {np.__version__}"


def _try_name() -> str:
    """Look for other projects that install ``gen_data`` too; pip lets them overwrite its files."""
    others = {*packages_distributions().get("gen_data", ())} - {DISTRIBUTION}
    _expect(not others, f"gen_data is also installed by {' and '.join(sorted(others))}")
    return f"no other distribution than {DISTRIBUTION} installs gen_data"


def _try_cache() -> str:
    from gen_data.assets.library import default_cache_dir

    folder = default_cache_dir()
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder) as file:
        file.write(b"ok")
    return f"{folder}, {shutil.disk_usage(folder).free / 1e9:.1f} GB free"


def _try_limits() -> str:
    """Limits of this user on files, memory and file sizes; Windows has none."""
    try:
        resource: Any = import_module("resource")
    except ImportError:
        return f"none, {system_calls.usable_cores()} cores"
    files, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    _expect(files == resource.RLIM_INFINITY or files >= FILES_MIN, f"only {files} open files")
    for name, kind in (("memory", resource.RLIMIT_AS), ("file size", resource.RLIMIT_FSIZE)):
        limit, _ = resource.getrlimit(kind)
        few = limit != resource.RLIM_INFINITY and limit < MEMORY_MIN_BYTES
        _expect(not few, f"{name} is limited to {limit / 1e6:.0f} MB")
    cores = f"{system_calls.usable_cores()} cores"
    if "SC_AVPHYS_PAGES" not in os.sysconf_names:  # macOS
        return f"{files} open files, {cores}"
    free = os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return f"{files} open files, {free / 1e9:.1f} GB of memory free, {cores}"


def _try_renderer() -> str:
    import warp as wp

    from gen_data.renderers.warp.device import open_device

    device = open_device("auto")
    total = float(wp.full(1000, 2.0, dtype=float, device=device).numpy().sum())
    _expect(total == 2000.0, f"{device}: an array of 1,000 twos has the sum {total}")
    return f"Warp {version('warp-lang')} on {device}"


def _try_gpu() -> str:
    """The first GPU: its name, and one computation on it."""
    import warp as wp

    from gen_data.renderers.warp.device import open_device, why_no_gpu

    _expect(not (reason := why_no_gpu()), reason)
    device = open_device("cuda:0")
    total = float(wp.full(1000, 2.0, dtype=float, device=device).numpy().sum())
    _expect(total == 2000.0, f"{device}: an array of 1,000 twos has the sum {total}")
    free, all_ = (size / 1e9 for size in (device.free_memory, device.total_memory))
    driver = ".".join(map(str, wp.get_cuda_driver_version() or ()))
    return f"{device.name}, sm_{device.arch}, {free:.1f} of {all_:.1f} GB free, CUDA {driver}"


def _try_physics() -> str:
    import numpy as np

    from gen_data.core.asset_types import ConvexParts
    from gen_data.core.se3 import SE3
    from gen_data.physics import PhysicsConfig
    from gen_data.physics.collision_shapes import collision_shape
    from gen_data.physics.open_world import open_world

    config = PhysicsConfig()
    corners = np.array([(x, y, z) for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (-0.1, 0.1)])
    with closing(open_world(config)) as world:
        world.reset()
        world.add("cube", collision_shape(ConvexParts((corners,))), SE3(), mass_kg=1.0)
        world.step(10)
        _expect(world.pose("cube").translation_m[2] < 0.0, "a cube does not fall")
    return f"{config.engine} {version(config.engine)}"


def _try_meshes() -> str:
    import fast_simplification
    import numpy as np
    import trimesh
    from scipy.spatial import ConvexHull

    sphere = trimesh.creation.icosphere(subdivisions=2)
    _expect(len(ConvexHull(sphere.vertices).vertices) == 162, "the hull of a sphere is wrong")
    _, faces = fast_simplification.simplify(
        np.asarray(sphere.vertices, np.float32), np.asarray(sphere.faces), 0.5
    )
    _expect(len(faces) <= 160, "a sphere is not simplified")
    return f"SciPy {version('scipy')}, trimesh {version('trimesh')}"


def _try_images() -> str:
    import cv2
    import deflate
    import numpy as np
    from PIL import Image

    grey = np.full((16, 16), 128, np.uint8)
    packed = deflate.zlib_compress(grey.tobytes(), 6)
    _expect(zlib.decompress(packed) == grey.tobytes(), "zlib cannot read the output of libdeflate")
    coded = cv2.imencode(".jpg", grey)[1]
    read = cv2.imdecode(coded, cv2.IMREAD_GRAYSCALE)
    _expect(read is not None and np.array_equal(read, grey), "OpenCV does not read its own output")
    _expect(Image.fromarray(grey).resize((4, 4)).size == (4, 4), "Pillow does not resize")
    return f"OpenCV {version('opencv-python-headless')}, libdeflate {version('deflate')}"


def _try_openexr() -> str:
    import numpy as np
    import OpenEXR

    with temporary_folders.temporary_folder("doctor") as folder:
        path = str(folder / "probe.exr")
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        OpenEXR.File(header, {"RGB": np.ones((2, 2, 3), np.float32)}).write(path)
        read = OpenEXR.File(path).channels()["RGB"].pixels
    _expect(float(read.sum()) == 12.0, "OpenEXR does not read its own output")
    return f"OpenEXR {version('OpenEXR')}"


def _try_coco() -> str:
    import numpy as np
    from pycocotools import mask

    coded = mask.encode(np.asfortranarray(np.ones((4, 5), np.uint8)))
    _expect(int(mask.area(coded)) == 20, "the area of a mask is wrong")
    return f"pycocotools {version('pycocotools')}"


def _try_usd() -> str:
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.CreateInMemory()
    UsdGeom.Xform.Define(stage, "/world")
    _expect("world" in stage.GetRootLayer().ExportToString(), "a stage loses its prim")
    return f"OpenUSD {version('usd-core')}"


def _try_preview() -> str:
    import rerun as rr
    import rerun_cli

    stream = rr.RecordingStream("gen-data doctor")
    recording = stream.memory_recording()
    stream.log("point", rr.Points3D([[0.0, 0.0, 0.0]]))
    _expect(recording.num_msgs() > 0, "a recording stays empty")
    viewer = Path(rerun_cli.__file__).with_name("rerun")
    subprocess.run([str(viewer), "--version"], capture_output=True, check=True)
    return f"Rerun {version('rerun-sdk')}"


def _try_sample() -> str:
    """Generate one small sample of the shipped tabletop, through every stage."""
    from gen_data.annotations.sample_checks import sample_faults
    from gen_data.assemble.config import load_config
    from gen_data.assemble.pipeline_factory import open_pipeline

    config = load_config("tabletop.yaml", overrides=("sensors[0].size_px=[160, 120]",))
    with open_pipeline(config) as pipeline:
        before = pipeline.numerics()
        sample = pipeline.sample(0)
        after = pipeline.numerics()
    _expect(before == after, f"the same computations gave two results: {before}, then {after}")
    _expect(not list(sample_faults(pipeline.info, sample)), "the sample is not valid")
    labelled = sum(len(truth.objects) for truth in sample.truth.values())
    digest = hashlib.sha256("".join(before.values()).encode()).hexdigest()
    attempts = f"{sample.attempts} layout attempt(s)"
    return f"{labelled} objects labelled, {attempts}, numerics class {digest[:12]}"


def _try_speed() -> str:
    """Generate one scene's samples of the shipped tabletop again and again for a few seconds."""
    from gen_data.assemble.config import load_config
    from gen_data.assemble.pipeline_factory import open_pipeline
    from gen_data.renderers.warp.device import open_device

    made, spent_s = 0, 0.0
    with open_pipeline(load_config("tabletop.yaml")) as pipeline:
        views = range(pipeline.info.views_per_scene)
        # The first round prepares assets, as the first samples of a run do.
        for view in views:
            pipeline.sample(view)
        started_s = time.perf_counter()
        while spent_s < BENCHMARK_S:
            for view in views:
                pipeline.sample(view)
            made += len(views)
            spent_s = time.perf_counter() - started_s
    rate = f"{made / spent_s:.1f} labelled samples/s"
    return f"{rate} in memory by one process on {open_device('auto')}: tabletop, 640x480"


def _try_denoiser() -> str:
    import pyoidn

    with pyoidn.Device(pyoidn.OIDN_DEVICE_TYPE_CPU):
        return f"Open Image Denoise {version('pyoidn')}"


def _try_packs() -> str:
    from gen_data.assets.installed_packs import installed_packs
    from gen_data.assets.paths import packs_dir

    records = installed_packs(packs_dir())
    _expect(bool(records), f"none installed in {packs_dir()}")
    return ", ".join(f"{record.name} {record.version}" for record in records)


def _is_installed(module: str) -> bool:
    """Whether an optional package must work because it is there."""
    return not optional_packages.missing_packages(module)


CHECKS = (
    Check("python", _try_python, REINSTALL.format(f"{DISTRIBUTION} numpy")),
    Check(
        "name",
        _try_name,
        f"uninstall it and {DISTRIBUTION}, then install {DISTRIBUTION} again: one has overwritten "
        "files of the other",
        required=False,
    ),
    Check("cache", _try_cache, "make the folder writable, or point XDG_CACHE_HOME elsewhere"),
    Check("limits", _try_limits, "raise them with ulimit -n, -v and -f"),
    Check("renderer", _try_renderer, REINSTALL.format("warp-lang")),
    Check("gpu", _try_gpu, "images are rendered on the CPU", required=False),
    Check(
        "physics", _try_physics, REINSTALL.format("pybullet" if find_spec("pybullet") else "mujoco")
    ),
    Check("meshes", _try_meshes, REINSTALL.format("scipy trimesh fast-simplification")),
    Check("images", _try_images, REINSTALL.format("opencv-python-headless deflate pillow")),
    Check("openexr", _try_openexr, install_command("exr"), _is_installed("OpenEXR")),
    Check("coco", _try_coco, REINSTALL.format("pycocotools")),
    Check("usd", _try_usd, install_command("usd"), _is_installed("pxr")),
    Check("preview", _try_preview, install_command("preview"), _is_installed("rerun")),
    Check("sample", _try_sample, "if the checks above pass, delete ~/.cache/warp and try again"),
    Check("speed", _try_speed, "see the check of the sample", required=False),
    Check("denoiser", _try_denoiser, install_command("denoise"), required=False),
    Check("packs", _try_packs, "gen-data assets list shows the available packs", required=False),
)
