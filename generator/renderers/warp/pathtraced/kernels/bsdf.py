"""BSDFs of the path tracer: evaluation and sampling.

All directions are in the shading frame, whose Z axis is the normal; ``v`` points to the previous
vertex of the path, ``l`` to the next. The model is the one of ``brdf`` with Smith's exact
height-correlated masking instead of its approximation, and a coat above it. Thin sheets also
transmit diffusely: their face, not their smooth normal, separates both sides, and either side
counts by the absolute cosine of the smooth normal, whose mean over one side is the same for all
normals.

Sources: see ``brdf``; Heitz, "Sampling the GGX distribution of visible normals", JCGT 7(4),
2018; Dupuy and Benyoub, "Sampling visible GGX normals with spherical caps", HPG 2023 (the same
distribution with fewer operations); Heitz, "Understanding the masking-shadowing function in
microfacet-based BRDFs", JCGT 3(2), 2014; Walter et al. 2007 (refraction).
"""

import warp as wp

from gen_data.renderers.warp.scene.kernels import brdf, records

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

# Smallest roughness: alpha 0.002, as in ``brdf``.
SMOOTHEST = wp.constant(0.045)
# Lacquers have refractive indices about 1.5: ((n - 1) / (n + 1))^2.
COAT_F0 = wp.constant(0.04)


@wp.struct
class Bsdf:
    """Reflection at a vertex, for one direction ``v``.

    Attributes:
        v: Direction to the previous vertex of the path; Z > 0.
        diffuse: Albedo of the diffuse layer, attenuated by the layers above it.
        passed: Albedo of diffuse transmission, attenuated by the same layers.
        flat: Normal of the face on the side of ``v``, for sheets; else 0.
        f0, f90: Reflectance of the specular layer (Schlick); ``scale`` contains the coat's
            attenuation and multiple scattering.
        ior: If not 0, a dielectric interface: only a specular layer, which reflects by Fresnel's
            equations for this index and transmits the rest.
        alpha: Width of the specular lobe.
        coat: Weight of the clear coat, multiple scattering included.
        coat_f0: Its reflectance at normal incidence.
        coat_alpha: Width of its lobe.
        p_coat, p_shine, p_passed: Probabilities of sampling the coat, the specular layer and
            diffuse transmission.
    """

    v: wp.vec3
    diffuse: wp.vec3
    passed: wp.vec3
    flat: wp.vec3
    f0: wp.vec3
    f90: float
    scale: wp.vec3
    ior: float
    alpha: float
    coat: float
    coat_f0: float
    coat_alpha: float
    p_coat: float
    p_shine: float
    p_passed: float


@wp.struct
class Scattering:
    """A sampled direction.

    Attributes:
        l: Unit.
        weight: BSDF times cosine over density; 0 where sampling fails and the path ends.
        density: Density per solid angle [1/sr]; negative for directions that no other technique
            samples.
    """

    l: wp.vec3  # noqa: E741
    weight: wp.vec3
    density: float


@wp.func
def roughness_to_alpha(roughness: float):
    """Width of a GGX lobe from perceptual roughness."""
    r = wp.clamp(roughness, SMOOTHEST, 1.0)
    return r * r


@wp.func
def schlick_weight(c: float):
    """(1 - c)^5, the weight of F90 in Schlick's approximation."""
    d = 1.0 - c
    d2 = d * d
    return d2 * d2 * d


@wp.func
def make_bsdf(
    table: wp.array2d[wp.vec2],
    v: wp.vec3,
    albedo: wp.vec3,
    translucency: wp.vec3,
    flat: wp.vec3,
    roughness: float,
    metallic: float,
    specular: float,
    coat: float,
    coat_f0: float,
    coat_roughness: float,
):
    """BSDF of a surface that transmits nothing, or only diffusely.

    Args:
        table: Directional albedo of GGX lobes, see
            gen_data.renderers.warp.scene.brdf_albedo_lut.smith_albedo.
        v: Unit direction to the viewer.
        translucency: Ratio of diffuse transmittance to ``albedo``.
        flat: Normal of the face on the side of ``v``.
        albedo, roughness, metallic, specular: As of gen_data.core.asset_types.Material.
        coat, coat_f0, coat_roughness: Weight of the coat above it, its reflectance at normal
            incidence, and its roughness.
    """
    one = wp.vec3(1.0, 1.0, 1.0)
    n_v = v[2]
    s = Bsdf()
    s.v = v
    s.alpha = roughness_to_alpha(roughness)
    # Burley 2012: specular 0.5 is 4 %.
    dielectric = 0.08 * specular * (1.0 - metallic)
    s.f0 = one * dielectric + albedo * metallic
    # Nothing real reflects less than 2 %: below that even the grazing reflection fades.
    s.f90 = wp.min(50.0 * wp.max(s.f0), 1.0)
    part = brdf.directional_albedo(table, wp.sqrt(s.alpha), n_v)
    # Turquin 2019; the floor guards against entries of the table near 0.
    s.scale = one + s.f0 * (1.0 / wp.max(part[0] + part[1], 0.05) - 1.0)
    gloss = wp.cw_mul(s.f0 * part[0] + one * (s.f90 * part[1]), s.scale)
    s.diffuse = wp.cw_mul(one - gloss, albedo) * (1.0 - metallic)
    # Layers are sampled in proportion to the luminance of their albedo.
    shine = brdf.luminance(gloss)
    if coat > 0.0:
        s.coat_f0 = coat_f0
        s.coat_alpha = roughness_to_alpha(coat_roughness)
        above = brdf.directional_albedo(table, wp.sqrt(s.coat_alpha), n_v)
        s.coat = coat * (1.0 + coat_f0 * (1.0 / (above[0] + above[1]) - 1.0))
        coated = s.coat * (coat_f0 * above[0] + above[1])
        # Light reflected by the coat does not reach the layers below.
        s.scale = s.scale * (1.0 - coated)
        s.diffuse = s.diffuse * (1.0 - coated)
        shine = shine * (1.0 - coated)
        s.p_coat = coated
    total = s.p_coat + shine + brdf.luminance(s.diffuse)
    if wp.max(translucency) > 0.0:
        s.passed = wp.cw_mul(s.diffuse, translucency)
        s.flat = flat
        s.p_passed = brdf.luminance(s.passed)
        total += s.p_passed
    if total > 0.0:
        s.p_coat = s.p_coat / total
        s.p_shine = shine / total
        s.p_passed = s.p_passed / total
    return s


@wp.func
def make_interface(v: wp.vec3, alpha: float, ior: float):
    """Reflection of a dielectric interface, without the transmitted part."""
    s = Bsdf()
    s.v = v
    s.alpha = alpha
    s.ior = ior
    s.scale = wp.vec3(1.0, 1.0, 1.0)
    s.p_shine = 1.0
    return s


@wp.func
def reflectance(s: Bsdf, v_h: float):
    """Reflectance of the specular layer's facets at the cosine ``v_h``."""
    f = s.f0
    if s.ior > 0.0:
        r = brdf.fresnel_dielectric(v_h, s.ior)
        f = wp.vec3(r, r, r)
    else:
        k = schlick_weight(wp.min(v_h, 1.0))
        f = f * (1.0 - k) + wp.vec3(s.f90, s.f90, s.f90) * k
    return wp.cw_mul(f, s.scale)


@wp.func
def smith_root(alpha: float, c: float):
    """The root in Smith's masking function for one cosine."""
    a2 = alpha * alpha
    return wp.sqrt(a2 + (1.0 - a2) * c * c)


@wp.func
def ggx_density(alpha: float, h: wp.vec3):
    """GGX: the density of facet normals."""
    # From the squared tangent, which keeps its digits in narrow lobes.
    a2 = alpha * alpha
    q = (h[0] * h[0] + h[1] * h[1]) / a2 + h[2] * h[2]
    return 1.0 / (wp.pi * a2 * q * q)


@wp.func
def evaluate(s: Bsdf, l: wp.vec3):  # noqa: E741
    """BSDF times cosine for one direction, and the density with which ``scatter`` samples it."""
    n_l = l[2]
    n_v = s.v[2]
    diffuse = wp.abs(n_l) * (1.0 / wp.pi)
    if wp.dot(s.flat, l) < 0.0:
        return s.passed * diffuse, diffuse * s.p_passed
    f = s.diffuse * diffuse
    density = diffuse * (1.0 - s.p_coat - s.p_shine - s.p_passed)
    # Only sheets are lit from below the smooth horizon, and there by diffuse light alone.
    if n_l <= 0.0:
        return f, density
    # Purely diffuse surfaces are the most common: they skip the half vector.
    if s.p_shine == 0.0 and s.coat == 0.0:
        return f, density
    h = records.fast_normalize(s.v + l)
    v_h = wp.max(wp.dot(s.v, h), 0.0)
    if s.p_shine > 0.0:
        lobe = 0.5 * ggx_density(s.alpha, h)
        root = smith_root(s.alpha, n_v)
        reflected = reflectance(s, v_h)
        p = s.p_shine
        # At an interface ``scatter_glass`` chooses reflection by Fresnel's equations, facet by
        # facet.
        if s.ior > 0.0:
            p = reflected[0]
        f += reflected * (lobe * n_l / (n_l * root + n_v * smith_root(s.alpha, n_l)))
        # Density of reflected visible normals: D G1 / (4 n_v); n_v cancels in Smith's form.
        density += p * lobe / (n_v + root)
    if s.coat > 0.0:
        lobe = 0.5 * ggx_density(s.coat_alpha, h)
        root = smith_root(s.coat_alpha, n_v)
        k = schlick_weight(wp.min(v_h, 1.0))
        shine = s.coat * (s.coat_f0 + (1.0 - s.coat_f0) * k) * lobe * n_l
        shine = shine / (n_l * root + n_v * smith_root(s.coat_alpha, n_l))
        f += wp.vec3(shine, shine, shine)
        density += s.p_coat * lobe / (n_v + root)
    return f, density


@wp.func
def sample_visible_normal(v: wp.vec3, alpha: float, u: wp.vec2):
    """Sample the GGX distribution of normals visible from ``v``."""
    # Heitz 2018: scaled by alpha, a GGX surface becomes a hemisphere.
    w = records.fast_normalize(wp.vec3(v[0] * alpha, v[1] * alpha, v[2]))
    # Dupuy and Benyoub 2023: a uniform spherical cap of directions gives the visible normals.
    z = (1.0 - u[1]) * (1.0 + w[2]) - w[2]
    r = wp.sqrt(wp.max(1.0 - z * z, 0.0))
    angle = 2.0 * wp.pi * u[0]
    x = r * wp.cos(angle) + w[0]
    y = r * wp.sin(angle) + w[1]
    # Scale back. Rounding may leave Z slightly below 0, where no facet faces outwards.
    return records.fast_normalize(wp.vec3(x * alpha, y * alpha, wp.max(z + w[2], 0.0)))


@wp.func
def sample_cosine(u: wp.vec2):
    """A direction distributed by the cosine."""
    # Malley's method: uniform on a disk, lifted to the hemisphere.
    r = wp.sqrt(u[0])
    angle = 2.0 * wp.pi * u[1]
    return wp.vec3(r * wp.cos(angle), r * wp.sin(angle), wp.sqrt(1.0 - u[0]))


@wp.func
def scatter(s: Bsdf, choice: float, u: wp.vec2):
    """Sample a direction approximately in proportion to BSDF times cosine.

    Args:
        choice: In [0, 1), selects the layer.
        u: In [0, 1), select the direction.
    """
    out = Scattering()
    usable = bool(True)
    if choice < s.p_coat + s.p_shine:
        alpha = s.alpha
        if choice < s.p_coat:
            alpha = s.coat_alpha
        h = sample_visible_normal(s.v, alpha, u)
        out.l = h * (2.0 * wp.dot(s.v, h)) - s.v
        usable = out.l[2] > 0.0 and wp.dot(s.flat, out.l) >= 0.0
    else:
        out.l = sample_cosine(u)
        # A direction and its opposite have the same absolute cosine: one of both is on the side
        # that is sampled.
        wanted = wp.where(choice >= 1.0 - s.p_passed, -1.0, 1.0)
        if wp.dot(s.flat, out.l) * wanted < 0.0:
            out.l = -out.l
    # The weight contains all layers, whichever was sampled: a one-sample mixture.
    if usable:
        f, density = evaluate(s, out.l)
        out.density = density
        if density > 0.0:
            out.weight = f * (1.0 / density)
    return out


@wp.func
def scatter_glass(s: Bsdf, xi: float, u: wp.vec2):
    """Sample a reflected direction, or a transmitted one towards negative Z.

    The weight excludes tint. Transmitted directions have no density: no other technique samples
    them. Radiance is not scaled by the squared index on entry: light that enters a body leaves it
    again. Masking of transmission is separable, as in Walter et al. 2007.

    Args:
        xi: In [0, 1), selects reflection or transmission.
        u: In [0, 1), select the direction.
    """
    out = Scattering()
    h = sample_visible_normal(s.v, s.alpha, u)
    v_h = wp.min(wp.dot(s.v, h), 1.0)
    if xi < brdf.fresnel_dielectric(v_h, s.ior):
        out.l = h * (2.0 * v_h) - s.v
        if out.l[2] > 0.0:
            f, density = evaluate(s, out.l)
            out.density = density
            out.weight = f * (1.0 / wp.max(density, 1.0e-20))
    else:
        out.l = brdf.refract(-s.v, h, s.ior)
        out.density = -1.0
        n_l = -out.l[2]
        if n_l > 0.0:
            # Divided by the density of visible normals, Walter's BTDF reduces to Smith's G1 of l.
            passed = 2.0 * n_l / (n_l + smith_root(s.alpha, n_l))
            out.weight = wp.vec3(passed, passed, passed)
    return out
