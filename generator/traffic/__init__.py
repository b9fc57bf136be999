"""Traffic simulation: routes over lanes, drivers, pedestrians and signals.

Vehicles follow their routes as kinematic bicycles with pure-pursuit steering; their paths depend on
distance only. The Intelligent Driver Model, signals and right of way determine the progress along a
path (path-velocity decomposition: Kant and Zucker, "Toward efficient trajectory planning", IJRR
5(3), 1986). Only routes and paths of pedestrians are random.

Motion is computed with ``+ - * / sqrt`` and comparisons only, for equal results on all machines.
"""
