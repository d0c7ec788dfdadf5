"""Assembled robots and pressures -> trajectories; the stepper itself is compiled from engine/."""
