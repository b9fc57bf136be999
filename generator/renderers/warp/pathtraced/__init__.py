"""The path-traced tier: integrator, BSDF, emitters, sampler and denoiser."""
