"""Run independent tasks on the processes of one machine, or on many machines with Ray.

A task is an argument of a function; all tasks share one further argument. Results come back as they
finish, so the caller keeps them and knows what is left when it is stopped. A task whose worker dies
(killed for memory, machine lost) is tried again; an exception of the function itself ends the run,
because it would come again.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from typing import Literal, TypeVar

from pneumorph.base.checked import Checked, Count
from pneumorph.base.workers import process_workers, ray_workers

Shared = TypeVar("Shared")
Task = TypeVar("Task")
Result = TypeVar("Result")

Backend = Literal["processes", "ray"]


class WorkerError(RuntimeError):
    """The workers of one task died as often as is allowed."""


@dataclass(frozen=True)
class ExecutorSettings(Checked):
    """Where tasks run in parallel."""

    backend: Backend = "processes"
    """`processes` on this machine, or `ray` (needs the extra `ray`)."""
    process_count: Count | None = None
    """Number of tasks that run at the same time. None: two processes, or all processors of the Ray
    cluster. 1 with `processes` runs them in the program itself, one after another, unless they may
    be given up."""
    address: str | None = None
    """Ray cluster to join, such as auto or ray://head:10001, with pneumorph installed on every
    machine; without it that of RAY_ADDRESS, or else Ray starts on this machine only."""
    attempt_limit: Count = 3
    """How often a task is tried in all if its worker dies."""

    def __post_init__(self) -> None:
        super().__post_init__()
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
    if settings.backend == "ray":
        places = ray_workers(function, shared, settings.process_count, settings.address)
    elif settings.process_count == 1 and given_up is None:
        yield from ((number, function(shared, task)) for number, task in enumerate(tasks))
        return
    else:
        places = process_workers(function, shared, settings.at_once())
    waiting = deque((number, 1) for number in range(len(tasks)))
    running: dict[Future[Result], tuple[int, int]] = {}
    with places as workers:
        while waiting or running:
            # Begin no more than can run: results wait in the workers' memory until fetched.
            while waiting and len(running) < workers.count:
                number, attempt = waiting.popleft()
                running[workers.begin(tasks[number])] = number, attempt
            for call in wait(running, return_when=FIRST_COMPLETED).done:
                number, attempt = running.pop(call)
                try:
                    result = call.result()
                except workers.deaths as death:
                    if attempt < settings.attempt_limit:
                        waiting.append((number, attempt + 1))
                        continue
                    error = WorkerError(
                        f"task {number} was begun {attempt} times and its worker died "
                        f"each time ({type(death).__name__}), expected a result; the machine may "
                        "lack memory for so many tasks at once (process_count), or the script that "
                        "asked for them runs again in each worker: put it below if __name__ == "
                        '"__main__"'
                    )
                    if given_up is None:
                        raise error from death
                    result = given_up(error)
                yield number, result
