"""Reduced robots in, trajectories out: the Python face of the compiled stepper."""

from pneumorph.simulation.batched_simulator import BatchedSimulator, RobotStatus
from pneumorph.simulation.simulation_settings import SimulationSettings

__all__ = ["BatchedSimulator", "RobotStatus", "SimulationSettings"]
