"""A robot's file that is in nothing like the paper's: legs of two chambers in two sizes at four
sites, on five regulators."""

from __future__ import annotations

from pathlib import Path

from helpers.synthetic_part import synthetic_mesh, vibration_modes
from pneumorph.fem.material import Material, Membrane
from pneumorph.fem.part_model import PartModel
from pneumorph.reduction.assemble import assemble_reduced_part

DESIGN = "1+2.3.b4+5.3"

_FILE = f"""
name = "two chambers"
[physics]
based_on = "published"
regulator_count = 5
damping = "objective"
floor_height_mm = -20.0
pressure_map = {{ slope = 1.5, intercept_kPa = 2.0 }}
[hub]
shape = "box"
length_mm = 60
width_mm = 60
height_mm = 16
bottom_mm = 0
density_g_per_ml = 0.6
[modules.long]
part = "leg.npz"
mesh = "mesh.npz"
mass_g = 40
[modules.short]
part = "leg.npz"
mesh = "mesh.npz"
mass_g = 25
size_factor = 0.8
[[sites]]
position_mm = [30, 0, 8]
pitch_deg = 10
[[sites]]
position_mm = [0, 30, 8]
yaw_deg = 90
pitch_deg = 10
modules = ["long"]
[[sites]]
position_mm = [-30, 0, 8]
yaw_deg = 180
pitch_deg = 10
[[sites]]
position_mm = [0, -30, 8]
yaw_deg = -90
pitch_deg = 10
modules = ["long"]
[designs]
mirror = false
usual = "{DESIGN}"
options = ["0 *+* b*+*", "0 *", "0 *+* b*+*", "0 *"]
"""


def write_described_robot(folder: Path) -> Path:
    """Write the robot's file with its leg's mesh and reduced part beside it; return the file."""
    mesh = synthetic_mesh((8, 4, 4), wall=4)
    sheet = Membrane("sheet", Material(2320.0, 0.49), 1.0)
    part = PartModel(mesh, Material(1160.0, 0.2), 0.04, (sheet,), ("cavity", "cavity_outer"))
    mesh.save(folder / "mesh.npz")
    assemble_reduced_part(part, vibration_modes(part, 4)).save(folder / "leg.npz")
    path = folder / "robot.toml"
    path.write_text(_FILE)
    return path
