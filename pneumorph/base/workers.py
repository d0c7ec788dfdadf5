"""Calls of one function in other processes: of this machine, of a Ray cluster, or of Ray here."""

from __future__ import annotations

import logging
import multiprocessing
import os
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import chdir, contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

Function = Callable[[Any, Any], Any]

# Two BLAS threads in each of two workers stall each other on shared cores.
_ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


@dataclass(frozen=True)
class Workers:
    """Where calls run."""

    begin: Callable[[Any], Future[Any]]
    """Calls the function with a task, in a worker whose death is that of this call alone."""
    count: int
    """Calls at the same time."""
    deaths: tuple[type[Exception], ...]
    """What a call raises whose worker died."""


@contextmanager
def process_workers(function: Function, shared: Any, count: int) -> Iterator[Workers]:
    """Processes of this machine; those at work when this ends are ended."""
    # Spawned, for a forked child would inherit the locks of BLAS and JAX threads.
    spawn = multiprocessing.get_context("spawn")
    ours, theirs = multiprocessing.Pipe()

    def begin(task: Any) -> Future[Any]:
        # A process for each call: one pool would break with its first worker, whosesoever task.
        pool = ProcessPoolExecutor(1, spawn, _live_with, (theirs,))
        before = dict(os.environ)
        os.environ.update(_ONE_THREAD)
        try:
            return pool.submit(function, shared, task)
        finally:
            os.environ.clear()
            os.environ.update(before)
            pool.shutdown(wait=False)

    with ours, theirs:
        yield Workers(begin, count, (BrokenProcessPool,))


def _live_with(life: Connection) -> None:
    """End this process when the pipe's other end is closed: its work would be nobody's.

    That is when nobody waits for results any more, or when the parent is gone, however it died.
    """

    def end() -> None:
        life.poll(None)
        os._exit(1)

    threading.Thread(target=end, daemon=True).start()


@contextmanager
def ray_workers(
    function: Function, shared: Any, count: int | None, address: str | None
) -> Iterator[Workers]:
    """Tasks of Ray, as `connected` finds it; with no `count` as many as it has processors."""
    with connected(count, address) as ray:
        # Attempts are the caller's: Ray would retry for ever a task that runs out of memory.
        call, reference = ray.remote(max_retries=0)(_call_in), ray.put(shared)
        errors = ray.exceptions
        yield Workers(
            lambda task: call.remote(Path.cwd(), function, reference, task).future(),
            count or int(ray.cluster_resources().get("CPU", 1)),
            (
                errors.WorkerCrashedError,
                errors.OutOfMemoryError,
                errors.NodeDiedError,
                errors.ObjectLostError,
            ),
        )


def _call_in(folder: Path, function: Function, shared: Any, task: Any) -> Any:
    """Call from the caller's folder, which its relative paths mean; workers begin elsewhere."""
    with chdir(folder if folder.is_dir() else Path.cwd()):
        return function(shared, task)


@dataclass(frozen=True)
class RemoteObjects:
    """Objects of one class, each in a worker of its own."""

    make: Callable[..., Any]
    """Makes one with these arguments, and returns what stands for it."""
    call: Callable[..., Any]
    """Calls its method of a name with a tuple of arguments, and returns what stands for the answer;
    what `put` returned arrives as what was put."""
    fetch: Callable[[Any], Any]
    """Waits for an answer."""
    put: Callable[[Any], Any]
    """Sends an object to all workers, once."""
    count: int
    """Objects that work at the same time."""
    deaths: tuple[type[Exception], ...]
    """What `fetch` raises where the worker has died."""


def remote_objects(kind: type, count: int | None, address: str | None) -> RemoteObjects:
    """Objects on Ray, which stays connected until this process ends; with no `count` as many as it
    has processors.

    Raises:
        ConnectionError: No cluster at the address, or it does not let this program in.
        ModuleNotFoundError: Ray is not installed.
    """
    ray = _joined(count, address)
    # They claim no processor: a simulator that waits would keep the next one from starting.
    actor = ray.remote(max_restarts=0, num_cpus=0, scheduling_strategy="SPREAD")(kind)
    return RemoteObjects(
        actor.remote,
        lambda made, name, arguments: getattr(made, name).remote(*arguments),
        ray.get,
        ray.put,
        count or int(ray.cluster_resources().get("CPU", 1)),
        (ray.exceptions.RayActorError, ray.exceptions.OutOfMemoryError),
    )


@contextmanager
def connected(count: int | None, address: str | None) -> Iterator[Any]:
    """The module ray, joined to the cluster at an address or, without one, started here.

    One that runs in this process already is used, and goes on running.

    Raises:
        ConnectionError: No cluster at the address, or it does not let this program in.
        ModuleNotFoundError: Ray is not installed.
    """
    here = "ray" in sys.modules and sys.modules["ray"].is_initialized()
    ray = _joined(count, address)
    try:
        yield ray
    finally:
        if not here:
            ray.shutdown()


def _joined(count: int | None, address: str | None) -> Any:
    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    address = address or os.environ.get("RAY_ADDRESS")  # as in a job that a cluster runs
    try:
        import ray
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            "the backend ray needs the extra ray: pip install 'pneumorph[ray]'"
        ) from error
    if not ray.is_initialized():
        # Workers of this machine find every module that this process finds.
        modules = {} if address else {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
        try:
            ray.init(
                address=address or "local",  # not a cluster that happens to run here
                num_cpus=None if address else count,
                include_dashboard=None if address else False,
                log_to_driver=False,
                logging_level=logging.WARNING,
                runtime_env={"env_vars": _ONE_THREAD | modules},
            )
        except ConnectionError as error:
            raise ConnectionError(
                f"no Ray lets this program in at {address or 'this machine'}; it may not run "
                "there, or ask for its token, which is sent where the environment has "
                "RAY_AUTH_MODE=token"
            ) from error
    return ray
