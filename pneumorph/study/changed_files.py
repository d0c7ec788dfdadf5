"""Which files of a run's robot are others than they were when the run was made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.physics.calibration import Calibration, UsedCalibration
from pneumorph.reduction.part_summary import PartsSummary


@dataclass(frozen=True)
class ChangedFile:
    """A file that was written again.

    Attributes:
        name: What it is called.
        then: Digest of what was in it.
        now: Of what is.
    """

    name: str
    then: str
    now: str

    @property
    def said(self) -> str:
        """In a few words."""
        return f"{self.name} was {self.then[:12]} and is {self.now[:12]} now"


def changed_calibration(then: UsedCalibration | None, now: RobotOptions) -> list[ChangedFile]:
    """The calibration, where it is another; none where one of the two says nothing of it.

    Args:
        then: What the run said.
        now: The run's robot.

    Raises:
        FileNotFoundError: Its file is gone.
        ArtefactError: It is no calibration.
    """
    if then is None or then.digest is None or now.calibration is None:
        return []
    digest = Calibration.load(now.calibration).digest()
    if digest == then.digest:
        return []
    return [ChangedFile(str(now.calibration), then.digest, digest)]


def changed_parts(
    then: PartsSummary | None, calibration: UsedCalibration | None, now: RobotOptions
) -> list[ChangedFile]:
    """Reduced parts that are others, whatever became of the calibration that they are as stiff as.

    Args:
        then: What the run said of them; None, or parts without a digest, in earlier versions.
        calibration: What it said of its calibration.
        now: The run's robot; raises as its `spec` does.
    """
    if then is None or all(each.digest is None for each in then.all_parts):
        return []
    if calibration is not None and changed_calibration(calibration, now):
        spec = replace(now, calibration=None).spec().scaled(calibration.modulus_factor or 1.0)
    else:
        spec = now.spec()
    parts: PartsSummary = spec.describe()["leg"]
    # By their order: files may have been found elsewhere.
    return [
        ChangedFile(each.part, was.digest, str(each.digest))
        for each, was in zip(parts.all_parts, then.all_parts, strict=False)
        if was.digest is not None and each.digest != was.digest
    ]


def changed_digests(then: Mapping[str, str], now: Mapping[str, str]) -> list[ChangedFile]:
    """Files whose digests are others, by their names; those that one of the two does not say are
    left out."""
    return [
        ChangedFile(name, then[name], digest)
        for name, digest in now.items()
        if name in then and then[name] != digest
    ]
