"""Forces and exact tangents of a part's elements by the engine, added straight into its assembly.

The same numbers, to rounding, as those of the element groups in NumPy, which stay their
specification: solids of `yeoh`, `stable_neo_hookean` and `st_venant_kirchhoff`, with mean
dilatation and Maxwell branches, sheets of `st_venant_kirchhoff`, and pressure.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import pneumorph._engine as engine
from pneumorph.fem.assembly import Assembly
from pneumorph.fem.cavity import Cavity, Pressure
from pneumorph.fem.element_group import ElementGroup
from pneumorph.fem.maxwell_group import MaxwellGroup, ViscousState
from pneumorph.fem.volume_group import VolumeGroup, volume_tensor

_LAWS = {3: ("yeoh", "stable_neo_hookean", "st_venant_kirchhoff"), 2: ("st_venant_kirchhoff",)}


class CompiledElements:
    """Elements of a part in the engine.

    Args:
        assembly: Sparsity of the part's matrices.
        groups: Tetrahedra first, then sheets.
        volumes: Volumes of the tetrahedra; None where a law takes them at every point.
        branches: What of the tetrahedra's stress relaxes; None if nothing does.
        cavities: Where pressure acts.
    """

    def __init__(
        self,
        assembly: Assembly,
        groups: tuple[ElementGroup, ...],
        volumes: VolumeGroup | None,
        branches: MaxwellGroup | None,
        cavities: Sequence[Cavity],
    ) -> None:
        self._assembly, self._branches = assembly, branches
        self._sums = [_element_sums(assembly, group) for group in groups]
        self._cavities = [
            engine.CavitySums(
                np.ascontiguousarray(cavity.triangles, dtype=np.int32),
                cavity.weights,
                assembly.indptr,
                assembly.indices,
            )
            for cavity in cavities
        ]
        if volumes is not None:
            pairs, tensor = volume_tensor(volumes.connectivity.shape[1])
            self._sums[0].set_volumes(
                volumes.lame_lambda, volumes.rest_volume, np.array(pairs, dtype=np.int32), tensor
            )

    @staticmethod
    def know(groups: tuple[ElementGroup, ...]) -> bool:
        """Whether the engine has the laws of all these groups."""
        return all(group.material.law in _LAWS[group.dimension] for group in groups)

    def use(self, instruction_set: str) -> None:
        """Take an instruction set by name instead of the best one of this machine.

        Args:
            instruction_set: One of ``engine.ELEMENT_INSTRUCTION_SETS``.
        """
        for sums in self._sums:
            sums.use(instruction_set)

    def relaxing_stress(self, memory: ViscousState | None, step_s: float) -> RelaxingStress | None:
        """What the branches' stress is in a step, by the strain at its end; None without branches.

        Args:
            memory: What the solid remembers at the step's start.
            step_s: Length of the step [s].
        """
        if memory is None or self._branches is None:
            return None
        return RelaxingStress(self._branches, memory, step_s)

    def force(
        self,
        x: np.ndarray,
        pressure_kPa: Pressure = 0.0,
        relaxing: RelaxingStress | None = None,
    ) -> np.ndarray:
        """Force of elasticity, pressure and branches on the nodes [mN], (node, 3).

        Args:
            x: Node positions [mm], (node, 3).
            pressure_kPa: Pressure in the cavities, or of each [kPa].
            relaxing: The branches' stress in this step.
        """
        return self._add(x, pressure_kPa, relaxing, None, 1.0)

    def force_and_tangent(
        self,
        x: np.ndarray,
        pressure_kPa: Pressure,
        relaxing: RelaxingStress | None,
        data: np.ndarray,
        factor: float,
        change: np.ndarray | None = None,
    ) -> np.ndarray:
        """The same, with a factor times -d(force)/dx added to `data` in place.

        Args:
            x: Node positions [mm], (node, 3).
            pressure_kPa: Pressure in the cavities, or of each [kPa].
            relaxing: The branches' stress in this step.
            data: In the pattern of the part's assembly, (entry,).
            factor: What the tangent is multiplied by.
            change: A step that led here [mm], (node, 3): the tangent has the stresses that it
                foresaw in what is stiff, sheets and volumes (`pneumorph.fem.foreseen_stress`).
        """
        return self._add(x, pressure_kPa, relaxing, data, factor, change)

    def _add(
        self,
        x: np.ndarray,
        pressure_kPa: Pressure,
        relaxing: RelaxingStress | None,
        data: np.ndarray | None,
        factor: float,
        change: np.ndarray | None = None,
    ) -> np.ndarray:
        x, forces = np.ascontiguousarray(x, dtype=float), np.zeros(x.shape)
        step = None if change is None else np.ascontiguousarray(change, dtype=float)
        for number, sums in enumerate(self._sums):
            if number == 0 and relaxing is not None:
                sums.add(x, step, relaxing.base, relaxing.gain, forces, data, factor)
            else:
                sums.add(x, step, None, 0.0, forces, data, factor)
        pressures = np.broadcast_to(pressure_kPa, (len(self._cavities),))
        for cavity, pressure in zip(self._cavities, pressures, strict=True):
            if pressure != 0.0:
                cavity.add(x, float(pressure), forces, data, factor)
        return forces


class RelaxingStress:
    """S = base + 2 gain E: the branches' stress at the end of a step, by Green's strain there.

    The update of `pneumorph.fem.maxwell_group` is linear in the strain at the step's end.

    Args:
        branches: The branches.
        memory: What the solid remembers at the step's start.
        step_s: Length of the step [s].
    """

    def __init__(self, branches: MaxwellGroup, memory: ViscousState, step_s: float) -> None:
        decay, gain = branches.series.step_factors(step_s)
        moduli = branches.shear_moduli[:, 0]  # a solid is of one material
        self.gain = float(gain @ moduli)
        """Shear modulus of the strain at the end [kPa]."""
        stress = np.tensordot(2.0 * decay * moduli, memory.spring, 1)
        stress -= 2.0 * self.gain * memory.strain
        rows, columns = np.triu_indices(3)
        self.base: np.ndarray = np.ascontiguousarray(stress[rows, columns])
        """Stress of the unstrained solid there [kPa], xx xy xz yy yz zz, (6, point)."""


def _element_sums(assembly: Assembly, group: ElementGroup) -> engine.ElementSums:
    points, dimension = group.points_per_element, group.dimension
    elements = group.connectivity[::points]
    return engine.ElementSums(
        group.material.law,
        np.array(_constants(group)),
        np.ascontiguousarray(elements, dtype=np.int32),
        group.material_gradients.reshape(len(elements), points, -1, dimension).copy(),
        group.measure.reshape(len(elements), points).copy(),
        assembly.indptr,
        assembly.indices,
    )


def _constants(group: ElementGroup) -> tuple[float, float, float, float]:
    material = group.material
    lame_lambda, lame_mu = material.lame_constants(group.dimension)
    if material.law != "yeoh":
        return lame_mu, lame_lambda, 0.0, 0.0
    first, bulk = 0.5 * lame_mu, lame_lambda + 2.0 * lame_mu / 3.0
    return first, first * material.yeoh_c2_over_c1, first * material.yeoh_c3_over_c1, bulk
