"""Meshes, robots, parts and runs that several tests share."""
