"""Everything that decides the reduction of a leg, as the settings of its run hold it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from pneumorph.base.checked import Checked, Positive
from pneumorph.base.run_folder import RunFolder
from pneumorph.base.settings import laid_over, settings_from_dict, settings_to_dict
from pneumorph.catalogue.hub_spec import HubModel
from pneumorph.catalogue.leg_kinds import (
    HYPERELASTIC_MATERIALS,
    MEASURED_MATERIALS,
    LegName,
    leg_kind,
    paper_leg_mesh,
)
from pneumorph.catalogue.leg_module import module_of_leg
from pneumorph.catalogue.masses import CastDensities, Masses
from pneumorph.catalogue.older_names import with_current_leg
from pneumorph.catalogue.paper_robot import paper_robot
from pneumorph.fem.material import LAWS_OF_HOOKES_CONSTANTS, YEOH_RATIOS, LegMaterials
from pneumorph.fem.silicones import silicone
from pneumorph.geometry.mesh import Mesh
from pneumorph.reduction.collect import SnapshotSettings
from pneumorph.reduction.ecsw import EcswSettings
from pneumorph.reduction.reduction_settings import ReductionSettings
from pneumorph.reduction.static_snapshots import StaticSnapshotSettings
from pneumorph.reduction.walk_snapshots import WalkSnapshotSettings
from pneumorph.study.gait_walks import GaitWalkSettings
from pneumorph.study.reduce_settings import ReduceSettings, learned_settings, shipped_settings
from pneumorph.study.reduction import Reduction, reduce


@dataclass(frozen=True)
class ReduceOptions(Checked):
    """The leg, its snapshots, and how to reduce it."""

    leg: LegName = "published"
    """A leg that ships: its mesh is reduced if no --mesh is given, and robots walk in its physics.
    Brings all of the preset that made it."""
    mesh: Path | None = None
    """Mesh of the leg, as `pneumorph mesh` writes it."""
    silicone: str | None = None
    """What a leg of the measured physics is cast of, by the supplier's name, such as "Ecoflex
    00-30": sets its law (--materials.silicone) and density, and all pressures and forces of the
    snapshots in proportion to its modulus. By default the preset's."""
    largest_pressure_kPa: Positive | None = None
    """Largest pressure that the leg is driven with [kPa], to which the preset's loads and walks go
    (100 in the measured physics, of another silicone than Dragon Skin 30 in proportion to its
    modulus): sets all pressures of snapshots in proportion. Free bends go some percent further (5
    in the measured physics), and gaits to the end of these, up to their usual 90 kPa."""
    materials: LegMaterials = field(default_factory=LegMaterials)
    masses: Masses = field(default_factory=Masses)
    """What the leg weighs, and the hub of walking robots."""
    hub: HubModel = "soft"
    """What carries the legs of walking robots: the paper's disk (`soft`), whose compliance at a
    leg's attachment becomes the stiffness of the reduced leg's mount, or a `rigid` hub."""
    snapshots: SnapshotSettings = field(default_factory=SnapshotSettings)
    walked: GaitWalkSettings = field(default_factory=GaitWalkSettings)
    """Additional gaits that full robots walk, such as learned ones."""
    reduction: ReductionSettings = field(default_factory=ReductionSettings)

    @classmethod
    def implied(cls, content: Mapping[str, Any], below: Mapping[str, Any]) -> dict[str, Any]:
        """What another leg, a mesh of one's own, a silicone, a largest pressure and a law bring
        with them where it is not set.

        Raises:
            ValueError: A silicone that is not in the table, or one for a leg that does not relax.
        """
        brought: dict[str, Any] = {}
        leg = content.get("leg", below["leg"])
        another = leg != below["leg"] and leg in _OF_LEG
        if another:
            brought = _made_of(_OF_LEG[leg]())
        for name, of_it in (
            ("mesh", _of_mesh),
            ("silicone", _of_silicone),
            ("largest_pressure_kPa", _of_largest_pressure),
        ):
            # What was chosen before holds for another leg or silicone, too.
            value = content.get(name, below[name] if another else None)
            if value is not None:
                another = another or name != "mesh"
                usual = laid_over(dict(below), brought)
                brought = laid_over(brought, of_it(value, usual, content))
        brought = laid_over(brought, _of_law(content))
        weighed = content.get("masses")
        if isinstance(weighed, Mapping) and _is_weighed(weighed) and "densities" not in weighed:
            usual = settings_to_dict(CastDensities())
            brought = laid_over(brought, {"masses": {"densities": usual}})
        return brought

    @classmethod
    def upgraded(cls, content: Mapping[str, Any]) -> dict[str, Any]:
        """Settings of an earlier version with their leg as it is called now."""
        return with_current_leg(content)


def _made_of(preset: ReduceOptions) -> dict[str, Any]:
    """What a preset says of a leg and its snapshots, but where these are computed."""
    content = settings_to_dict(preset)
    del content["snapshots"]["executor"]
    return {
        name: content[name] for name in ("materials", "masses", "hub", "snapshots", "reduction")
    }


def _materials(usual: dict[str, Any], content: Mapping[str, Any]) -> LegMaterials:
    """What a leg is made of, with what is set."""
    return settings_from_dict(
        LegMaterials, laid_over(usual, {"materials": content.get("materials", {})})["materials"]
    )


def _is_weighed(masses: Mapping[str, Any]) -> bool:
    """Whether masses are not those of what is cast."""
    return masses.get("leg_mass_g") is not None or masses.get("model", "cast") != "cast"


def _of_mesh(mesh: Any, usual: dict[str, Any], content: Mapping[str, Any]) -> dict[str, Any]:
    """Polar rotations, which know no left and right as edge-based ones do, and in the published
    physics the mass, as much for its volume as the published leg has, 105 g of 43 ml; measured legs
    weigh what is cast."""
    polar = {"rotation": "polar"}
    brought: dict[str, Any] = {"snapshots": {"static": polar}, "reduction": polar}
    if not _materials(usual, content).relaxation.weights:
        volume = float(Mesh.load(mesh).volumes.sum())
        share = volume / float(paper_leg_mesh().volumes.sum())
        brought["materials"] = {"mass_kg": LegMaterials().mass_kg * share}
    return brought


def _of_silicone(name: Any, usual: dict[str, Any], content: Mapping[str, Any]) -> dict[str, Any]:
    """The law of a silicone that was measured; its density where it is cast; and the pressures and
    forces of the snapshots, in proportion to its modulus."""
    relaxation = _materials(usual, content).relaxation
    if not relaxation.weights:
        raise ValueError(
            f"silicone is {name!r}, expected none of a leg that does not relax, as in the "
            "published physics, whose stiffness is tuned: see materials.silicone"
        )
    rubber = silicone(str(name))
    # As the measured leg was made; branches of one's own have the stress of the test.
    as_shipped = relaxation == MEASURED_MATERIALS.relaxation
    law = rubber.material(relaxation=relaxation, small_strain=as_shipped)
    softer = law.young_modulus_kPa / usual["materials"]["silicone"]["young_modulus_kPa"]
    brought = {
        "materials": {"silicone": settings_to_dict(law)},
        "snapshots": _pressures(softer, usual["snapshots"]),
    }
    load_mN = softer * usual["snapshots"]["static"]["load_limit_mN"]
    brought["snapshots"]["static"]["load_limit_mN"] = load_mN
    masses = laid_over(usual, {"masses": content.get("masses", {})})["masses"]
    if isinstance(masses, Mapping) and not _is_weighed(masses):
        brought["masses"] = {"densities": {"silicone_g_per_ml": rubber.density_g_per_ml}}
    return brought


def _of_law(content: Mapping[str, Any]) -> dict[str, Any]:
    """No constants of Yeoh's law where a material is given one that has none: those are the
    preset's. A law of one's own may have them."""
    materials = content.get("materials")
    brought = {}
    for name in ("silicone", "sheet"):
        chosen = materials.get(name) if isinstance(materials, Mapping) else None
        if isinstance(chosen, Mapping) and chosen.get("law") in LAWS_OF_HOOKES_CONSTANTS:
            brought[name] = dict.fromkeys(YEOH_RATIOS, 0.0)
    return {"materials": brought} if brought else {}


def _of_largest_pressure(
    largest_kPa: Any, usual: dict[str, Any], _: Mapping[str, Any]
) -> dict[str, Any]:
    """The pressures of all snapshots, in proportion."""
    snapshots = usual["snapshots"]
    if not isinstance(largest_kPa, int | float) or not largest_kPa > 0.0:
        return {}  # it is refused by its name, once all is laid together
    usual_kPa = snapshots["walk"]["amplitude_kPa"] or snapshots["static"]["bend_pressure_kPa"]
    return {"snapshots": _pressures(largest_kPa / usual_kPa, snapshots)}


def _pressures(factor: float, snapshots: Mapping[str, Any]) -> dict[str, dict[str, float]]:
    """All pressures of snapshots, so many times as high."""
    names = {
        "static": ("bend_pressure_kPa", "load_pressure_kPa"),
        "blocked": ("pressure_kPa",),
        "walk": ("amplitude_kPa", "pressure_rate_kPa_per_s"),
    }
    return {
        group: {name: factor * snapshots[group][name] for name in each}
        for group, each in names.items()
    }


def reduce_as_asked(
    options: ReduceOptions, folder: RunFolder, snapshot_folder: Path | None = None
) -> Reduction:
    """Reduce a leg of the paper's robot as the options say; other arguments and errors as of
    `reduce`."""
    kind = leg_kind(options.leg)
    _refuse_locking(options)
    leg = module_of_leg(options.leg, None, options.mesh, options.materials, options.masses)
    physics = kind.physics
    if options.reduction.rotation == "polar" and physics.rotation != "polar":
        physics = replace(physics, damping="objective")
    return reduce(
        paper_robot(
            leg, physics, options.masses, hub_model=options.hub, full_order=kind.full_order
        ),
        folder,
        ReduceSettings(options.snapshots, options.walked, options.reduction),
        {
            "materials": settings_to_dict(replace(options.materials, mass_kg=leg.full.mass_kg)),
            "masses": settings_to_dict(options.masses),
        },
        snapshot_folder=snapshot_folder,
    )


def _refuse_locking(options: ReduceOptions) -> None:
    """Refuse linear tetrahedra of a nearly incompressible silicone.

    Raises:
        ValueError: The mesh has such.
    """
    if options.materials.silicone.dilatation != "mean":
        return
    own = options.mesh is not None
    mesh = Mesh.load(options.mesh) if options.mesh else leg_kind(options.leg).mesh()
    if mesh.edge_nodes is None:
        name = f"mesh {options.mesh}" if own else f"the mesh of the {options.leg} leg that ships"
        remedy = (
            "make it again with pneumorph mesh --quadratic, or reduce it in the published physics "
            "with --preset paper"
            if own
            else "give such a mesh (--mesh), or leave materials.silicone.dilatation pointwise"
        )
        raise ValueError(
            f"{name} has linear tetrahedra, which lock in silicone that hardly changes its "
            f"volume, expected 10-node ones: {remedy}"
        )


def hyperelastic() -> ReduceOptions:
    """The leg that follows `HYPERELASTIC_PRESSURE_MAP`."""
    made = shipped_settings("hyperelastic")
    return ReduceOptions(
        leg="hyperelastic",
        materials=HYPERELASTIC_MATERIALS,
        hub="rigid",
        snapshots=made.snapshots,
        reduction=made.reduction,
    )


def measured() -> ReduceOptions:
    """The leg as its silicone was measured, up to the pressure of the real one."""
    made = shipped_settings("measured")
    return ReduceOptions(
        leg="measured",
        materials=MEASURED_MATERIALS,
        masses=Masses("cast"),
        hub="rigid",
        snapshots=made.snapshots,
        reduction=made.reduction,
    )


def quick() -> ReduceOptions:
    """The measured leg from fewer equilibria and one short walk, with fewer modes and elements, in
    minutes."""
    usual = measured()
    static = replace(usual.snapshots.static, bend_count=12, load_count=24)
    walk = replace(usual.snapshots.walk, leg_counts=(2,), corner_limit=3, record_every=4)
    ecsw = replace(usual.reduction.ecsw, element_limit=240)
    return replace(
        usual,
        snapshots=replace(usual.snapshots, static=static, walk=walk),
        reduction=replace(usual.reduction, mode_limit=24, ecsw=ecsw),
    )


def paper_quick() -> ReduceOptions:
    """The published leg from equilibria alone, in minutes."""
    return ReduceOptions(
        snapshots=SnapshotSettings(
            static=StaticSnapshotSettings(bend_count=12, load_count=24),
            walk=WalkSnapshotSettings(leg_counts=()),
        )
    )


def learned() -> ReduceOptions:
    """The published leg from equilibria and given gaits, with more modes and elements."""
    made = learned_settings()
    return ReduceOptions(snapshots=made.snapshots, reduction=made.reduction)


def corners() -> ReduceOptions:
    """The paper's protocol: every robot through every corner of its pressures, which takes days."""
    return ReduceOptions(
        snapshots=SnapshotSettings(
            static=StaticSnapshotSettings(load_count=0),
            walk=WalkSnapshotSettings(
                robots="all", corner_limit=None, hold_s=1.0, compression=3e-4
            ),
        ),
        # Free bending is computed for the report alone.
        reduction=ReductionSettings(
            norm="mass",
            mode_limit=36,  # as the paper
            symmetric=False,
            bend_share=0.0,
            load_share=0.0,
            ecsw=EcswSettings(
                hyperreduction_tolerance=0.001, element_limit=1000, stiffness_state_count=0
            ),
        ),
    )


_OF_LEG: dict[str, Callable[[], ReduceOptions]] = {
    "published": ReduceOptions,
    "hyperelastic": hyperelastic,
    "measured": measured,
}
"""What made each leg that ships."""

PRESETS: dict[str, Callable[[], ReduceOptions]] = {
    "measured": measured,
    "quick": quick,
    "paper": ReduceOptions,
    "paper_quick": paper_quick,
    "hyperelastic": hyperelastic,
    "learned": learned,
    "corners": corners,
}
"""Ready options by name; the first where none is named."""
