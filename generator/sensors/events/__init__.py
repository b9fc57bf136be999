"""Event detectors: collisions, lane invasions, obstacles, traffic lights, proximity."""
