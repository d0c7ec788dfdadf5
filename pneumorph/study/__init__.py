"""What is asked of robots and runs: comparisons, evaluations, robustness, fits."""
