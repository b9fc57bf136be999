"""A GPU that is missing, too old or full: one line with the reason and the remedy.

Warp's answers are replaced: no such machine is at hand.
"""

from types import SimpleNamespace
from typing import Any

import pytest
import warp as wp

from gen_data.core.errors import ConfigError, OutOfMemory, SampleError
from gen_data.renderers.warp.device import open_device, why_no_gpu
from gen_data.runner.error_context import explain_errors


@pytest.fixture
def machine(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Make Warp answer as on a machine with a driver, of a CUDA version, and some devices."""
    open_device("cpu")

    def answer(toolkit: Any, driver: Any, *arches: int) -> None:
        devices = [SimpleNamespace(alias=f"cuda:{i}", name="Old", arch=a)
                   for i, a in enumerate(arches)]  # fmt: skip
        monkeypatch.setattr(wp, "get_cuda_toolkit_version", lambda: toolkit)
        monkeypatch.setattr(wp, "get_cuda_driver_version", lambda: driver)
        monkeypatch.setattr(wp, "get_cuda_devices", lambda: devices)
        monkeypatch.setattr(wp, "is_cuda_available", lambda: bool(devices))
        monkeypatch.setattr(wp, "get_device", {d.alias: d for d in devices}.get)

    return answer


@pytest.mark.parametrize(("toolkit", "driver", "text"), [
    (None, None, "this build of warp-lang has no CUDA; install the one for Linux or Windows on"),
    ((13, 4), None, "no NVIDIA driver was found; install one for CUDA 13.0 or newer"),
    ((13, 4), (12, 9), "its NVIDIA driver is for CUDA 12.9, but warp-lang needs 13.0; update it"),
    ((13, 4), (13, 0), "the NVIDIA driver shows no device; compare nvidia-smi and CUDA_VISIBLE"),
])  # fmt: skip
def test_an_unusable_gpu_is_told_with_why(
    machine: Any, toolkit: Any, driver: Any, text: str
) -> None:
    """In the error of a configuration that asks for a GPU, on one line."""
    machine(toolkit, driver)

    assert why_no_gpu().startswith(text)
    with pytest.raises(ConfigError) as refused:
        open_device("cuda:0")
    assert text in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_gpu_that_warp_cannot_compile_for_is_refused(machine: Any) -> None:
    """Builds for CUDA 13 know Turing (sm_75) and newer ones; those for CUDA 12 older ones too."""
    machine((13, 4), (13, 0), 61)
    with pytest.raises(ConfigError, match=r"'cuda:0' \(Old, sm_61\) is too old .* sm_75 or newer"):
        open_device("cuda:0")

    machine((13, 4), (13, 0), 75)
    assert open_device("auto").alias == "cuda:0"
    machine((12, 9), (13, 0), 61)
    assert open_device("cuda").alias == "cuda:0"


@pytest.mark.parametrize("text", [
    "Failed to allocate 4915200 bytes on device 'cuda:0'",
    "Warp CUDA error 2: out of memory (in function wp_alloc_device_async, warp.cu:675)",
])  # fmt: skip
def test_a_full_gpu_is_an_error_that_names_workers_and_device(text: str) -> None:
    """Not the limits of the system's memory."""
    with pytest.raises(OutOfMemory) as refused, explain_errors("sample 3"):
        raise RuntimeError(text)
    assert str(refused.value) == (
        "sample 3: out of memory: the GPU has no more for this process; use fewer --workers, which"
        " share it (about 2.5 GB each), smaller images, or --set render.device=cpu"
    )


def test_memory_that_the_system_refuses_is_not_taken_for_that_of_a_gpu() -> None:
    with pytest.raises(SampleError, match="the system refused more memory"), explain_errors("x"):
        raise RuntimeError("Failed to allocate 4915200 bytes on device 'cpu'")
