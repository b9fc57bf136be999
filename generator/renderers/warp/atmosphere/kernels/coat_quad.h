// Four interpolated coats at once, in the types of sample_quad.h: the factor and the snow of
// ``albedo_below_coat``, and ``bump_visibility``.

struct Coat { Floats wet, snow, bumps; };
auto coat_of = [&](const Floats* mixable) {
    const Floats ramp = smaller(larger(mixable[2], 0.0f), 1.0f);
    Coat coat;
    coat.snow = ramp * ramp * (3.0f - 2.0f * ramp) * mixable[3];
    coat.wet = mixable[0] * larger(1.0f - coat.snow, 0.0f);
    coat.bumps = mixable[1] * (1.0f - 0.8f * smaller(coat.snow, 1.0f));
    return coat;
};
