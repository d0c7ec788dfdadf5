"""In how many worlds a training's certificate tunes and chooses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from pneumorph.base.layers import layered
from pneumorph.study import training_options
from pneumorph.study.certified_candidates import CertificateSettings
from pneumorph.study.study_once import study_folder
from pneumorph.study.training_options import PRESETS, train_as_asked


class _AskedError(Exception):
    """The training is asked for."""


@pytest.mark.parametrize(
    ("changes", "world_count", "tuning_world_count"),
    [
        ({"robot": {"based_on": "published"}, "certify": True}, 200, 24),
        ({"certify": True, "certified_world_count": 0}, 200, 24),
        ({"certify": True}, 48, 8),
        ({"certified_world_count": 4}, 4, 1),
    ],
)
def test_the_experts_phase_is_tuned_in_a_sixth_of_the_worlds(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    changes: dict[str, Any],
    world_count: int,
    tuning_world_count: int,
) -> None:
    """Also of as many as a certificate has where no number is asked for: the best pair of a
    training in one world is chosen in those that the expert is tuned in."""
    asked: list[CertificateSettings] = []

    def instead(*_: Any, certificate: CertificateSettings, **__: Any) -> None:
        asked.append(certificate)
        raise _AskedError

    monkeypatch.setattr(training_options, "run_training", instead)
    options = layered(PRESETS["quick"](), [changes])
    with pytest.raises(_AskedError):
        train_as_asked(options, study_folder(tmp_path, "coopt"))
    (certificate,) = asked
    assert certificate.world_count == world_count
    assert certificate.tuning_world_count == tuning_world_count
