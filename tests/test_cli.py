"""The command line: help that teaches, one line for each failure, JSON alone on the output."""

from __future__ import annotations

import json
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from pneumorph import command
from pneumorph.base.executor import WorkerError
from pneumorph.cli import VERBS, run


def test_help_names_every_verb_in_the_order_of_the_flow(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--help"]) == 0
    shown = capsys.readouterr().out
    places = [shown.index(f"\n  {verb}") for verb in VERBS]
    assert places == sorted(places)


def test_verbs_are_short() -> None:
    """They parse, call and print; what they do is the library's, for everyone to call."""
    files = Path(command.__file__).parent.glob("*.py")
    lengths = {each.name: len(each.read_text().splitlines()) for each in files}
    assert len(lengths) > len(VERBS)
    assert {name: count for name, count in lengths.items() if count >= 80} == {}


def test_no_verb_is_bad_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert run([]) == 2
    assert "usage: pneumorph VERB" in capsys.readouterr().out


def test_unknown_verb_is_refused_with_the_known_ones(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["crawl"]) == 2
    error = capsys.readouterr().err
    assert error.startswith("pneumorph: verb 'crawl' is unknown, expected one of mesh, reduce")
    assert error.count("\n") == 1


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_explains_itself(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as exit_info:
        run([verb, "--help"])
    assert exit_info.value.code == 0
    shown = capsys.readouterr().out
    assert f"Example: pneumorph {verb}" in " ".join(shown.split())
    for flag in ("--json", "--out", "--settings", "--debug"):
        assert flag in shown


def test_json_is_alone_on_standard_output(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "disk"
    assert run(["mesh", "disk", "--out", str(folder), "--json"]) == 0
    captured = capsys.readouterr()
    summary = json.loads(captured.out)
    assert summary["verb"] == "mesh"
    assert Path(summary["mesh"]).exists()
    assert json.loads((folder / "summary.json").read_text()) == summary
    assert json.loads((folder / "settings.json").read_text())["part"] == "disk"
    assert captured.err == f"wrote {folder}\n"


def test_settings_of_a_run_repeat_it_and_flags_come_last(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    run(["mesh", "disk", "--disk.height-mm", "12", "--out", str(first)])
    settings = str(first / "settings.json")
    run(["mesh", "--settings", settings, "--disk.top-radius-mm", "60", "--out", str(second)])
    disk = json.loads((second / "settings.json").read_text())["disk"]
    assert (disk["height_mm"], disk["top_radius_mm"]) == (12.0, 60.0)


def test_failure_is_one_line_and_leaves_no_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "run"
    missing = str(tmp_path / "none.msh")
    assert run(["mesh", "--file", missing, "--out", str(folder)]) == 1
    assert capsys.readouterr().err == f"pneumorph: mesh file {missing} does not exist\n"
    assert not folder.exists()


def test_debug_shows_the_traceback(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["mesh", "--file", "none.msh", "--out", str(tmp_path / "r"), "--debug"]) == 1
    assert "Traceback" in capsys.readouterr().err


def test_unknown_setting_in_a_file_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "mine.toml"
    file.write_text("[disk]\nheigth_mm = 3.0\n")
    assert run(["mesh", "--settings", str(file)]) == 1
    assert "unknown setting disk.heigth_mm: did you mean height_mm?" in (capsys.readouterr().err)


def test_settings_of_another_verbs_run_are_told_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "settings.json").write_text('{"walk": {}}')
    (tmp_path / "summary.json").write_text('{"verb": "simulate"}')
    assert run(["mesh", "--settings", str(tmp_path / "settings.json")]) == 1
    assert "settings.json is of `pneumorph simulate`)" in capsys.readouterr().err


def test_a_misspelt_flag_is_told_what_it_may_mean(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        run(["baseline", "--frction", "0.5"])
    assert left.value.code == 2
    assert "--frction: did you mean --physics.friction" in capsys.readouterr().err


def test_help_of_an_option_is_one_paragraph(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Lines of a docstring are no lines of the help, not even after flags were suggested."""
    with pytest.raises(SystemExit):
        run(["mesh", "disk", "--heigth-mm", "3"])
    monkeypatch.setenv("COLUMNS", "400")
    with pytest.raises(SystemExit):
        run(["mesh", "--help"])
    shown = " ".join(capsys.readouterr().out.split())
    assert "such as the settings.json of a run; flags come last. (default: None)" in shown


def test_an_interrupt_in_a_collection_of_garbage_is_not_lost() -> None:
    """Python prints and forgets what is raised there, by whichever callback JAX has registered."""
    program = textwrap.dedent("""
        import gc, signal, time
        from pneumorph.cli import _interrupts_heard

        def _xla_gc_callback(phase, info):
            if phase == "start":
                signal.raise_signal(signal.SIGINT)

        signal.signal(signal.SIGINT, signal.default_int_handler)
        try:
            with _interrupts_heard():
                gc.callbacks.append(_xla_gc_callback)
                gc.collect()
                gc.callbacks.clear()
                time.sleep(60.0)
        except KeyboardInterrupt:
            print("stopped")
    """)
    told = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (told.stdout, told.stderr) == ("stopped\n", "")


def test_what_is_noted_of_a_walk_is_printed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Pressures beyond the snapshots': the reduced leg extrapolates."""
    asked = "simulate --expert.amplitude-kPa 70 --expert.maximum-pressure-kPa 300"
    asked += f" --physics.air.supply-kPa 400 --expert.duration-s 6 --out {tmp_path / 'walk'}"
    assert run(asked.split()) == 0
    assert "note: The robot left the range of its legs' snapshots" in capsys.readouterr().out


def test_the_keyboard_stops_a_training_and_says_how_it_goes_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "run"

    def stopped(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    def stopped_later(*_: object, **__: object) -> None:
        (out / "training").mkdir()
        raise KeyboardInterrupt

    def stopped_much_later(*_: object, **__: object) -> None:
        (out / "training/checkpoint.npz").touch()
        raise KeyboardInterrupt

    again = f"the same command with --resume --out {out} "
    for stop, said_then in (
        (stopped, ""),
        (stopped_later, f"{again}begins again: it had no checkpoint yet"),
        (stopped_much_later, f"{again}goes on"),
    ):
        monkeypatch.setattr("pneumorph.study.training_options.run_training", stop)
        assert run(["coopt", "--out", str(out)]) == 130
        said = capsys.readouterr().err
        assert "stopped by the keyboard" in said
        assert said_then in said
        assert (again in said) == bool(said_then) == out.exists()


def test_settings_are_saved_before_a_training_begins(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Into a folder that is there, too: a run that is killed can be resumed with them."""
    found: list[int] = []

    def trained(*_: object, **__: object) -> None:
        content = json.loads((tmp_path / "settings.json").read_text())
        found.append(content["coopt"]["seed"])
        raise ValueError("refused")

    monkeypatch.setattr("pneumorph.study.training_options.run_training", trained)
    assert run(["coopt", "--seed", "3", "--out", str(tmp_path)]) == 1
    assert found == [3]
    assert list(tmp_path.iterdir()) == []


def test_workers_that_died_are_told_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def died(*_: object, **__: object) -> None:
        raise WorkerError("task 3 was begun 3 times and its worker died each time")

    monkeypatch.setattr("pneumorph.study.training_options.run_training", died)
    assert run(["coopt", "--out", str(tmp_path / "run")]) == 1
    assert capsys.readouterr().err.splitlines()[-1].startswith("pneumorph: task 3 was begun")


def test_what_a_task_of_ray_raised_is_told_without_its_traceback(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    errors = pytest.importorskip("ray.exceptions")
    raised = [
        errors.RayTaskError("f", "Traceback ...", ValueError("no such leg")).as_instanceof_cause(),
        errors.ObjectLostError("0" * 56, None, ""),
        errors.RayTaskError("f", "Traceback ...", TypeError("a slip")).as_instanceof_cause(),
    ]

    def failed(*_: object, **__: object) -> None:
        raise raised.pop(0)

    monkeypatch.setattr("pneumorph.study.training_options.run_training", failed)
    assert run(["coopt", "--out", str(tmp_path / "run")]) == 1
    assert capsys.readouterr().err.splitlines()[-1] == "pneumorph: no such leg"
    assert run(["coopt", "--out", str(tmp_path / "run")]) == 1
    assert capsys.readouterr().err.splitlines()[-1].startswith("pneumorph: ")
    with pytest.raises(TypeError):  # of the program itself, whose traceback is wanted
        run(["coopt", "--out", str(tmp_path / "run")])


def test_a_closed_standard_error_takes_nothing_from_a_run(tmp_path: Path) -> None:
    asked = [sys.executable, "-c", "from pneumorph.cli import main; main()", "mesh", "disk"]
    asked += ["--json", "--out", str(tmp_path / "disk")]
    told = subprocess.run(
        ["sh", "-c", 'exec "$@" 2>&-', "sh", *asked], stdout=subprocess.PIPE, text=True
    )
    assert told.returncode == 0
    assert json.loads(told.stdout)["verb"] == "mesh"
