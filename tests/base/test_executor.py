"""Tasks on processes and on Ray: all results, in any order, whatever happens to the workers."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from pneumorph.base.executor import ExecutorSettings, WorkerError, run_tasks
from pneumorph.base.workers import connected

SettingsOf = Callable[..., ExecutorSettings]
BACKENDS = ["in this process", "processes", "ray"]


@pytest.fixture(scope="module")
def local_ray() -> Iterator[None]:
    """One Ray for all tests, since starting it takes several seconds."""
    pytest.importorskip("ray")
    with connected(2, None):
        yield


@pytest.fixture
def settings_of(request: pytest.FixtureRequest) -> Callable[..., ExecutorSettings]:
    def make(backend: str, attempt_limit: int = 3) -> ExecutorSettings:
        if backend == "ray":
            request.getfixturevalue("local_ray")
            return ExecutorSettings("ray", 2, attempt_limit=attempt_limit)
        count = 1 if backend == "in this process" else 2
        return ExecutorSettings("processes", count, attempt_limit=attempt_limit)

    return make


def scaled(factor: float, number: int) -> tuple[float, str | None]:
    return factor * number, os.environ.get("OPENBLAS_NUM_THREADS")


def refuses_three(shared: None, number: int) -> int:
    if number == 3:
        raise ValueError("three is not wanted")
    return number


def dies_at_first(folder: Path, number: int) -> int:
    """Task 1 kills its own worker the first time, as a machine out of memory would."""
    mark = folder / "tried"
    if number == 1 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def dies_at_one(shared: None, number: int) -> str:
    if number == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return str(number)


def says_where_it_is(shared: None, number: int) -> Path:
    return Path.cwd()


def dies_always(shared: None, number: int) -> int:
    os.kill(os.getpid(), signal.SIGKILL)
    return number


@pytest.mark.parametrize("backend", BACKENDS)
def test_every_task_is_done_once(backend: str, settings_of: SettingsOf) -> None:
    results = dict(run_tasks(scaled, 0.5, range(3), settings_of(backend)))
    assert {number: value for number, (value, _) in results.items()} == {
        number: 0.5 * number for number in range(3)
    }
    if backend != "in this process":
        assert {threads for _, threads in results.values()} == {"1"}


@pytest.mark.parametrize("backend", BACKENDS)
def test_relative_paths_mean_the_callers(
    backend: str, tmp_path: Path, settings_of: SettingsOf, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = settings_of(backend)
    monkeypatch.chdir(tmp_path)
    assert dict(run_tasks(says_where_it_is, None, [0], settings)) == {0: tmp_path}


@pytest.mark.parametrize("backend", BACKENDS)
def test_an_exception_of_a_task_comes_through_as_it_is(
    backend: str, settings_of: SettingsOf
) -> None:
    with pytest.raises(ValueError, match="three is not wanted"):
        dict(run_tasks(refuses_three, None, range(4), settings_of(backend)))


@pytest.mark.parametrize("backend", BACKENDS[1:])
def test_a_task_whose_worker_dies_is_tried_again(
    backend: str, tmp_path: Path, settings_of: SettingsOf
) -> None:
    results = dict(run_tasks(dies_at_first, tmp_path, range(4), settings_of(backend)))
    assert results == {number: number for number in range(4)}
    assert (tmp_path / "tried").exists()


@pytest.mark.parametrize("backend", BACKENDS[1:])
def test_a_task_that_kills_every_worker_is_given_up(backend: str, settings_of: SettingsOf) -> None:
    with pytest.raises(WorkerError, match="was begun 2 times and its worker died each time"):
        dict(run_tasks(dies_always, None, [0], settings_of(backend, attempt_limit=2)))


@pytest.mark.parametrize("backend", BACKENDS)
def test_the_others_go_on_without_a_task_that_is_given_up(
    backend: str, settings_of: SettingsOf
) -> None:
    settings = settings_of(backend, attempt_limit=1)
    results = dict(run_tasks(dies_at_one, None, range(4), settings, given_up=str))
    assert "task 1 was begun 1 times" in results.pop(1)
    assert results == {0: "0", 2: "2", 3: "3"}


def test_a_task_is_named_by_its_number() -> None:
    """Whatever it holds, such as all settings of a robot."""
    settings = ExecutorSettings(process_count=2, attempt_limit=1)
    with pytest.raises(WorkerError) as told:
        dict(run_tasks(dies_always, None, ["content" * 1000], settings))  # type: ignore[list-item]
    assert str(told.value).startswith("task 0 was begun 1 times")
    assert "content" not in str(told.value)


_PARENT = """
import sys, time
from pathlib import Path
from pneumorph.base.executor import ExecutorSettings, run_tasks
from test_executor import notes_its_process

if __name__ == "__main__":
    list(run_tasks(notes_its_process, Path(sys.argv[1]), range(2), ExecutorSettings()))
"""


def notes_its_process(folder: Path, number: int) -> None:
    (folder / f"{number}.new").write_text(str(os.getpid()))
    (folder / f"{number}.new").rename(folder / f"{number}.pid")
    time.sleep(600.0)


@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGKILL])
def test_workers_end_with_the_process_that_began_them(how: signal.Signals, tmp_path: Path) -> None:
    (tmp_path / "parent.py").write_text(_PARENT)
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parent)}
    parent = subprocess.Popen(
        [sys.executable, str(tmp_path / "parent.py"), str(tmp_path)], env=environment
    )
    notes = [tmp_path / f"{number}.pid" for number in range(2)]
    workers: list[int] = []
    try:
        wait_for(lambda: all(note.exists() for note in notes), 60.0)
        workers = [int(note.read_text()) for note in notes]
        parent.send_signal(how)
        parent.wait()
        wait_for(lambda: not any(is_running(worker) for worker in workers), 20.0)
    finally:
        parent.kill()
        for worker in filter(is_running, workers):
            os.kill(worker, signal.SIGKILL)


def notes_its_process_if_not_first(folder: Path, number: int) -> None:
    if number:
        notes_its_process(folder, number)


def test_workers_end_when_nobody_waits_for_results_any_more(tmp_path: Path) -> None:
    results = run_tasks(notes_its_process_if_not_first, tmp_path, range(2), ExecutorSettings())
    assert isinstance(results, Generator)
    assert next(results) == (0, None)
    wait_for((tmp_path / "1.pid").exists, 60.0)
    worker = int((tmp_path / "1.pid").read_text())
    assert is_running(worker)
    results.close()
    wait_for(lambda: not is_running(worker), 20.0)


def is_running(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().split()[2] != "Z"
    except FileNotFoundError:
        return False


def wait_for(condition: Callable[[], bool], longest_s: float) -> None:
    end = time.monotonic() + longest_s
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)


def test_a_cluster_that_runs_already_is_joined(tmp_path: Path) -> None:
    """By a program of its own, which leaves it running; one that does not ask for it starts its
    own."""
    pytest.importorskip("ray")
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{found.getsockname()[1]}"
    own = Path(sys.executable).parent
    quiet = os.environ | {"RAY_USAGE_STATS_ENABLED": "0", "RAY_AUTH_MODE": "disabled"}
    asked = "start --head --block --num-cpus 2 --include-dashboard false --port"
    head = [str(own / "ray"), *asked.split(), address.partition(":")[2]]
    program = (
        "import operator, sys\n"
        "from pneumorph.base.executor import ExecutorSettings, run_tasks\n"
        "there = ExecutorSettings('ray', address=sys.argv[1])\n"
        "here = ExecutorSettings('ray', 1)\n"
        "asked = there if sys.argv[1] else here\n"
        "print(sorted(run_tasks(operator.mul, 3.0, [1.0, 2.0, 5.0], asked)))\n"
    )
    with subprocess.Popen(
        head,
        env=quiet,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as cluster:
        try:
            wait_for(lambda: _answers(address) or cluster.poll() is not None, 60.0)
            for joined in (address, address, ""):
                told = subprocess.run(
                    [sys.executable, "-c", program, joined],
                    env=quiet,
                    capture_output=True,
                    text=True,
                    timeout=240.0,
                )
                assert told.returncode == 0, told.stderr
                assert told.stdout.splitlines()[-1] == "[(0, 3.0), (1, 6.0), (2, 15.0)]"
        finally:
            cluster.terminate()
            with suppress(subprocess.TimeoutExpired):
                cluster.wait(30.0)
            cluster.kill()


def _answers(address: str) -> bool:
    host, _, port = address.partition(":")
    try:
        socket.create_connection((host, int(port)), 1.0).close()
    except OSError:
        return False
    return True


def test_impossible_settings_are_refused() -> None:
    with pytest.raises(ValueError, match="backend must be one of processes, ray"):
        ExecutorSettings("threads")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="process_count must be at least 1, got 0"):
        ExecutorSettings(process_count=0)
    with pytest.raises(ValueError, match="is for the backend ray"):
        ExecutorSettings(address="auto")
    with pytest.raises(ValueError, match="attempt_limit must be at least 1"):
        ExecutorSettings(attempt_limit=0)
