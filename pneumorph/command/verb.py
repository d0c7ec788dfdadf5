"""What every verb of the command line is: options, presets and one function."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from pneumorph.base.flags import flat as flat
from pneumorph.base.run_folder import RunFolder

if TYPE_CHECKING:
    from pneumorph.study.finished_run import TakenOver

Options = TypeVar("Options")


@dataclass(frozen=True)
class Verb(Generic[Options]):
    """One verb.

    Attributes:
        options: A frozen dataclass; its fields become the flags.
        run: Does the work in a run folder and returns a typed result: the summary.
        presets: Ready options by name; the first is used where none is named. Each is a function,
            so that no verb pays for another's imports.
        alone: Whether one process at a time may write into the folder.
        taken_over: Settings of an earlier run that the options name, to be laid under the file and
            the flags; None where they name none.
        folder: Where to write without ``--out``; None stands for runs/VERB-TIME.
    """

    options: type[Options]
    run: Callable[[Options, RunFolder], Any]
    presets: Mapping[str, Callable[[], Options]] = field(default_factory=dict)
    folder: Callable[[Options], Path] | None = None
    alone: bool = True
    taken_over: Callable[[Options], TakenOver | None] = lambda _: None

    def preset(self, name: str | None) -> Options:
        """Return the options of a preset; None stands for the first.

        Raises:
            ValueError: No preset of that name.
        """
        if not self.presets:
            if name is not None:
                raise ValueError(f"preset {name!r} is unknown: this verb has no presets")
            return self.options()
        if name is None:
            return next(iter(self.presets.values()))()
        if name not in self.presets:
            raise ValueError(f"preset {name!r} is unknown, expected {' or '.join(self.presets)}")
        return self.presets[name]()


@dataclass(frozen=True)
class CommonOptions:
    """Options of every verb."""

    settings: Path | None = None
    """JSON or TOML file of settings laid over the preset, such as the settings.json of a run; flags
    come last."""
    out: Path | None = None
    """Run folder to write; by default runs/VERB-TIME."""
    json: bool = False
    """Print the summary as JSON on standard output and everything else on standard error."""
    debug: bool = False
    """Show the full traceback of an error."""
