"""Which gait is driven through which rig, how often, and which options go together."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from pneumorph.base.checked import Checked, Count
from pneumorph.base.layers import changed_flags
from pneumorph.gait.expert_gait import ExpertGait
from pneumorph.hardware.bend_staircase import BendTestSettings
from pneumorph.hardware.virtual_rig import VirtualRigSettings
from pneumorph.study.recorded_walk import Model


@dataclass(frozen=True)
class DeploymentSettings(Checked):
    """Which gait, on which rig, and how often."""

    rank: Count = 1
    """Which of the run's best pairs to drive: 1 is the best."""
    design: str | None = None
    """Design that walks, if the gait file does not name one."""
    trials: Count = 5
    """Number of trials."""
    dry_run: bool = False
    """Only print the schedule and command nothing."""
    bend_test: bool = False
    """Measure the bend of one leg against pressure instead of driving a gait."""
    rig: Path | None = None
    """File that describes the rig (JSON or TOML, docs/hardware.md); by default a virtual rig."""
    model: Model = "full"
    """Model of the virtual rig's robot: finite elements (many minutes per trial), or reduced
    (seconds)."""
    virtual: VirtualRigSettings = field(default_factory=VirtualRigSettings)
    bends: BendTestSettings = field(default_factory=BendTestSettings)
    expert: ExpertGait = field(default_factory=ExpertGait)

    def refuse_unused(self, driver: str) -> None:
        """Refuse options that this deployment would not look at.

        Args:
            driver: Of the rig.

        Raises:
            ValueError: There is one; names its flag and what it is for.
        """
        uses = {} if self.bend_test else {"--bends.": "with --bend-test"}
        if driver != "virtual":
            real = f"with a virtual rig only, and {self.rig} has the driver {driver!r}"
            uses |= {"--virtual.": real, "--model": real, "--bends.repeats": real}
        elif self.bend_test:
            uses["--trials"] = "without --bend-test, of which a virtual rig makes one"
        for flag in changed_flags(DeploymentSettings(), self):
            for begin, use in uses.items():
                if flag.startswith(begin):
                    raise ValueError(f"{flag} is given, expected it {use}: it would be ignored")

    def refuse_source_of_bend_test(self, source: Path | None) -> None:
        """Raise ValueError where a bend test is asked for together with a gait."""
        if self.bend_test and source is not None:
            raise ValueError(
                f"source is {source}, expected none with --bend-test: it climbs a staircase "
                "of its own (--bends.highest-kPa, --bends.step-kPa)"
            )
