"""Records and functions that all stages share: rays, materials, lights, environment."""
