"""A beam of silicone that is let go: sag, frequency and decay under three loads.

    python reproduce/released_beam/run.py --out runs/released_beam

A cantilever of Dragon Skin 10, 100 x 30 x 30 mm, straight at first, swings under its weight and
that of a load at its tip, as in the real-beam experiments of DiffPD (srl-ethz). One relaxed modulus
and one set of branches serve for all three loads. One file for each load, so that a run that was
stopped goes on; then beam.json and beam.png.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from functools import partial
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tyro
from scipy.signal import argrelextrema

from pneumorph.base.artefact import write_json
from pneumorph.base.run_folder import made_once
from pneumorph.fem.held_motion import held_motion
from pneumorph.fem.part_model import PartModel
from pneumorph.fem.prony import PronySeries
from pneumorph.fem.yeoh_constants import yeoh_material
from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.mirror import mirror_half
from pneumorph.geometry.netgen_mesher import MesherSettings, box, tetrahedralise
from pneumorph.geometry.quadratic import quadratic_mesh
from pneumorph.report.style import figure_style, new_figure, save_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SIZE_MM = (100.0, 30.0, 30.0)
DENSITY_KG_PER_MM3 = 1.07e-6
GRAVITY_MM_PER_S2 = 9810.0
MEASURED = {
    0.0: (6.75, 7.76, 0.0535),
    0.510: (17.6, 4.335, 0.0575),
    1.001: (27.25, 3.37, 0.071),
}
"""By weight at the tip [N]: sag [mm], frequency [Hz] and damping ratio, middles of
what was found in two takes each."""


@dataclass(frozen=True)
class Beam:
    """What the beam is made of, and how its swing is computed."""

    relaxed_modulus_kPa: float = 253.0
    """Young's modulus after a long rest."""
    series: PronySeries = field(default_factory=lambda: prony((0.037, 0.281), (0.65, 0.03)))
    mesh_mm: float = 18.0
    """Largest edge of the quadratic tetrahedra [mm]."""
    step_s: float = 0.005
    duration_s: float = 1.3


def prony(ratios: tuple[float, ...], times_s: tuple[float, ...]) -> PronySeries:
    """The series whose branches have these stiffnesses over the relaxed one."""
    return PronySeries(tuple(k / (1.0 + sum(ratios)) for k in ratios), times_s)


def beam_model(beam: Beam) -> PartModel:
    """Its finite elements, symmetric in y: two bending modes of equal frequency would mix else."""
    length, width, height = SIZE_MM
    half = tetrahedralise(
        box((0.0, 0.0, 0.0), (length, 0.5 * width, height)),
        MesherSettings(size_mm=beam.mesh_mm, grading=0.9),
    )
    whole = mirror_half(*half)
    nodes = whole.nodes
    ends = {"held": nodes[:, 0] < 1e-6, "tip": nodes[:, 0] > length - 1e-6}
    mesh = Mesh(
        nodes,
        whole.tetrahedra,
        {},
        {name: np.flatnonzero(chosen) for name, chosen in ends.items()},
        mirror_nodes=whole.mirror_nodes,
    )
    return PartModel(
        quadratic_mesh(mesh),
        yeoh_material(beam.relaxed_modulus_kPa / 6.0),
        DENSITY_KG_PER_MM3 * float(np.prod(SIZE_MM)),
        mass_lumping="volume",
        relaxation=beam.series,
    )


def swing(beam: Beam, weight_N: float) -> dict[str, Any]:
    """Sag of the tip over time under a weight, and what it says."""
    part = beam_model(beam)
    tip = part.mesh.node_set("tip")
    added = np.zeros(part.node_count)
    added[tip] = weight_N / 9.81 / len(tip)
    load = np.zeros_like(part.rest_nodes)
    load[:, 2] = -GRAVITY_MM_PER_S2 * (part.node_mass + added)
    motion = held_motion(part, part.mesh.node_set("held"), load, beam.step_s, added)
    sag = [
        float((part.rest_nodes - state.positions)[tip, 2].mean())
        for state in takewhile(lambda state: state.time_s < beam.duration_s, motion)
    ]
    return {"sag_mm": sag, **read_off(beam.step_s, np.array(sag)), "nodes": part.node_count}


def read_off(step_s: float, sag: np.ndarray) -> dict[str, float]:
    """Sag about which a swing decays [mm], its frequency [Hz] and its damping ratio.

    Extrema by a parabola through three frames; the damping ratio by the logarithmic decrement of
    the distances from one extremum to the next, which creep hardly changes.
    """
    places = np.sort(
        np.concatenate([argrelextrema(sag, each)[0] for each in (np.less, np.greater)])
    )
    before, here, after = (sag[places + shift] for shift in (-1, 0, 1))
    offset = 0.5 * (before - after) / (before - 2.0 * here + after)
    times = (places + 1 + offset) * step_s
    values = here - 0.25 * (before - after) * offset
    half_periods = np.arange(len(times))
    decrement = -2.0 * np.polyfit(half_periods[1:], np.log(np.abs(np.diff(values))), 1)[0]
    return {
        "mean_sag_mm": float(0.25 * values[-3] + 0.5 * values[-2] + 0.25 * values[-1]),
        "frequency_Hz": float(0.5 / np.polyfit(half_periods, times, 1)[0]),
        "damping_ratio": float(decrement / np.hypot(2.0 * np.pi, decrement)),
    }


@figure_style()
def beam_figure(beam: Beam, found: dict[float, dict[str, Any]]) -> Figure:
    """Sag of the tip over time under each weight; dashed where the real one came to rest."""
    figure = new_figure(5.5, 3.0)
    axes = figure.add_subplot()
    for number, (weight, each) in enumerate(found.items()):
        times = beam.step_s * np.arange(1, len(each["sag_mm"]) + 1)
        axes.plot(times, each["sag_mm"], color=f"C{number}", label=f"{weight:g} N")
        axes.axhline(MEASURED[weight][0], color=f"C{number}", linestyle="--", linewidth=0.7)
    axes.set(xlabel="time (s)", ylabel="sag (mm)")
    axes.legend(fontsize="x-small")
    return figure


def main(beam: Beam, out: Path = Path("runs/released_beam")) -> None:
    """Let the beam go under each load and compare.

    Args:
        beam: What it is made of.
        out: Folder of a file for each load, beam.json and beam.png.
    """
    found, rows = {}, []
    for weight, (sag, frequency, ratio) in MEASURED.items():
        path = out / f"{weight:g}_N.json"
        each = made_once(path, partial(swing, beam, weight), weight_N=weight, **asdict(beam))
        found[weight] = each
        names = ("mean_sag_mm", "frequency_Hz", "damping_ratio")
        row = {
            name: {"simulated": each[name], "measured": real, "error_percent": error}
            for name, real in zip(names, (sag, frequency, ratio), strict=True)
            for error in [100.0 * (each[name] / real - 1.0)]
        }
        rows.append({"weight_N": weight, **row})
        print({name: [round(value, 4) for value in row[name].values()] for name in names})
    write_json(out / "beam.json", {"beam": asdict(beam), "loads": rows})
    save_figure(beam_figure(beam, found), out / "beam.png", ("png",))


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
