"""Traffic through time: routes over lanes, drivers, people on foot, and signals.

Vehicles follow their routes as a kinematic bicycle with pure-pursuit steering: a path that depends
on distance alone. When they are where on it is decided by the Intelligent Driver Model, by signals
and by who has the right of way (path-velocity decomposition: Kant and Zucker, "Toward efficient
trajectory planning", IJRR 5(3), 1986). Nothing here is random except routes, which are drawn.

Only ``+ - * / sqrt`` and comparisons decide where things go.
"""
