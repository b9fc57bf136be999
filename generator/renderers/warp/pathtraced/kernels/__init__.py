"""Path tracing: integrator, BSDF, emitters, sampler and guides of the denoiser."""
