"""Robots as specifications: a hub, what is mounted where, and the physics it all lives in."""
