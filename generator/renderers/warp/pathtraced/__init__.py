"""The path-traced tier: integrator, BSDFs, emitters, sampler and denoiser."""
