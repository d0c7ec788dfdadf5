"""How far the printed hub gives way under its legs, beside what the legs themselves give."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from scipy.sparse.linalg import splu

from pneumorph.base.checked import Bounds, Checked, Positive
from pneumorph.fabrication.leg_place import end_face_mm, leg_pose
from pneumorph.fem.free_body import free_body_displacements, rigid_motions
from pneumorph.fem.material import Material
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.mounting import RadialMounting
from pneumorph.geometry.netgen_mesher import MesherSettings, tetrahedralise
from pneumorph.geometry.pneunet import PneuNetShape
from pneumorph.geometry.quadratic import quadratic_mesh
from pneumorph.geometry.surface import boundary_triangles


@dataclass(frozen=True)
class HubCheckSettings(Checked):
    """How --check-hub computes the hub's deflection with finite elements."""

    young_modulus_kPa: Positive = 2.3e6
    """Young's modulus of the printed material [kPa]; the default is the low end for PLA."""
    poisson_ratio: Annotated[float, Bounds(least=0.0, below=0.5)] = 0.35
    """Poisson's ratio of the printed material."""
    size_mm: Positive = 5.0
    """Largest edge of the quadratic elements [mm]."""
    force_over_weight: Positive = 1.5
    """Largest force on a leg's outer end, in any direction, relative to the robot's weight. It was
    1.3 at most in simulated walks of learned robots: one leg carries everything and slides."""
    gravity_mm_per_s2: Positive = 9800.0
    """Gravity [mm/s^2]."""

    def largest_force_mN(self, robot_mass_kg: float) -> float:
        """Bound of the force on a leg's outer end [mN]."""
        return self.force_over_weight * robot_mass_kg * self.gravity_mm_per_s2


def hub_model(hub: Any, mass_kg: float, settings: HubCheckSettings | None = None) -> PartModel:
    """Quadratic finite elements of a printed hub.

    Args:
        hub: OpenCASCADE solid, in the robot's frame.
        mass_kg: Its mass [kg].
        settings: What it is printed of, and how finely to mesh.
    """
    settings = settings or HubCheckSettings()
    material = Material(settings.young_modulus_kPa, settings.poisson_ratio)
    nodes, tetrahedra = tetrahedralise(hub, MesherSettings(settings.size_mm, grading=0.9))
    mesh = Mesh(nodes, tetrahedra, {"skin": boundary_triangles(tetrahedra)})
    return PartModel(quadratic_mesh(mesh), material, mass_kg, mass_lumping="volume")


def mount_compliance(
    hub: PartModel, leg: PneuNetShape, mounting: RadialMounting, location: int = 0
) -> np.ndarray:
    """Motion of every mount of a free hub under unit loads on one of them.

    A leg's load is spread over the face behind its end tooth as a traction that is linear in the
    place; a mount's motion is the mean over its face that does work on it.

    Args:
        hub: Finite elements of the hub, in the robot's frame.
        leg: The leg.
        mounting: Where legs sit.
        location: The mount that is loaded.

    Returns:
        Translation [mm] and turn [rad] of each mount, (location, 6, 6), along the axes of its own
        leg and about the middle of its face, for a unit force [1/mN] and a unit moment
        [1/(mN mm)] on the loaded one.
    """
    faces = [_face(hub, leg, mounting, k) for k in range(mounting.location_count)]
    nodes, spread = faces[location]
    forces = np.zeros((hub.node_count, 3, 6))
    forces[nodes] = spread
    moved = free_body_displacements(hub, forces)
    return np.stack([np.einsum("pir,pic->rc", spread, moved[nodes]) for nodes, spread in faces])


def _face(
    hub: PartModel, leg: PneuNetShape, mounting: RadialMounting, location: int
) -> tuple[np.ndarray, np.ndarray]:
    """Nodes of a mount, (n,), and their forces for six unit loads in the leg's axes, (n, 3, 6)."""
    pose = leg_pose(leg, mounting, location)
    length, width, _ = leg.tooth_base_mm
    bottom, top = leg.base_plate_mm[2], leg.height_mm
    local = pose.inverse().apply(hub.rest_nodes)
    triangles = hub.mesh.surface_connectivity("skin")
    on_face = (
        (np.abs(local[:, 0] + length / 2.0) < 1e-6)
        & (np.abs(local[:, 1]) < width / 2.0 + 1.0)
        & (local[:, 2] > bottom - 1.0)
        & (local[:, 2] < top + 1.0)
    )
    mine = triangles[on_face[triangles].all(axis=1)]
    corners = local[mine[:, :3]]
    areas = 0.5 * np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    # A constant traction on a straight quadratic triangle loads its midside nodes, a third each.
    weight = np.bincount(mine[:, 3:].ravel(), np.repeat(areas / 3.0, 3), hub.node_count)
    nodes = np.flatnonzero(weight)
    motions = rigid_motions(local[nodes], end_face_mm(leg))
    weighted = weight[nodes, None, None] * motions
    gram = np.einsum("pir,pis->rs", motions, weighted)
    spread = weighted @ np.linalg.inv(gram)
    return nodes, np.einsum("ij,pjr->pir", pose.rotation, spread)


@dataclass(frozen=True)
class HubStiffness:
    """What a hub gives at a leg's outer end, where the leg stands on the floor."""

    largest_force_N: float
    """Bound of the force on a leg's outer end [N]."""
    end_moves_mm: float
    """Largest motion of a leg's outer end by the hub alone, under that force in any direction."""
    mount_turns_deg: float
    """Largest turn of the leg's mount under it [degrees]."""
    share_of_leg_percent: float
    """Motion by the hub over that by the leg itself, for the worst direction of the force."""
    share_of_leg_all_loaded_percent: float
    """The same with all legs loaded alike, each in the direction that is worst for this one."""


def hub_stiffness(
    hub: PartModel,
    leg: PartModel,
    shape: PneuNetShape,
    mounting: RadialMounting,
    force_mN: float,
) -> HubStiffness:
    """Compare what the hub gives with what a leg gives.

    Args:
        hub: Finite elements of the hub, in the robot's frame.
        leg: Finite elements of a leg; the stiffest one is the safe side.
        shape: The leg's sizes.
        mounting: Where legs sit.
        force_mN: Largest force on a leg's outer end [mN].
    """
    mounts = mount_compliance(hub, shape, mounting)
    end = np.array([[shape.base_plate_mm[0] / 2.0, 0.0, 0.0]])
    to_end = rigid_motions(end, end_face_mm(shape))[0]  # (3, 6)
    by_leg = leg_end_compliance(leg, shape)
    # Forces in units under which the leg moves by one in each direction.
    root = np.linalg.inv(np.linalg.cholesky(by_leg)).T
    at_ends = np.einsum("ir,krs,js->kij", to_end, mounts, to_end)
    shares = [np.linalg.norm(root.T @ each @ root, 2) for each in at_ends]
    turns = mounts[0, 3:] @ to_end.T
    return HubStiffness(
        largest_force_N=1e-3 * force_mN,
        end_moves_mm=float(force_mN * np.linalg.norm(at_ends[0], 2)),
        mount_turns_deg=float(np.degrees(force_mN * np.linalg.norm(turns, 2))),
        share_of_leg_percent=100.0 * float(shares[0]),
        share_of_leg_all_loaded_percent=100.0 * float(sum(shares)),
    )


def leg_end_compliance(leg: PartModel, shape: PneuNetShape) -> np.ndarray:
    """Motion of a leg's outer lower edge under unit forces on it, the inner tooth face held.

    Args:
        leg: Finite elements of the leg, in its own frame.
        shape: Its sizes.

    Returns:
        Compliance at rest along the leg's axes [mm/mN], (3, 3).
    """
    x, z = leg.rest_nodes[:, 0], leg.rest_nodes[:, 2]
    length, plate = shape.tooth_base_mm[0], shape.base_plate_mm
    held = (np.abs(x + length / 2.0) < 1e-6) & (z > plate[2] - 1e-6)
    edge = np.flatnonzero((np.abs(x - plate[0] / 2.0) < 1e-6) & (np.abs(z) < 1e-6))
    forces = np.zeros((leg.node_count, 3, 3))
    forces[edge] = np.eye(3) / len(edge)
    free = np.flatnonzero(np.repeat(~held, 3))
    stiffness = leg.stiffness(leg.rest_nodes, "polar")
    moved = np.zeros((3 * leg.node_count, 3))
    moved[free] = splu(stiffness[free][:, free].tocsc()).solve(forces.reshape(-1, 3)[free])
    compliance = moved.reshape(-1, 3, 3)[edge].mean(axis=0)
    result: np.ndarray = 0.5 * (compliance + compliance.T)
    return result
