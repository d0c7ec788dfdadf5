"""What of the options of a mesh would be ignored is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from pneumorph.base.run_folder import RunFolder
from pneumorph.geometry.disk import DiskShape
from pneumorph.geometry.netgen_mesher import MesherSettings
from pneumorph.geometry.pneunet import PneuNetShape
from pneumorph.study.made_mesh import MEASURED_LEG, MeshSettings, make_mesh

BESIDE = MeshSettings(file=Path("own_leg.msh"))


@pytest.mark.parametrize(
    ("settings", "flag"),
    [
        (replace(BESIDE, leg=replace(PneuNetShape(), tooth_height_mm=9.0)), r"--leg\.\*"),
        (replace(BESIDE, disk=replace(DiskShape(), height_mm=9.0)), r"--disk\.\*"),
        (replace(BESIDE, leg_mesher=MesherSettings(size_mm=3.0)), r"--leg-mesher\.\*"),
        (replace(BESIDE, disk_mesher=MesherSettings(size_mm=9.0)), r"--disk-mesher\.\*"),
    ],
)
def test_a_shape_or_mesher_beside_a_file_is_refused(
    settings: MeshSettings, flag: str, tmp_path: Path
) -> None:
    """Before the file is read: there is none of this name."""
    with pytest.raises(ValueError, match=rf"{flag} has no effect on the mesh of own_leg\.msh"):
        make_mesh("leg", settings, RunFolder(tmp_path / "m", "mesh"))
    assert not (tmp_path / "m").exists()
    replace(settings, file=None).refuse_unused()


def test_what_changes_the_mesh_of_a_file_is_taken() -> None:
    """A mesher's settings are the usual preset's, which nobody need have asked for."""
    preset = MeshSettings(**MEASURED_LEG)
    replace(preset, file=BESIDE.file, scale=1000.0, quadratic=True).refuse_unused()
