"""What summaries say of a reduced part: its size, provenance and measured errors."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class PartSummary:
    """Size, provenance and measured errors of a reduced part."""

    part: str
    """What it is called: its file, or a name."""
    mode_count: int
    tetrahedron_count: int
    """Sampled integration points of the solid."""
    membrane_count: int
    """The same of the membrane."""
    mesh_digest: str
    errors: dict[str, float | None]
    """By the names that the report of the reduction gives them; None where it measured none."""
    bend: dict[str, list[float]] | None
    """Pressures [kPa] with the bend of both models [degrees]; None where it was not measured."""
    knows_range: bool = False
    """Whether it can tell when it leaves the range of its snapshots; older files cannot."""
    stress_count: int = 0
    """Fields of stress that the membrane is seen by instead of sampled points; older files have
    none."""
    mass_kg: float | None = None
    """None in summaries of earlier versions."""
    silicone: str | None = None
    """The supplier's name of what it is of; None of what is not in the table of silicones."""
    digest: str | None = None
    """Hash of all that it is; None in summaries of earlier versions."""

    @property
    def sizes(self) -> str:
        """Numbers of modes and samples, and the mesh, which tell most reductions apart."""
        counts = self.mode_count, self.tetrahedron_count, self.membrane_count, self.stress_count
        return f"{' '.join(map(str, counts))} {self.mesh_digest[:12]}"


@dataclass(frozen=True)
class PartsSummary(PartSummary):
    """Of the parts that a robot has: the first, and the other kinds beside it."""

    others: dict[str, PartSummary] = field(default_factory=dict)
    """By what they are called."""

    def changed_since(self, earlier: PartsSummary) -> list[str]:
        """What parts are called that are others than in an earlier summary, as far as that says.

        Args:
            earlier: Of the same robot, whose parts may have been found elsewhere.
        """
        now, then = ((one, *one.others.values()) for one in (self, earlier))
        return [
            each.part
            for each, was in zip(now, then, strict=False)
            if was.digest is not None and each.digest != was.digest
        ]

    @property
    def sizes(self) -> str:
        """Those of all of them."""
        return ", ".join([super().sizes, *(each.sizes for each in self.others.values())])
