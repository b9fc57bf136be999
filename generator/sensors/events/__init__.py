"""Events of traffic and manipulation: collisions, lane crossings, obstacles."""
