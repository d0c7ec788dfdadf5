"""Flags of a reduction of the small leg in conftest.py: every stage, seconds."""

FEW_SNAPSHOTS = (
    "--preset paper --snapshots.executor.process-count 1 --snapshots.walk.leg-counts "
    "--snapshots.static.bend-count 4 --snapshots.static.bend-pressure-kPa 40 "
    "--snapshots.static.load-count 4 --snapshots.static.load-pressure-kPa 20 "
    "--snapshots.static.load-limit-mN 50 --reduction.mode-limit 4"
)
