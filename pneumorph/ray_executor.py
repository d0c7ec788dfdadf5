"""Tasks on a Ray cluster, or on a Ray of this machine alone; see `pneumorph.executor`."""

from __future__ import annotations

import logging
import os
import sys
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import chdir
from pathlib import Path
from typing import Any, TypeVar

from pneumorph.executor import ExecutorSettings, WorkerError, worker_error

Shared = TypeVar("Shared")
Task = TypeVar("Task")
Result = TypeVar("Result")


def run_with_ray(
    function: Callable[[Shared, Task], Result],
    shared: Shared,
    tasks: Sequence[Task],
    settings: ExecutorSettings,
    given_up: Callable[[WorkerError], Result],
) -> Iterator[tuple[int, Result]]:
    """Yield the number and the result of each task as it finishes; see `run_tasks`."""
    ray, started = connect(settings)
    try:
        # Attempts are counted here: Ray itself would retry for ever a task that runs out of memory.
        remote = ray.remote(max_retries=0)(_call)
        reference = ray.put(shared)
        waiting = deque(range(len(tasks)))
        attempts = [0] * len(tasks)
        running: dict[Any, int] = {}
        here = Path.cwd()
        # Results wait in the cluster's memory until they are fetched: begin no more than can run.
        limit = settings.process_count or int(ray.cluster_resources().get("CPU", 1))
        while waiting or running:
            while waiting and len(running) < limit:
                number = waiting.popleft()
                attempts[number] += 1
                running[remote.remote(function, reference, tasks[number], here)] = number
            (ready,), _ = ray.wait(list(running), num_returns=1)
            number = running.pop(ready)
            try:
                result = ray.get(ready)
            except (
                ray.exceptions.WorkerCrashedError,
                ray.exceptions.OutOfMemoryError,
                ray.exceptions.NodeDiedError,
                ray.exceptions.ObjectLostError,
            ) as error:
                if attempts[number] < settings.attempt_limit:
                    waiting.append(number)
                    continue
                how = type(error).__name__
                result = given_up(worker_error(tasks[number], attempts[number], how))
            except ray.exceptions.RayTaskError as error:
                raise (error.cause or error) from error
            yield number, result
    finally:
        if started:
            ray.shutdown()


def _call(function: Callable[[Any, Any], Any], shared: Any, task: Any, folder: Path) -> Any:
    """Body of a worker, which begins in a folder of its own: relative paths mean the caller's."""
    with chdir(folder if folder.is_dir() else Path.cwd()):
        return function(shared, task)


def connect(settings: ExecutorSettings) -> tuple[Any, bool]:
    """Join the settings' cluster, or start a Ray of this machine; one that runs already is used.

    Returns:
        The module ray, and whether it was started here.

    Raises:
        ModuleNotFoundError: Ray is not installed.
    """
    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    try:
        import ray
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            "the backend ray needs the extra ray: pip install 'pneumorph[ray]'"
        ) from error
    if ray.is_initialized():
        return ray, False
    # Two BLAS threads in each of two workers stall each other on shared cores.
    environment = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    if settings.address is None:
        # Workers of this machine find every module that this process finds.
        environment["PYTHONPATH"] = os.pathsep.join(filter(None, sys.path))
    ray.init(
        address=settings.address,
        num_cpus=None if settings.address else settings.process_count or None,
        include_dashboard=None if settings.address else False,
        log_to_driver=False,
        logging_level=logging.WARNING,
        runtime_env={"env_vars": environment},
    )
    return ray, True
