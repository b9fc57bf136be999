"""Reflection and refraction of surfaces, and the luminance of colours.

The BRDF is metallic-roughness: GGX over Lambert, energy-conserving. Dielectric interfaces and thin
panes reflect and refract by Fresnel's equations.

Sources: Walter et al., "Microfacet models for refraction through rough surfaces", EGSR 2007 (GGX);
Hammon, "PBR diffuse lighting for GGX+Smith microsurfaces", GDC 2017 (height-correlated Smith
without square roots); Burley, "Physically based shading at Disney", 2012 (parameters); Karis, "Real
shading in Unreal Engine 4", 2013 (directional albedo from a table); Turquin, "Practical multiple
scattering compensation for microfacet models", 2019; Lagarde and de Rousiers, "Moving Frostbite to
PBR", 2014 (F90); Born and Wolf, "Principles of Optics", 1.5.2 (Fresnel's formulae); Snell's law as
in Pharr, Jakob and Humphreys, "Physically Based Rendering", 4th ed., 9.3. Weights of luminance as
in ``gen_data.core.colorimetry``.
"""

import warp as wp

from gen_data.core.colorimetry import REC709_LUMINANCE
from gen_data.renderers.warp.scene.kernels.records import fast_normalize

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

WEIGHTS = wp.constant(wp.vec3(*(float(weight) for weight in REC709_LUMINANCE)))


@wp.func
def luminance(rgb: wp.vec3):
    """Luminance of linear RGB (Rec. 709)."""
    return WEIGHTS[0] * rgb[0] + WEIGHTS[1] * rgb[1] + WEIGHTS[2] * rgb[2]


@wp.struct
class Brdf:
    """A BRDF at a point, for one viewing direction.

    Attributes:
        matte: Share of the light that the specular layer transmits to the diffuse albedo.
        f0, f90: Specular reflectance at normal and grazing incidence.
        gloss: Directional albedo of the specular layer, multiple scattering included.
        boost: Multiple scattering factor on single scattering.
        roughness: Perceptual; alpha is its square.
        n_v: Cosine between normal and viewer.
    """

    matte: wp.vec3
    f0: wp.vec3
    f90: float
    gloss: wp.vec3
    boost: wp.vec3
    roughness: float
    n_v: float


@wp.func
def directional_albedo(table: wp.array2d[wp.vec2], roughness: float, n_v: float):
    """Factors on F0 and on F90 of the GGX lobe's directional albedo.

    Args:
        table: The factors over [0, 1] x [0, 1], ends included; roughness by row, cosine by column.
    """
    last = float(table.shape[0] - 1)
    # The last cell ends at 1: staying just below keeps the right neighbour inside the table.
    x = wp.min(n_v * last, last - 0.001)
    y = wp.min(roughness * last, last - 0.001)
    x0 = int(x)
    y0 = int(y)
    fx = x - float(x0)
    fy = y - float(y0)
    top = table[y0, x0] * (1.0 - fx) + table[y0, x0 + 1] * fx
    bottom = table[y0 + 1, x0] * (1.0 - fx) + table[y0 + 1, x0 + 1] * fx
    return top * (1.0 - fy) + bottom * fy


@wp.func
def make_brdf(
    table: wp.array2d[wp.vec2],
    albedo: wp.vec3,
    roughness: float,
    metallic: float,
    specular: float,
    n_v: float,
):
    """The BRDF at a point with its view-dependent constants."""
    s = Brdf()
    # Alpha 0.002: in narrower lobes n_h^2 (alpha^2 - 1) + 1 cancels at the peak.
    s.roughness = wp.clamp(roughness, 0.045, 1.0)
    # Interpolated normals may turn away from the viewer; Smith's term divides by this.
    s.n_v = wp.max(n_v, 1.0e-3)
    # Burley 2012: specular 0.5 is 4 %, the reflectance of most plastics (index 1.5).
    dielectric = 0.08 * specular * (1.0 - metallic)
    s.f0 = wp.vec3(dielectric, dielectric, dielectric) + albedo * metallic
    # Nothing real reflects less than 2 %: below that even the grazing reflection fades.
    s.f90 = wp.min(50.0 * wp.max(s.f0[0], wp.max(s.f0[1], s.f0[2])), 1.0)
    part = directional_albedo(table, s.roughness, s.n_v)
    # Turquin 2019: energy that single scattering loses under white light, relative to what it
    # keeps. The floor guards against table entries near 0.
    loss = 1.0 / wp.max(part[0] + part[1], 0.05) - 1.0
    s.boost = wp.vec3(1.0, 1.0, 1.0) + s.f0 * loss
    s.gloss = wp.cw_mul(s.f0 * part[0] + wp.vec3(s.f90, s.f90, s.f90) * part[1], s.boost)
    # The diffuse layer receives light that the specular layer does not reflect; metals have none.
    s.matte = wp.vec3(1.0 - s.gloss[0], 1.0 - s.gloss[1], 1.0 - s.gloss[2]) * (1.0 - metallic)
    return s


@wp.func
def specular_lobe(s: Brdf, n: wp.vec3, v: wp.vec3, l: wp.vec3, n_l: float, widening: float):  # noqa: E741
    """GGX reflection without the cosine [1/sr].

    Args:
        widening: Added to alpha for a light that is not a point, with the peak lowered to keep its
            energy (Karis, "Real shading in Unreal Engine 4", 2013).
    """
    h = fast_normalize(l + v)
    # Rounding may leave the cosine above 1, where the denominator would change sign.
    n_h = wp.min(wp.dot(n, h), 1.0)
    alpha = s.roughness * s.roughness
    wide = wp.min(alpha + widening, 1.0)
    # Karis 2013: the peak falls by (alpha / wide)^2: a wider lobe must not have more energy.
    a2 = alpha * alpha
    q = n_h * n_h * (a2 - 1.0) + 1.0
    # Hammon 2017: Smith's height-correlated masking, without its two square roots.
    g = 2.0 * n_l * s.n_v * (1.0 - alpha) + (n_l + s.n_v) * alpha
    lobe = 0.5 * a2 * a2 / (wp.pi * q * q * wide * wide * wp.max(g, 1.0e-4))
    c = 1.0 - wp.max(wp.dot(v, h), 0.0)
    # Schlick 1994, with F90 in place of 1.
    c2 = c * c
    c5 = c2 * c2 * c
    f = s.f0 * (1.0 - c5) + wp.vec3(s.f90, s.f90, s.f90) * c5
    return wp.cw_mul(f, s.boost) * lobe


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
        cosine: Cosine of the angle of incidence, [0, 1].
        eta: Refractive index behind the interface divided by the index before it.
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
        f: Reflectance of one face.
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
