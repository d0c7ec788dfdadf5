"""Between simulation and a rig on a table: calibration, deployment, logs, comparison."""
