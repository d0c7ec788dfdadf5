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

    @property
    def all_parts(self) -> tuple[PartSummary, ...]:
        """All of them, in the order of the robot's modules."""
        return (self, *self.others.values())

    @property
    def sizes(self) -> str:
        """Those of all of them."""
        return ", ".join([super().sizes, *(each.sizes for each in self.others.values())])
