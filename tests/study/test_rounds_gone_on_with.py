"""Rounds of a certificate that was stopped, moved, or asked for with other settings; what walks and
what is reduced is told, not made."""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.result_example import example
from helpers.synthetic_part import synthetic_reduced_part

from pneumorph.base.run_folder import RunFolder
from pneumorph.base.spent_time import spent_s
from pneumorph.catalogue.paper_designs import BASELINE_DESIGN
from pneumorph.catalogue.robot_options import RobotOptions
from pneumorph.catalogue.robot_spec import RobotSpec
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.gait.held_gait import HeldGait
from pneumorph.gait.phase_sweep import PhaseSweepSettings
from pneumorph.physics.height_map import HeightMap
from pneumorph.reduction.reduction_settings import ReductionSettings
from pneumorph.robot.design import Design
from pneumorph.simulation.randomisation import Randomisation
from pneumorph.study import certified_rounds
from pneumorph.study.certified_candidates import Candidates, CertificateSettings, RoundSettings
from pneumorph.study.certified_pairs import Certificate, CertifiedPair
from pneumorph.study.certified_rounds import (
    CERTIFICATE_FILE,
    Again,
    certify_candidates,
    forget_certificate,
    set_rounds_aside,
)
from pneumorph.study.certified_settings import SAID_NOW
from pneumorph.study.certified_walks import FullOrderWalk
from pneumorph.study.finished_run import Pair
from pneumorph.study.reduce_settings import ReduceSettings
from pneumorph.study.reduction import PART_FILE, Reduction
from pneumorph.study.robustness import KEPT_WALKS
from pneumorph.study.shown_worlds import SHOWN_WORLDS

SETTINGS = CertificateSettings(full=True, randomisation=Randomisation())
Certify = Callable[..., Certificate]
Changed = Callable[[Candidates, RobotSpec], tuple[Candidates, RobotSpec]]
GAIT = HeldGait.evenly(np.array([[20.0, 0.0, 1.0], [5.0, 30.0, 1.0]]))
PAIR = Pair(Design.parse(BASELINE_DESIGN), "training/gaits/L1.csv", GAIT, None, None)


@pytest.fixture
def told(tmp_path: Path) -> dict[str, Any]:
    """What walked so far, the file of its states, and how a leg is reduced."""

    def reduced(_: RobotSpec, folder: RunFolder, *__: Any, **___: Any) -> Reduction:
        leg = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4))
        path = leg.save(folder / PART_FILE)
        return replace(example(Reduction), part=str(path), wall_s=1.0)

    return {"walked": [], "states": "full_order/a.npz", "reduce": reduced}


@pytest.fixture
def certify(tmp_path: Path, told: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> Certify:
    """Certify a pair whose models part, in a folder."""
    leg = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4)).save(tmp_path / "leg.npz")
    spec = RobotOptions.of("published", part=leg, threads=1).spec()
    candidates = Candidates(
        tmp_path, (PAIR,), CrawlingTask(), PhaseSweepSettings(), (), False, Randomisation()
    )

    def once(
        _: Candidates, settings: CertificateSettings, spec: RobotSpec, folder: RunFolder
    ) -> Certificate:
        told["walked"].append((settings, spec.module.reduced.mode_count))
        (folder / f"{KEPT_WALKS}/a.json").write_text("{}")
        walk = FullOrderWalk(None, 10.0, 20.0, 10.0, False, "completed", 5.0, told["states"])
        pair = replace(example(CertifiedPair), label="L1", full_order=(walk,))
        return replace(example(Certificate), best="L1", pairs=(pair,), rounds=())

    monkeypatch.setattr(certified_rounds, "certify_once", once)
    monkeypatch.setattr(certified_rounds, "said_of_further", lambda _: {})
    monkeypatch.setattr(certified_rounds, "reduce", lambda *a, **k: told["reduce"](*a, **k))

    def made(
        folder: RunFolder | Path,
        settings: CertificateSettings = SETTINGS,
        reduction: ReduceSettings | None = None,
        change: Changed = lambda candidates, spec: (candidates, spec),
    ) -> Certificate:
        own = folder if isinstance(folder, RunFolder) else RunFolder(folder, "certify")
        again = Again(reduction or ReduceSettings())
        asked, robot = change(candidates, spec)
        return certify_candidates(asked, settings, robot, own, again)

    return made


@pytest.mark.parametrize(
    ("other", "name"),
    [
        (replace(SETTINGS, pair_count=2), "certificate.pair_count is 5 there and 2 here"),
        (
            replace(SETTINGS, randomisation=Randomisation(friction="0.5")),
            r"certificate.randomisation.friction is 'U\(0.9, 1.5\)' there and '0.5' here",
        ),
    ],
)
def test_other_settings_are_named_before_anything_walks(
    certify: Certify,
    told: dict[str, Any],
    tmp_path: Path,
    other: CertificateSettings,
    name: str,
) -> None:
    certify(tmp_path / "out")
    told["walked"].clear()
    before = (tmp_path / "out" / CERTIFICATE_FILE).read_text()
    with pytest.raises(ValueError, match=name):
        certify(tmp_path / "out", other)
    changed = ReduceSettings(reduction=ReductionSettings(mode_limit=7))
    with pytest.raises(ValueError, match=r"reduction\.reduction\.mode_limit is .* and 7 here"):
        certify(tmp_path / "out", SETTINGS, changed)
    assert told["walked"] == []
    assert (tmp_path / "out" / CERTIFICATE_FILE).read_text() == before
    # What decides none of the new legs may be another.
    free = replace(SETTINGS, cycle_s=2.0, rounds=RoundSettings(limit=1))
    assert len(certify(tmp_path / "out", free).rounds) == 2


def _full_order(spec: RobotSpec, **changes: Any) -> RobotSpec:
    return replace(spec, full_order=replace(spec.full_order, **changes))


OTHERS: dict[str, Changed] = {
    "hub_mass": lambda c, s: (c, replace(s, hub=s.hub.weighing(0.05))),
    "hub_model": lambda c, s: (c, replace(s, hub_model="rigid")),
    "mounting_angle_deg": lambda c, s: (c, replace(s, mounting_angle_deg=3.0)),
    "full_order": lambda c, s: (c, _full_order(s, contact_sweeps=7)),
    "settling_step_count": lambda c, s: (
        replace(c, task=replace(c.task, settling_step_count=7)),
        s,
    ),
    "pairs.L1": lambda c, s: (replace(c, pairs=(replace(PAIR, design=Design.parse("1.2")),)), s),
    "pairs.L2": lambda c, s: (replace(c, pairs=(PAIR, PAIR)), s),
}


@pytest.mark.parametrize("name", OTHERS)
def test_other_robots_and_pairs_are_refused_before_anything_walks(
    certify: Certify, told: dict[str, Any], tmp_path: Path, name: str
) -> None:
    """Once finite elements walked first, and what the folder shows was written over."""
    certify(tmp_path / "out")
    told["walked"].clear()
    with pytest.raises(ValueError, match=rf"round_1 holds a run of other settings \({name}\b"):
        certify(tmp_path / "out", change=OTHERS[name])
    assert told["walked"] == []


def test_another_gait_and_another_map_of_the_same_name_are_refused(
    certify: Certify, told: dict[str, Any], tmp_path: Path
) -> None:
    file = tmp_path / "ground.npy"

    def on_map(candidates: Candidates, spec: RobotSpec) -> tuple[Candidates, RobotSpec]:
        ground = replace(spec.physics.ground, map=HeightMap(file))
        return candidates, replace(spec, physics=replace(spec.physics, ground=ground))

    def stronger(candidates: Candidates, spec: RobotSpec) -> tuple[Candidates, RobotSpec]:
        gait = HeldGait.evenly(GAIT.held_kPa + 1.0)
        return replace(candidates, pairs=(replace(PAIR, gait=gait),)), on_map(candidates, spec)[1]

    np.save(file, np.zeros((4, 4)))
    certify(tmp_path / "out", change=on_map)
    told["walked"].clear()
    with pytest.raises(ValueError, match=r"other settings \(pairs\.L1 is "):
        certify(tmp_path / "out", change=stronger)
    np.save(file, np.eye(4))
    with pytest.raises(ValueError, match=r"other settings \(ground"):
        certify(tmp_path / "out", change=on_map)
    assert told["walked"] == []


def test_legs_whose_points_lie_on_other_surfaces_are_refused_where_friction_names_them(
    certify: Certify, told: dict[str, Any], tmp_path: Path
) -> None:
    """What moves a leg, all that its digest is of, is the same."""
    leg = synthetic_reduced_part(mode_count=4, cells=(4, 4, 4))
    count = len(leg.contact_points)

    def on_soles(soles: int) -> Changed:
        names = np.where(np.arange(count) < soles, "sole", "skin")
        part = replace(leg, contact_surface=names, contact_area_mm2=np.ones(count))
        path = part.save(tmp_path / f"leg_{soles}.npz")
        usual = RobotOptions.of("published", part=path, threads=1).spec()
        physics = replace(usual.physics, friction_by_surface=(("sole", 0.3),))
        return lambda candidates, _: (candidates, replace(usual, physics=physics))

    certify(tmp_path / "out", change=on_soles(1))
    told["walked"].clear()
    with pytest.raises(ValueError, match=r"other settings \(contact_points\b"):
        certify(tmp_path / "out", change=on_soles(2))
    assert told["walked"] == []
    assert len(certify(tmp_path / "out", change=on_soles(1)).rounds) == 2


def test_threads_change_no_leg_and_earlier_versions_said_less(
    certify: Certify, tmp_path: Path
) -> None:
    def threads(candidates: Candidates, spec: RobotSpec) -> tuple[Candidates, RobotSpec]:
        return candidates, _full_order(spec, thread_count=3)

    first = certify(tmp_path / "out")
    assert certify(tmp_path / "out", change=threads).rounds == first.rounds
    path = tmp_path / "out/round_1/settings.json"
    known = {"certificate", "physics", "leg", "reductions", "reduction", "walks"}
    kept = json.loads(path.read_text())
    assert set(kept) - known == set(SAID_NOW) - known
    path.write_text(json.dumps({name: kept[name] for name in known}))
    assert certify(tmp_path / "out").rounds == first.rounds


def test_new_legs_of_an_earlier_version_go_on_with_the_same_settings(
    certify: Certify, told: dict[str, Any], tmp_path: Path
) -> None:
    """Its verb's settings say how many pairs and worlds there were."""
    first = certify(tmp_path / "out")
    path = tmp_path / "out/round_1/settings.json"
    kept = json.loads(path.read_text())
    path.write_text(json.dumps({name: kept[name] for name in ("reduction", "walks")}))
    folder = RunFolder(tmp_path / "out", "certify")
    folder.save_settings({"certificate": {"pair_count": 5, "world_count": 200}})
    folder.save_summary({})
    assert certify(tmp_path / "out").rounds == first.rounds
    told["walked"].clear()
    with pytest.raises(ValueError, match=r"'pair_count': 5, .* the same \({'pair_count': 2"):
        certify(tmp_path / "out", replace(SETTINGS, pair_count=2))
    assert told["walked"] == []


def test_a_certificate_is_written_once_its_walks_are_those_of_the_new_leg(
    certify: Certify, told: dict[str, Any], tmp_path: Path
) -> None:
    certify(tmp_path / "out")
    before = (tmp_path / "out" / CERTIFICATE_FILE).read_text()
    told["states"] = "full_order/b.npz"
    with pytest.raises(ValueError, match="round_1 holds a run of other settings"):
        certify(tmp_path / "out")
    assert (tmp_path / "out" / CERTIFICATE_FILE).read_text() == before


def test_a_moved_certificate_goes_on_from_another_folder(
    certify: Certify, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    first = certify(Path("out"))
    (tmp_path / "elsewhere").mkdir()
    shutil.move(tmp_path / "out", tmp_path / "elsewhere/moved")
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert certify(Path("moved")).rounds == first.rounds


def test_what_a_stopped_reduction_took_counts(
    certify: Certify, told: dict[str, Any], tmp_path: Path
) -> None:
    reduced = told["reduce"]

    def stopped(*_: Any, **__: Any) -> None:
        time.sleep(0.05)
        raise KeyboardInterrupt

    told["reduce"] = stopped
    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            certify(tmp_path / "out")
    told["reduce"] = reduced
    made_s = certify(tmp_path / "out").rounds[1].made_s
    assert made_s >= 1.1
    assert certify(tmp_path / "out").rounds[1].made_s == made_s


def test_what_a_killed_reduction_took_is_kept_meanwhile(tmp_path: Path) -> None:
    file = tmp_path / "spent.json"
    with spent_s(file, 0.01) as earlier_s:
        assert earlier_s == 0.0
        end = time.monotonic() + 20.0
        while not file.exists():
            assert time.monotonic() < end
            time.sleep(0.01)
        assert json.loads(file.read_text())["wall_s"] > 0.0


def test_walks_in_worlds_are_there_until_the_summary_is(certify: Certify, tmp_path: Path) -> None:
    folder = RunFolder(tmp_path / "out", "certify")
    certify(folder)
    assert (folder.path / KEPT_WALKS).is_dir()
    folder.save_summary({})
    assert not (folder.path / KEPT_WALKS).exists()


@pytest.mark.parametrize("own", [False, True])
def test_the_certificate_of_an_earlier_training_is_forgotten(tmp_path: Path, own: bool) -> None:
    """But for its finite elements, and unless the verb made it there as a run of its own."""
    names = [CERTIFICATE_FILE, *(file for file, _ in SHOWN_WORLDS.values())]
    for name in (*names, "walk.json", *(["summary.json"] if own else [])):
        (tmp_path / name).write_text("{}")
    forget_certificate(tmp_path)
    assert [(tmp_path / name).exists() for name in names] == [own] * 3
    assert (tmp_path / "walk.json").exists()


def test_new_legs_of_an_earlier_training_lie_aside(tmp_path: Path) -> None:
    """Twice: the second, of fewer rounds, lies in the place of the first; walks of finite elements
    and the leg's snapshots stay."""
    for made, rounds in (("first", ("round_1", "round_2")), ("second", ("round_1",))):
        for name in (*rounds, "snapshots", "full_order"):
            (tmp_path / name).mkdir(exist_ok=True)
            (tmp_path / name / made).touch()
        set_rounds_aside(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"earlier", "full_order", "snapshots"}
    aside = {f"{path.parent.name}/{path.name}" for path in (tmp_path / "earlier").glob("*/*")}
    assert aside == {"round_1/second"}
    for name in ("full_order", "snapshots"):
        assert len(list((tmp_path / name).iterdir())) == 2
    set_rounds_aside(tmp_path)  # nothing new takes their place
    assert (tmp_path / "earlier" / "round_1").exists()
