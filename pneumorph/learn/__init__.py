"""Design and gait learned together, and searches that learn nothing, to compare with."""
