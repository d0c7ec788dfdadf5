"""A part as finite elements: forces, stiffness, mass, cavities."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import csc_array

from pneumorph.fem.assembly import Assembly, matrix_of_blocks
from pneumorph.fem.cavity import Cavity, Pressure
from pneumorph.fem.compiled_elements import CompiledElements
from pneumorph.fem.corotational import Corotational
from pneumorph.fem.element_group import ElementGroup
from pneumorph.fem.element_stiffness import (
    full_matrices,
    objective_stiffness_entries,
    stiffness_entries,
    tangent_entries,
    tangent_matrices,
)
from pneumorph.fem.foreseen_stress import foreseen_stress_entries
from pneumorph.fem.material import MassLumping, Material, Membrane
from pneumorph.fem.maxwell_group import MaxwellGroup, ViscousState
from pneumorph.fem.membrane import membrane_group
from pneumorph.fem.node_mass import given_node_mass, node_mass
from pneumorph.fem.node_turns import NodeTurns
from pneumorph.fem.prony import PronySeries
from pneumorph.fem.solid import solid_groups
from pneumorph.fem.volume_group import VolumeGroup
from pneumorph.geometry.mesh import Mesh, MeshError
from pneumorph.geometry.mesh_checks import check_mesh
from pneumorph.geometry.region_names import cavity_regions
from pneumorph.geometry.surface import enclosed_centre
from pneumorph.physics.physics import Rotation


class PartModel:
    """Full-order model of a part, in its own frame.

    Args:
        mesh: The part; refused with its reason when faulty.
        material: What the solid is made of.
        mass_kg: Mass of the part [kg].
        membranes: Sheets on surface regions.
        cavity: Surface region under pressure, or several; None for a part without.
        mass_lumping: How the mass is shared among the nodes: ``even``, the paper's, gives each the
            same; ``volume`` gives each what its elements hold (Hinton, Rock and Zienkiewicz 1976);
            or the mass of each node itself [kg], (node,), as `matched_node_mass` makes them.
        relaxation: How the solid's shear modulus relaxes, `material` being what is left; None, or
            a series without branches, for a solid that does not.

    Raises:
        MeshError: The mesh is faulty or lacks a region.
        ValueError: The mass is not positive, or node masses do not add up to it; or a material has
            numbers that its elements do nothing with.
    """

    def __init__(
        self,
        mesh: Mesh,
        material: Material,
        mass_kg: float,
        membranes: Sequence[Membrane] = (),
        cavity: str | Sequence[str] | None = None,
        mass_lumping: MassLumping | np.ndarray = "even",
        relaxation: PronySeries | None = None,
    ) -> None:
        if not 0.0 < mass_kg < float("inf"):
            raise ValueError(f"mass_kg must be positive and finite, got {mass_kg}")
        material.refuse_unused(3)
        for each in membranes:
            each.material.refuse_unused(2)
        regions = [membrane.surface for membrane in membranes]
        names = (cavity,) if isinstance(cavity, str) else tuple(cavity or ())
        if len(set(names)) < len(names):
            raise ValueError(
                f"cavity is {', '.join(names)}, expected each region once: pressure would act twice"
            )
        check_mesh(mesh, [*regions, *names], cavities=names)
        self.mesh = mesh
        self.material = material
        self.mass_kg = mass_kg
        self.membranes = tuple(membranes)
        self.mass_lumping = mass_lumping
        self.node_mass: np.ndarray = (
            node_mass(mesh, mass_kg, mass_lumping)
            if isinstance(mass_lumping, str)
            else given_node_mass(mass_lumping, mesh, mass_kg)
        )
        """Lumped mass [kg], (node,)."""
        tetrahedra, volumes = solid_groups(mesh.nodes, mesh.connectivity, material)
        self.volume_group: VolumeGroup | None = volumes
        """What of the solid's energy depends on whole elements' volumes; None if nothing."""
        self.element_groups: tuple[ElementGroup, ...] = (
            tetrahedra,
            *(
                membrane_group(
                    mesh.nodes,
                    mesh.surface_connectivity(each.surface),
                    each.material,
                    each.thickness_mm,
                )
                for each in membranes
            ),
        )
        """Tetrahedra first, then the membranes."""
        self.branches: MaxwellGroup | None = (
            MaxwellGroup(tetrahedra, relaxation) if relaxation and relaxation.weights else None
        )
        """What of the solid's stress relaxes."""
        self.cavity_names = names
        """Surface region of each of the cavities."""
        self.cavities: tuple[Cavity, ...] = tuple(
            Cavity.of_surface(mesh.surface_connectivity(name)) for name in names
        )
        """Where pressure acts: each at its own, or all at one."""
        self._shares = np.ones(len(names))

    def check_cavities(self, some: bool = False) -> None:
        """Refuse cavities that a reduction would take for others: it has those of the mesh, by
        their names.

        Args:
            some: Whether it may have some of them alone, such as for a bend of one chamber.

        Raises:
            ValueError: They are others, or in another order.
        """
        named = cavity_regions(self.mesh)
        wanted = [name for name in named if name in self.cavity_names] if some else named
        if list(self.cavity_names) != wanted:
            raise ValueError(
                f"cavity is {', '.join(self.cavity_names) or 'none'}, expected what the mesh names "
                f"so, in this order, {', '.join(named) or 'none'}: a reduced part numbers its "
                "chambers by these; pass cavity_regions(mesh), or name the mesh's regions cavity, "
                "cavity_left ..."
            )

    @property
    def cavity_centres_mm(self) -> np.ndarray:
        """Middle of each cavity at rest [mm], (cavity, 3)."""
        regions = [self.mesh.surfaces[name] for name in self.cavity_names]
        centres = [enclosed_centre(self.mesh.nodes, region) for region in regions]
        return np.reshape(centres, (-1, 3))

    def inflated_in(self, shares: Sequence[float] | np.ndarray) -> PartModel:
        """The same part, where one pressure is so much in each cavity, (cavity,): what rises with
        one number goes into one direction of the cavities' pressures.

        Raises:
            ValueError: There are not as many shares as cavities.
        """
        if len(shares) != len(self.cavities):
            raise ValueError(
                f"got {len(shares)} shares of the pressure, expected one for each of "
                f"{len(self.cavities)} cavities"
            )
        part = copy(self)
        part._shares = np.array(shares, dtype=float)
        return part

    def pressures_kPa(self, pressure_kPa: Pressure) -> np.ndarray:
        """Pressure of each cavity [kPa], (cavity,), of one for all or of each one's own.

        Raises:
            ValueError: As many as there are cavities were expected.
        """
        given = np.asarray(pressure_kPa, dtype=float)
        if given.ndim == 0:
            return given * self._shares
        if given.shape != self._shares.shape:
            raise ValueError(
                f"pressure_kPa has shape {given.shape}, expected one for all or "
                f"{self._shares.shape}, one for each cavity"
            )
        return given

    def damped(self, factor: float) -> PartModel:
        """The same part with the stiffness of every branch that relaxes times a factor."""
        if self.branches is None or factor == 1.0:
            return self
        part = copy(self)
        vars(part).pop("compiled", None)  # made of the branches
        part.branches = replace(self.branches, series=self.branches.series.scaled(factor))
        return part

    @property
    def rest_nodes(self) -> np.ndarray:
        """Positions at rest [mm], (node, 3)."""
        return self.mesh.nodes

    @property
    def node_count(self) -> int:
        """Number of nodes."""
        return len(self.mesh.nodes)

    @cached_property
    def assembly(self) -> Assembly:
        """Fixed sparsity of the part's matrices."""
        connectivities = [group.connectivity for group in self.element_groups]
        if self.volume_group is not None:
            connectivities.append(self.volume_group.connectivity)
        connectivities += [cavity.triangles for cavity in self.cavities]
        return Assembly(self.node_count, connectivities)

    @cached_property
    def compiled(self) -> CompiledElements | None:
        """The elements in the engine; None where it lacks a law."""
        groups = self.element_groups
        if not CompiledElements.know(groups):
            return None
        volumes, branches = self.volume_group, self.branches
        return CompiledElements(self.assembly, groups, volumes, branches, self.cavities)

    def __getstate__(self) -> dict[str, Any]:
        """Without what the engine holds, which another process makes for itself."""
        return {name: value for name, value in self.__dict__.items() if name != "compiled"}

    @cached_property
    def turns(self) -> NodeTurns:
        """How far the solid turns about its nodes."""
        return NodeTurns(self.rest_nodes, self.mesh.connectivity)

    def internal_force(self, x: np.ndarray, rotation: Rotation = "edge") -> np.ndarray:
        """Elastic force on the nodes [mN], (node, 3).

        Args:
            x: Node positions [mm], (node, 3).
            rotation: Where the elements take their rotation from.
        """
        total = np.zeros((3, self.node_count))
        forces = [
            (group.nodes_by_corner, group.forces_by_corner(x, rotation))
            for group in self.element_groups
        ]
        if self.volume_group is not None:
            group = self.volume_group
            forces.append((group.nodes_by_corner, group.forces_by_corner(x)))
        for nodes, by_corner in forces:
            for axis in range(3):
                values = by_corner[axis].ravel()
                total[axis] += np.bincount(nodes.ravel(), values, self.node_count)
        return total.T

    def elastic_force(self, x: np.ndarray, rotation: Rotation = "edge") -> np.ndarray:
        """`internal_force` by the engine where it knows the elements, to rounding [mN], (node, 3).

        Args:
            x: Node positions [mm], (node, 3).
            rotation: Where the elements take their rotation from.
        """
        if self.compiled is None:
            return self.internal_force(x, rotation)
        return self.compiled.force(x)

    def has_potential(self, rotation: Rotation) -> bool:
        """Whether forces derive from an energy; those of edge-based rotations do not."""
        laws = [group.law for group in self.element_groups]
        return rotation == "polar" or not any(isinstance(law, Corotational) for law in laws)

    def elastic_energy(self, x: np.ndarray) -> float:
        """Stored energy [mN mm]; of corotational elements with polar rotations."""
        of_volume = 0.0 if self.volume_group is None else self.volume_group.energy(x)
        return sum((group.energy(x) for group in self.element_groups), of_volume)

    def stiffness_data(self, x: np.ndarray, rotation: Rotation = "edge") -> np.ndarray:
        """Data of `stiffness`, in the pattern of `assembly`."""
        entries = [stiffness_entries(group, x, rotation) for group in self.element_groups]
        return self.assembly.symmetric_data(entries + self._volume_entries(x, definite=True))

    def stiffness(self, x: np.ndarray, rotation: Rotation = "edge") -> csc_array:
        """The stiffness of the published step [mN/mm], (3 node, 3 node); positive semi-definite.

        Corotational elements: the rotated linear stiffness without geometric term. Other laws:
        their tangent, negative eigenvalues removed. Neither vanishes on the rigid rotation of a
        stressed body.
        """
        return self.assembly.matrix(self.stiffness_data(x, rotation))

    def shape_stiffness(self, x: np.ndarray, rotation: Rotation = "edge") -> csc_array:
        """The solid's share of `stiffness`, without what wholes of elements and membranes resist
        [mN/mm], (3 node, 3 node)."""
        solid = stiffness_entries(self.element_groups[0], x, rotation)
        return self.assembly.matrix(self.assembly.symmetric_data([solid]))

    def objective_stiffness_data(self, x: np.ndarray) -> np.ndarray:
        """Data of `objective_stiffness`, in the pattern of `assembly`."""
        return self.assembly.symmetric_data(
            [objective_stiffness_entries(group, x) for group in self.element_groups]
            + self._volume_entries(x, definite=True)
        )

    def objective_stiffness(self, x: np.ndarray) -> csc_array:
        """Stiffness against deformation only [mN/mm]; zero on every rigid motion."""
        return self.assembly.matrix(self.objective_stiffness_data(x))

    def tangent_data(
        self,
        x: np.ndarray,
        pressure_kPa: Pressure = 0.0,
        rotation: Rotation = "edge",
        definite: bool = False,
        change: np.ndarray | None = None,
    ) -> np.ndarray:
        """Data of `tangent`, in the pattern of `assembly`.

        Args:
            x: Node positions [mm], (node, 3).
            pressure_kPa: Pressure in the cavities, or of each [kPa].
            rotation: Where corotational elements take their rotation from.
            definite: Replace the elements' part by the nearest positive semi-definite matrix and
                leave the pressure's out.
            change: A Newton step that led here [mm], (node, 3), to take the stresses of sheets and
                volumes as it foresaw them (`pneumorph.fem.foreseen_stress`).
        """
        entries = [tangent_entries(group, x, rotation, definite) for group in self.element_groups]
        if change is not None:
            for place, group in enumerate(self.element_groups):
                if group.kind == "membrane":
                    entries[place] += foreseen_stress_entries(group, x, change, rotation)
        entries += self._volume_entries(x, definite, change)
        pressures = self.pressures_kPa(pressure_kPa)
        if pressures.any() and not definite:
            rows, columns = np.triu_indices(9)
            entries += [
                -pressure * cavity.hessian_blocks(x)[:, rows, columns].T
                for pressure, cavity in zip(pressures, self.cavities, strict=True)
            ]
        return self.assembly.symmetric_data(entries)

    def tangent(
        self, x: np.ndarray, pressure_kPa: Pressure = 0.0, rotation: Rotation = "edge"
    ) -> csc_array:
        """-d(elastic force + pressure force)/dx [mN/mm], (3 node, 3 node), nothing left out."""
        if self.has_potential(rotation):
            return self.assembly.matrix(self.tangent_data(x, pressure_kPa, rotation))
        # Edge-based rotations: a matrix without symmetry.
        blocks = [
            (group.connectivity, tangent_matrices(group, x, rotation))
            for group in self.element_groups
        ]
        for entries in self._volume_entries(x):
            blocks.append((self.mesh.connectivity, full_matrices(entries)))
        for pressure, cavity in zip(self.pressures_kPa(pressure_kPa), self.cavities, strict=True):
            if pressure != 0.0:
                blocks.append((cavity.triangles, -pressure * cavity.hessian_blocks(x)))
        return matrix_of_blocks(self.node_count, blocks).tocsc()

    def _volume_entries(
        self, x: np.ndarray, definite: bool = False, change: np.ndarray | None = None
    ) -> list[np.ndarray]:
        """Upper triangles of the volume group's tangent, in a list for `Assembly`."""
        if self.volume_group is None:
            return []
        return [self.volume_group.tangent_entries(x, definite, change)]

    def relaxed(self, x: np.ndarray) -> ViscousState | None:
        """What the solid remembers after a long rest at x; None if it never remembers."""
        return None if self.branches is None else self.branches.relaxed(x)

    def relaxing_force(self, state: ViscousState, x: np.ndarray) -> np.ndarray:
        """Force of the stress that relaxes on the nodes [mN], (node, 3).

        Args:
            state: What the solid remembers, at these positions.
            x: Node positions [mm], (node, 3).
        """
        assert self.branches is not None, "a state is of a part that remembers"
        nodes = self.branches.group.nodes_by_corner.ravel()
        by_corner = self.branches.forces_by_corner(state, x)
        axes = [np.bincount(nodes, each.ravel(), self.node_count) for each in by_corner]
        return np.stack(axes, axis=1)

    def cavity_volumes(self, x: np.ndarray) -> np.ndarray:
        """Volume of each cavity [mm^3], (cavity,)."""
        return np.array([cavity.volume(x) for cavity in self.cavities])

    def cavity_volume(self, x: np.ndarray) -> float:
        """Volume of all cavities [mm^3].

        Raises:
            MeshError: The part has no cavity.
        """
        self._require_cavity()
        return float(self.cavity_volumes(x).sum())

    def pressure_force(self, x: np.ndarray, pressure_kPa: Pressure) -> np.ndarray:
        """Follower load p dV/dx on the nodes [mN], (node, 3).

        Args:
            x: Node positions [mm], (node, 3).
            pressure_kPa: Pressure in the cavities, or of each [kPa].

        Raises:
            MeshError: The part has no cavity.
        """
        self._require_cavity()
        loads = [
            pressure * cavity.gradient(x)
            for pressure, cavity in zip(
                self.pressures_kPa(pressure_kPa), self.cavities, strict=True
            )
        ]
        return sum(loads[1:], loads[0])

    def _require_cavity(self) -> None:
        if not self.cavities:
            raise MeshError("the part has no cavity; name its surface region when making it")
