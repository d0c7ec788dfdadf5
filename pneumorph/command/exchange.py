"""Convert gaits and reductions to other programs' files, and back.

A gait (CSV, or sorotraj YAML) is converted to the other format: --to csv or --to sorotraj. A
reduced leg of the published physics (npz, or `shipped` for the one that ships) becomes a SOFA scene
for the ModelOrderReduction plugin with --to sofa, which knows no relaxation as measured legs have;
a folder with your own reduction in that plugin's format becomes a reduced leg with --to part.

Writes gait.csv, gait.yaml, scene.py with its files, or part.npz.

Example: pneumorph exchange runs/quick/training/gaits/L1.csv --to sorotraj --out runs/sorotraj
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Annotated

import tyro

from pneumorph.command.verb import Verb, flat
from pneumorph.exchange.conversion import ConversionSettings, convert
from pneumorph.physics.physics import Physics

_OF_A_SCENE = {"time_step_s", "gravity_mm_per_s2", "stiffness_damping_s", "mass_damping_per_s"}
"""What a SOFA scene says of the physics."""


@dataclass(frozen=True)
class ExchangeOptions:
    """What to turn into what."""

    source: tyro.conf.Positional[str] = tyro.MISSING
    """Gait file, reduced leg (npz), `shipped`, or the folder of a reduction made by the plugin."""
    conversion: Annotated[ConversionSettings, flat] = field(default_factory=ConversionSettings)

    def idle_settings(self) -> dict[str, str]:
        """What of the physics no scene says; other conversions refuse all of it."""
        if self.conversion.to != "sofa":
            return {}
        names = {each.name for each in fields(Physics)} - _OF_A_SCENE
        why = "of a SOFA scene, which has only time step, gravity and damping numbers"
        return {f"conversion.physics.{name}": why for name in sorted(names)}


VERB = Verb(
    ExchangeOptions, lambda options, folder: convert(options.source, options.conversion, folder)
)
