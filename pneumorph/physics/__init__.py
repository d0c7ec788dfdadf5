"""What is simulated, whatever the model: supply of pressure, calibration."""
