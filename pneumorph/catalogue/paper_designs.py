"""Designs of the paper's robot."""

from __future__ import annotations

BASELINE_DESIGN = "1.0.0.2.2.0.0.1"
"""Two fore legs on regulator 1 and two hind legs on regulator 2 (paper, section IV)."""
