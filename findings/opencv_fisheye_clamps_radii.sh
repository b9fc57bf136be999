#!/usr/bin/env bash
# Common guess: cv2.fisheye.undistortPoints inverts cv2.fisheye.projectPoints wherever the polynomial of the
#   lens rises, at least within 90 degrees of the axis; wider directions are an error or NaN.
# Behaviour: undistortPoints clamps the distance from the centre, divided by f, to pi / 2, which is an angle
#   only for a lens without coefficients. With k1 = 0.3, all pixels that show more than 65 degrees come back wrong,
#   silently: 70 degrees as 67.5, 80 as 71.7, 89 as 74.7. projectPoints divides by z: a direction 100 degrees from
#   the axis lands where 80 degrees do, on the opposite side of the image.
# Why it matters: rays of a calibrated fisheye are off by up to 14 degrees in the outer part of its image, in front
#   of the camera, and objects behind a lens of 195 degrees are drawn into its middle. Our lens agrees with
#   projectPoints to 1e-6 px in front of the camera, inverts it to the end of the polynomial, and shows 100
#   degrees where the model has them; readers of our calibrations that use these two functions do not.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
for release in 4.14.0.94 5.0.0.93; do
  "$work/venv/bin/pip" install -q "opencv-python-headless==$release" numpy
  "$work/venv/bin/python" - <<'PY'
import cv2
import numpy as np

print(f"opencv {cv2.__version__}")
K = np.array([[200.0, 0.0, 400.0], [0.0, 200.0, 400.0], [0.0, 0.0, 1.0]])
zero = np.zeros(3)


def pixel(degrees: float, D: np.ndarray) -> np.ndarray:
    angle = np.radians(degrees)
    ray = np.array([[[np.sin(angle), 0.0, np.cos(angle)]]])
    return cv2.fisheye.projectPoints(ray, zero, zero, K, D)[0]


D = np.array([0.3, 0.0, 0.0, 0.0])  # Its polynomial rises without end.
limit = 64.96  # The angle t with t + 0.3 t^3 = pi / 2.
for degrees in (50.0, 64.0, 70.0, 80.0, 89.0):
    theta = np.radians(degrees)
    radius = (pixel(degrees, D)[0, 0, 0] - 400.0) / 200.0
    assert abs(radius - (theta + 0.3 * theta**3)) < 1e-9, "projectPoints is no longer the model"
    back = cv2.fisheye.undistortPoints(pixel(degrees, D), K, D)[0, 0, 0]
    found = np.degrees(np.arctan(back))
    print(f"shown at {degrees:g} degrees, radius {radius:.3f} f: comes back as {found:.2f} degrees")
    assert (abs(found - degrees) < 1e-3) == (degrees < limit), f"behaviour changed: {found}"
straight = np.zeros(4)
ahead, behind = pixel(80.0, straight)[0, 0, 0], pixel(100.0, straight)[0, 0, 0]
model = 400.0 + 200.0 * np.radians(100.0)
print(f"80 degrees to the right at x = {ahead:.1f}, 100 degrees at {behind:.1f}, not {model:.1f}")
assert abs(behind - 400.0 + (ahead - 400.0)) < 1e-6, "behaviour changed"
PY
done
echo "as described"
