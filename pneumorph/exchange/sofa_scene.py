"""A SOFA scene of a reduced leg, for the plugins SoftRobots and ModelOrderReduction.

The leg is held at its attachment, by springs on its modes where its mount gives way, and inflated
by a pressure that follows a staircase. Units are the house's: mm, kg, s, mN, kPa.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pneumorph.base.artefact import write_text
from pneumorph.exchange.sofa_reduction import mounted_modes, write_sofa_reduction
from pneumorph.fem.part_model import PartModel
from pneumorph.geometry.region_names import cavity_regions
from pneumorph.geometry.surface import write_stl
from pneumorph.physics.physics import Physics
from pneumorph.reduction.reduced_part import SAME_MASS, ReducedPart

SCENE_FILE = "scene.py"

_SCENE = '''"""A reduced leg, held at its attachment and inflated; made by pneumorph.

runSofa -l SofaPython3 scene.py
"""

import os

import Sofa

HERE = os.path.dirname(os.path.abspath(__file__))
DATA = os.path.join(HERE, "data")
MODES = os.path.join(DATA, "modes.txt")
MODE_COUNT = {mode_count}
MOUNT_STIFFNESS = {mount_stiffness}  # of each mode
PLUGINS = [
    "SoftRobots",
    "ModelOrderReduction",
    "Sofa.Component.AnimationLoop",
    "Sofa.Component.Constraint.Lagrangian.Correction",
    "Sofa.Component.Constraint.Lagrangian.Solver",
    "Sofa.Component.IO.Mesh",
    "Sofa.Component.LinearSolver.Direct",
    "Sofa.Component.Mapping.Linear",
    "Sofa.Component.Mass",
    "Sofa.Component.ODESolver.Backward",
    "Sofa.Component.SolidMechanics.FEM.Elastic",
    "Sofa.Component.SolidMechanics.Spring",
    "Sofa.Component.StateContainer",
    "Sofa.Component.Topology.Container.Constant",
    "Sofa.Component.Topology.Container.Dynamic",
]


class Staircase(Sofa.Core.Controller):
    """Raises the pressure by 20 kPa (simulated) every three seconds."""

    def __init__(self, pressure, time_step):
        Sofa.Core.Controller.__init__(self)
        self.pressure, self.time_step, self.steps = pressure, time_step, 0

    def onAnimateBeginEvent(self, event):
        self.steps += 1
        self.pressure.value = [20.0 * int(self.steps * self.time_step / 3.0)]


def hyper_reduced(name):
    return dict(
        nbModes=MODE_COUNT,
        performECSW=True,
        modesPath=MODES,
        RIDPath=os.path.join(DATA, name + "_RID.txt"),
        weightsPath=os.path.join(DATA, name + "_weight.txt"),
    )


def createScene(root):
    root.dt = {time_step}
    root.gravity = [0.0, 0.0, -{gravity}]
    for plugin in PLUGINS:
        root.addObject("RequiredPlugin", name=plugin)
    root.addObject("FreeMotionAnimationLoop")
    root.addObject("GenericConstraintSolver", tolerance=1e-8, maxIterations=250)

    solver = root.addChild("solver")
    solver.addObject(
        "EulerImplicitSolver", rayleighStiffness={stiffness_damping}, rayleighMass={mass_damping}
    )
    solver.addObject("SparseLDLSolver", template="CompressedRowSparseMatrixd")
    solver.addObject("GenericConstraintCorrection")
    solver.addObject(
        "MechanicalMatrixMapperMOR",
        template="Vec1d,Vec1d",
        object1="@./reduced/modes",
        object2="@./reduced/modes",
        nodeToParse="@./reduced/leg",
    )
    reduced = solver.addChild("reduced")
    reduced.addObject(
        "MechanicalObject", template="Vec1d", name="modes", position=[0.0] * MODE_COUNT
    )
    if any(MOUNT_STIFFNESS):
        reduced.addObject(
            "RestShapeSpringsForceField",
            template="Vec1d",
            name="mount",
            points=list(range(MODE_COUNT)),
            stiffness=MOUNT_STIFFNESS,
        )
    leg = reduced.addChild("leg")
    leg.addObject("MeshVTKLoader", name="loader", filename=os.path.join(HERE, "leg.vtk"))
    leg.addObject("TetrahedronSetTopologyContainer", src="@loader", name="tetrahedra")
    leg.addObject("MechanicalObject", name="nodes", template="Vec3d")
    leg.addObject("UniformMass", totalMass={mass})
    leg.addObject(
        "HyperReducedTetrahedronFEMForceField",
        name="silicone",
        template="Vec3d",
        method="large",
        youngModulus={young},
        poissonRatio={poisson},
        **hyper_reduced("tetrahedra"),
    )
    leg.addObject(
        "ModelOrderReductionMapping", input="@../modes", output="@./nodes", modesPath=MODES
    )
    sheet = leg.addChild("sheet")
    sheet.addObject("MeshVTKLoader", name="loader", filename=os.path.join(HERE, "sheet.vtk"))
    sheet.addObject("TriangleSetTopologyContainer", src="@loader", name="triangles")
    sheet.addObject(
        "HyperReducedTriangleFEMForceField",
        name="sheet",
        template="Vec3d",
        method="large",
        youngModulus={sheet_young},
        poissonRatio={sheet_poisson},
        thickness={sheet_thickness},
        **hyper_reduced("membrane"),
    )
    cavity = leg.addChild("cavity")
    cavity.addObject("MeshSTLLoader", name="loader", filename=os.path.join(HERE, "cavity.stl"))
    cavity.addObject("MeshTopology", src="@loader")
    cavity.addObject("MechanicalObject")
    pressure = cavity.addObject(
        "SurfacePressureConstraint", name="pressure", value=[0.0], valueType="pressure"
    )
    cavity.addObject("BarycentricMapping", mapForces=False, mapMasses=False)
    root.addObject(Staircase(pressure, {time_step}))
'''


def export_sofa_scene(
    folder: Path, part: ReducedPart, model: PartModel, physics: Physics | None = None
) -> Path:
    """Write a scene script, the meshes and the reduction into a folder.

    Args:
        folder: Where to write.
        part: The reduced leg, whose mass and materials the scene has.
        model: Finite elements of its mesh: one solid, one membrane, one cavity of whatever name.
        physics: Time step, damping and gravity of the scene; None for the paper's.

    Returns:
        The scene's path.

    Raises:
        ArtefactError: The part was reduced from another mesh.
        ValueError: The model or the part has no membrane, the model not one cavity, or elements
            that the scene's force fields have not; or the part's mass is not the same at every
            node. Nothing is written.
    """
    physics = physics or Physics()
    part.check_mesh(model.mesh)
    if model.mesh.edge_nodes is not None:
        raise ValueError(
            "the part is of 10-node tetrahedra (it is sampled at their integration points), "
            "expected linear ones, as `pneumorph mesh --preset paper` makes them: SOFA's force "
            "fields of the scene know no other"
        )
    if not model.membranes:
        raise ValueError("the model has no membrane, expected a leg with its sheet")
    if len(part.membrane_index) == 0:
        raise ValueError(
            "the part has no membrane though its model has one, expected sampled elements of its "
            "sheet: it may have been reduced without them"
        )
    mesh = model.mesh
    cavities = cavity_regions(mesh)
    if len(cavities) != 1:
        raise ValueError(
            f"the leg has {len(cavities)} cavities{': ' * bool(cavities)}{', '.join(cavities)}, "
            "expected one: the scene has one pressure"
        )
    _check_even_mass(part)
    sheet = mesh.surface(model.membranes[0].surface)
    counts = {"tetrahedra": len(mesh.tetrahedra), "membrane": len(sheet)}
    write_sofa_reduction(folder / "data", part, counts)
    _write_vtk(folder / "leg.vtk", mesh.nodes, mesh.tetrahedra, 10)
    _write_vtk(folder / "sheet.vtk", mesh.nodes, sheet, 5)
    write_stl(folder / "cavity.stl", mesh.nodes, mesh.surface(cavities[0]))
    text = _SCENE.format(
        mode_count=part.mode_count,
        mount_stiffness=[float(f"{value:.9g}") for value in mounted_modes(part)[1]],
        time_step=physics.time_step_s,
        gravity=physics.gravity_mm_per_s2,
        stiffness_damping=physics.stiffness_damping_s,
        mass_damping=physics.mass_damping_per_s,
        mass=float(part.mass),
        young=part.tetrahedron_material.young_modulus_kPa,
        poisson=part.tetrahedron_material.poisson_ratio,
        sheet_young=part.membrane_material.young_modulus_kPa,
        sheet_poisson=part.membrane_material.poisson_ratio,
        sheet_thickness=float(f"{_sheet_thickness_mm(part, mesh.nodes[sheet]):.9g}"),
    )
    return write_text(folder / SCENE_FILE, text)


def _check_even_mass(part: ReducedPart) -> None:
    """Refuse a part whose modes are not orthonormal in the scene's mass, the same at every node.

    Raises:
        ValueError: They are not.
    """
    modes = part.modes.reshape(-1, part.mode_count).astype(float)
    masses = part.mass / len(part.rest_nodes) * (modes.T @ modes)
    off = float(np.abs(masses - np.eye(part.mode_count)).max())
    if off > SAME_MASS:
        raise ValueError(
            f"the part's modes have masses up to {off:.2g} off one if each node has the same mass, "
            f"expected {SAME_MASS:g} or less: the scene has a UniformMass. The part may have been "
            "reduced with --materials.mass-lumping volume; reduce it with `even`"
        )


def _sheet_thickness_mm(part: ReducedPart, corners_mm: np.ndarray) -> float:
    """Thickness of a part's sheet, of which a part keeps weight times area times thickness [mm].

    Args:
        part: The part.
        corners_mm: Corners of all triangles of its sheet [mm], (triangle, 3, 3).
    """
    first, second, third = corners_mm[part.membrane_index].swapaxes(0, 1)
    areas = 0.5 * np.linalg.norm(np.cross(second - first, third - first), axis=1)
    return float(part.membrane_measure.sum() / (part.membrane_weight @ areas))


def _write_vtk(path: Path, nodes: np.ndarray, cells: np.ndarray, cell_type: int) -> None:
    """Write nodes and cells of one type as a legacy VTK file; nodes and cells keep their order."""
    count, corners = cells.shape
    lines = ["# vtk DataFile Version 2.0", "pneumorph, millimetres", "ASCII"]
    lines += ["DATASET UNSTRUCTURED_GRID", f"POINTS {len(nodes)} double"]
    lines += [" ".join(repr(float(v)) for v in node) for node in nodes]
    lines.append(f"CELLS {count} {count * (corners + 1)}")
    lines += [" ".join(map(str, (corners, *cell))) for cell in cells]
    lines.append(f"CELL_TYPES {count}")
    lines += [str(cell_type)] * count
    write_text(path, "\n".join(lines) + "\n")
