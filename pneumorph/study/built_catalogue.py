"""The modules of a catalogue, meshed and reduced once and kept by what they depend on."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path

from pneumorph.base.artefact import ArtefactError, read_json, reading, write_json
from pneumorph.base.executor import ExecutorSettings, WorkerError
from pneumorph.base.result import result_from_dict, result_to_dict
from pneumorph.base.run_folder import RunFolder
from pneumorph.catalogue.built_module import SHIPPED_MODULES, BuiltModule
from pneumorph.catalogue.leg_kinds import LegName
from pneumorph.reduction.reduced_part import ReducedPart
from pneumorph.study.made_mesh import MESH_FILE, make_mesh
from pneumorph.study.module_catalogue import ParametricModule
from pneumorph.study.reduction import PART_FILE, Reduction
from pneumorph.study.reduction_options import reduce_as_asked

REPORT_FILE = "module.json"
"""What is known of a built module; written when all of it is there."""
REPORT_VERSION = 1
"""Of that file."""
FAILURE_FILE = "failure.json"
"""Why the last attempt to build a module ended without it."""
SNAPSHOT_FOLDER = "snapshots"
"""Modules that differ in their reduction alone have the same snapshots there."""


@dataclass(frozen=True)
class ModuleShape:
    """What a module of a catalogue is, built or not."""

    name: str
    key: str
    """Digest of all that its files depend on."""
    part: str
    """File of the reduced part where it is built, to be given as --part with `mesh`."""
    mesh: str
    """File of its mesh, to be given as --full.mesh."""
    leg: LegName
    """The leg that it is like."""
    length_mm: float
    """Of its base plate."""
    width_mm: float
    tooth_count: int
    """Teeth with a chamber."""
    tooth_width_mm: float
    chamber_count: int
    """Cavities with a pressure of their own."""
    pressure_kPa: float
    """Highest simulated pressure of its free bends."""
    load_pressure_kPa: float
    """Highest simulated pressure of its loads and walks."""
    load_mN: float
    """Highest normal force of its loads."""

    @classmethod
    def of(cls, name: str, module: ParametricModule, folder: Path) -> ModuleShape:
        """That of a module; the folder is that of built modules."""
        folder = _home(module, folder)
        leg, snapshots = module.mesh.leg, module.options().snapshots
        return cls(
            name,
            module.key,
            str(folder / module.key / PART_FILE),
            str(folder / module.key / MESH_FILE),
            module.leg,
            leg.base_plate_mm[0],
            leg.base_plate_mm[1],
            leg.inner_tooth_count,
            leg.tooth_base_mm[1],
            1 if leg.middle_wall_mm == 0.0 else 2,
            snapshots.static.bend_pressure_kPa,
            snapshots.static.load_pressure_kPa,
            snapshots.static.load_limit_mN,
        )


@dataclass(frozen=True)
class ModuleReport:
    """What is known of a module that was built: mass, bend, errors, size and cost."""

    mass_g: float
    reached_kPa: float
    """Highest pressure in all cavities at which it was bent [simulated kPa]."""
    bend_deg: float
    """Bend of its finite elements there."""
    bend_error_percent: float | None
    """As `Reduction` has it, and so are all errors."""
    blocked_error_percent: float | None
    compliance_error_percent: float | None
    heldout_node_error_mm: float | None
    heldout_force_error_percent: float | None
    mode_count: int
    tetrahedron_count: int
    node_count: int
    """Nodes of its finite elements."""
    snapshot_count: int
    part_bytes: int
    snapshot_processor_s: float
    """Processor time of its snapshots."""
    reduction_wall_s: float
    """Wall time of choosing modes and elements, which has one thread."""


@dataclass(frozen=True)
class Catalogue:
    """Which modules there are, and what is known of those that are built."""

    status: str
    """``completed``, or that some could not be built."""
    module_count: int
    built_count: int
    not_built: tuple[str, ...]
    shapes: dict[str, ModuleShape]
    """By name."""
    reports: dict[str, ModuleReport]
    """Of those that are built, by name."""
    failures: dict[str, str]
    """Why modules could not be built, by name."""
    wall_s: float


@dataclass(frozen=True)
class BuildSettings:
    """Which modules to build, and where their snapshots are computed."""

    only: tuple[str, ...] = ()
    """Names of the modules; all by default."""
    shipped: bool = False
    """Also build modules that ship with the package."""
    executor: ExecutorSettings = field(default_factory=ExecutorSettings)
    """Where snapshots are computed."""


def chosen(
    modules: Mapping[str, ParametricModule], only: Sequence[str]
) -> Mapping[str, ParametricModule]:
    """Those of the names, or all without any.

    Raises:
        ValueError: There is no module of a name.
    """
    for name in only:
        if name not in modules:
            raise ValueError(
                f"only names module {name!r}, expected some of the catalogue: {', '.join(modules)}"
            )
    return {name: modules[name] for name in only} if only else modules


def listed(modules: Mapping[str, ParametricModule], folder: RunFolder) -> Catalogue:
    """What is there of a catalogue's modules, and a line of each for a person.

    Args:
        modules: By name, as `read_catalogue` reads them.
        folder: The folder of built modules.
    """
    start = time.monotonic()
    reports, failures = {}, {}
    for name, module in modules.items():
        inner = _home(module, folder.path) / module.key
        try:
            report, failure = _report(inner), _failure(inner)
        except ArtefactError as error:
            report, failure = None, str(error)
        if report is not None:
            reports[name] = report
        if failure is not None:
            failures[name] = failure
            folder.progress.say(f"{name} could not be built: {failure}")
    shapes = {name: ModuleShape.of(name, each, folder.path) for name, each in modules.items()}
    for line in _table(shapes, reports):
        folder.progress.say(line)
    return Catalogue(
        status="some modules could not be built" if failures else "completed",
        module_count=len(modules),
        built_count=len(reports),
        not_built=tuple(name for name in modules if name not in reports),
        shapes=shapes,
        reports=reports,
        failures=failures,
        wall_s=time.monotonic() - start,
    )


def build_catalogue(
    modules: Mapping[str, ParametricModule],
    executor: ExecutorSettings,
    folder: RunFolder,
    shipped: bool = False,
) -> Catalogue:
    """Mesh and reduce the modules that are not there yet; the same call goes on where it stopped.

    Args:
        modules: By name, as `read_catalogue` reads them.
        executor: Where snapshots are computed.
        folder: The folder of built modules.
        shipped: Also build those that ship with the package.

    Raises:
        ValueError: Another process builds there.
    """
    start = time.monotonic()
    with folder.alone():
        for name, module in modules.items():
            failure = folder.path / module.key / FAILURE_FILE
            try:
                _build(name, module, executor, folder, shipped)
                failure.unlink(missing_ok=True)
            except (ValueError, ArithmeticError, WorkerError) as error:  # the others go on
                write_json(failure, {"error": str(error)})
    return replace(listed(modules, folder), wall_s=time.monotonic() - start)


def _build(
    name: str,
    module: ParametricModule,
    executor: ExecutorSettings,
    folder: RunFolder,
    shipped: bool,
) -> None:
    """Make what is missing of one module, its report last, and let its name stand for it."""
    if not shipped and _home(module, folder.path) == SHIPPED_MODULES:
        folder.progress.say(f"{name}: ships with the package; --shipped builds it as well")
        return
    inner = RunFolder(folder.path / module.key, folder.verb, folder.progress, folder.provenance)
    mesh = inner / MESH_FILE
    try:
        report = _report(inner.path)
    except ArtefactError as error:
        folder.progress.say(f"{name}: is made again, since {error}")
        report = None
    if report is None:
        write_json(inner / "made_of.json", module.made_of())
        if not mesh.exists():
            folder.progress.stage(f"{name}: meshing")
            make_mesh("leg", module.mesh, inner)
        folder.progress.say(f"{name}: reducing into {inner.path}")
        options = module.options(mesh)
        options = replace(options, snapshots=replace(options.snapshots, executor=executor))
        made = reduce_as_asked(options, inner, folder.path / SNAPSHOT_FOLDER / module.snapshot_key)
        report = _reported(made)
        content = {"format_version": REPORT_VERSION, **result_to_dict(report)}
        write_json(inner / REPORT_FILE, content)
    else:
        folder.progress.say(f"{name}: is there already, in {inner.path}")
    materials = replace(module.options(mesh).materials, mass_kg=1e-3 * report.mass_g)
    built = BuiltModule(inner / PART_FILE, mesh, module.leg, materials, module.mesh.leg)
    built.save(name, folder.path)


def _home(module: ParametricModule, folder: Path) -> Path:
    """The folder of built modules that has a module, or where it was tried: the given one, unless
    it only ships."""
    there = any((folder / module.key / name).exists() for name in (REPORT_FILE, FAILURE_FILE))
    ships = (SHIPPED_MODULES / module.key / REPORT_FILE).exists()
    return SHIPPED_MODULES if ships and not there else folder


def _reported(made: Reduction) -> ModuleReport:
    part = ReducedPart.load(made.part)
    taken = {
        each.name: getattr(made, each.name)
        for each in fields(ModuleReport)
        if hasattr(made, each.name)
    }
    return ModuleReport(
        **taken,
        mass_g=1e3 * part.mass,
        reached_kPa=made.bend["pressure_kPa"][-1],
        bend_deg=made.bend["full_deg"][-1],
        node_count=len(part.rest_nodes),
        reduction_wall_s=sum(made.stage_seconds.values()),
    )


def _report(folder: Path) -> ModuleReport | None:
    """What is known of a built module; None where it is not complete."""
    path = folder / REPORT_FILE
    if not all((folder / name).exists() for name in (REPORT_FILE, PART_FILE, MESH_FILE)):
        return None
    content = read_json(path, "built module")
    version = content.pop("format_version", None)
    if version != REPORT_VERSION:
        raise ArtefactError(
            f"{path} has format version {version}, expected {REPORT_VERSION}; build it again"
        )
    with reading(path, "built module"):
        return result_from_dict(ModuleReport, content)


def _failure(folder: Path) -> str | None:
    """Why a module could not be built; None where nobody tried, or it is there."""
    path = folder / FAILURE_FILE
    if not path.exists():
        return None
    return str(read_json(path, "failure of a module").get("error", "for no reason that was kept"))


def _table(shapes: Mapping[str, ModuleShape], reports: Mapping[str, ModuleReport]) -> Sequence[str]:
    """A line for each module, under a heading."""
    rows = [_HEADING]
    for name, shape in shapes.items():
        report = reports.get(name)
        rows.append(
            [name, f"{shape.length_mm:g} x {shape.width_mm:g}", str(shape.chamber_count)]
            + (["not built"] if report is None else _numbers(shape, report))
        )
    widths = [max(len(row[place]) for row in rows if place < len(row)) for place in range(_COLUMNS)]
    return ["  ".join(f"{cell:{width}}" for cell, width in zip(row, widths, strict=False)).rstrip()
            for row in rows]  # fmt: skip


_HEADING = [
    "module", "plate mm", "chambers", "mass g", "bend", "bend error %", "blocked %", "compliance %",
    "loaded up to", "modes", "points", "MB",
]  # fmt: skip
_COLUMNS = len(_HEADING)


def _numbers(shape: ModuleShape, report: ModuleReport) -> list[str]:
    def shown(value: float | None) -> str:
        return "-" if value is None else f"{value:.2g}"

    return [
        f"{report.mass_g:.1f}",
        f"{report.bend_deg:.0f} deg at {report.reached_kPa:g} kPa",
        shown(report.bend_error_percent),
        shown(report.blocked_error_percent),
        shown(report.compliance_error_percent),
        f"{shape.load_pressure_kPa:g} kPa, {1e-3 * shape.load_mN:g} N",
        str(report.mode_count),
        str(report.tetrahedron_count),
        f"{1e-6 * report.part_bytes:.1f}",
    ]
