"""Materials of a leg to be reduced whose numbers would do nothing, or make it lock."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from pneumorph.base.layers import layered
from pneumorph.base.run_folder import RunFolder
from pneumorph.fem.material import YEOH_RATIOS
from pneumorph.study.reduction_options import ReduceOptions, measured, reduce_as_asked


def test_mean_dilatation_is_refused_of_the_linear_mesh_that_ships(tmp_path: Path) -> None:
    """Where no mesh is named it is the leg's own, of which each element has one point."""
    law = {"law": "yeoh", "dilatation": "mean"}
    options = layered(ReduceOptions(), [{"materials": {"silicone": law}}])
    with pytest.raises(ValueError, match=r"mesh of the published leg that ships has linear .*lock"):
        reduce_as_asked(options, RunFolder(tmp_path / "run", "reduce"))
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("preset", [ReduceOptions(), measured()])
def test_another_law_leaves_the_presets_constants_of_yeohs_behind(preset: ReduceOptions) -> None:
    """Those that are asked for with it stay, to be refused; a law of one's own may have them."""

    def silicone(**content: Any) -> list[float]:
        found = layered(preset, [{"materials": {"silicone": content}}]).materials.silicone
        return [getattr(found, name) for name in YEOH_RATIOS]

    own = [getattr(preset.materials.silicone, name) for name in YEOH_RATIOS]
    assert silicone(poisson_ratio=0.49) == silicone(law="yeoh") == own
    assert silicone(law="stable_neo_hookean") == [0.0, 0.0]
    assert silicone(law="a law of one's own") == own
    assert silicone(law="stable_neo_hookean", yeoh_c2_over_c1=0.3) == [0.3, 0.0]
