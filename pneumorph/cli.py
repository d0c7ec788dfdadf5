"""Command line: one verb for each step of the flow from the shape of a leg to a crawling robot."""

from __future__ import annotations

import errno
import importlib
import json
import os
import resource
import shutil
import signal
import sys
import textwrap
import threading
import time
import traceback
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import field, fields, make_dataclass, replace
from functools import cache
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pneumorph.base.verbs import VERBS as VERBS

if TYPE_CHECKING:
    from pneumorph.catalogue.robot_mass import RobotMass
    from pneumorph.command.verb import CommonOptions, Verb

_USAGE = """\
usage: pneumorph VERB [OPTIONS]

Design pneumatic soft robots and teach them to move. Each verb reads and writes files
of one run folder; `pneumorph VERB --help` lists its options.

{verbs}

A first walk:
  pneumorph baseline --out runs/baseline          the expert's gait at every phase
  pneumorph coopt --preset quick --out runs/quick design and gait learned together
  pneumorph report runs/quick                     one page that shows both

Every verb takes --settings FILE (JSON or TOML), --out FOLDER, --json (the
summary alone on standard output) and --debug, some --preset. Lengths are in mm, pressures in kPa,
times in s; distances in cm."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and leave with its exit status: 0, 1 for a failure, 2 for bad usage."""
    sys.exit(run(sys.argv[1:] if arguments is None else arguments))


def run(arguments: Sequence[str]) -> int:
    """Run one command and return its exit status."""
    for stream in ("stdout", "stderr"):
        if getattr(sys, stream) is None:  # closed by who began us: a file would be opened there
            setattr(sys, stream, open(os.devnull, "w"))  # noqa: SIM115
    # Our own threads share the cores with BLAS, and two BLAS threads stall at random; this must
    # be said before numpy is imported.
    for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    if not arguments or arguments[0] in ("-h", "--help", "help"):
        width = max(map(len, VERBS))
        print(_USAGE.format(verbs="\n".join(f"  {v:{width}}  {t}" for v, t in VERBS.items())))
        return 0 if arguments else 2
    if arguments[0] == "--version":
        from pneumorph import __version__

        print(f"pneumorph {__version__}")
        return 0
    name = arguments[0]
    if name not in VERBS:
        return _fail(f"verb {name!r} is unknown, expected one of {', '.join(VERBS)}", 2)
    debug = "--debug" in arguments
    try:
        with _interrupts_heard():
            return _run_verb(name, list(arguments[1:]))
    except BrokenPipeError:
        # The reader of the output, such as `head`, has seen enough.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except _errors_of_workers() as error:
        if debug:
            traceback.print_exc()
        cause = getattr(error, "cause", None)  # Ray wraps what a task raised into its traceback
        if cause is not None and not isinstance(cause, (*_TOLD, MemoryError)):
            raise
        return _fail(str(cause or error) + getattr(error, _BACKGROUND, ""), 1)
    except _TOLD as error:
        if debug:
            traceback.print_exc()
        return _fail(str(error) + getattr(error, _BACKGROUND, ""), 1)
    except MemoryError as error:
        if debug:
            traceback.print_exc()
        return _fail(f"the memory is full; ask for less at once ({error})", 1)
    except KeyboardInterrupt as error:
        return _fail("stopped by the keyboard" + getattr(error, _BACKGROUND, ""), 130)


def _errors_of_workers() -> tuple[type[BaseException], ...]:
    """What workers that died raise, and Ray; of modules that the verb has loaded, none for this."""
    kinds = {"pneumorph.base.executor": "WorkerError", "ray.exceptions": "RayError"}
    return tuple(
        getattr(sys.modules[module], kind)
        for module, kind in kinds.items()
        if module in sys.modules
    )


@contextmanager
def _interrupts_heard() -> Iterator[None]:
    """Have Ctrl-C stop the program wherever it comes.

    What is raised inside JAX's callback of a garbage collection, of which imports cause many, is
    printed and forgotten: a moment later the interrupt is tried again.
    """

    def heard(number: int, frame: FrameType | None) -> None:
        if frame is not None and frame.f_code.co_name == "_xla_gc_callback":
            main = threading.main_thread().ident
            threading.Timer(0.01, signal.pthread_kill, [main, number]).start()
        else:
            signal.default_int_handler(number, frame)

    usual = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if not usual or threading.current_thread() is not threading.main_thread():
        yield
        return
    signal.signal(signal.SIGINT, heard)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _run_verb(name: str, arguments: list[str]) -> int:
    from pneumorph.base.progress import Progress
    from pneumorph.base.provenance import made_by
    from pneumorph.base.result import result_to_dict
    from pneumorph.base.run_folder import RunFolder, default_folder
    from pneumorph.base.settings import settings_to_dict

    module = importlib.import_module(f"pneumorph.command.{name}")
    verb: Verb[Any] = module.VERB
    options, common, origin = _parsed(name, verb, module.__doc__ or "", arguments)
    usual = verb.folder(options) if verb.folder is not None else default_folder(name)
    folder = RunFolder(
        common.out or usual,
        name,
        Progress(),
        made_by([name, *arguments]),
        summary_only=common.json,
    )
    content = settings_to_dict(options)
    folder.refuse_file()
    folder.refuse_other_verb()
    fresh, begun_s = not folder.path.exists(), time.time()
    with folder.alone() if verb.alone else nullcontext():
        resumable = hasattr(options, "resume")  # it refuses other settings than its checkpoint's
        put_back = folder.begin(content, fresh, resumable)
        try:
            with _told_of_earlier_run(origin.get("taken_over_from"), arguments):
                result = verb.run(options, folder)
            summary = result_to_dict(result)
        except BaseException as error:
            put_back()
            stopped = isinstance(error, KeyboardInterrupt) and folder.path.exists()
            if stopped and hasattr(options, "resume"):
                again = f"; the same command with --resume --out {folder.path} "
                kept = any(folder.path.rglob("checkpoint*.npz"))
                again += "goes on" if kept else "begins again: it had no checkpoint yet"
                setattr(error, _BACKGROUND, again)
            if isinstance(error, OSError) and error.errno == errno.ENOSPC and not error.filename:
                # From a log that grows; whole files say their own names.
                error.filename = str(folder.path)
            raise
        folder.save_settings(content)
        written = folder.save_summary({**summary, **origin, "peak_memory_mb": _peak_memory_mb()})
    folder.tell_of_earlier_page(begun_s)
    if common.json:
        print(json.dumps(json.loads(written.read_text())))
    else:
        from pneumorph.report.physics_words import physics_of

        walked_in = {"physics": physics_of(result)} if summary.get("physics") else {}
        mass: RobotMass | None = getattr(result, "mass", None)
        weighed = {} if mass is None else {"mass": mass.words}
        _print_summary({**summary, **walked_in, **weighed})
    print(f"wrote {folder.path}", file=sys.stderr)
    if summary.get("page") is not None:
        print(f"open {Path(summary['page']).resolve()}", file=sys.stderr)
    return 0 if summary.get("status", "completed") == "completed" else 1


def _parsed(
    name: str, verb: Verb[Any], description: str, arguments: list[str]
) -> tuple[Any, CommonOptions, dict[str, str]]:
    """Return the options, as `pneumorph.base.layers` lays them over one another.

    Last comes what a summary says of where they are from: ``preset`` and ``taken_over_from``.
    """
    import tyro

    from pneumorph.base.idle_settings import is_of_a_run, refuse_idle
    from pneumorph.base.layers import changed_flags, flags_of, given_flags, layer_of_flag, layered
    from pneumorph.base.meant_flags import meant_flags
    from pneumorph.base.settings import load_settings, read_settings_file, upgraded
    from pneumorph.catalogue.older_names import current_arguments
    from pneumorph.command.verb import CommonOptions

    arguments = current_arguments(arguments)
    preset = default = verb.preset(_last(_values_of("--preset", arguments)))
    files = _values_of("--settings", arguments)
    if len(files) > 1:
        raise ValueError(
            f"--settings is given {len(files)} times ({', '.join(files)}), expected one file: only "
            "the last would count; put their settings into one"
        )
    file = _last(files)
    if file is not None:
        with _told_of_other_verb(Path(file), name):
            default = load_settings(verb.options, Path(file), default)
    described = _last(_values_of("--robot", arguments))
    if described is not None and not _must_be_given(preset):
        # Flags beside it change that robot: ten legs are not too many for twelve sites.
        default = layered(default, [layer_of_flag(verb.options, "--robot", described)])
    # Both groups without a prefix: --out, not --common.out.
    flat = tyro.conf.arg(name="")
    groups: list[Any] = [
        ("options", Annotated[verb.options, flat], field(default=default)),
        ("common", Annotated[CommonOptions, flat], field(default=CommonOptions())),
    ]
    if verb.presets:
        names = tuple(verb.presets)
        said = tyro.conf.arg(help="Ready settings to start from.")
        groups.append(("preset", Annotated[Literal[names], said], field(default=names[0])))
    if "-h" in arguments or "--help" in arguments:
        # Before tyro's own help, which would run the paragraphs' lines together.
        print(_wrapped(description), end="\n\n")
    _join_lines_of_help()  # tyro keeps what it has read of a class, with help asked for or not
    asked_for = make_dataclass("Arguments", groups)
    try:
        parsed: Any = tyro.cli(asked_for, args=arguments, prog=f"pneumorph {name}", description="")
    except SystemExit as left:
        if left.code == 2:
            flags = [*flags_of(verb.options), *flags_of(CommonOptions)]
            for flag, meant in meant_flags(arguments, flags).items():
                print(f"{flag}: did you mean {' or '.join(meant)}?", file=sys.stderr)
        raise
    layers: list[Mapping[str, Any]] = [given_flags(parsed.options, default, arguments)]
    if file is not None:
        layers.insert(0, read_settings_file(file))
    origin = {"preset": parsed.preset} if verb.presets else {}
    asked = {name: getattr(parsed.options, name) for name in _must_be_given(preset)}
    base = below = replace(preset, **asked)
    options = layered(base, layers)
    earlier = verb.taken_over(parsed.options)
    if earlier is not None:
        with _told_of_earlier_run(str(earlier.run), arguments):
            taken = below = layered(base, [earlier.settings])
            options = layered(taken, layers)
        given = [upgraded(type(options), layer) for layer in layers]
        set_here = {flag for each in given for flag in changed_flags(taken, options, each)}
        changed = changed_flags(taken, options, earlier.settings)
        changed = [flag for flag in changed if flag in set_here]  # others come with these
        yours = f" (yours: {', '.join(changed)})" if changed else ""
        print(f"{earlier.said}{yours}", file=sys.stderr)
        origin["taken_over_from"] = str(earlier.run)
    chosen = None if file is None else Path(file)
    if chosen is not None and is_of_a_run(chosen):
        below, layers, chosen = layered(below, layers[:1]), layers[1:], None
    refuse_idle(options, below, layers, parsed.common.out, chosen)
    return options, parsed.common, origin


_TOLD = (ValueError, OSError, ImportError, ArithmeticError)
"""Errors whose message says enough; others are the program's own."""
_BACKGROUND = "pneumorph_background"
"""Attribute of an error: what its message ends with on the command line."""


@contextmanager
def _told_of_earlier_run(folder: str | None, arguments: list[str]) -> Iterator[None]:
    """Say of what fails with settings of an earlier run, which nobody wrote, whose they are.

    Args:
        folder: The run's; None where no settings are taken over.
        arguments: The verb's; a robot's file among them stands in place of the run's robot.
    """
    try:
        yield
    except (ValueError, OSError, ArithmeticError) as error:
        if folder is not None and folder not in str(error):
            file, robot = Path(folder) / "settings.json", _last(_values_of("--robot", arguments))
            said = f" (leg and physics are of {file})"
            if robot is not None:
                said = (
                    f" (--robot {robot} is given, what it does not say is of {file}; without "
                    "--robot the robot is that run's own)"
                )
            setattr(error, _BACKGROUND, said)
        raise


@contextmanager
def _told_of_other_verb(file: Path, verb: str) -> Iterator[None]:
    """Say of settings that cannot be read that they are of another verb's run, if they are."""
    from pneumorph.base.artefact import ArtefactError
    from pneumorph.base.run_folder import SETTINGS, SUMMARY, read_summary

    try:
        yield
    except ValueError as error:
        other = None
        if file.name == SETTINGS and (file.parent / SUMMARY).exists():
            with suppress(ArtefactError):  # it is the settings that are asked for
                other = read_summary(file.parent).get("verb")
        if other not in (None, verb):
            setattr(error, _BACKGROUND, f" ({file} is of `pneumorph {other}`)")
        raise


def _must_be_given(options: Any) -> list[str]:
    """Options that have no value of their own."""
    import tyro

    return [each.name for each in fields(options) if getattr(options, each.name) is tyro.MISSING]


@cache
def _join_lines_of_help() -> None:
    """Let each option's help be one paragraph: tyro keeps line breaks before indented lines."""
    import docstring_parser

    parsed = docstring_parser.parse_from_object

    def joined(described: Any, *style: Any) -> Any:
        result = parsed(described, *style)
        for each in result.params:
            each.description = each.description and " ".join(each.description.split())
        return result

    docstring_parser.parse_from_object = joined  # type: ignore[assignment]


def _wrapped(description: str) -> str:
    """Return the paragraphs of a description wrapped to the width of the terminal."""
    width = min(shutil.get_terminal_size().columns, 100)
    paragraphs = description.strip().split("\n\n")
    return "\n\n".join(textwrap.fill(" ".join(p.split()), width) for p in paragraphs)


def _values_of(flag: str, arguments: list[str]) -> list[str]:
    """Return the values of a flag that must be known before the others can be read."""
    found = []
    for index, argument in enumerate(arguments):
        if argument == flag and index + 1 < len(arguments):
            found.append(arguments[index + 1])
        elif argument.startswith(f"{flag}="):
            found.append(argument.split("=", 1)[1])
    return found


def _last(values: list[str]) -> str | None:
    """Return the value that counts; None where the flag is not given."""
    return values[-1] if values else None


def _peak_memory_mb() -> float:
    """Return the largest resident memory of this process or of one that it started."""
    used = (
        resource.getrusage(who).ru_maxrss
        for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    )
    # Linux counts in kilobytes, macOS in bytes.
    return max(used) / (1024.0 if sys.platform == "linux" else 1024.0**2)


def _print_summary(summary: dict[str, Any]) -> None:
    """Print the summary for a person: one line for each plain value that is known."""
    plain = {k: v for k, v in summary.items() if not isinstance(v, dict | list | None)}
    width = max(map(len, plain), default=0)
    for key, value in plain.items():
        shown = f"{value:.4g}" if isinstance(value, float) else value
        print(f"{key.replace('_', ' '):{width}}  {shown}")
    for note in summary.get("notes") or ():
        print(f"note: {note}")


def _fail(message: str, status: int) -> int:
    # In one line, whatever a library has said in several.
    lines = " ".join(line.strip() for line in message.splitlines())
    print(f"pneumorph: {lines}", file=sys.stderr)
    return status
