"""Fresnel reflection and refraction at dielectric interfaces and thin panes.

Sources: Born and Wolf, "Principles of Optics", 1.5.2 (Fresnel's formulae); Snell's law as in Pharr,
Jakob and Humphreys, "Physically Based Rendering", 4th ed., 9.3.
"""

from __future__ import annotations

import warp as wp

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

# Reflectance of water at normal incidence: ((n - 1) / (n + 1))^2 with n = 1.33, in visible light
# and in the near infrared alike (Hale and Querry, "Optical constants of water", 1973).
WATER_F0 = wp.constant(0.02)


@wp.func
def fresnel_schlick(f0: float, cosine: float):
    """Reflectance by Schlick's approximation, 1994; ``f0`` at normal incidence."""
    grazing = 1.0 - cosine
    squared = grazing * grazing
    return f0 + (1.0 - f0) * squared * squared * grazing


@wp.func
def fresnel_dielectric(cosine: float, eta: float):
    """Reflectance of unpolarised light; 1 for total internal reflection.

    Args:
        cosine: Of the angle of incidence, [0, 1].
        eta: Refractive index behind the interface over that before it.
    """
    reflectance = float(1.0)
    # Snell's law; a squared sine above 1 has no refracted direction.
    sine2 = (1.0 - cosine * cosine) / (eta * eta)
    if sine2 < 1.0:
        behind = wp.sqrt(1.0 - sine2)
        across = (cosine - eta * behind) / (cosine + eta * behind)
        along = (eta * cosine - behind) / (eta * cosine + behind)
        # The mean of both polarisations.
        reflectance = 0.5 * (across * across + along * along)
    return reflectance


@wp.func
def refract(d: wp.vec3, n: wp.vec3, eta: float):
    """Unit refracted direction; 0 for total internal reflection.

    Args:
        d: Unit direction of travel.
        n: Unit normal, facing the incident side.
        eta: As for fresnel_dielectric.
    """
    cosine = -wp.dot(n, d)
    sine2 = (1.0 - cosine * cosine) / (eta * eta)
    way = wp.vec3(0.0)
    if sine2 < 1.0:
        way = wp.normalize(d * (1.0 / eta) + n * (cosine / eta - wp.sqrt(1.0 - sine2)))
    return way


@wp.func
def pane_reflectance(f: float, tint: wp.vec3):
    """Reflectance of a thin pane with all inter-reflections.

    Args:
        f: Of one face.
        tint: Transmittance of one passage.
    """
    # Geometric series: enter, reflect at the back face, leave; each further pair of reflections
    # adds a factor f^2 t^2. The small term avoids 0 / 0 at grazing incidence.
    part = (1.0 - f) * (1.0 - f) * f
    return wp.vec3(
        f + part * tint[0] * tint[0] / (1.0 - f * f * tint[0] * tint[0] + 1.0e-6),
        f + part * tint[1] * tint[1] / (1.0 - f * f * tint[1] * tint[1] + 1.0e-6),
        f + part * tint[2] * tint[2] / (1.0 - f * f * tint[2] * tint[2] + 1.0e-6),
    )


@wp.func
def pane_transmittance(f: float, tint: wp.vec3):
    """Transmittance of a thin pane; arguments as for pane_reflectance."""
    # The same series for light that leaves by the back face.
    part = (1.0 - f) * (1.0 - f)
    return wp.vec3(
        part * tint[0] / (1.0 - f * f * tint[0] * tint[0] + 1.0e-6),
        part * tint[1] / (1.0 - f * f * tint[1] * tint[1] + 1.0e-6),
        part * tint[2] / (1.0 - f * f * tint[2] * tint[2] + 1.0e-6),
    )
