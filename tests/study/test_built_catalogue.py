"""A catalogue's modules are made once, kept by what they depend on, and found by robots' files."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pneumorph.base.artefact import ArtefactError
from pneumorph.base.executor import ExecutorSettings
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.built_module import SHIPPED_MODULES, BuiltModule
from pneumorph.catalogue.robot_description import RobotDescription
from pneumorph.cli import run
from pneumorph.geometry.face_tie import ATTACHMENT_FACE
from pneumorph.geometry.mesh import Mesh
from pneumorph.reduction.modal_equilibrium import rising_modal_equilibria
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.study import built_catalogue
from pneumorph.study.built_catalogue import Catalogue, build_catalogue
from pneumorph.study.finished_run import FinishedRun
from pneumorph.study.made_mesh import MeshSettings
from pneumorph.study.module_catalogue import read_catalogue, shipped_catalogue

# Two teeth of linear elements, a few equilibria: every stage in seconds.
CATALOGUE = """
[defaults]
leg = "published"
reduced_as = "paper_quick"

[defaults.changes.snapshots.static]
bend_count = 3
bend_pressure_kPa = 60
load_count = 2
load_pressure_kPa = 40
load_limit_mN = 100

[defaults.changes.reduction]
mode_limit = 4

[defaults.mesh]
face_tied = true
leg_mesher = { size_mm = 12.0, grading = 1.0 }

[modules.stub.mesh.leg]
base_plate_mm = [52, 32, 4]
tooth_base_mm = [41, 20, 9]
inner_tooth_count = 2
connector_mm = [18, 2, 2]

[modules.twin.mesh.leg]
base_plate_mm = [52, 32, 4]
tooth_base_mm = [41, 20, 9]
inner_tooth_count = 2
connector_mm = [18, 8, 2]
middle_wall_mm = 2
"""

HERE = ExecutorSettings(process_count=1)
ROBOT = """
name = "four stubs"
catalogue_folder = "built"

[physics]
based_on = "published"

[hub]
shape = "disk"
radius_mm = 50
top_radius_mm = 54.5
height_mm = 18
bottom_mm = 26.9
mass_kg = 0.075

[modules.leg]
catalogue = "stub"

[ring]
location_count = 4
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a catalogue, one of its two modules built, and a robot of it."""
    path = tmp_path_factory.mktemp("catalogue")
    (path / "legs.toml").write_text(CATALOGUE)
    (path / "robot.toml").write_text(ROBOT)
    command = ["catalogue", "build", str(path / "legs.toml"), "--only", "stub", "--json"]
    assert run([*command, "--executor.process-count", "1", "--out", str(path / "built")]) == 0
    return path


def listed(folder: Path, capsys: pytest.CaptureFixture[str]) -> Catalogue:
    command = ["catalogue", "list", str(folder / "legs.toml"), "--out", str(folder / "built")]
    assert run([*command, "--json"]) == 0
    shown = capsys.readouterr().err
    assert "twin" in shown
    assert "not built" in shown
    assert "loaded up to" in shown  # beside the bend at the highest pressure, which is another
    return FinishedRun.read(folder / "built").result(Catalogue)


def test_the_list_says_what_is_built_and_what_is_known_of_it(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = listed(folder, capsys)
    assert (found.module_count, found.built_count, found.not_built) == (2, 1, ("twin",))
    report, shape = found.reports["stub"], found.shapes["stub"]
    part = ReducedPart.load(shape.part)
    assert report.mode_count == part.mode_count == 4
    assert report.mass_g == pytest.approx(1e3 * part.mass, rel=1e-12)
    assert report.reached_kPa == shape.pressure_kPa == 60.0
    assert report.bend_deg > 0.0  # towards the sheet
    assert min(report.snapshot_processor_s, report.reduction_wall_s) > 0.0
    assert (shape.chamber_count, found.shapes["twin"].chamber_count) == (1, 2)
    # As much for its volume as the published leg: 105 g of 43 ml.
    mesh = Mesh.load(Path(shape.part).parent / "mesh.npz")
    assert ATTACHMENT_FACE in mesh.node_sets
    assert report.mass_g == pytest.approx(105.0 / 43072.0 * float(mesh.volumes.sum()), rel=0.01)


def test_its_page_has_every_module(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    listed(folder, capsys)
    out = ["--figure-files", "--out", str(tmp_path)]
    assert run(["report", str(folder / "built"), *out]) == 0
    page = (tmp_path / "page.html").read_text()
    assert "Not built: twin." in page
    assert page.count("<td>stub</td>") == 2


def test_what_is_there_is_not_made_again(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object, **__: object) -> None:
        raise AssertionError("it is made again")

    monkeypatch.setattr(built_catalogue, "reduce_as_asked", refused)
    modules = read_catalogue(folder / "legs.toml")
    modules = built_catalogue.chosen(modules, ("stub",))
    found = build_catalogue(modules, HERE, RunFolder(folder / "built", "catalogue"))
    assert (found.status, found.module_count, found.built_count) == ("completed", 1, 1)


def test_a_build_that_was_stopped_goes_on_with_its_snapshots(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    modules = {"stub": read_catalogue(folder / "legs.toml")["stub"]}
    out = RunFolder(tmp_path / "built", "catalogue")
    inner = out.path / modules["stub"].key

    def stopped(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("pneumorph.study.reduction.reduce_part", stopped)
        with pytest.raises(KeyboardInterrupt):
            build_catalogue(modules, HERE, out)
    assert not (inner / "module.json").exists()
    assert built_catalogue.listed(modules, out).not_built == ("stub",)
    before = {each: each.stat().st_mtime_ns for each in out.path.rglob("*.npz")}
    assert {each.name for each in before} == {"mesh.npz", "bend.npz", "load_0.npz"}
    assert build_catalogue(modules, HERE, out).built_count == 1
    assert {each: each.stat().st_mtime_ns for each in before} == before


def test_another_reduction_takes_the_same_snapshots(folder: Path, tmp_path: Path) -> None:
    """A module with fewer modes lies beside; its name stands for the newer one."""
    text = (folder / "legs.toml").read_text()
    (tmp_path / "legs.toml").write_text(text.replace("mode_limit = 4", "mode_limit = 3"))
    modules = {"stub": read_catalogue(tmp_path / "legs.toml")["stub"]}
    out = RunFolder(tmp_path / "built", "catalogue")
    shutil.copytree(folder / "built", out.path)
    assert built_catalogue.listed(modules, out).built_count == 0
    found = build_catalogue(modules, HERE, out)
    assert found.reports["stub"].mode_count == 3
    assert ReducedPart.load(BuiltModule.find("stub", out.path).part).mode_count == 3
    assert len(list(out.path.rglob("bend.npz"))) == 1
    assert len(list(out.path.rglob("leg.npz"))) == 2


def test_what_is_damaged_is_told_and_what_is_gone_is_made_again(
    folder: Path, tmp_path: Path
) -> None:
    modules = {"stub": read_catalogue(folder / "legs.toml")["stub"]}
    out = RunFolder(tmp_path / "built", "catalogue")
    inner = out.path / modules["stub"].key
    shutil.copytree(folder / "built", out.path)
    kept = (inner / "leg.npz").read_bytes()
    (inner / "leg.npz").unlink()
    assert build_catalogue(modules, HERE, out).built_count == 1
    assert len((inner / "leg.npz").read_bytes()) == pytest.approx(len(kept), rel=0.01)
    report = (inner / "module.json").read_text()
    for damaged, told in (
        ('{"format_version": 1, "mass_g": 3.0}', "cannot be read .*reached_kPa"),
        ('{"mass_g": 3.0}', "format version None, expected 1"),
    ):
        (inner / "module.json").write_text(damaged)
        found = built_catalogue.listed(modules, out)
        assert found.not_built == ("stub",)
        assert re.search(rf"module\.json .*{told}", found.failures["stub"])
    assert build_catalogue(modules, HERE, out).status == "completed"
    assert json.loads((inner / "module.json").read_text()).keys() == json.loads(report).keys()


def test_one_that_cannot_be_built_does_not_end_the_others(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object, **__: object) -> None:
        raise ValueError("it folds at 50 kPa")

    monkeypatch.setattr(built_catalogue, "reduce_as_asked", refused)
    modules = read_catalogue(folder / "legs.toml")
    out = RunFolder(tmp_path / "built", "catalogue")
    found = build_catalogue(modules, HERE, out)
    assert found.failures == {"stub": "it folds at 50 kPa", "twin": "it folds at 50 kPa"}
    assert found.status == "some modules could not be built"
    assert built_catalogue.listed(modules, out).failures == found.failures
    with pytest.raises(ValueError, match=r"only names module 'stump', expected .* stub, twin"):
        built_catalogue.chosen(modules, ("stump",))


def test_a_robots_file_names_a_module(folder: Path) -> None:
    """Reduced and as finite elements, of one mass and mesh, at its attachment face."""
    described = RobotDescription.read(folder / "robot.toml")
    (module,) = described.spec().modules
    module.check_reduction()
    assert module.full.node_mass.sum() == pytest.approx(module.reduced.mass, rel=1e-6)
    assert module.face is not None
    np.testing.assert_allclose(module.face.translation[0], -20.5, atol=1e-6)
    assert module.name == "leg"


def test_a_module_that_is_not_built_names_its_command(folder: Path, tmp_path: Path) -> None:
    path = folder / "other.toml"
    path.write_text(ROBOT.replace('"stub"', '"twin"'))
    command = r"there are .*stub.* catalogue build \[FILE\] --only twin --out .*built, where"
    with pytest.raises(FileNotFoundError, match=command):
        RobotDescription.read(path).spec()
    path.write_text(ROBOT.replace('"stub"', '"two_chamber"'))
    with pytest.raises(FileNotFoundError, match=r"modules\.leg: .* did you mean two_chambers\?"):
        RobotDescription.read(path).spec()
    path.write_text(ROBOT.replace('"stub"', '"stub"\nleg = "published"'))
    with pytest.raises(ArtefactError, match="leg is given beside catalogue = 'stub'"):
        RobotDescription.read(path)


def test_a_damaged_pointer_is_told_by_its_file(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "robot.toml").write_text(ROBOT)
    (tmp_path / "built" / "modules").mkdir(parents=True)
    pointer = tmp_path / "built" / "modules" / "stub.json"
    content = json.loads((folder / "built" / "modules" / "stub.json").read_text())
    del content["materials"]
    pointer.write_text(json.dumps(content))
    with pytest.raises(ArtefactError, match=r"stub\.json cannot be read \(materials is missing\)"):
        RobotDescription.read(tmp_path / "robot.toml").spec()
    pointer.write_text(json.dumps({**content, "format_version": 0}))
    with pytest.raises(ArtefactError, match="format version 0, expected 1"):
        RobotDescription.read(tmp_path / "robot.toml").spec()


def test_a_measured_leg_is_meshed_as_the_one_that_ships(tmp_path: Path) -> None:
    """Where a catalogue does not say how."""
    text = shipped_catalogue().read_text()
    before, _, after = text.partition("[defaults.mesh]")
    (tmp_path / "legs.toml").write_text(before + after[after.index("[modules.") :])
    found = read_catalogue(tmp_path / "legs.toml")
    assert {name: each.key for name, each in found.items()} == {
        name: each.key for name, each in read_catalogue(shipped_catalogue()).items()
    }


def test_the_key_is_of_all_that_a_module_depends_on(tmp_path: Path) -> None:
    def keys(text: str) -> dict[str, str]:
        (tmp_path / "legs.toml").write_text(text)
        return {n: each.key for n, each in read_catalogue(tmp_path / "legs.toml").items()}

    usual = keys(CATALOGUE)
    assert usual["stub"] != usual["twin"]
    (tmp_path / "legs.toml").write_text(
        CATALOGUE.replace("mode_limit = 4", 'mode_limit = 4\nrotation = "edge"')
    )
    # With another rotation robots walk in another physics, too.
    edge = read_catalogue(tmp_path / "legs.toml")["stub"].snapshot_key
    (tmp_path / "legs.toml").write_text(CATALOGUE)
    assert edge != read_catalogue(tmp_path / "legs.toml")["stub"].snapshot_key
    assert keys(CATALOGUE.replace("modules.stub", "modules.stump"))["stump"] == usual["stub"]
    for old, new in (
        ("size_mm = 12.0", "size_mm = 11.0"),
        ("face_tied = true", "face_tied = false"),
        ("inner_tooth_count = 2", "inner_tooth_count = 2\nchamber_mm = [2, 12, 13]"),
        ('leg = "published"', 'leg = "hyperelastic"'),
        ("mode_limit = 4", "mode_limit = 5"),
        ("load_count = 2", "load_count = 3"),
        ("[defaults.mesh]", "[defaults.changes.materials]\nmass_kg = 0.05\n[defaults.mesh]"),
    ):
        assert old in CATALOGUE
        other = keys(CATALOGUE.replace(old, new))
        assert not set(other.values()) & set(usual.values()), new
    # Where snapshots are computed decides nothing.
    executor = "[defaults.changes.snapshots.executor]\nprocess_count = 1\n[defaults.mesh]"
    assert keys(CATALOGUE.replace("[defaults.mesh]", executor)) == usual


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("mode_limit", "mode_limits", r"module stub: unknown setting reduction\.mode_limits"),
        ("inner_tooth_count = 2", "inner_tooth_count = 0", "module stub: .*inner_tooth_count"),
        ('"paper_quick"', '"fast"', "reduced_as is 'fast', expected a preset of reduce: measured"),
        ('"paper_quick"', '"quick"', "'quick', a preset of the measured physics, .* paper_quick"),
        ("[modules.stub", '[modules."a/b"', "module a/b: expected a name of letters"),
        ("[defaults.changes.reduction]", "[default]", r"tables \[modules.NAME\].*also default"),
        ("face_tied = true", 'file = "leg.msh"', "modules of a catalogue are parametric legs"),
        ("mode_limit = 4", 'mode_limit = 4\n[defaults.changes.leg]', "expected leg as a field"),
        ("mode_limit = 4", 'mode_limit = 4\n[defaults.changes.walked]', "not by what files of"),
    ],
)  # fmt: skip
def test_a_bad_catalogue_is_told_by_file_and_module(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    assert old in CATALOGUE
    path = tmp_path / "legs.toml"
    path.write_text(CATALOGUE.replace(old, new))
    with pytest.raises(ArtefactError, match=rf"catalogue .*legs\.toml.*{message}"):
        read_catalogue(path)


def test_the_catalogue_that_ships_is_of_the_measured_physics() -> None:
    """Two lengths by two widths and one of two chambers, tied and meshed as the leg that ships."""
    modules = read_catalogue(shipped_catalogue())
    single = [each.mesh.leg for each in modules.values() if each.mesh.leg.middle_wall_mm == 0.0]
    lengths, widths = ({leg.base_plate_mm[axis] for leg in single} for axis in (0, 1))
    sizes = {leg.base_plate_mm[:2] for leg in single}
    assert sizes == {(length, width) for length in lengths for width in widths}
    assert min(len(lengths), len(widths)) >= 2
    assert len(modules) > len(single)
    for each in modules.values():
        assert (each.leg, each.mesh.quadratic, each.mesh.face_tied) == ("measured", True, True)
        assert each.options().materials.relaxation.weights
        assert each.options().masses.model == "cast"


@pytest.mark.parametrize("name", read_catalogue(shipped_catalogue()))
def test_a_module_ships_as_its_catalogue_has_it(name: str, tmp_path: Path) -> None:
    """Another law, shape or setting asks for it to be built again:
    `pneumorph catalogue build --only NAME`, then its folder into pneumorph/data/catalogue.
    """
    module = read_catalogue(shipped_catalogue())[name]
    assert (SHIPPED_MODULES / module.key / "leg.npz").exists()
    found = built_catalogue.listed({name: module}, RunFolder(tmp_path, "catalogue"))
    report = found.reports[name]
    assert report.bend_error_percent < 1.0
    assert report.blocked_error_percent is not None
    assert report.blocked_error_percent < 3.0
    built = BuiltModule.find(name, tmp_path)
    assert built.shape == module.mesh.leg
    # Nothing is made again, and nothing is written where it would be.
    build_catalogue({name: module}, ExecutorSettings(), RunFolder(tmp_path, "catalogue"))
    assert not (tmp_path / module.key).exists()


def test_what_ships_is_built_where_that_is_asked_for(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    asked = []

    def meshed(kind: str, mesh: MeshSettings, inner: RunFolder) -> None:
        asked.append((kind, mesh.leg))
        raise ValueError("meshed in earnest")

    monkeypatch.setattr(built_catalogue, "make_mesh", meshed)
    module = read_catalogue(shipped_catalogue())["short_wide"]
    folder = RunFolder(tmp_path, "catalogue")
    found = build_catalogue({"short_wide": module}, ExecutorSettings(), folder, shipped=True)
    assert asked == [("leg", module.mesh.leg)]
    assert found.status == "some modules could not be built"


def test_a_robot_of_legs_that_ship_bends_to_both_sides(tmp_path: Path) -> None:
    """`examples/two_chambers.toml` needs nothing built; its left chamber alone bends a leg
    to the right, and the right one as far to the left."""
    path = Path(__file__).parent.parent.parent / "examples" / "two_chambers.toml"
    described = replace(RobotDescription.read(path), catalogue_folder=tmp_path)
    (module,) = described.spec().modules
    part = module.reduced
    assert part.cavity_count == 2
    module.check_reduction()
    end = module.full.mesh.node_set("outer_end_face")

    def inflated(side: Sequence[float]) -> np.ndarray:
        rising = np.outer(np.arange(10.0, 61.0, 10.0), side)
        *_, reached = rising_modal_equilibria(part, rising, "polar")
        assert reached.converged
        moved: np.ndarray = part.positions(reached.alpha)[end]
        return moved

    left, right = inflated([1.0, 0.0]), inflated([0.0, 1.0])
    aside = left[:, 1].mean()
    assert aside < -0.5
    # Mirror images to the error of the reduction, a percent of the bend.
    assert right[:, 1].mean() == pytest.approx(-aside, rel=1e-2)
    sunk = left[:, 2].mean() - part.rest_nodes[end, 2].mean()
    assert right[:, 2].mean() - left[:, 2].mean() == pytest.approx(0.0, abs=1e-2 * abs(sunk))
