"""Robot arms: inverse kinematics, motion and task planning, grasps, trajectories."""
