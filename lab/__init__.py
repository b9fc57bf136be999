"""Laboratory: certificates, environments, fits to recordings and studies, on top of the core."""
