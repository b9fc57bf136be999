"""Recovery of known parameters: ``python -m benchmarks.bench_match [--repeats 6] [--spread 0.4]``.

Photographs and scans of scenes without a renderer (from the tests) are made with known values, and
fitted from other scenes of the same kind. Prints, for each quantity, the true value, mean and
standard deviation of the fits over repetitions with new scenes, and how many 95 % intervals contain
the true value.
"""

import argparse
import time
from collections.abc import Iterable

import numpy as np

from benchmarks.runs import machine
from gen_data.config.distributions import Constant, Distribution, Normal
from gen_data.lab.matching import lidar_fit, recordings
from gen_data.lab.matching.camera_fit import fit_camera, measure_photo
from gen_data.lab.matching.results import FittedQuantity
from gen_data.lab.matching.simulation import photograph, rescan
from gen_data.sensors.camera.image_pipeline import ImagePipeline
from tests.matching.scenes import RESPONSE, exposures, illuminations, scanner

BASE = ImagePipeline.model_validate({"preset": "industrial", "focus": None})
CAMERA = {
    "exposure": -0.7, "tone": 1.375, "white balance": 0.3, "saturation": 0.75, "blur": 1.0,
    "noise": 3000.0, "read noise": 12.0, "JPEG quality": 92.0,
}  # fmt: skip
SCANNER = {"reflectance gain": 0.25, "dark returns": 0.2, "dropout": 0.7, "range": 30.0}
FittedRows = Iterable[FittedQuantity]
STRIDE = 1000
"""Seeds between repetitions."""


def fit_photographs(first: int, pictures: int, scenes: int, spread_ev: float) -> FittedRows:
    """Fit photographs of one camera, whose exposures differ by a standard deviation."""
    exposure: Distribution[float] = Constant(CAMERA["exposure"])
    if spread_ev:
        exposure = Normal(CAMERA["exposure"], spread_ev, (-2.0, 1.0))
    real = ImagePipeline.model_validate({
        "preset": "industrial",
        "focus": None,
        "contrast": CAMERA["tone"],
        "saturation": CAMERA["saturation"],
        "warmth_ev": CAMERA["white balance"],
        "blur_px": CAMERA["blur"],
        "image_sensor": {
            "full_well_e": CAMERA["noise"],
            "read_noise_e": CAMERA["read noise"],
        },
        "jpeg_quality": CAMERA["JPEG quality"],
    }).model_copy(update={"exposure_compensation_ev": exposure})  # fmt: skip
    photos = [
        measure_photo(recordings.Photo(f"{k}.png", photograph(one, real).rgb, (320, 240), None))
        for k, one in enumerate(exposures(range(first, first + pictures), real))
    ]
    seeds = range(first + STRIDE // 2, first + STRIDE // 2 + scenes)
    return fit_camera(exposures(seeds, BASE), photos, 0).quantities


def fit_scans(first: int, scans: int, scenes: int) -> FittedRows:
    """Fit sweeps of one scanner."""
    real = scanner(
        white_intensity=SCANNER["reflectance gain"],
        response={**RESPONSE, "dark": SCANNER["dark returns"]}, window=SCANNER["dropout"],
        range_m=(0.5, SCANNER["range"]),
    )  # fmt: skip
    made = [rescan(one, real) for one in illuminations(range(first, first + scans), real)]
    seeds = range(first + STRIDE // 2, first + STRIDE // 2 + scenes)
    return lidar_fit.fit_lidar(illuminations(seeds, scanner(response=RESPONSE)), made, 0).quantities


def main() -> None:
    """Repeat, and print a table as Markdown."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=6)
    parser.add_argument("--pictures", type=int, default=30)
    parser.add_argument("--scenes", type=int, default=24)
    parser.add_argument("--spread", type=float, default=0.4, help="Of exposures [EV].")
    args = parser.parse_args()
    started_s = time.process_time()
    truths = {**CAMERA, **SCANNER}
    found: dict[str, list[FittedQuantity]] = {name: [] for name in truths}
    for number in range(args.repeats):
        first = 5000 + STRIDE * number
        for row in (
            *fit_photographs(first, args.pictures, args.scenes, args.spread),
            *fit_scans(first, args.pictures, args.scenes),
        ):
            if row.name in found and row.mean is not None:
                found[row.name].append(row)
    print("| quantity | true | mean of fits | deviation of a fit | intervals that hold it |")
    print("|---|---|---|---|---|")
    for name, rows in found.items():
        means = np.array([row.mean for row in rows])
        held = sum(
            row.low is not None and row.high is not None and row.low <= truths[name] <= row.high
            for row in rows
        )
        print(
            f"| {name} | {truths[name]:g} | {means.mean():.4g} | {means.std(ddof=1):.2g} "
            f"| {held} of {len(rows)} |"
        )
    print(f"\n{time.process_time() - started_s:.0f} CPU s; {machine()}")


if __name__ == "__main__":
    main()
