"""Run independent tasks on the processes of one machine, or on many machines with Ray.

A task is an argument of a function; all tasks share one further argument. Results come back as they
finish, so the caller keeps them and knows what is left when it is stopped. A task whose worker dies
(killed for memory, machine lost) is tried again; an exception of the function itself ends the run,
because it would come again.
"""

from __future__ import annotations

import multiprocessing
import os
import threading
import traceback
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any, Literal, TypeVar, get_args

Shared = TypeVar("Shared")
Task = TypeVar("Task")
Result = TypeVar("Result")

Backend = Literal["processes", "ray"]


class WorkerError(RuntimeError):
    """The workers of one task died as often as is allowed."""


@dataclass(frozen=True)
class ExecutorSettings:
    """Where tasks run."""

    backend: Backend = "processes"
    """`processes` of this machine, or `ray` (needs the extra `ray`)."""
    process_count: int | None = None
    """Tasks that run at the same time; None: two processes, or all processors of the Ray cluster.
    With `processes`, 1 needs no other process than this one, unless tasks may be given up."""
    address: str | None = None
    """Ray cluster to join, such as auto or ray://head:10001, with pneumorph installed on every
    machine; without it Ray starts on this machine alone."""
    attempt_limit: int = 3
    """How often a task is begun at most when its workers die."""

    def __post_init__(self) -> None:
        if self.backend not in get_args(Backend):
            raise ValueError(
                f"backend must be one of {', '.join(get_args(Backend))}, got {self.backend!r}"
            )
        if self.process_count is not None and self.process_count < 1:
            raise ValueError(f"process_count must be at least 1, got {self.process_count}")
        if self.attempt_limit < 1:
            raise ValueError(f"attempt_limit must be at least 1, got {self.attempt_limit}")
        if self.address is not None and self.backend != "ray":
            raise ValueError(f"address {self.address!r} is for the backend ray, got {self.backend}")

    def at_once(self, usual: int = 2) -> int:
        """Tasks that run at the same time on this machine, `usual` where that is left open."""
        return usual if self.process_count is None else self.process_count


def run_tasks(
    function: Callable[[Shared, Task], Result],
    shared: Shared,
    tasks: Sequence[Task],
    settings: ExecutorSettings | None = None,
    given_up: Callable[[WorkerError], Result] | None = None,
) -> Iterator[tuple[int, Result]]:
    """Yield the number and the result of each task as it finishes.

    Args:
        function: Called as ``function(shared, task)``; of the top level of a module, so that it can
            be pickled.
        shared: What all tasks read; it must not be changed.
        tasks: Picklable.
        settings: Where they run.
        given_up: Makes the result of a task whose workers died `attempt_limit` times, so that the
            others go on; every task then has a worker of its own, even one at a time. None lets
            such a task end them all.

    Raises:
        ModuleNotFoundError: Ray is asked for and not installed.
        WorkerError: The workers of a task died `attempt_limit` times and `given_up` is None.
    """
    settings = settings or ExecutorSettings()
    in_this_process = settings.process_count == 1 and given_up is None
    given_up = given_up or _raise
    if settings.backend == "ray":
        from pneumorph.ray_executor import run_with_ray

        yield from run_with_ray(function, shared, tasks, settings, given_up)
    elif in_this_process:
        for number, task in enumerate(tasks):
            yield number, function(shared, task)
    else:
        yield from _run_in_processes(function, shared, tasks, settings, given_up)


def _raise(error: WorkerError) -> Any:
    raise error


def worker_error(task: Any, attempts: int, how: str) -> WorkerError:
    """The error of a task given up."""
    return WorkerError(
        f"task {task!r} was begun {attempts} times and its worker died each time ({how}), expected "
        "a result; the machine may lack memory for so many tasks at once (process_count)"
    )


def _run_in_processes(
    function: Callable[[Shared, Task], Result],
    shared: Shared,
    tasks: Sequence[Task],
    settings: ExecutorSettings,
    given_up: Callable[[WorkerError], Result],
) -> Iterator[tuple[int, Result]]:
    # One process for each task, not a pool: the death of one leaves the others alone. Spawned, for
    # a forked child would inherit the locks of BLAS and JAX threads.
    context = multiprocessing.get_context("spawn")
    waiting = deque(range(len(tasks)))
    attempts = [0] * len(tasks)
    running: dict[Connection, tuple[int, Any]] = {}
    try:
        while waiting or running:
            while waiting and len(running) < settings.at_once():
                number = waiting.popleft()
                attempts[number] += 1
                receiver, sender = context.Pipe(duplex=False)
                process = context.Process(
                    target=_work, args=(sender, function, shared, tasks[number]), daemon=True
                )
                with _single_threaded_children():
                    process.start()
                sender.close()  # else the end of the child's copy would go unnoticed
                running[receiver] = (number, process)
            for ready in wait(list(running)):
                receiver = ready  # type: ignore[assignment]
                number, process = running.pop(receiver)
                try:
                    error, result = receiver.recv()
                except (EOFError, OSError):  # it died before or while it answered
                    process.join()
                    if attempts[number] == settings.attempt_limit:
                        how = f"exit code {process.exitcode}"
                        yield number, given_up(worker_error(tasks[number], attempts[number], how))
                    else:
                        waiting.append(number)
                    continue
                finally:
                    receiver.close()
                process.join()
                if error is not None:
                    raise error
                yield number, result
    finally:
        for _, process in running.values():
            process.terminate()
            process.join()


def _work(sender: Connection, function: Callable[[Any, Any], Any], shared: Any, task: Any) -> None:
    """Body of a child: send (exception or None, result)."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        answer: tuple[BaseException | None, Any] = (None, function(shared, task))
    except Exception as error:
        error.add_note(f"in a process of its own:\n{traceback.format_exc()}")
        answer = (error, None)
    sender.send(answer)


def _end_with_parent() -> None:
    """End this child when its parent is gone, however that died: its work would be nobody's."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


@contextmanager
def _single_threaded_children() -> Iterator[None]:
    # Two BLAS threads in each of two processes stall each other on shared cores.
    names = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")
    before = {name: os.environ.get(name) for name in names}
    os.environ.update(dict.fromkeys(names, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
