"""How groups of settings become flags of the command line."""

from __future__ import annotations

import tyro

flat = tyro.conf.arg(name="")
"""Marks a group of settings whose flags have no prefix of their own: `--leg`, not `--robot.leg`."""
